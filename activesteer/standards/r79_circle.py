"""UN R79: steering effort at walking pace, and failures of auxiliary steering equipment on a 100 m circle (annex 4).

Every fault is driven at least twice from one state: with hands fixed (steering wheel and pedals move as without the
fault), and with the driver. The fault-tolerant time is the longest duration of the fault, hands fixed, without
exceeding a limit.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.config import Source, build
from activesteer.config.faults import Fault, fault_table, fault_words
from activesteer.controllers import system_of
from activesteer.core.conventions import Array
from activesteer.core.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.core.units import display_unit, three_digits
from activesteer.errors import SimulationDiverged
from activesteer.pages import Table, failed, passed
from activesteer.plotting import Curve, Panel, Picture
from activesteer.scenario import FileOrTable, check_parts, resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.recorder import Recorder
from activesteer.standards.standard import SIDES, Findings, NoResult, StandardRun, StandardRunner, cell, time_panels
from activesteer.studies.engine.workers import in_parallel


class Effort(NamedTuple):
    """Limit of the steering effort for cars (M1): a row of table 2 of UN R79."""

    radius_m: float  # radius to reach [m]
    limit_N: float  # largest force at the rim until then [N]
    case: Mapping[str, Any]  # condition of the car: dotted key -> value


EFFORTS: Final = {
    "intact": Effort(12.0, 150.0, {}),
    "power_assist_failed": Effort(20.0, 300.0, {"steering.assist_fraction": 0.0}),
}
"""Requirements for the steering effort, by name."""
WITHIN_S: Final = 4.0
"""Time in which the car must reach the radius [s]."""
SPEED_KMH: Final = 10.0
"""Speed of the spiral [km/h]."""
RIM_RADIUS_M: Final = 0.185
"""Nominal radius of the steering wheel [m]: an assumption (diameter 370 mm). Vehicle files have none."""
FIGURES: Final = (
    "yaw_rate_change_radps", "ay_change_mps2", "lateral_offset_1s_m", "lateral_offset_1s_driver_m",
    "steering_correction_rad", "fault_tolerant_time_s",
)  # fmt: skip
"""Values of a fault: largest changes with hands fixed. Offset across the path, left positive, with hands fixed and with
the driver. Largest change of the driver's steering wheel angle. Tolerated time, None if no limit is exceeded."""
_TURNED_S: Final = 3.0
"""Time in which the steering wheel reaches the Ackermann angle of the radius [s]. The limit is a third longer."""
_BEGIN_S: Final = 0.5
_CHANNELS: Final = ("steering_wheel_rad", "hand_torque_Nm", "yaw_rate_radps", "speed_mps")


def reached(run: StandardRun, radius_m: float) -> tuple[float, float]:
    """Return the time until a path radius is reached [s], and the largest rim force until then [N], or nan."""
    if not run.channels or not (tighter := np.abs(run["yaw_rate_radps"]) * radius_m >= run["speed_mps"]).any():
        return math.nan, math.nan
    first = int(np.argmax(tighter))
    effort_N = float(np.abs(run["hand_torque_Nm"][: first + 1]).max()) / RIM_RADIUS_M
    return float(run.time_s[first]) - _BEGIN_S, effort_N


def examine(runner: StandardRunner) -> Findings:
    """Drive and evaluate one car with one controller."""
    spirals = {name: _spirals(runner, name, effort) for name, effort in EFFORTS.items()}
    efforts = []
    for name, runs in spirals.items():
        requirement = EFFORTS[name]
        for side, run in runs.items():
            time_s, effort_N = reached(run, requirement.radius_m)
            efforts.append({
                "steering": name, "direction": side, "radius_m": requirement.radius_m, "time_s": time_s,
                "effort_N": effort_N, "limit_N": requirement.limit_N,
                "pass": time_s <= WITHIN_S and effort_N <= requirement.limit_N,
            })  # fmt: skip
    try:
        faults = fault_circles(runner)
    except SimulationDiverged as reason:
        raise NoResult(f"the car without fault does not complete the circle: {reason}") from reason
    values = {
        "rim_radius_m": RIM_RADIUS_M, "efforts": efforts, "faults": faults,
        "pass": all(row["pass"] for row in efforts),
    }  # fmt: skip
    summary = f"{_effort_words(efforts)}. Faults on a circle are not judged: {_fault_words(faults)}"
    force = {f"{name.replace('_', ' ')}, {side}": run for name, runs in spirals.items() for side, run in runs.items()}
    pictures = [
        Picture("Spiral at 10 km/h", time_panels(force, _CHANNELS[:2], _BEGIN_S, "the start of steering")),
        _dots(faults),
    ]
    return Findings(values, summary, [_effort_table(efforts), _fault_table(faults)], pictures)


