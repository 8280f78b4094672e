"""Any controllers side by side over a population: the same cars, roads, drivers and sensors for all of them.

It is the study `population` without the gains, which only the paper's systems have, and behind the sensors of
production cars, of which every sample has others.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa

from activesteer.analysis.claims.population import SystemEffect, percent
from activesteer.analysis.loss import SIDESLIP_PEAKS
from activesteer.config import read_toml
from activesteer.errors import ManeuverError, ParameterError, StudyError
from activesteer.files import finite, make_folder, reading, write_text
from activesteer.resources import find_maneuver, studies_dir
from activesteer.scenario import FileOrTable
from activesteer.studies.comparison import CASES, SHOWN, Row
from activesteer.studies.comparison_targets import (
    LOWER_SHARE,
    NONE,
    REFERENCES,
    SPOILED_SHARE,
    Target,
    asked,
    targets_text,
)
from activesteer.studies.factor_values import label_of
from activesteer.studies.population import STEERING_EFFORT, effects, population_study
from activesteer.studies.run_identity import versions
from activesteer.studies.store import IDENTITY, OUTCOME
from activesteer.studies.study import StudyProgress, study
from activesteer.studies.study_file import StudyFile, read_study
from activesteer.theory.shares import wilson_interval

SCENARIOS: Final = tuple(name for name in CASES if name not in ("severe_lane_change", "split_mu_braking"))
"""Those of the comparison but two: one is compared by entry speed, in the other sideslip is not what matters."""
STORED: Final = "comparison/summary.json"
"""What is kept with the package of its own one, below the folder of the study files."""
_PRESET: Final = "sensors.preset"
_SEED: Final = "sensors.seed"
TOTAL: Final = "all scenarios"


@dataclass(frozen=True)
class Share:
    """How many of some runs something holds for.

    Attributes:
        count: In which it does.
        number: Of how many.
    """

    count: int
    number: int

    def __add__(self, other: Share) -> Share:
        """Both together."""
        return Share(self.count + other.count, self.number + other.number)

    @property
    def share(self) -> float:
        """The share; nan of none."""
        return self.count / self.number if self.number else math.nan

    def to_json(self) -> dict[str, Any]:
        """As JSON values, with the 95 % interval (Wilson)."""
        low, high = wilson_interval(self.count, self.number)
        return {**asdict(self), "share": finite(self.share), "low": low, "high": high}

    def __str__(self) -> str:
        """In percent, with the interval."""
        if not self.number:
            return "-"
        low, high = wilson_interval(self.count, self.number)
        return f"{percent(self.share)} % ({percent(low)} to {percent(high)})"


@dataclass(frozen=True)
class Effect:
    """What a controller does in a scenario, against the same samples without control.

    Attributes:
        scenario: The scenario.
        controller: The controller.
        lower: Samples in which the peak of the sideslip is lower than the lowest of `REFERENCES`; of no samples where
            the controller is one of them.
        saved: Samples in which the car is kept, of those in which it is lost without control; see `loss.is_lost`.
        spoiled: Samples in which it is lost, of those in which it is not without control.
        sideslip_change_rad: By how much the peak of the sideslip is larger, median [rad].
        steering_change_rad: The same of the root mean square of the steering wheel angle, which is the driver's effort;
            nan where he follows a table [rad].
    """

    scenario: str
    controller: str
    lower: Share
    saved: Share
    spoiled: Share
    sideslip_change_rad: float
    steering_change_rad: float

    def to_json(self) -> dict[str, Any]:
        """As JSON values."""
        return {
            field.name: value.to_json() if isinstance(value := getattr(self, field.name), Share) else finite(value)
            for field in fields(self)
        }

    @classmethod
    def from_json(cls, table: Mapping[str, Any]) -> Effect:
        """The effect that `to_json` was made of."""
        read: dict[str, Any] = {key: math.nan if value is None else value for key, value in table.items()}
        read |= {key: Share(read[key]["count"], read[key]["number"]) for key in ("lower", "saved", "spoiled")}
        return cls(**read)


@dataclass(frozen=True)
class ComparisonPopulation:
    """What came of it.

    Attributes:
        samples: Number of samples.
        seed: Of the sample.
        vehicle: The car that the samples are variations of.
        versions: What it was driven with.
        controllers: What was compared, in the order given.
        failed: Runs that did not come to their end; each counts as lost.
        effects: Scenario by scenario, in the order of the controllers, of all but `none`.
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
        """What a controller does, scenario by scenario."""
        return [effect for effect in self.effects if effect.controller == controller]

    def total(self, controller: str) -> Effect:
        """What a controller does in all scenarios together."""
        nothing, own = Share(0, 0), self.of(controller)
        lower, saved, spoiled = (
            sum((getattr(effect, name) for effect in own), nothing) for name in ("lower", "saved", "spoiled")
        )
        return Effect(TOTAL, controller, lower, saved, spoiled, math.nan, math.nan)

    @property
    def targets(self) -> list[Target]:
        """What became of what the controllers beyond the paper's are asked for, in all scenarios together."""
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
        """As JSON values."""
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
        """The population that `to_json` was made of.

        Raises:
            StudyError: it was not.
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
        """Shares for a terminal, and the targets."""
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


def comparison_study(
    controllers: Sequence[str],
    samples: int | None = None,
    seed: int | None = None,
    vehicle: FileOrTable | None = None,
) -> StudyFile:
    """The study that is driven.

    Args:
        controllers: As for `simulate`; with `none` and `REFERENCES`, which the others are compared with.
        samples: Number of samples, that of the study `population` where not given.
        seed: Of the sample, likewise.
        vehicle: Name, path or table of a vehicle, likewise.

    Raises:
        ActiveSteerError: an input is wrong.
    """
    missing = [name for name in (NONE, *REFERENCES) if name not in controllers]
    if missing:
        raise ParameterError(
            f"{', '.join(missing)} is missing: the others are compared with {', '.join((NONE, *REFERENCES))}",
            key="--controllers",
            value=",".join(controllers),
        )
    table = population_study(samples, seed, vehicle).to_table()
    factors = {key: dict(value) for key, value in table["factors"].items() if not key.startswith("controllers.")}
    del factors[_PRESET], factors[_SEED]["when"], table["curves"]
    shown = (metric for scenario in SCENARIOS for metric in SHOWN[scenario])
    return read_study(
        table
        | {
            "title": "Controllers side by side over a population",
            "maneuvers": [_maneuver(name) for name in SCENARIOS],
            "controllers": list(controllers),
            "claims": False,
            "overrides": {_PRESET: "production"},
            "factors": factors,
            "metrics": list(dict.fromkeys([*table["metrics"], *shown])),
        }
    )


def _maneuver(scenario: str) -> FileOrTable:
    maneuver, changes = CASES[scenario]
    if not changes:
        return maneuver
    table, _ = read_toml(find_maneuver(maneuver), ManeuverError)
    return {**table, **changes, "name": scenario}


def compare_population(
    controllers: Sequence[str],
    samples: int | None = None,
    *,
    seed: int | None = None,
    vehicle: FileOrTable | None = None,
    output: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> ComparisonPopulation:
    """Drives the controllers over a population; see `comparison_study` and `study` for the arguments.

    Raises:
        ActiveSteerError: an input is wrong, or the folder holds another study.
    """
    planned = comparison_study(controllers, samples, seed, vehicle)
    table = study(planned, output=output, jobs=jobs, scheduler=scheduler, progress=progress)
    return summarise(table, planned)


def summarise(table: pa.Table, planned: StudyFile) -> ComparisonPopulation:
    """Counts what the runs say.

    Args:
        table: The study's table, or as much of it as there is.
        planned: The study.
    """
    rows = table.to_pylist()
    names = [label_of(controller) for controller in planned.controllers]
    lower = _lower(rows, asked(names))
    found = effects(rows, NONE, *(name for name in names if name != NONE))
    return ComparisonPopulation(
        samples=len({row["sample"] for row in rows}),
        seed=planned.seed,
        vehicle=label_of(planned.vehicles[0]),
        versions=versions(),
        controllers=tuple(names),
        failed=sum(row["status"] != "ok" for row in rows),
        effects=tuple(_effect(one, lower) for one in found),
        table=tuple(_medians(rows, planned)),
    )


def store_comparison(found: ComparisonPopulation) -> Path:
    """Keeps what came of a comparison with the package, without the medians of all metrics.

    Returns:
        The file.

    Raises:
        StudyError: it cannot be written.
    """
    path = studies_dir() / STORED
    make_folder(path.parent, StudyError)
    return write_text(path, json.dumps(replace(found, table=()).to_json(), indent=1) + "\n", StudyError)


def stored_comparison() -> ComparisonPopulation | None:
    """The comparison that belongs to the package; None where there is none.

    Raises:
        StudyError: it cannot be read.
    """
    path = studies_dir() / STORED
    if not path.is_file():
        return None
    with reading(path, StudyError):
        return ComparisonPopulation.from_json(json.loads(path.read_text(encoding="utf-8")))


def _effect(found: SystemEffect, lower: Mapping[tuple[str, str], Share]) -> Effect:
    changes = {change.metric: change.median for change in found.changes}
    return Effect(
        found.scenario,
        found.controller,
        lower.get((found.scenario, found.controller), Share(0, 0)),
        Share(found.saved, found.lost_without),
        Share(found.spoiled, found.fine_without),
        next((changes[name] for name in SIDESLIP_PEAKS if name in changes), math.nan),
        changes.get(STEERING_EFFORT, math.nan),
    )


def _lower(rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> dict[tuple[str, str], Share]:
    """Scenario and controller -> samples in which its peak of the sideslip is the lowest.

    A run that did not come to its end has no peak: it is lower than nothing, and everything is lower than it.
    """
    peaks: dict[tuple[str, int], dict[str, float]] = {}
    for row in rows:
        found = next((abs(row[name]) for name in SIDESLIP_PEAKS if row.get(name) is not None), math.inf)
        peaks.setdefault((row["maneuver"], row["sample"]), {})[row["controller"]] = found
    shares: dict[tuple[str, str], Share] = {}
    for (scenario, _), by_controller in peaks.items():
        best = min(by_controller.get(name, math.inf) for name in REFERENCES)
        for name in names:
            if name in by_controller:
                before = shares.get((scenario, name), Share(0, 0))
                shares[scenario, name] = before + Share(int(by_controller[name] < best), 1)
    return shares


def _medians(rows: Sequence[Mapping[str, Any]], planned: StudyFile) -> list[Row]:
    about = {*IDENTITY, *OUTCOME, *planned.keys}
    metrics = [name for name in (rows[0] if rows else ()) if name not in about]
    found = []
    for scenario in dict.fromkeys(row["maneuver"] for row in rows):
        for controller in dict.fromkeys(row["controller"] for row in rows):
            own = [row for row in rows if row["maneuver"] == scenario and row["controller"] == controller]
            for metric in metrics:
                values = [row[metric] for row in own if row[metric] is not None and math.isfinite(row[metric])]
                if values:
                    found.append(Row(scenario, controller, metric, float(np.median(values))))
    return found
