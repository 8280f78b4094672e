"""Results of a comparison of controllers over a population: proportions, effects and targets."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, Final

from activesteer.analysis.claims.population import percent
from activesteer.errors import StudyError
from activesteer.files import finite
from activesteer.studies.paper.comparison import Row
from activesteer.studies.paper.comparison_targets import (
    LOWER_SHARE,
    NONE,
    REFERENCES,
    SPOILED_SHARE,
    Target,
    asked,
    targets_text,
)
from activesteer.theory.shares import wilson_interval

TOTAL: Final = "all scenarios"


@dataclass(frozen=True)
class Share:
    """Number of runs with a property.

    Attributes:
        count: Runs with the property.
        number: All runs.
    """

    count: int
    number: int

    def __add__(self, other: Share) -> Share:
        """Return the proportion of both sets together."""
        return Share(self.count + other.count, self.number + other.number)

    @property
    def share(self) -> float:
        """The proportion; nan without runs."""
        return self.count / self.number if self.number else math.nan

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, with the 95 % interval (Wilson)."""
        low, high = wilson_interval(self.count, self.number)
        return {**asdict(self), "share": finite(self.share), "low": low, "high": high}

    def __str__(self) -> str:
        """Return the proportion in percent, with the interval."""
        if not self.number:
            return "-"
        low, high = wilson_interval(self.count, self.number)
        return f"{percent(self.share)} % ({percent(low)} to {percent(high)})"


@dataclass(frozen=True)
class Effect:
    """Effect of a controller in a scenario, relative to the same samples without control.

    Attributes:
        scenario: The scenario.
        controller: The controller.
        lower: Samples with a lower peak sideslip angle than the lowest of `REFERENCES`; no samples if the controller is
            one of `REFERENCES`.
        saved: Samples in which the car is not lost, of those in which it is lost without control; see `is_lost`.
        spoiled: Samples in which the car is lost, of those in which it is not lost without control.
        sideslip_change_rad: Median change of the peak sideslip angle [rad].
        steering_change_rad: Median change of the root mean square of the steering wheel angle, the driver's effort; nan
            if he follows a table [rad].
    """

    scenario: str
    controller: str
    lower: Share
    saved: Share
    spoiled: Share
    sideslip_change_rad: float
    steering_change_rad: float

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {
            field.name: value.to_json() if isinstance(value := getattr(self, field.name), Share) else finite(value)
            for field in fields(self)
        }

    @classmethod
    def from_json(cls, table: Mapping[str, Any]) -> Effect:
        """Return the effect from the JSON values of `to_json`."""
        read: dict[str, Any] = {key: math.nan if value is None else value for key, value in table.items()}
        read |= {key: Share(read[key]["count"], read[key]["number"]) for key in ("lower", "saved", "spoiled")}
        return cls(**read)


@dataclass(frozen=True)
class ComparisonPopulation:
    """Results of a comparison over a population.

    Attributes:
        samples: Number of samples.
        seed: Seed of the sample.
        vehicle: The car of which the samples are variations.
        versions: Versions of the software that drove it.
        controllers: The compared controllers, in the order given.
        failed: Number of incomplete runs; each counts as lost.
        effects: Effects by scenario, in the order of the controllers, without `none`.
        table: Median of every metric over the samples.
    """

    samples: int
    seed: int
    vehicle: str
    versions: Mapping[str, str]
    controllers: tuple[str, ...]
    failed: int
    effects: tuple[Effect, ...]
    table: tuple[Row, ...]

    def of(self, controller: str) -> list[Effect]:
        """Return the effects of a controller by scenario."""
        return [effect for effect in self.effects if effect.controller == controller]

    def total(self, controller: str) -> Effect:
        """Return the effect of a controller in all scenarios together."""
        nothing, own = Share(0, 0), self.of(controller)
        lower, saved, spoiled = (
            sum((getattr(effect, name) for effect in own), nothing) for name in ("lower", "saved", "spoiled")
        )
        return Effect(TOTAL, controller, lower, saved, spoiled, math.nan, math.nan)

    @property
    def targets(self) -> list[Target]:
        """Return the verdicts on the targets of the controllers beyond the paper's, in all scenarios together."""
        found = []
        for name in asked(self.controllers):
            total = self.total(name)
            lower = f"peak of the sideslip below the lowest of {', '.join(REFERENCES)} in {total.lower}"
            spoils = f"of the runs that are fine without control it spoils {total.spoiled}"
            found += [
                Target(name, f"{lower}, asked for >= {LOWER_SHARE:.0%}", total.lower.share >= LOWER_SHARE),
                Target(name, f"{spoils}, asked for <= {SPOILED_SHARE:.0%}", total.spoiled.share <= SPOILED_SHARE),
            ]
        return found

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {
            "samples": self.samples,
            "seed": self.seed,
            "vehicle": self.vehicle,
            "versions": dict(self.versions),
            "controllers": list(self.controllers),
            "failed": self.failed,
            "effects": [effect.to_json() for effect in self.effects],
            "totals": [self.total(name).to_json() for name in self.controllers if name != NONE],
            "targets": [target._asdict() for target in self.targets],
            "table": [finite(row._asdict()) for row in self.table],
        }

    @classmethod
    def from_json(cls, table: Mapping[str, Any]) -> ComparisonPopulation:
        """Return the population from the JSON values of `to_json`.

        Raises:
            StudyError: the values are no such population.
        """
        try:
            read = {
                "controllers": tuple(table["controllers"]),
                "effects": tuple(Effect.from_json(effect) for effect in table["effects"]),
                "table": tuple(
                    Row(**{**row, "value": math.nan if row["value"] is None else row["value"]})
                    for row in table["table"]
                ),
            }
            return cls(**{field.name: read.get(field.name, table[field.name]) for field in fields(cls)})
        except (KeyError, TypeError, AttributeError) as reason:
            raise StudyError(f"the stored comparison is damaged: {reason}") from reason

    def to_text(self) -> str:
        """Return the proportions and the targets as text."""
        lines = [
            f"{self.samples} samples of {self.vehicle}, seed {self.seed}; median changes against {NONE}",
            "",
            _ROW.format("", "sideslip below all", "saves of", "spoils of", "sideslip", "steering"),
            _ROW.format("", f"of {', '.join(REFERENCES)}", "the lost", "the fine", "peak", "rms"),
        ]
        named = [name for name in self.controllers if name != NONE]
        totals = [self.total(name) for name in named]
        for scenario in [*dict.fromkeys(effect.scenario for effect in self.effects), TOTAL]:
            lines.append(scenario)
            lines += [_line(effect) for effect in (*self.effects, *totals) if effect.scenario == scenario]
        if self.failed:
            lines += ["", f"{self.failed} runs did not come to their end"]
        return "\n".join([*lines, "", targets_text(self.targets)]).rstrip()


_ROW: Final = "{:16}{:>22}{:>14}{:>14}{:>12}{:>12}"


def _line(effect: Effect) -> str:
    counts = (f"{share.count} of {share.number}" for share in (effect.saved, effect.spoiled))
    changes = (
        "-" if math.isnan(value) else f"{math.degrees(value):+.2f} deg"
        for value in (effect.sideslip_change_rad, effect.steering_change_rad)
    )
    return _ROW.format(f"  {effect.controller}", str(effect.lower), *counts, *changes)