def _spirals(runner: StandardRunner, name: str, effort: Effort) -> dict[str, StandardRun]:
    """Drive a spiral to each side with a steadily rising steering wheel angle."""
    config = runner.scenario("slowly_increasing_steer").car.config
    single_track = config.single_track
    angle_deg = math.degrees(config.steering.ratio * single_track.wheelbase_m / effort.radius_m)
    runs = runner.drive(
        f"effort_{name}",
        "slowly_increasing_steer",
        [{"steer.rate_degps": sign * angle_deg / _TURNED_S, **effort.case} for sign in SIDES.values()],
        {
            "speed_kmh": SPEED_KMH,
            "steer.start_s": _BEGIN_S,
            "steer.end_deg": angle_deg * WITHIN_S / _TURNED_S,
            "duration_s": _BEGIN_S + WITHIN_S + 0.5,
        },
        _CHANNELS,
    )
    return dict(zip(SIDES, runs, strict=True))


def _effort_words(efforts: list[dict[str, Any]]) -> str:
    broken = [row for row in efforts if not row["pass"]]
    if broken:
        words = [f"{row['steering'].replace('_', ' ')}, {row['direction']}: {_how(row)}" for row in broken]
        return f"steering effort: {'; '.join(words)}"
    hardest = [
        f"{max(row['effort_N'] for row in efforts if row['steering'] == name):.0f} N of {requirement.limit_N:.0f} "
        f"({name.replace('_', ' ')})"
        for name, requirement in EFFORTS.items()
    ]
    return f"steering effort within limits: {' and '.join(hardest)}"


def _how(row: Mapping[str, Any]) -> str:
    if math.isnan(row["time_s"]):
        return f"a radius of {row['radius_m']:g} m is not reached within {WITHIN_S:g} s"
    return f"{row['effort_N']:.0f} N ({row['limit_N']:.0f} allowed) after {row['time_s']:.1f} s"


def _fault_words(faults: list[dict[str, Any]]) -> str:
    done = [row for row in faults if "error" not in row]
    words = "no run finished"
    if done:
        worst = max(done, key=lambda row: row["steering_correction_rad"])
        words = (
            f"{_named(worst).replace(': ', ' ')} in the {worst['direction']} circle needs the largest correction, "
            f"{math.degrees(worst['steering_correction_rad']):.0f} deg at the steering wheel; the car is "
            f"{abs(worst['lateral_offset_1s_driver_m']):.2f} m off its course after 1 s"
        )
    count = len({row["fault"] for row in faults})
    if idle := count - len(_with_effect(faults)):
        words += f". {idle} of {count} faults have no effect with this controller"
    return words + ("" if done == faults else f". {len(faults) - len(done)} of {len(faults)} faults did not finish")


def _effort_table(efforts: list[dict[str, Any]]) -> Table:
    rows = [
        (
            row["steering"].replace("_", " "), row["direction"], f"{row['radius_m']:g}", cell(row["time_s"], 2),
            cell(row["effort_N"], 1), f"{row['limit_N']:.0f}",
            passed("pass", chip=True) if row["pass"] else failed("fail", chip=True),
        )
        for row in efforts
    ]  # fmt: skip
    columns = (
        "steering", "direction", "turning radius [m]", f"time to the radius [s], at most {WITHIN_S:g}",
        "steering effort [N]", "limit [N]", "result",
    )  # fmt: skip
    outside = frozenset(i for i, row in enumerate(efforts) if not row["pass"])
    return Table("Steering effort to reach the radius", columns, rows, outside)


