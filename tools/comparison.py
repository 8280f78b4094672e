"""Comparison of controllers in the paper's five scenarios and five harder ones, with the sensors of production cars.

`python tools/renew.py controllers` prints the table and the targets of docs/controller_design.md, and keeps the
recordings; `renew.py comparison` counts harm over a population. The targets were set before any of these controllers
was tuned. For your own car and controllers, `activesteer study side_by_side -c CONTROLLER` drives the same scenarios.
"""

from __future__ import annotations

import functools
import math
import os
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from activesteer import simulate
from activesteer.analysis.claims.judge import SCENARIOS
from activesteer.analysis.requirement import EvaluatedRun, Names, Requirement, Runs
from activesteer.analysis.tables import Change, significance
from activesteer.config import Source
from activesteer.controllers import controller_spec
from activesteer.core.files import make_folder
from activesteer.core.metric_table import SIDESLIP_PEAKS
from activesteer.core.metric_table import metric as declared
from activesteer.errors import ParameterError, SimulationDiverged
from activesteer.plotting import Heat, Picture, draw
from activesteer.recording import Recording, check_target
from activesteer.scenario import FileOrTable, resolve
from activesteer.studies.engine.workers import Progress, in_parallel
from activesteer.studies.reproduction import drive
from tools.population_results import NONE, STEERING_EFFORT, TOTAL, UNITS, Population, SystemEffect, asked

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HARMED_PROPORTION: Final = 0.01
"""Largest proportion of runs of a population that a controller harms (see `analysis.harm`)."""
TRACK_HARM_M: Final = 0.10
"""Largest growth of a lane overstep or path error by a controller in any run [m]."""


class Target(NamedTuple):
    """Verdict on a target of a controller, with the target and the result as text."""

    controller: str
    text: str
    passed: bool


_RULES: Final = (
    ("step_steer", "abs(yaw_rate_overshoot(controller)) <= 0.03"),
    ("step_steer", "abs(yaw_rate_response_time_s(controller)) <= abs(yaw_rate_response_time_s(none))"),
    ("step_steer", "abs(ay_response_time_s(controller)) <= abs(ay_response_time_s(none))"),
    ("step_steer", "abs(sideslip_peak_rad(controller)) <= abs(sideslip_peak_rad(none))"),
    ("slalom", "track_amplitude_m(controller) < track_amplitude_m(none)"),
    # Cars with such systems gain as much.
    ("split_mu_braking", "stopping_distance_m(controller) <= 0.94 * stopping_distance_m(esc)"),
    ("split_mu_braking", "abs(lateral_deviation_max_m(controller)) <= abs(lateral_deviation_max_m(esc))"),
    ("severe_lane_change", "entry_speed_mps(controller) > entry_speed_mps(none)"),
)
"""Scenario and requirement of each target."""


def targets(controllers: Sequence[str], rows: Iterable[Any]) -> list[Target]:
    """Judge the nominal runs by their rows of `scenario`, `controller`, `metric` and `value`.

    A target fails if its value was sought and not found. It is left out if no controller has the metric, or
    if a controller that it compares with was not driven.
    """
    runs: defaultdict[EvaluatedRun, dict[str, float | None]] = defaultdict(dict)
    sought = set()
    for row in rows:
        runs[EvaluatedRun(row.controller, row.scenario)][row.metric] = row.value
        sought.add((row.metric, row.scenario))
    found = []
    for name in asked(controllers):
        for scenario, text in _RULES:
            rule = Requirement(text, Names(None, [scenario], name), Source("targets"), ())
            driven = all(run in runs for _, run in rule.metrics)
            if driven and (next(iter(rule.metrics))[0], scenario) in sought:
                found.append(_judged(name, rule, runs))
    return found


def _judged(controller: str, rule: Requirement, runs: Runs) -> Target:
    (metric_name, run), *others = rule.metrics
    ((left, sign, right),) = rule.comparisons
    shown = declared(metric_name)
    value, limit = (f"{short(side(runs) * shown.unit.factor)} {shown.unit.name}" for side in (left, right))
    of = f" ({others[0][1].controller})" if others else ""
    return Target(controller, f"{run.maneuver}: {shown.label} {value}, asked for {sign} {limit}{of}", rule(runs) >= 0.0)


def short(value: float) -> str:
    """Return a number with three digits, or a hyphen for nan."""
    return "-" if math.isnan(value) else f"{value:.3g}"


