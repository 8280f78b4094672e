"""Shares of a population of cars, roads and drivers in which the claims hold, and effects of the systems in it.

`studies.paper.population` drives it. The result of the package's own population is stored with it, so that a nominal
verdict can be read beside its share.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Final

from activesteer.errors import StudyError
from activesteer.files import reading
from activesteer.metric_table import metric
from activesteer.resources import studies_dir
from activesteer.theory.shares import ShareVerdict, share_verdict

NONE: Final = "none"
"""Name in place of a factor if no factor is significant."""


@dataclass(frozen=True)
class ClaimShare:
    """Share of a population in which a claim holds.

    Attributes:
        id: Number of the claim.
        passed: Whether the claim holds with the nominal car, road and driver.
        number: Number of samples in which the claim could be judged.
        share: Share of these samples in which it holds; nan for no samples.
        low: Lower end of the 95 % interval.
        high: Upper end.
        depends_on: Key of the factor with the largest influence; `none` if no factor is significant.
        explained: Share of the variance that this factor explains.
        direction: 1 if the claim holds more often with more of the factor, -1 with less, 0 in the middle or at the
            ends.
        at: Value of a factor that is a choice, as `sensors.preset = ideal` -> share of the samples with this value.
    """

    id: str
    passed: bool
    number: int
    share: float
    low: float
    high: float
    depends_on: str = NONE
    explained: float = 0.0
    direction: int = 0
    at: Mapping[str, float] = field(default_factory=dict)

    @property
    def verdict(self) -> ShareVerdict:
        """Verdict of the interval."""
        return share_verdict(self.low, self.high)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {**asdict(self), "verdict": self.verdict.value}

    @property
    def words(self) -> str:
        """The factor in words; empty without a factor."""
        if self.depends_on == NONE:
            return ""
        choices = {name: share for name, share in self.at.items() if name.startswith(f"{self.depends_on} = ")}
        if choices:
            return f"with {max(choices, key=lambda name: choices[name])}"
        return f"{('in the middle or at the ends of', 'with more', 'with less')[self.direction]} {self.depends_on}"


@dataclass(frozen=True)
class Change:
    """Change of the magnitude of a metric by a system, relative to the same sample without control.

    Attributes:
        metric: The metric.
        number: Number of samples in which both runs have the metric.
        low: 5 % quantile of the changes.
        median: Median of the changes.
        high: 95 % quantile of the changes.
    """

    metric: str
    number: int
    low: float
    median: float
    high: float


@dataclass(frozen=True)
class SystemEffect:
    """Effects of a system in a scenario.

    Attributes:
        controller: The system.
        scenario: The manoeuvre.
        lost_without: Number of samples in which the car without control is lost; see `loss_of_control.is_lost`.
        saved: Number of these samples in which the car with the system is not lost.
        fine_without: Number of samples in which the car without control is not lost.
        spoiled: Number of these samples in which the car with the system is lost.
        spun_without: Number of samples in which the car without control spins; the other lost cars leave the course.
        spun: Number of samples in which the car with the system spins.
        changes: Peak of the sideslip, remaining oscillation, steering effort, if the manoeuvre has them.
    """

    controller: str
    scenario: str
    lost_without: int
    saved: int
    fine_without: int
    spoiled: int
    spun_without: int
    spun: int
    changes: tuple[Change, ...]


@dataclass(frozen=True)
class Population:
    """Result of a population.

    Attributes:
        samples: Number of samples.
        seed: Seed of the samples.
        vehicle: The car that the samples are variations of.
        versions: Versions of the program and its libraries.
        claims: In the order of the paper.
        systems: Scenario by scenario.
    """

    samples: int
    seed: int
    vehicle: str
    versions: Mapping[str, str]
    claims: tuple[ClaimShare, ...]
    systems: tuple[SystemEffect, ...]

    def of(self, claim: str) -> ClaimShare | None:
        """Return the share of a claim; None for an unknown claim."""
        return next((share for share in self.claims if share.id == claim), None)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {**asdict(self), "claims": [claim.to_json() for claim in self.claims]}

    @classmethod
    def from_json(cls, table: Mapping[str, Any]) -> Population:
        """Return the population that `to_json` described.

        Raises:
            StudyError: the table is damaged.
        """
        try:
            claims = [ClaimShare(**{key: claim[key] for key in claim if key != "verdict"}) for claim in table["claims"]]
            systems = [
                SystemEffect(**{**effect, "changes": tuple(Change(**change) for change in effect["changes"])})
                for effect in table["systems"]
            ]
            return cls(**{**table, "claims": tuple(claims), "systems": tuple(systems)})
        except (KeyError, TypeError) as reason:
            raise StudyError(f"the stored population is damaged: {reason}") from reason

    def to_text(self) -> str:
        """Return shares and effects for a terminal, in degrees."""
        return "\n".join(
            [f"{self.samples} samples of {self.vehicle}, seed {self.seed}", "", *self._claim_lines(), "",
             *self._system_lines()]
        )  # fmt: skip

    def _claim_lines(self) -> list[str]:
        lines = ["     nominal  holds in  95 % interval  verdict         most"]
        for claim in self.claims:
            interval = f"{percent(claim.low)} to {percent(claim.high)} %"
            lines.append(
                f"{claim.id:4} {'passed' if claim.passed else 'fails':<8} {percent(claim.share):>6} %  {interval:<13}  "
                f"{claim.verdict.value:<14}  {claim.words}".rstrip()
            )
        return lines

    def _system_lines(self) -> list[str]:
        lines = []
        for effect in self.systems:
            lines.append(
                f"{effect.scenario}, {effect.controller}: saves {effect.saved} of the {effect.lost_without} that are "
                f"lost without it ({effect.spun_without} spin, with it {effect.spun}), spoils {effect.spoiled} of the "
                f"{effect.fine_without} that are not"
            )
            for change in effect.changes:
                shown = metric(change.metric)
                values = (change.low, change.median, change.high)
                low, median, high = (f"{shown.unit.factor * value:+.3g}" for value in values)
                lines.append(f"    {shown.label}: {f'{median} {shown.unit_name}'.rstrip()} ({low} to {high})")
        return lines


def percent(share: float) -> str:
    """Write a share in whole percent; within one percent of 0 or 100 with the digit that differs from them."""
    value = 100.0 * share
    beyond = float(f"{min(value, 100.0 - value):.1g}")
    decimals = max(0, -math.floor(math.log10(beyond))) if beyond > 0.0 else 0
    return f"{value:.{decimals}f}"


@functools.cache
def stored_population(vehicle: str) -> Population | None:
    """Return the population that belongs to the package.

    Args:
        vehicle: Name of a car.

    Returns:
        Its result; None if no population of this car is stored.

    Raises:
        StudyError: the file cannot be read.
    """
    path = studies_dir() / "population" / "summary.json"
    if not path.is_file():
        return None
    with reading(path, StudyError):
        text = path.read_text(encoding="utf-8")
    found = Population.from_json(json.loads(text))
    return found if found.vehicle == vehicle else None