def _fault_table(faults: list[dict[str, Any]]) -> Table:
    def tolerated(row: Mapping[str, Any]) -> str:
        return "always" if row["fault_tolerant_time_s"] is None else cell(row["fault_tolerant_time_s"], 3)

    names = _with_effect(faults)
    idle = dict.fromkeys(name for name in map(_named, faults) if name not in names)
    faults = [row for row in faults if _named(row) in names]
    rows = [
        (
            _named(row), row["direction"], *(cell(_shown(row, name), 2) for name in FIGURES[:-1]),
            row.get("error") or tolerated(row),
        )
        for row in faults
    ]  # fmt: skip
    if idle:  # in one row
        rows.append((f"without effect: {', '.join(idle)}", "both", *[cell(0.0, 2)] * len(FIGURES[:-1]), "always"))
    columns = (
        "fault", "circle", "yaw rate, change, hands fixed [deg/s]", "lateral acceleration, change, hands fixed [m/s²]",
        "lateral offset after 1 s, hands fixed [m]", "lateral offset after 1 s, driver [m]",
        "driver's correction [deg]",
        "fault-tolerant time [s], by the fault map's limits",
    )  # fmt: skip
    outside = frozenset(i for i, row in enumerate(faults) if "error" in row)
    return Table("Failures in a circle of 100 m at 80 km/h", columns, rows, outside)


def _named(row: Mapping[str, Any]) -> str:
    return fault_words(vars(build(Fault, fault_table(row["fault"], 0.0), Source(row["fault"]))))


def _with_effect(faults: list[dict[str, Any]]) -> list[str]:
    return list(dict.fromkeys(_named(row) for row in faults if _has_effect(row)))


def _has_effect(row: Mapping[str, Any]) -> bool:
    return any(row[name] != 0.0 for name in FIGURES[:-1])


def _shown(row: Mapping[str, Any], name: str) -> float:
    return display_unit(name).factor * row[name]


def _dots(faults: list[dict[str, Any]]) -> Picture:
    """Return a figure with a row for each fault with an effect, with the right circle below the left circle."""
    names = _with_effect(faults)

    def panel(figure: str, label: str) -> Panel:
        curves = []
        notes = []
        for side, below, marker in zip(SIDES, (0.0, 0.3), "oD", strict=True):  # in rows
            own = [row for row in faults if row["direction"] == side and _named(row) in names]
            x, y = [_shown(row, figure) for row in own], [names.index(_named(row)) + below for row in own]
            curves.append(Curve(x, y, side, dashes="", marker=marker, size=6.0))
            notes += [(at, row, three_digits(at)) for at, row in zip(x, y, strict=True)]
        return Panel(label, "", curves, names=names, notes=notes)

    panels = [
        panel("yaw_rate_change_radps", "yaw rate, change,\nhands fixed [deg/s]"),
        panel("lateral_offset_1s_m", "lateral offset after 1 s,\nhands fixed [m]"),
        panel("steering_correction_rad", "driver's correction,\nsteering wheel [deg]"),
    ]
    return Picture("Failures with an effect in a circle of 100 m at 80 km/h", panels)


RADIUS_M: Final = 100.0
"""Radius for cars and light vans [m], from extracts of UN R79, revision 4, annex 4, and of GB 17675-2021."""
SPEED_MPS: Final = 80.0 / 3.6
"""Speed in the circle [m/s]."""
YAW_RATE_RADPS: Final = math.radians(3.0)
"""Largest change of the yaw rate [rad/s]. Drivers control steps of 2 to 5 deg/s and 1 m/s2: both are assumptions."""
AY_MPS2: Final = 1.0
"""Largest change of the lateral acceleration [m/s2]."""
LANE_M: Final = 3.5
"""Width of the lane, with the car in its middle [m]. Its edge is the largest lateral offset after 1 s."""
_ENTRY_S: Final = 2.0
_FAULT_S: Final = _ENTRY_S + 2.5
"""Time at which the fault begins, in the steady circle [s]."""
_WINDOW_S: Final = 2.0
"""Evaluated time after the start of the fault [s]."""
_SPACING_M: Final = 1.0
OFFSET_AT_S: Final = 1.0
"""Time after the start of a fault at which the lateral offset is taken [s]."""
_RESOLUTION_S: Final = 0.005
"""Resolution of the fault-tolerant time [s]."""
_ALL_KINDS: Final = (
    "stuck", "runaway=left", "runaway=right", "float", "offset=1deg", "reversed", "delayed=0.1s", "dropout",
)  # fmt: skip
_REAR: Final = tuple(f"rear:{kind}" for kind in _ALL_KINDS)
_FRONT: Final = tuple(f"superposition:{kind}" for kind in _ALL_KINDS)
_TOLD: Final = ("yaw_rate_sensor:stuck", "yaw_rate_sensor:offset=2degps", "yaw_rate_sensor:dropout")


