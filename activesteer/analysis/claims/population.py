"""Results of a population of cars, roads and drivers: proportions in which claims hold, and effects of controllers.

`studies.paper.population` drives it. The package stores the results of its own populations; a nominal verdict
is printed beside the proportion.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Final

from activesteer.errors import StudyError
from activesteer.files import finite, reading
from activesteer.metric_table import metric
from activesteer.resources import studies_dir
from activesteer.theory.proportions import Proportion, ProportionVerdict, percent, proportion_verdict

NO_FACTOR: Final = "none"
"""Name in place of a factor if no factor is significant."""
TOTAL: Final = "all scenarios"
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


@dataclass(frozen=True)
class Change:
    """Change of the magnitude of a metric or a measure by a system, relative to the same sample without control.

    Attributes:
        metric: The metric, or the name of one of `harm.MEASURES`.
        number: Number of samples in which both runs have the metric.
        low: 5 % quantile of the changes.
        median: Median of the changes.
        high: 95 % quantile of the changes.
        largest: Largest change; infinite if a run with the system alone does not define the value.
        harmed: Number of samples in which the change is harm.
    """

    metric: str
    number: int
    low: float
    median: float
    high: float
    largest: float = math.nan
    harmed: int = 0


@dataclass(frozen=True)
class WorstRun:
    """A run with much harm.

    Attributes:
        controller: The controller.
        scenario: The manoeuvre.
        sample: Number of the sample.
        severity: Largest growth of a measure, in multiples of its size.
        growth: Measure -> growth [SI], for the measures that are harmed.
        command: Command line that repeats the run; with `-c none` it repeats the run without control.
    """

    controller: str
    scenario: str
    sample: int
    severity: float
    growth: Mapping[str, float]
    command: str

    @classmethod
    def from_json(cls, table: dict[str, Any]) -> WorstRun:
        """Return the run from JSON values, in which an infinite growth is None."""
        growth = {name: math.inf if value is None else value for name, value in table["growth"].items()}
        return cls(**table | {"growth": growth, "severity": table["severity"] or math.inf})


@dataclass(frozen=True)
class SystemEffect:
    """Effect of a controller in a scenario, relative to the same samples without control.

    `loss_of_control.is_lost` decides whether a car is lost.

    Attributes:
        controller: The controller.
        scenario: The manoeuvre.
        saved: Samples in which the car is not lost, of those in which it is lost without control.
        spoiled: Samples in which the car is lost, of those in which it is not lost without control.
        changes: Peak of the sideslip, remaining oscillation, steering effort, if the manoeuvre has them.
        spun_without: Number of samples in which the car without control spins; the other lost cars leave the course.
            None if it is not stored.
        spun: Number of samples in which the car with the controller spins; None if it is not stored.
        lower: Samples with a lower peak sideslip angle than the lowest of the reference controllers; no samples if the
            controller is not compared with them.
        harmed: Samples with harm; see `analysis.harm`.
        growth: Distribution of each measure of harm.
        worst_track_m: Largest growth of lane overstep or path error [m]; nan without such a measure.
    """

    controller: str
    scenario: str
    saved: Proportion
    spoiled: Proportion
    changes: tuple[Change, ...] = ()
    spun_without: int | None = None
    spun: int | None = None
    lower: Proportion = Proportion()
    harmed: Proportion = Proportion()
    growth: tuple[Change, ...] = ()
    worst_track_m: float = math.nan

    def median_change(self, metrics: Sequence[str]) -> float:
        """Return the median change of the first metric that the scenario has; nan if it has none of them."""
        medians = {change.metric: change.median for change in self.changes}
        return next((medians[name] for name in metrics if name in medians), math.nan)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return finite({**asdict(self), **{name: getattr(self, name).to_json() for name in _PROPORTIONS}})

    @classmethod
    def from_json(cls, table: dict[str, Any]) -> SystemEffect:
        """Return the effect that `to_json` described."""
        read: dict[str, Any] = {
            name: Proportion(table[name]["count"], table[name]["number"]) for name in _PROPORTIONS if name in table
        }
        nan: dict[str, Any] = dict.fromkeys(("low", "median", "high"), math.nan)
        for name in ("changes", "growth"):
            read[name] = tuple(
                Change(**nan | {key: value for key, value in change.items() if value is not None})
                for change in table.get(name, ())
            )
        known: dict[str, Any] = {
            key: value for key, value in table.items() if value is not None or key.startswith("spun")
        }
        return cls(**known | read)


_PROPORTIONS: Final = ("saved", "spoiled", "lower", "harmed")


@dataclass(frozen=True)
class Population:
    """Result of a population.

    Attributes:
        samples: Number of samples.
        seed: Seed of the samples.
        vehicle: The car that the samples are variations of.
        versions: Versions of the program and its libraries.
        claims: In the order of the paper; none for a comparison of controllers.
        systems: Effects, scenario by scenario, in the order of the controllers.
        failed: Number of incomplete runs; each counts as lost.
        table: Median of every metric over the samples: `scenario`, `controller`, `metric`, `value`. Empty for a
            population with claims, and not stored.
        worst: The runs with the most harm, of each controller.
    """

    samples: int
    seed: int
    vehicle: str
    versions: Mapping[str, str]
    claims: tuple[ClaimProportion, ...]
    systems: tuple[SystemEffect, ...]
    failed: int = 0
    table: tuple[Mapping[str, Any], ...] = ()
    worst: tuple[WorstRun, ...] = ()

    def of(self, claim: str) -> ClaimProportion | None:
        """Return the proportion of a claim; None for an unknown claim."""
        return next((proportion for proportion in self.claims if proportion.id == claim), None)

    @property
    def controllers(self) -> list[str]:
        """Controllers that have effects, in their order."""
        return list(dict.fromkeys(effect.controller for effect in self.systems))

    def total(self, controller: str) -> SystemEffect:
        """Return the effect of a controller in all scenarios together, without changes."""
        own = [effect for effect in self.systems if effect.controller == controller]
        sums: dict[str, Any] = {
            name: sum((getattr(effect, name) for effect in own), Proportion()) for name in _PROPORTIONS
        }
        tracks = [effect.worst_track_m for effect in own if not math.isnan(effect.worst_track_m)]
        return SystemEffect(controller, TOTAL, **sums, worst_track_m=max(tracks, default=math.nan))

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {
            **asdict(self),
            "claims": [claim.to_json() for claim in self.claims],
            "systems": [effect.to_json() for effect in self.systems],
            "worst": finite([asdict(run) for run in self.worst]),
        }

    @classmethod
    def from_json(cls, table: Mapping[str, Any]) -> Population:
        """Return the population that `to_json` described."""
        try:
            claims = (
                ClaimProportion(**{key: claim[key] for key in claim if key != "verdict"}) for claim in table["claims"]
            )
            read = {
                "claims": tuple(claims),
                "systems": tuple(SystemEffect.from_json(effect) for effect in table["systems"]),
                "table": tuple(table["table"]),
                "worst": tuple(map(WorstRun.from_json, table.get("worst", ()))),
            }
            known = {**table, **read}
            return cls(**{field.name: known[field.name] for field in fields(cls) if field.name in known})
        except (KeyError, TypeError, AttributeError) as reason:
            raise StudyError(f"the stored population is damaged: {reason}") from reason

    def to_text(self) -> str:
        """Return proportions and effects for a terminal, in degrees."""
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
                f"{effect.scenario}, {effect.controller}: saves {effect.saved.count} of the {effect.saved.number} "
                f"that are lost without it ({effect.spun_without} spin, with it {effect.spun}), spoils "
                f"{effect.spoiled.count} of the {effect.spoiled.number} that are not"
            )
            for change in effect.changes:
                shown = metric(change.metric)
                values = (change.low, change.median, change.high)
                low, median, high = (f"{shown.unit.factor * value:+.3g}" for value in values)
                lines.append(f"    {shown.label}: {f'{median} {shown.unit_name}'.rstrip()} ({low} to {high})")
        return lines


def read_population(name: str) -> Population | None:
    """Return the results that the package stores of a study, `population` or `comparison`; None if it stores none."""
    path = studies_dir() / name / SUMMARY
    if not path.is_file():
        return None
    with reading(path, StudyError):
        text = path.read_text(encoding="utf-8")
    return Population.from_json(json.loads(text))


@functools.cache
def stored_population(vehicle: str) -> Population | None:
    """Return the population that belongs to the package.

    Returns:
        Its result; None if no population of this car is stored.
    """
    found = read_population("population")
    return found if found is not None and found.vehicle == vehicle else None
