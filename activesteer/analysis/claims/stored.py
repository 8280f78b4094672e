"""Data that the package stores about the claims: settings, claims that are not reproduced, and populations.

A setting holds what the paper leaves open, as numbers with ranges and reasons. `literature` is the nominal car with a
driver from published ranges; it changes nothing. `paper` was selected by the verdicts of the claims (`activesteer tune
match_paper`), within ranges that were written down before: it shows under which conditions the paper's statements hold
together, and is no evidence for them.

A population holds the proportions in which the claims hold for other cars, roads and drivers, which `activesteer study
population` drives. A nominal verdict is printed with the proportion. Its bands, from 10 to 90 % of the runs, are drawn
behind a nominal curve.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.analysis.claims.judge import SCENARIOS, STATEMENTS, Scenario
from activesteer.analysis.source import RecordingLike
from activesteer.config import Source, build, read_toml
from activesteer.conventions import Array
from activesteer.errors import ParameterError, StudyError, nearest_names
from activesteer.files import reading
from activesteer.resources import DEFAULT_DRIVER, studies_dir
from activesteer.theory.proportions import ProportionVerdict, proportion_verdict

LITERATURE: Final = "literature"
PAPER: Final = "paper"
SETTINGS: Final = {PAPER: "paper's setting", LITERATURE: "driver from literature"}
"""Name of a setting -> its title."""
VEHICLE: Final = "compact"
"""Car of the paper's setting."""
NOT_REPRODUCED: Final = Path(__file__).parent / "not_reproduced.toml"
SUMMARY: Final = "summary.json"
NO_FACTOR: Final = "none"
"""Name in place of a factor if no factor is significant."""
_NO_SETTING: Final = frozenset({"vehicle", "duration_s", "settle_s", "title"})
"""Keys that may differ from the paper's: these keys of the manoeuvre, and the whole car."""


@dataclass(frozen=True)
class Number:
    """A number of a setting."""

    key: str
    """Dotted key, as for `--set`."""
    value: float | str
    """Its value in this setting."""
    nominal: float | str
    """Its value in the setting `literature`."""
    reason: str
    """Source of the range."""
    low: float | None = None
    """Lower end of the range that was allowed."""
    high: float | None = None
    """Upper end of the range."""
    maneuvers: tuple[str, ...] = ()
    """Manoeuvres in which it acts, or empty for all."""


@dataclass(frozen=True)
class Setting:
    """A setting file."""

    title: str = ""
    """One line for people."""
    numbers: tuple[Number, ...] = ()
    """Everything that differs from the nominal car, driver and manoeuvre."""
    fails: dict[str, str] = field(default_factory=dict)
    """Number of each statement that does not hold -> reason."""

    def overrides(self, scenario: str) -> dict[str, Any]:
        """Return the overrides of a scenario."""
        return {
            number.key: number.value for number in self.numbers if not number.maneuvers or scenario in number.maneuvers
        }


@functools.cache
def read_setting(name: str) -> Setting:
    """Return a setting of the package, `paper` or `literature`."""
    if name not in SETTINGS:
        raise ParameterError(nearest_names(name, SETTINGS), key="--setting", value=name, allowed=tuple(SETTINGS))
    if name == LITERATURE:
        return Setting()
    table, source = read_toml(Path(__file__).parent / f"{name}_setting.toml", ParameterError)
    found = build(Setting, table, source)
    _check_reasons(found.fails, source, "fails")
    return found


def setting_of(recording: RecordingLike) -> str:
    """Return the name of the setting in which a run was made, or empty if it has other overrides or is of the user."""
    maneuver, overrides = recording.metadata.get("maneuver"), recording.metadata.get("overrides") or {}
    name = maneuver.get("name") if isinstance(maneuver, Mapping) else None
    if name not in SCENARIOS or not isinstance(overrides, Mapping):
        return ""
    if not overrides:
        return LITERATURE
    return PAPER if dict(overrides) == read_setting(PAPER).overrides(str(name)) else ""


def claims_for(recording: RecordingLike) -> Scenario | None:
    """Return the scenario that checks the paper's claims about the manoeuvre of a run, or None if it has none."""
    # The name of its manoeuvre counts, and for the two open-loop manoeuvres also its kind: a user's step steer is a
    # step steer. The paper has no claims about a manoeuvre with other settings, except those of `setting_of`; any car
    # and any duration are judged.
    maneuver, vehicle = recording.metadata.get("maneuver"), recording.metadata.get("vehicle")
    if not isinstance(maneuver, Mapping):
        return None
    harmless = {*_NO_SETTING, *(vehicle if isinstance(vehicle, Mapping) else ())}
    keys = recording.metadata.get("overrides") or ()
    changed = any(key.removeprefix("maneuver.").partition(".")[0] not in harmless for key in keys)
    if changed and setting_of(recording) != PAPER:
        return None
    name, kind = maneuver.get("name"), maneuver.get("kind")
    return SCENARIOS.get(str(name if name in SCENARIOS or kind not in {"step_steer", "sine_with_dwell"} else kind))


def not_reproduced(vehicle: str, path: Path = NOT_REPRODUCED) -> dict[str, str]:
    """Return the claims that are not reproduced with a vehicle."""
    table, source = read_toml(path, ParameterError)
    for name, reasons in table.items():
        _check_reasons(reasons, source, name)
    return dict(table.get(vehicle, {}))