def usual_faults(controller: str) -> tuple[str, ...]:
    """Return the faults of the actuators and sensors that a controller uses."""
    known = {"ars": (*_REAR, *_TOLD), "afs": (*_FRONT, *_TOLD)}
    return known.get(system_of(controller), (*_REAR, *_FRONT, *_TOLD))


def circle(direction: str) -> dict[str, Any]:
    """Return the manoeuvre: a path that turns smoothly into the circle."""
    duration_s = _FAULT_S + _WINDOW_S
    times = (np.arange(math.ceil(SPEED_MPS * (duration_s + 4.0) / _SPACING_M)) + 0.5) * _SPACING_M / SPEED_MPS
    entry = 0.5 - 0.5 * np.cos(np.pi * np.minimum(times / _ENTRY_S, 1.0))
    heading = np.cumsum([0.0, *(_SPACING_M * SIDES[direction] / RADIUS_M * entry)])
    along = 0.5 * (heading[:-1] + heading[1:])
    x, y = (np.concatenate(([0.0], _SPACING_M * np.cumsum(part))) for part in (np.cos(along), np.sin(along)))
    return {
        "kind": "follow_path", "name": f"circle_100m_{direction}", "speed_mps": SPEED_MPS, "duration_s": duration_s,
        "path": {"x_m": x.tolist(), "y_m": y.tolist()},
    }  # fmt: skip


def fault_circles(runner: StandardRunner) -> list[dict[str, Any]]:
    """Drive every usual fault in both circles, without keeping the runs."""
    faults = usual_faults(runner.controller)
    drive = functools.partial(fault_circle, runner.controller, runner.driver, runner.vehicle, runner.overrides, faults)
    done = in_parallel(
        drive,
        [(direction,) for direction in SIDES],
        report=lambda _, count: runner.progress("fault_circles", count, len(SIDES)),
        workers=runner.workers,
    )
    return [row for pair in zip(*done, strict=True) for row in pair]


def fault_circle(
    controller: Any,
    driver: Any,
    vehicle: FileOrTable,
    overrides: Mapping[str, Any],
    faults: Sequence[str],
    direction: str,
) -> list[dict[str, Any]]:
    """Drive faults without a time, such as `rear:offset=1deg`, in one circle."""
    chosen = {text: build(Fault, fault_table(text, start_s=0.0), Source(f"--fault {text}")) for text in faults}
    scenario = resolve(circle(direction), vehicle, overrides, driver, [controller])
    check_parts(overrides, scenario, ("vehicle", "driver"))
    longest_delay_s = max(fault.delay_s or 0.0 for fault in chosen.values())
    offset_m = 0.5 * (LANE_M - scenario.car.config.width_m)
    runs = _FaultRuns(ClosedLoop(scenario, controller), longest_delay_s, offset_m)
    return [{"fault": text, "direction": direction, **_judged(runs, fault)} for text, fault in chosen.items()]


class _Signals(NamedTuple):
    """Evaluated signals of a run from the start of the fault, shape (n,) each."""

    x_m: Array
    y_m: Array
    yaw_rad: Array
    yaw_rate_radps: Array
    ay_mps2: Array
    steering_wheel_rad: Array


class _RecordingDriver:
    """Driver whose commands are recorded."""

    def __init__(self, driver: Any) -> None:
        self._driver = driver
        self.commands: list[DriverCommand] = []

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        self.commands.append(self._driver.step(setpoint, measurement, motion))
        return self.commands[-1]


class _HandsFixed:
    """Driver that repeats the commands of the car without a fault."""

    def __init__(self, commands: Sequence[DriverCommand]) -> None:
        self._next = iter(commands)

    def step(self, *_: Any) -> DriverCommand:
        return next(self._next)


