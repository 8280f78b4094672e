"""Every evaluation of a match, in a file that grows line by line, so that an interrupted search loses nothing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.errors import StudyError
from activesteer.files import make_folder, reading, write_text, writing

FILE: Final = "evaluations.jsonl"
_STUDY: Final = "match.toml"


class Evaluation(NamedTuple):
    """A scenario, driven with all controllers: `Claim.distance` by statement, and metrics by controller."""

    distances: dict[str, float]
    metrics: dict[str, dict[str, float]]


@dataclass
class Candidate:
    """A setting that was tried.

    Attributes:
        number: Its number.
        values: Factor -> value.
        origin: Part of the search that proposed it.
        scenarios: Manoeuvre -> its evaluation; some are missing if the setting was given up.
    """

    number: int
    values: dict[str, Any]
    origin: str = ""
    scenarios: dict[str, Evaluation] = field(default_factory=dict)

    @property
    def distances(self) -> dict[str, float]:
        """Statement -> distance, of all driven scenarios."""
        return {claim: distance for found in self.scenarios.values() for claim, distance in found.distances.items()}

    @property
    def holding(self) -> list[str]:
        """Statements that hold."""
        return [claim for claim, distance in self.distances.items() if distance <= 0.0]


class MatchStore:
    """The folder of a match.

    Attributes:
        candidates: All candidates, by number.
        evaluations: Number of scenarios driven, all controllers together.
        known: (manoeuvre, digest of its overrides) -> evaluation.
    """

    def __init__(self, folder: Path, study_toml: str, *, reads: bool = False) -> None:
        """Open the folder, or resume the search in it.

        The study stands behind a line with the digest of everything that decides its results; another version may read
        it.
        """
        self.candidates: dict[int, Candidate] = {}
        self.known: dict[tuple[str, str], Evaluation] = {}
        self.evaluations = 0
        make_folder(folder, StudyError)
        path = folder / _STUDY
        given = path.read_text(encoding="utf-8", errors="replace") if path.exists() else study_toml
        same = given.partition("\n")[2] == study_toml.partition("\n")[2]
        if given != study_toml and not (reads and same):
            what = "this search by another version of activesteer or of its files" if same else "another search"
            raise StudyError(f"{folder} holds {what}; use a new folder", value=folder)
        if not reads:
            write_text(path, study_toml, StudyError)
        self._path = folder / FILE
        for line in self._lines():
            self._take(line)

    def begin(self, candidate: Candidate) -> None:
        """Store a new candidate."""
        self._write({"candidate": candidate.number, "origin": candidate.origin, "values": candidate.values})

    def add(self, candidate: Candidate, maneuver: str, key: str, found: Evaluation) -> None:
        """Store an evaluation of a candidate; one that another candidate has already is not counted again."""
        same = (maneuver, key) in self.known
        line = {"of": candidate.number, "maneuver": maneuver, "key": key}
        self._write(line if same else line | {"distances": found.distances, "metrics": found.metrics})

    def _write(self, line: dict[str, Any]) -> None:
        with writing(self._path, StudyError), self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        self._take(line)

    def _take(self, line: dict[str, Any]) -> None:
        if "candidate" in line:
            self.candidates[line["candidate"]] = Candidate(line["candidate"], line["values"], line["origin"])
            return
        key = line["maneuver"], line["key"]
        if "distances" in line:
            self.known[key] = Evaluation(line["distances"], line["metrics"])
            self.evaluations += 1
        self.candidates[line["of"]].scenarios[line["maneuver"]] = self.known[key]

    def _lines(self) -> Iterator[dict[str, Any]]:
        if not self._path.exists():
            return
        with reading(self._path, StudyError):
            text = self._path.read_text(encoding="utf-8")
        whole, _, rest = text.rpartition("\n")
        if rest:  # a process was killed while writing
            write_text(self._path, f"{whole}\n" if whole else "", StudyError)
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                yield json.loads(line)
            except ValueError as reason:
                raise StudyError(f"{self._path}, line {number}: is damaged: {reason}", value=self._path) from reason