def targets_text(found: Sequence[Target]) -> str:
    """Return a line for each target."""
    width = max((len(target.controller) for target in found), default=0) + 2
    return "\n".join(
        f"{target.controller:{width}}{'passed' if target.passed else 'FAILED'}  {target.text}" for target in found
    )


CASES: Final[dict[str, tuple[str, dict[str, Any]]]] = {
    **{name: (name, {}) for name in SCENARIOS},
    "step_steer_120_kmh": ("step_steer", {"speed_kmh": 120.0}),
    "severe_lane_change": ("severe_lane_change", {}),
    "split_mu_braking": ("split_mu_braking", {}),
    "brake_in_turn": ("brake_in_turn", {}),
    "mu_jump": ("mu_jump", {}),
}
"""Scenario -> manoeuvre and its overrides."""
_STEP: Final = ("yaw_rate_response_time_s", "ay_response_time_s", "yaw_rate_overshoot", "sideslip_peak_rad")
_ALONG_PATH: Final = ("sideslip_peak_abs_rad", "yaw_rate_peak_abs_radps", "steering_wheel_peak_abs_rad")
_ENTRY: Final = ("entry_speed_min_mps", "entry_speed_mps", "entry_speed_max_mps")
COMPARED: Final = ("none", "ars", "afs", "ars_sideslip", "esc", "lqr", "integrated")
"""Controllers that are compared unless others are named."""
SHOWN: Final[dict[str, tuple[str, ...]]] = {
    "step_steer": _STEP,
    "sine_with_dwell": ("yaw_rate_after_1000ms_share", "lateral_displacement_m", "sideslip_peak_abs_rad"),
    "double_lane_change": _ALONG_PATH,
    "slalom": ("sideslip_peak_abs_rad", "yaw_rate_rms_radps", "track_amplitude_m", "steering_wheel_peak_abs_rad"),
    "double_lane_change_low_mu": _ALONG_PATH,
    "step_steer_120_kmh": _STEP,
    "severe_lane_change": (*_ALONG_PATH, "lane_overstep_m", *_ENTRY),
    "split_mu_braking": ("stopping_distance_m", "lateral_deviation_max_m", "yaw_rate_peak_abs_radps"),
    "brake_in_turn": (
        "path_deviation_after_1000ms_m",
        "yaw_rate_deviation_after_1000ms_radps",
        "sideslip_peak_abs_rad",
    ),
    "mu_jump": (*_ALONG_PATH, "track_deviation_max_m"),
}
"""Scenario -> metrics that are printed and drawn. The JSON has all metrics."""
SENSORS: Final = {"sensors.preset": "production", "sensors.seed": 1}
"""Sensors of all controllers."""
ENTRY_SEEDS: Final = (1, 2, 3)
"""Seeds of the sensors for the highest entry speed of the severe lane change."""
ENTRY_DRIVER: Final = "expert"
"""Driver of the severe lane change, as in ISO 3888-2: the default driver leaves its lanes at every speed."""
ENTRY_LINE: Final = {"lane.margin_m": 0.15}
"""Distance of his line from the cones, the middle one of the distances in the test of ISO 3888-2."""
ENTRY_RANGE_KMH: Final = (40.0, 160.0)
"""Range of the entry speed, which is found to 1 km/h."""
_AFTER_S: Final = 4.0
"""Time after the last gate [s]: metrics use 3 s of it."""
_LANE_CHANGE: Final = "severe_lane_change"
_LABEL: Final = 41
_COLUMN: Final = 7
"""Widths of the table: of a label, and the least of a number."""


class Row(NamedTuple):
    """One value of the table by its recorded metric [SI], or nan if the run does not define it."""

    scenario: str
    controller: str
    metric: str
    value: float