class _FaultRuns:
    """Runs in a circle, all from one state shortly before the faults begin."""

    def __init__(self, loop: ClosedLoop, lead_s: float, largest_offset_m: float) -> None:
        self.loop, self.largest_offset_m = loop, largest_offset_m
        self.timestep_s = loop.vehicle.timestep_s
        lead = min(round(_FAULT_S / self.timestep_s), round(lead_s / self.timestep_s) + 10)
        loop.advance(round(_FAULT_S / self.timestep_s) - lead)
        self._start, self._lead = loop.save_state(), lead
        loop.driver = driver = _RecordingDriver(loop.driver)
        self.in_order = self._driven()
        self._commands = driver.commands

    def hands_fixed(self, fault: Fault) -> _Signals:
        """Return the motion with a fault and hands fixed."""
        return self.again(fault, _HandsFixed(self._commands))

    def again(self, fault: Fault, driver: Any = None) -> _Signals:
        """Return the motion with a fault and a driver, by default the driver of the loop."""
        loop = self.loop
        loop.fail(())
        loop.restore_state(self._start)
        ends = None if fault.end_s is None else _FAULT_S + fault.end_s
        loop.fail((replace(fault, start_s=_FAULT_S, end_s=ends),))
        if driver is not None:
            loop.driver = driver
        return self._driven()

    def _driven(self) -> _Signals:
        loop = self.loop
        recorder = Recorder(loop.vehicle, loop.steps - loop.step_count)
        loop.advance(loop.steps - loop.step_count, recorder)
        names = [channel.name for channel in recorder.channels]
        values = recorder.result()[1][self._lead :]
        return _Signals(*(values[:, names.index(name)].copy() for name in _Signals._fields))


def _judged(runs: _FaultRuns, fault: Fault) -> dict[str, Any]:
    """Return the results of a fault, with nan for an incomplete run."""
    try:
        fixed = runs.hands_fixed(fault)
        driven = runs.again(fault)
        broken_s = _first_broken_s(runs, fixed)
        tolerant_s = None if broken_s is None else _tolerant_s(runs, fault, broken_s)
    except SimulationDiverged as error:
        return dict.fromkeys(FIGURES, math.nan) | {"error": str(error)}
    good = runs.in_order
    figures = (
        float(np.abs(fixed.yaw_rate_radps - good.yaw_rate_radps).max()),
        float(np.abs(fixed.ay_mps2 - good.ay_mps2).max()),
        _offset_m(runs, fixed),
        _offset_m(runs, driven),
        float(np.abs(driven.steering_wheel_rad - good.steering_wheel_rad).max()),
        tolerant_s,
    )
    return dict(zip(FIGURES, figures, strict=True))


def _offset_m(runs: _FaultRuns, motion: _Signals) -> float:
    """Return the lateral offset from the path without the fault, one second after its start, left positive [m]."""
    row, good = round(OFFSET_AT_S / runs.timestep_s) - 1, runs.in_order
    yaw = good.yaw_rad[row]
    across = math.cos(yaw) * (motion.y_m[row] - good.y_m[row]) - math.sin(yaw) * (motion.x_m[row] - good.x_m[row])
    return float(across)


def _first_broken_s(runs: _FaultRuns, motion: _Signals) -> float | None:
    """Return the time from the start of the fault to the first exceeded limit [s], or None."""
    good = runs.in_order
    broken = np.abs(motion.yaw_rate_radps - good.yaw_rate_radps) > YAW_RATE_RADPS
    broken |= np.abs(motion.ay_mps2 - good.ay_mps2) > AY_MPS2
    if abs(_offset_m(runs, motion)) > runs.largest_offset_m:
        broken[round(OFFSET_AT_S / runs.timestep_s) - 1] = True
    return float(np.argmax(broken)) * runs.timestep_s if broken.any() else None


def _tolerant_s(runs: _FaultRuns, fault: Fault, broken_s: float) -> float:
    """Find the longest duration of a fault within the limits [s], by bisection."""
    # The search assumes that a longer fault has a larger effect. It returns the bound that meets the limits.
    good, bad = 0, round(broken_s / runs.timestep_s)
    while bad - good > max(1.0, _RESOLUTION_S / runs.timestep_s):
        middle = (good + bad) // 2
        motion = runs.hands_fixed(replace(fault, end_s=middle * runs.timestep_s))
        if _first_broken_s(runs, motion) is None:
            good = middle
        else:
            bad = middle
    return good * runs.timestep_s
