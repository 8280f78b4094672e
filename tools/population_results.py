"""Results of a population of cars, roads and drivers: proportions of the claims, effects of controllers.

`activesteer study population` and `study comparison` drive the runs, paired: all controllers meet the same samples.
`summarise` counts their results; `population_store.py` stores them with the package.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any, Final

import numpy as np
import pyarrow as pa

from activesteer.analysis.claims.judge import SCENARIOS, SYSTEMS, Claim
from activesteer.analysis.harm import SIZES, harms, has_spun, is_lost, severity
from activesteer.analysis.harm import changes as growth_of
from activesteer.core.conventions import Array
from activesteer.core.files import finite, reading
from activesteer.core.metric_table import SIDESLIP_PEAKS, metric
from activesteer.core.units import DisplayUnit, display_unit, parameter_label
from activesteer.errors import ManeuverError, ModelError, ParameterError, StudyError
from activesteer.resources import studies_dir
from activesteer.scenario import FileOrTable, resolve
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.simulation.runner import run_scenario
from activesteer.studies.engine.factor_values import FactorValues, label_of
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.runs import CLAIM, Row, run_command, versions
from activesteer.studies.engine.study import StudyProgress, study
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.engine.workers import in_parallel
from tools.dependence import strongest
from tools.proportions import Proportion, ProportionVerdict, percent, proportion_verdict

SUMMARY: Final = "summary.json"
NO_FACTOR: Final = "none"
"""Name in place of a factor if no factor is significant."""
NONE: Final = "none"
REFERENCES: Final = ("ars", "afs", "esc")
"""Reference controllers: the paper's two systems, and the system that the law requires."""
REQUIRED: Final = "esc"
"""Reference that no controller may be worse than."""
TOTAL: Final = "all scenarios"
STUDY: Final = "population"
COMPARISON: Final = "comparison"
"""Names of the study files: ranges of car, driver, friction and speed. A comparison has the sensors of production cars,
and every sample drives one manoeuvre."""
STEERING_EFFORT: Final = "steering_wheel_rms_rad"
CHANGES: Final = (
    *SIDESLIP_PEAKS,
    "yaw_rate_after_gates_rms_radps",
    "yaw_rate_after_1750ms_share",
    STEERING_EFFORT,
)
"""Metrics whose change by a system is reported: peak sideslip angle, remaining oscillation, steering effort."""
UNITS: Final = {
    **dict.fromkeys(("lane", "path", "stopping", "stopping_elsewhere", "displacement"), display_unit("path_m")),
    **dict.fromkeys(("heading", "heading_open_loop", "steering"), display_unit("heading_rad")),
    **dict.fromkeys(("cones", "lost"), DisplayUnit("", 1.0)),
    "yaw_rate": display_unit("yaw_rate_radps"),
}
"""Measure of harm -> its unit for display."""
_RANGE: Final = (0.05, 0.5, 0.95)
_WORST: Final = 10
"""Number of the worst runs of a controller."""


def asked(controllers: Iterable[str]) -> list[str]:
    """Return the controllers that have targets."""
    return [name for name in controllers if name not in (NONE, *REFERENCES)]