@dataclass
class Comparison:
    """Result of a comparison.

    Attributes:
        controllers: The compared controllers, in the order given.
        rows: Every metric of every complete run.
        files: The recordings.
        failures: (scenario, controller) -> reason why that run ended early.
    """

    controllers: tuple[str, ...]
    rows: list[Row] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    failures: dict[tuple[str, str], str] = field(default_factory=dict)

    def shown(self) -> list[tuple[str, str, dict[str, float]]]:
        """Yield scenario, metric and its value by controller, for the metrics of `SHOWN` and the energies."""
        known = {(row.scenario, row.metric, row.controller): row.value for row in self.rows}
        lines = []
        for scenario in CASES:
            for metric in (*SHOWN[scenario], "battery_energy_J", "steering_energy_J", "brake_energy_J"):
                keys = {name: (scenario, metric, name) for name in self.controllers}
                values = {name: known[key] for name, key in keys.items() if key in known}
                if values:
                    lines.append((scenario, metric, values))
        return lines

    @property
    def targets(self) -> list[Target]:
        """Return the verdicts on the targets of the controllers beyond the paper's."""
        return targets(self.controllers, self.rows)

    def to_text(self) -> str:
        """Return the metrics of `SHOWN` as a table, and the targets."""
        columns = [max(_COLUMN, len(name) + 1) for name in self.controllers]
        heads = "".join(f"{name:>{width}}" for name, width in zip(self.controllers, columns, strict=True))
        lines, before = [" " * _LABEL + heads], ""
        for scenario, metric, values in self.shown():
            if scenario != before:
                lines.append(scenario)
            before = scenario
            label = f"  {declared(metric).title}"
            factor = declared(metric).unit.factor
            shown = [short(values.get(name, math.nan) * factor) for name in self.controllers]
            cells = "".join(f"{text:>{width}}" for text, width in zip(shown, columns, strict=True))
            lines.append(f"{label:{_LABEL}}{cells}")
        return "\n".join([*lines, *(["", targets_text(self.targets)] if self.targets else [])])