def _check_reasons(reasons: object, source: Source, name: str) -> None:
    if not isinstance(reasons, dict):
        raise source.fail((name,), f"is {reasons!r}; claims and reasons are needed", reasons)
    for number, reason in reasons.items():
        if number not in STATEMENTS:
            raise source.fail((name, number), f"no such claim; {nearest_names(number, STATEMENTS)}", number)
        if not isinstance(reason, str) or not reason.strip():
            raise source.fail((name, number), f"is {reason!r}; the reason in words is needed", reason)


@dataclass(frozen=True)
class ClaimProportion:
    """Proportion of a population in which a claim holds."""

    id: str  # number of the claim
    passed: bool  # whether the claim holds with the nominal car, road and driver
    number: int  # number of samples in which the claim could be judged
    share: float  # proportion of these samples in which it holds; nan for no samples
    low: float  # lower end of the 95 % interval
    high: float  # upper end
    depends_on: str = NO_FACTOR  # key of the factor with the largest influence; `none` if no factor is significant
    explained: float = 0.0  # proportion of the variance that this factor explains
    # 1 if the claim holds more often with more of the factor, -1 with less, 0 in the middle or at the ends
    direction: int = 0
    # value of a choice, such as `sensors.preset = ideal` -> proportion of the samples with this value
    at: Mapping[str, float] = field(default_factory=dict)

    @property
    def verdict(self) -> ProportionVerdict:
        """Verdict of the interval."""
        return proportion_verdict(self.low, self.high)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {**asdict(self), "verdict": self.verdict.value}

    @property
    def words(self) -> str:
        """The factor in words, or empty without a factor."""
        if self.depends_on == NO_FACTOR:
            return ""
        choices = {name: value for name, value in self.at.items() if name.startswith(f"{self.depends_on} = ")}
        if choices:
            return f"with {max(choices, key=lambda name: choices[name])}"
        return f"{('in the middle or at the ends of', 'with more', 'with less')[self.direction]} {self.depends_on}"


class Population(NamedTuple):
    """Stored proportions of a population: number and seed of its samples, its nominal car, its claims in order."""

    samples: int
    seed: int
    vehicle: str
    claims: tuple[ClaimProportion, ...]

    def of(self, claim: str) -> ClaimProportion | None:
        """Return the proportion of a claim, or None for an unknown claim."""
        return next((proportion for proportion in self.claims if proportion.id == claim), None)


def read_claims(table: Mapping[str, Any]) -> tuple[ClaimProportion, ...]:
    """Return the proportions of a stored population. A damaged table raises `StudyError`."""
    try:
        return tuple(
            ClaimProportion(**{key: claim[key] for key in claim if key != "verdict"}) for claim in table["claims"]
        )
    except (KeyError, TypeError) as reason:
        raise StudyError(f"the stored population is damaged: {reason}") from reason


def stored_table(name: str) -> dict[str, Any] | None:
    """Return the results that the package stores of a study, such as `population`, or None if it stores none."""
    path = studies_dir() / name / SUMMARY
    if not path.is_file():
        return None
    with reading(path, StudyError):
        return json.loads(path.read_text(encoding="utf-8"))


@functools.cache
def stored_population(vehicle: str) -> Population | None:
    """Return the population that belongs to the package, or None if no population of this car is stored."""
    table = stored_table("population")
    if table is None or table.get("vehicle") != vehicle:
        return None
    return Population(table["samples"], table["seed"], vehicle, read_claims(table))


TRACK: Final = ("front_axle_x_m", "front_axle_y_m")
"""Channels of the band across the course, y over x."""
BANDS: Final = "bands.parquet"


class Band(NamedTuple):
    """A band of one channel."""

    at: Array  # time [s], or x of the front axle centre [m], shape (n,)
    low: Array  # lower edge, shape (n,)
    high: Array  # upper edge, shape (n,)


def bands_of(recording: RecordingLike) -> Mapping[str, Band]:
    """Return the population's bands for a run."""
    maneuver, vehicle, driver = (_name_of(recording, part) for part in ("maneuver", "vehicle", "driver"))
    if claims_for(recording) is None or recording.metadata.get("overrides") or driver != DEFAULT_DRIVER:
        return {}
    return _stored_bands(vehicle).get((maneuver, str(recording.metadata.get("controller"))), {})


def _name_of(recording: RecordingLike, part: str) -> str:
    table = recording.metadata.get(part)
    return str(table.get("name")) if isinstance(table, Mapping) else ""


@functools.cache
def _stored_bands(vehicle: str) -> dict[tuple[str, str], dict[str, Band]]:
    path = studies_dir() / "population" / BANDS
    if not path.is_file():
        return {}
    import pyarrow.parquet as pq  # noqa: PLC0415 - slow to import

    with reading(path, StudyError):
        table = pq.read_table(path)
    found: dict[tuple[str, str], dict[str, Band]] = {}
    if (table.schema.metadata or {}).get(b"vehicle", b"").decode() != vehicle:
        return found
    for row in table.to_pylist():
        low, high = (np.array(row[edge], dtype=np.float64) for edge in ("low", "high"))
        band = Band(row["start"] + row["step"] * np.arange(len(low)), low, high)
        found.setdefault((row["maneuver"], row["controller"]), {})[row["channel"]] = band
    return found