@dataclass(frozen=True)
class Change:
    """Change of the magnitude of a metric or a measure by a system, relative to the same sample without control.

    Attributes:
        metric: The metric, or the name of one of `harm.SIZES`.
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
        """Return the run from JSON values, with None as an infinite growth."""
        growth = {name: math.inf if value is None else value for name, value in table["growth"].items()}
        return cls(**table | {"growth": growth, "severity": table["severity"] or math.inf})


@dataclass(frozen=True)
class SystemEffect:
    """Effect of a controller in a scenario, relative to the same samples without control.

    `harm.is_lost` decides whether a car is lost.

    Attributes:
        controller: The controller.
        scenario: The manoeuvre, or `TOTAL`.
        saved: Samples in which the car is not lost, of those in which it is lost without control.
        spoiled: Samples in which the car is lost, of those in which it is not lost without control.
        changes: Peak of the sideslip, remaining oscillation, steering effort, if the manoeuvre has them.
        spun_without: Number of samples in which the car without control spins; the other lost cars leave the course.
            None if it is not stored.
        spun: Number of samples in which the car with the controller spins; None if it is not stored.
        lower: Samples with a lower peak sideslip angle than the lowest of the reference controllers; no samples if the
            controller is not compared with them.
        harmed: Samples with harm; see `analysis.harm`.
        harmed_anywhere: The same, counting stops where the car without control leaves its line.
        harmed_unspun: Samples with harm, of those in which the car without control does not spin.
        growth: Distribution of each measure of harm.
        worst_track_m: Largest growth of lane overstep or path error [m]; nan without such a measure.
        vehicle: The car; empty for all cars of the population.
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
    harmed_anywhere: Proportion = Proportion()
    harmed_unspun: Proportion = Proportion()
    growth: tuple[Change, ...] = ()
    worst_track_m: float = math.nan
    vehicle: str = ""

    def median_change(self, metrics: Sequence[str]) -> float:
        """Return the median change of the first metric that the scenario has, or nan if it has none of them."""
        medians = {change.metric: change.median for change in self.changes}
        return next((medians[name] for name in metrics if name in medians), math.nan)

    def worst(self, measure: str) -> float:
        """Return the largest growth of a measure [SI], infinite if it is undefined, or nan without the measure."""
        found = [change for change in self.growth if change.metric == measure]
        return max((math.inf if math.isnan(change.largest) else change.largest for change in found), default=math.nan)

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


_PROPORTIONS: Final = ("saved", "spoiled", "lower", "harmed", "harmed_anywhere", "harmed_unspun")


@dataclass(frozen=True)
class ClaimProportion:
    """Proportion of a population for which a claim holds."""

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
        """Value or direction of the factor at which the claim holds more often, empty without a factor."""
        if self.depends_on == NO_FACTOR:
            return ""
        if choices := {name: share for name, share in self.at.items() if name.startswith(f"{self.depends_on} = ")}:
            key, _, value = max(choices, key=lambda name: choices[name]).partition(" = ")
            return f"{value} {key.removesuffix('.preset')}"
        label = parameter_label(self.depends_on)[0].replace(": ", " ")
        if not self.direction:
            return f"{label} in the middle or at the ends of its range"
        return f"{'higher' if self.direction > 0 else 'lower'} {label}"


def read_claims(table: Mapping[str, Any]) -> tuple[ClaimProportion, ...]:
    """Return the proportions of a stored population, or raise `StudyError` for a damaged table."""
    try:
        return tuple(
            ClaimProportion(**{key: claim[key] for key in claim if key != "verdict"}) for claim in table["claims"]
        )
    except (KeyError, TypeError) as reason:
        raise StudyError(f"the stored population is damaged: {reason}") from reason


