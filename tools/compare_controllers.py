"""Compare controllers in the paper's five scenarios and five harder ones, with the sensors of production cars.

    python tools/compare_controllers.py [--controllers C,C...] [--vehicle NAME] [-o DIR] [--jobs N]

It prints the table and the targets of docs/chassis_control.md, and keeps the recordings. For your own car and
controllers, `activesteer study side_by_side -c CONTROLLER` drives the same scenarios.
"""

from __future__ import annotations

import argparse
import functools
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer import simulate
from activesteer.analysis.claims.statements import SCENARIOS
from activesteer.analysis.energy import METRICS as ENERGIES
from activesteer.controllers import find_controller
from activesteer.errors import ParameterError, SimulationDiverged
from activesteer.files import make_folder
from activesteer.metric_table import metric as declared
from activesteer.recording import Recording, check_target
from activesteer.scenario import FileOrTable, resolve
from activesteer.studies.engine.task_queue import in_parallel
from activesteer.studies.reproduction import Progress, drive
from tools.controller_targets import Target, short, targets, targets_text

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
"""Scenario -> metrics that are printed and drawn; the JSON has all metrics."""
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
    """One value of the table by its recorded metric [SI]; nan if the run does not define it."""

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
            for metric in (*SHOWN[scenario], *ENERGIES):
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
    labels = {find_controller(given).label: given for given in controllers}
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
    """Return the highest speed at which a car stays in the severe lane change, by bisection [m/s]; nan for none."""
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


def main() -> int:
    """Run the tool."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--controllers", default="none,ars,afs,ars_sideslip,esc,lqr,integrated", metavar="C,C...")
    parser.add_argument("--vehicle", default="compact", metavar="NAME")
    parser.add_argument("-o", "--output", type=Path, default=Path("build", "compare_controllers"), metavar="DIR")
    parser.add_argument("--jobs", type=int, metavar="N")
    options = parser.parse_args()
    made = compare(options.controllers.split(","), options.output, options.vehicle, jobs=options.jobs)
    print(made.to_text())
    for (scenario, name), problem in made.failures.items():
        print(f"{scenario} {name} failed: {problem}")
    return 1 if made.failures else 0


if __name__ == "__main__":
    raise SystemExit(main())