def compare(
    controllers: Sequence[str],
    folder: str | os.PathLike[str],
    vehicle: FileOrTable = "compact",
    *,
    jobs: int | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Drive `CASES` with every controller and find their entry speeds in the severe lane change.

    `entry_speed_mps` is the median over `ENTRY_SEEDS`; `entry_speed_min_mps` and `entry_speed_max_mps` are the
    extremes. The recordings are SCENARIO-CONTROLLER.mcap in the folder. A failed run stops no other run; `failures`
    names it.
    """
    labels = {controller_spec(given).label: given for given in controllers}
    if len(labels) < len(controllers):
        raise ParameterError(f"of {', '.join(controllers)} two are called the same", value=tuple(controllers))
    scenarios = {name: resolve(maneuver, vehicle, {**SENSORS, **other}) for name, (maneuver, other) in CASES.items()}
    target = make_folder(folder, ParameterError)
    paths = {name: {given: target / f"{name}-{label}.mcap" for label, given in labels.items()} for name in scenarios}
    for systems in paths.values():
        for path in systems.values():
            check_target(path)
    searches = [(given, seed) for given in controllers for seed in ENTRY_SEEDS] if _LANE_CHANGE in CASES else []
    made, runs = Comparison(tuple(labels)), len(scenarios) * len(labels)

    def tell(what: str, done: int) -> None:
        if progress is not None:
            progress(what, done, runs + len(searches))

    named = {given: label for label, given in labels.items()}
    for done, (scenario, given, problem) in enumerate(drive(scenarios, paths, jobs), 1):
        if problem:
            made.failures[scenario, named[given]] = problem
        tell(f"{scenario} {named[given]}" + (" FAILED" if problem else ""), done)
    for scenario, systems in paths.items():
        for given, path in systems.items():
            if (scenario, named[given]) not in made.failures:
                made.files.append(path)
                found = Recording.open(path).metrics
                made.rows += [Row(scenario, named[given], metric, value) for metric, value in found.items()]
    search = functools.partial(_entry_speed, vehicle)
    speeds = in_parallel(search, searches, jobs, lambda _, done: tell("entry speeds", runs + done))
    for given, label in named.items():
        own = [speed for (other, _), speed in zip(searches, speeds, strict=True) if other == given]
        made.rows += _entry_speeds(label, own)
    return made


def _entry_speed(vehicle: FileOrTable, controller: str, seed: int) -> float:
    """Return the highest speed of a car that stays in the severe lane change, by bisection [m/s], or nan for none."""
    changes = SENSORS | ENTRY_LINE | {"sensors.seed": seed}
    course = resolve(_LANE_CHANGE, vehicle, changes, ENTRY_DRIVER, [controller]).maneuver.course
    assert course is not None
    last_gate_x_m = course.last_gate_x_m
    assert last_gate_x_m is not None

    def keeps(speed_kmh: float) -> bool:
        driven = {"speed_kmh": speed_kmh, "duration_s": round(3.6 * last_gate_x_m / speed_kmh + _AFTER_S, 2)}
        try:
            run = simulate(_LANE_CHANGE, controller, vehicle, overrides=changes | driven, driver=ENTRY_DRIVER)
        except SimulationDiverged:
            return False
        return run.metrics["stays_in_lanes"] == 1.0

    low, high = ENTRY_RANGE_KMH
    if not keeps(low):
        return math.nan
    if keeps(high):
        return high / 3.6
    for _ in range(math.ceil(math.log2(high - low))):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if keeps(middle) else (low, middle)
    return low / 3.6


def _entry_speeds(controller: str, speeds_mps: Sequence[float]) -> list[Row]:
    if not speeds_mps:
        return []
    values = np.min(speeds_mps), np.median(speeds_mps), np.max(speeds_mps)
    return [Row(_LANE_CHANGE, controller, name, float(value)) for name, value in zip(_ENTRY, values, strict=True)]


_ROW: Final = "{:14}{:>20}{:>12}{:>14}{:>14}{:>12}{:>12}"
_GROWTH: Final = "    {:14}{:>9}{:>9}{:>9}{:>9}  {:8}{:>4} of {}"


def population_targets(found: Population) -> list[Target]:
    """Return the verdicts on the targets of the controllers beyond the paper's, in all scenarios together."""
    verdicts = []
    for name in asked(found.controllers):
        total = found.total(name)
        harmed = f"harms {total.harmed} of the runs, asked for <= {HARMED_PROPORTION:.0%}"
        worst = f"worst harm of the track {total.worst_track_m:.2f} m, asked for <= {TRACK_HARM_M:.2f} m"
        verdicts += [
            Target(name, harmed, total.harmed.value <= HARMED_PROPORTION),
            Target(name, worst, total.worst_track_m <= TRACK_HARM_M),
        ]
    return verdicts


def comparison_text(found: Population) -> str:
    """Return the harm, the proportions and the targets of a comparison as text."""
    lines = [
        f"{found.samples} samples of {found.vehicle}, seed {found.seed}; changes against {NONE}, medians",
        "",
        _ROW.format("", "harmed", "deviation", "saves of", "spoils of", "sideslip", "steering"),
        _ROW.format("", "", "[m]", "the lost", "the fine", "peak", "rms"),
    ]
    effects = [*found.systems, *(found.total(name) for name in found.controllers)]
    for scenario in [*dict.fromkeys(effect.scenario for effect in found.systems), TOTAL]:
        lines += [scenario, *(_line(effect) for effect in effects if effect.scenario == scenario)]
    lines += ["", "growth of each measure: 5 %, median, 95 %, largest; runs in which it is harm"]
    for effect in found.systems:
        lines += [f"{effect.scenario} {effect.controller}", *map(_growth, effect.growth)]
    if found.worst:
        lines += ["", "runs with the most harm"]
    for run in found.worst:
        grown = ", ".join(f"{name} {shown_growth(name, growth)}" for name, growth in run.growth.items())
        lines += [f"{run.controller} {run.scenario}: {grown}", f"  {run.command}"]
    if found.failed:
        lines += ["", f"{found.failed} runs did not come to their end"]
    return "\n".join([*lines, "", targets_text(population_targets(found))]).rstrip()


def shown_growth(name: str, growth: float) -> str:
    """Return the growth of a measure in its unit, or `lost` where only the car without control gets so far."""
    unit = UNITS[name]
    return f"{growth * unit.factor:+.2f} {unit.name}".rstrip() if math.isfinite(growth) else "undefined"


def _growth(change: Any) -> str:
    unit = UNITS[change.metric]
    values = (change.low, change.median, change.high, change.largest)
    return _GROWTH.format(
        change.metric, *(f"{unit.factor * value:+.2f}" for value in values), unit.name, change.harmed, change.number
    )


def _line(effect: SystemEffect) -> str:
    counts = (f"{proportion.count} of {proportion.number}" for proportion in (effect.saved, effect.spoiled))
    medians = (effect.median_change(SIDESLIP_PEAKS), effect.median_change([STEERING_EFFORT]))
    changes = ("-" if math.isnan(value) else f"{math.degrees(value):+.2f} deg" for value in medians)
    track = "-" if math.isnan(effect.worst_track_m) else f"{effect.worst_track_m:.2f}"
    return _ROW.format(f"  {effect.controller}", str(effect.harmed), track, *counts, *changes)


_RANGE: Final = 3.0
"""Ratio at which the colours end in both directions."""
_WORSE, _NEUTRAL, _BETTER = "#e08a3c", "#f4f4f4", "#5b9fd0"
"""Ends and middle of the colours. They are told apart without seeing red or green, and black can be read on them."""
_COLOURS: Final = (_WORSE, _NEUTRAL, _BETTER)
_PALEST: Final = 0.2
"""Least depth of the colour of a better or worse value, so that it is seen to be one [-]."""
_PROPORTIONS: Final = {
    "harmed": ("runs with harm", -1.0),
    "saved": ("saved of those\nlost without control", 1.0),
}
"""Proportion of an effect -> title of its panel, and place of all runs in the colours, from -1 to 1."""


def comparison_figure(made: Comparison) -> Figure:
    """Return the figure of a comparison in the nominal runs."""
    lines, first = made.shown(), made.controllers[0]
    shades = np.full((len(lines), len(made.controllers)), math.nan)
    texts = [[""] * len(made.controllers) for _ in lines]
    labels, rules, before = [], [], ""
    for row, (scenario, metric, values) in enumerate(lines):
        shown = declared(metric)
        for column, name in enumerate(made.controllers):
            if name in values:
                shades[row, column] = _shade(metric, values[name], values.get(first, math.nan))
                texts[row][column] = short(values[name] * shown.unit.factor)
        begins = scenario != before
        labels.append(f"{scenario.replace('_', ' ')}: {shown.title}" if begins else shown.title)
        rules += [row] if begins and row else []
        before = scenario
    heat = Heat(shades, texts, made.controllers, labels, (-1.0, 1.0), _COLOURS, rules=rules)
    legend = _legend(
        f"better than {first}",
        f"worse; full colour: a factor of {_RANGE:g}",
        "no measurable difference, or neither better nor worse",
    )
    width_in, height_in = 4.2 + 0.85 * len(made.controllers), 1.2 + 0.26 * len(lines)
    return draw(Picture("", [heat], None, 1, width_in, height_in, legend))


def _shade(metric: str, value: float, first: float) -> float:
    """Return how much better a value is than the first controller's: 1 at a factor of `_RANGE`, below 0 if worse."""
    change = significance(metric, value, first)
    if change not in (Change.BETTER, Change.WORSE):
        return 0.0 if math.isfinite(value) else math.nan
    size, before = declared(metric).cost(value), declared(metric).cost(first)
    # Two values have no ratio if one of them is zero, or if only one of them is negative.
    depth = abs(math.log(size / before)) / math.log(_RANGE) if size * before > 0.0 else 1.0
    return math.copysign(_PALEST + (1.0 - _PALEST) * min(depth, 1.0), 1.0 if change is Change.BETTER else -1.0)


def _legend(better: str, worse: str, neutral: str) -> list[tuple[str, str]]:
    return [(better, _BETTER), (worse, _WORSE), (neutral, _NEUTRAL)]


def comparison_population_figure(made: Population) -> Figure:
    """Return the figure of a comparison over a population: counts and largest deviations by scenario and controller."""
    names = list(dict.fromkeys(effect.controller for effect in made.systems))
    scenarios = list(dict.fromkeys(effect.scenario for effect in made.systems))
    rows, blank = [name.replace("_", " ") for name in scenarios], [""] * len(scenarios)
    effects = {(effect.scenario, effect.controller): effect for effect in made.systems}
    cells = [[effects.get((scenario, name)) for name in names] for scenario in scenarios]
    panels = []
    for key, (title, every) in _PROPORTIONS.items():
        shown = [[cell and getattr(cell, key) for cell in row] for row in cells]
        shades = np.array([[every * one.value if one else math.nan for one in row] for row in shown])
        # Counts, because a share of one run says nothing.
        texts = [[f"{one.count}/{one.number}" if one and one.number else "-" for one in row] for row in shown]
        panels.append(Heat(shades, texts, names, blank if panels else rows, (-1.0, 1.0), _COLOURS, title))
    tracks = np.array([[cell.worst_track_m if cell else math.nan for cell in row] for row in cells])
    texts = [["-" if math.isnan(track) else f"{track:.2f}" for track in row] for row in tracks.tolist()]
    shades = -np.minimum(tracks / TRACK_HARM_M, 1.0)
    panels.append(Heat(shades, texts, names, blank, (-1.0, 1.0), _COLOURS, "largest additional\ndeviation [m]"))
    legend = _legend("better", f"worse; full colour: all runs, or {TRACK_HARM_M:g} m", "as without control")
    title = f"{made.samples} samples of {made.vehicle}, seed {made.seed}; -: no such run"
    width_in, height_in = 2.0 + 1.5 * max(len(names), 4), 1.4 + 0.3 * len(scenarios)
    return draw(Picture(title, panels, None, len(panels), width_in, height_in, legend))