@dataclass(frozen=True)
class Population:
    """Result of a population.

    Attributes:
        samples: Number of samples.
        seed: Seed of the samples.
        vehicle: The cars that the samples are variations of.
        versions: Versions of the program and its libraries.
        claims: In the order of the paper; none for a comparison of controllers.
        systems: Effects, scenario by scenario, in the order of the controllers.
        cars: Effects in all scenarios, car by car, for a comparison of controllers.
        against_required: Effects relative to `REQUIRED` instead of no control, car by car.
        failed: Number of incomplete runs. Each counts as lost, unless no car can start the manoeuvre on its road.
        worst: The runs with the most harm, of each controller.
    """

    samples: int
    seed: int
    vehicle: str
    versions: Mapping[str, str]
    claims: tuple[ClaimProportion, ...]
    systems: tuple[SystemEffect, ...]
    cars: tuple[SystemEffect, ...] = ()
    against_required: tuple[SystemEffect, ...] = ()
    failed: int = 0
    worst: tuple[WorstRun, ...] = ()

    def of(self, claim: str) -> ClaimProportion | None:
        """Return the proportion of a claim, or None for an unknown claim."""
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
        growth = tuple(change for effect in own for change in effect.growth)
        return SystemEffect(controller, TOTAL, **sums, growth=growth, worst_track_m=max(tracks, default=math.nan))

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {
            **asdict(self),
            "claims": [claim.to_json() for claim in self.claims],
            **{name: [effect.to_json() for effect in getattr(self, name)] for name in _EFFECTS},
            "worst": finite([asdict(run) for run in self.worst]),
        }

    @classmethod
    def from_json(cls, table: Mapping[str, Any]) -> Population:
        """Return the population that `to_json` described."""
        try:
            read: dict[str, Any] = {
                "claims": read_claims(table),
                **{name: tuple(map(SystemEffect.from_json, table.get(name, ()))) for name in _EFFECTS},
                "systems": tuple(map(SystemEffect.from_json, table["systems"])),
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


_EFFECTS: Final = ("systems", "cars", "against_required")


def read_population(name: str) -> Population | None:
    """Return the stored results of a study, `population` or `comparison`, or None if there are none."""
    path = studies_dir() / name / SUMMARY
    if not path.is_file():
        return None
    with reading(path, StudyError):
        return Population.from_json(json.loads(path.read_text(encoding="utf-8")))


def population_study(
    samples: int | None = None, seed: int | None = None, vehicle: FileOrTable | None = None
) -> StudyFile:
    """Return the study of the paper's claims, with values of its file for those that are not given."""
    return _study(STUDY, samples, seed, vehicle)


def comparison_study(
    controllers: Sequence[str], samples: int | None = None, seed: int | None = None, vehicle: FileOrTable | None = None
) -> StudyFile:
    """Return the study of a comparison with `none`, which must be among the controllers."""
    if NONE not in controllers:
        raise ParameterError(
            f"{NONE} is missing: the others are compared with it",
            key="--controllers",
            value=tuple(controllers),
            allowed=[NONE],
        )
    return _study(COMPARISON, samples, seed, vehicle, controllers=list(controllers))


def _study(
    name: str, samples: int | None, seed: int | None, vehicle: FileOrTable | None, **changes: object
) -> StudyFile:
    table: dict[str, Any] = read_study(name).to_table() | changes
    if samples is not None:
        table["design"]["samples"] = samples
    if seed is not None:
        table["seed"] = seed
    if vehicle is not None:
        table["vehicles"] = [vehicle]
    return read_study(table)


def population(
    samples: int | None = None,
    controllers: Sequence[str] | None = None,
    *,
    seed: int | None = None,
    vehicle: FileOrTable | None = None,
    output: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Population:
    """Check the paper's claims over a population, with 15 runs for each sample, or compare controllers.

    A study found in the folder is resumed; without a folder, nothing is stored. See `study` for the other arguments.
    """
    if controllers is None:
        planned = population_study(samples, seed, vehicle)
    else:
        planned = comparison_study(controllers, samples, seed, vehicle)
    table = study(planned, output=output, jobs=jobs, scheduler=scheduler, progress=progress)
    return summarise(table, planned, _nominal_claims(planned.vehicles[0], jobs) if planned.claims else ())


def _nominal_claims(vehicle: FileOrTable, jobs: int | None) -> list[Claim]:
    """Return the claims of the nominal scenarios."""
    found = in_parallel(_claims_of, [(name, vehicle) for name in SCENARIOS], jobs)
    return [claim for claims in found for claim in claims]


def _claims_of(name: str, vehicle: FileOrTable) -> list[Claim]:
    scenario = with_amplitude_found(resolve(name, vehicle))
    return SCENARIOS[name]({system: run_scenario(scenario, system) for system in SYSTEMS})


def summarise(table: pa.Table, planned: StudyFile, nominal: Sequence[Claim] = ()) -> Population:
    """Count the results of a population's runs as far as it is, without nominal claims for a comparison."""
    rows = table.to_pylist()
    names = [label_of(controller) for controller in planned.controllers]
    failed = sum(row["status"] != "ok" for row in rows)
    samples = len({row["sample"] for row in rows})
    rows = rows if planned.claims else _possible(rows)
    without = [row for row in rows if row["controller"] == NONE]
    systems = [name for name in names if name != NONE]
    return Population(
        samples=samples,
        seed=planned.seed,
        vehicle=", ".join(map(label_of, planned.vehicles)),
        versions=versions(),
        claims=tuple(_proportion(claim.id, claim.passed, without, planned.factors) for claim in nominal),
        systems=tuple(_effects(rows, systems)),
        cars=() if planned.claims else tuple(_effects_by_car(rows, systems, NONE)),
        against_required=() if planned.claims else tuple(_effects_by_car(rows, asked(systems), REQUIRED)),
        failed=failed,
        worst=() if planned.claims else tuple(_worst(rows, planned, systems)),
    )


def _proportion(name: str, passed: bool, rows: Sequence[Row], factors: Sequence[Factor]) -> ClaimProportion:
    column = f"{CLAIM}{name}"
    judged = [row for row in rows if row.get(column) is not None]
    held = [row[column] == 1.0 for row in judged]
    varied = [
        factor
        for factor in factors
        if judged and not factor.when and (not factor.maneuvers or judged[0]["maneuver"] in factor.maneuvers)
    ]
    at: dict[str, float] = {}
    for factor in varied:
        for value in factor.values:
            chosen = [one for row, one in zip(judged, held, strict=True) if row[factor.key] == value]
            at[f"{factor.key} = {value}"] = _count(chosen).value
    # A choice of two counts as 0 and 1.
    found = strongest({factor.key: _numbers(factor, judged) for factor in varied}, held)
    depends = (NO_FACTOR, 0.0, 0) if found is None else found
    proportion = _count(held)
    return ClaimProportion(name, passed, len(held), proportion.value, *proportion.interval, *depends, at)


def _numbers(factor: Factor, rows: Sequence[Row]) -> list[float]:
    values = [row[factor.key] for row in rows]
    return [factor.values.index(value) for value in values] if factor.values else values


def _effects(rows: Sequence[Row], systems: Sequence[str]) -> Iterator[SystemEffect]:
    """Yield the effect of each system in each scenario, relative to the same samples without control."""
    for scenario in dict.fromkeys(row["maneuver"] for row in rows):
        runs = _runs([row for row in rows if row["maneuver"] == scenario])
        for system in systems:
            lowest = [_has_lowest_peak(runs, system, car) for name, car in runs if name == system]
            counted = lowest if asked([system]) and {*REFERENCES} <= {*systems} else ()
            yield _effect(system, scenario, _pairs(runs, system, NONE), lower=_count(counted))


def _effects_by_car(rows: Sequence[Row], systems: Sequence[str], reference: str) -> Iterator[SystemEffect]:
    """Yield the effect of each system on each car in all scenarios together, relative to a reference."""
    for vehicle in dict.fromkeys(row["vehicle"] for row in rows):
        runs = _runs([row for row in rows if row["vehicle"] == vehicle])
        for system in systems:
            if both := _pairs(runs, system, reference):
                yield _effect(system, TOTAL, both, vehicle=vehicle)


def _possible(rows: Sequence[Row]) -> list[Row]:
    """Return the rows without cars that cannot start: the road does not bear the turn, or the axle not the actuator.

    Such a car fails with every controller. A failure with only some of them counts against these.
    """
    reasons = ManeuverError.__name__, ModelError.__name__
    possible = {_car(row) for row in rows if not str(row["error"]).startswith(reasons)}
    return [row for row in rows if _car(row) in possible]


Car = tuple[str, str, int]
"""Manoeuvre, vehicle and number of the sample."""


def _car(row: Row) -> Car:
    return row["maneuver"], row["vehicle"], row["sample"]


def _runs(rows: Sequence[Row]) -> dict[tuple[str, Car], Row]:
    """Return controller and car -> the metrics that the manoeuvre has."""
    has = {scenario: _metrics_of(scenario, rows) for scenario in dict.fromkeys(row["maneuver"] for row in rows)}
    return {(row["controller"], _car(row)): {name: row[name] for name in has[row["maneuver"]]} for row in rows}


def _pairs(runs: Mapping[tuple[str, Car], Row], system: str, reference: str) -> list[tuple[Row, Row]]:
    own = ((car, row) for (name, car), row in runs.items() if name == system)
    return [(runs[reference, car], row) for car, row in own if (reference, car) in runs]


def _effect(system: str, scenario: str, both: Sequence[tuple[Row, Row]], **other: Any) -> SystemEffect:
    lost = [(is_lost(without), is_lost(row)) for without, row in both]
    grown = [growth_of(*pair) for pair in both]
    tracks = [max((growth[name] for name in ("lane", "path") if name in growth), default=math.nan) for growth in grown]
    return SystemEffect(
        system,
        scenario,
        saved=_count(not after for before, after in lost if before),
        spoiled=_count(after for before, after in lost if not before),
        changes=tuple(
            _change(name, both) for name in CHANGES if both and all(name in row for pair in both for row in pair)
        ),
        spun_without=sum(has_spun(row) for row, _ in both),
        spun=sum(has_spun(row) for _, row in both),
        harmed=_count(bool(harms(growth)) for growth in grown),
        harmed_anywhere=_count(bool(_harms_anywhere(growth)) for growth in grown),
        harmed_unspun=_count(
            bool(harms(growth)) for (row, _), growth in zip(both, grown, strict=True) if not has_spun(row)
        ),
        growth=tuple(
            _distribution(name, [growth[name] for growth in grown if name in growth])
            for name in dict.fromkeys(name for growth in grown for name in growth)
        ),
        worst_track_m=max((track for track in tracks if not math.isnan(track)), default=math.nan),
        **other,
    )


def _harms_anywhere(change: Mapping[str, float]) -> list[str]:
    """Return `harms`, with stopping distances also where the car without control leaves its line."""
    return harms({"stopping" if name == "stopping_elsewhere" else name: growth for name, growth in change.items()})


def _count(held: Iterable[bool]) -> Proportion:
    judged = list(held)
    return Proportion(sum(judged), len(judged))


def _has_lowest_peak(runs: Mapping[tuple[str, Car], Row], system: str, car: Car) -> bool:
    """Return whether the peak sideslip angle is below every reference, with a missing peak as the largest."""

    def peak(controller: str) -> float:
        row = runs.get((controller, car), {})
        return next((abs(row[name]) for name in SIDESLIP_PEAKS if row.get(name) is not None), math.inf)

    return peak(system) < min(peak(name) for name in REFERENCES)


def _change(metric: str, both: Sequence[tuple[Row, Row]]) -> Change:
    pairs = np.array([[row[metric] for row in pair] for pair in both], dtype=np.float64)
    return _distribution(metric, np.diff(np.abs(pairs), axis=1)[:, 0])


def _distribution(name: str, values: Sequence[float] | Array) -> Change:
    change = np.asarray(values, dtype=np.float64)
    finite = change[np.isfinite(change)]
    low, median, high = np.quantile(finite, _RANGE).tolist() if len(finite) else [float("nan")] * 3
    largest = float(np.nanmax(change)) if np.isfinite(change).any() or np.isposinf(change).any() else math.nan
    return Change(
        name,
        len(finite),
        low,
        median,
        high,
        largest,
        sum(bool(harms({name: one})) for one in values) if name in SIZES else 0,
    )


def _worst(rows: Sequence[Row], planned: StudyFile, systems: Sequence[str]) -> Iterator[WorstRun]:
    """Yield the `_WORST` runs with the most harm of each system, the worst first."""
    values, labels = FactorValues(planned), [label_of(item) for item in planned.maneuvers]
    cars, runs = [label_of(item) for item in planned.vehicles], _runs(rows)
    for system in systems:
        found = []
        for row in rows:
            car = _car(row)
            if row["controller"] == system and (NONE, car) in runs:
                growth = growth_of(runs[NONE, car], runs[system, car])
                if names := harms(growth):
                    found.append((severity(growth), {name: growth[name] for name in names}, row))
        for size, growth, row in sorted(found, key=lambda one: -one[0])[:_WORST]:
            place = labels.index(row["maneuver"]), cars.index(row["vehicle"])
            overrides = planned.overrides | values.overrides(*place, {key: row[key] for key in planned.keys})
            vehicle = planned.vehicles[place[1]]
            command = run_command(planned.maneuvers[place[0]], system, vehicle, overrides, planned.driver)
            yield WorstRun(system, row["maneuver"], row["sample"], size, growth, command)


def _metrics_of(scenario: str, rows: Sequence[Row]) -> list[str]:
    driven = [row for row in rows if row["maneuver"] == scenario]
    return [name for name in (driven[0] if driven else ()) if any(row[name] is not None for row in driven)]
