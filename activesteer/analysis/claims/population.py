"""Proportions in which the paper's claims hold for other cars, roads and drivers.

The package stores those of its own populations, which `activesteer study population` drives; a nominal verdict is
printed beside the proportion.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final, NamedTuple

from activesteer.errors import StudyError
from activesteer.files import reading
from activesteer.resources import studies_dir
from activesteer.theory.proportions import ProportionVerdict, proportion_verdict

NO_FACTOR: Final = "none"
"""Name in place of a factor if no factor is significant."""
SUMMARY: Final = "summary.json"


@dataclass(frozen=True)
class ClaimProportion:
    """Proportion of a population in which a claim holds.

    Attributes:
        id: Number of the claim.
        passed: Whether the claim holds with the nominal car, road and driver.
        number: Number of samples in which the claim could be judged.
        share: Proportion of these samples in which it holds; nan for no samples.
        low: Lower end of the 95 % interval.
        high: Upper end.
        depends_on: Key of the factor with the largest influence; `none` if no factor is significant.
        explained: Proportion of the variance that this factor explains.
        direction: 1 if the claim holds more often with more of the factor, -1 with less, 0 in the middle or at the
            ends.
        at: Value of a choice, such as `sensors.preset = ideal` -> proportion of the samples with this value.
    """

    id: str
    passed: bool
    number: int
    share: float
    low: float
    high: float
    depends_on: str = NO_FACTOR
    explained: float = 0.0
    direction: int = 0
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
        """The factor in words; empty without a factor."""
        if self.depends_on == NO_FACTOR:
            return ""
        choices = {name: value for name, value in self.at.items() if name.startswith(f"{self.depends_on} = ")}
        if choices:
            return f"with {max(choices, key=lambda name: choices[name])}"
        return f"{('in the middle or at the ends of', 'with more', 'with less')[self.direction]} {self.depends_on}"


class Population(NamedTuple):
    """Stored proportions of a population.

    Attributes:
        samples: Number of samples.
        seed: Seed of the samples.
        vehicle: The car that the samples are variations of.
        claims: In the order of the paper.
    """

    samples: int
    seed: int
    vehicle: str
    claims: tuple[ClaimProportion, ...]

    def of(self, claim: str) -> ClaimProportion | None:
        """Return the proportion of a claim; None for an unknown claim."""
        return next((proportion for proportion in self.claims if proportion.id == claim), None)


def read_claims(table: Mapping[str, Any]) -> tuple[ClaimProportion, ...]:
    """Return the proportions of a stored population.

    Raises:
        StudyError: the table is damaged.
    """
    try:
        return tuple(
            ClaimProportion(**{key: claim[key] for key in claim if key != "verdict"}) for claim in table["claims"]
        )
    except (KeyError, TypeError) as reason:
        raise StudyError(f"the stored population is damaged: {reason}") from reason


def stored_table(name: str) -> dict[str, Any] | None:
    """Return the results that the package stores of a study, such as `population`; None if it stores none."""
    path = studies_dir() / name / SUMMARY
    if not path.is_file():
        return None
    with reading(path, StudyError):
        return json.loads(path.read_text(encoding="utf-8"))


@functools.cache
def stored_population(vehicle: str) -> Population | None:
    """Return the population that belongs to the package.

    Returns:
        Its result; None if no population of this car is stored.
    """
    table = stored_table("population")
    if table is None or table.get("vehicle") != vehicle:
        return None
    return Population(table["samples"], table["seed"], vehicle, read_claims(table))
