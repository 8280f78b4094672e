"""Effect of faults in a circle of 100 m, and the longest time they may last: UN R79, annex 4.

Every fault is driven at least twice from one state: with hands fixed (steering wheel and pedals move as without the
fault), and with the driver. The fault-tolerant time is the longest duration of the fault, hands fixed, without
exceeding a limit.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.config import Source, build
from activesteer.config.faults import Fault, fault_table
from activesteer.controllers import system_of
from activesteer.core.conventions import Array
from activesteer.core.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.errors import SimulationDiverged
from activesteer.scenario import FileOrTable, check_parts, resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.recorder import Recorder
from activesteer.standards.r79_circle import FIGURES
from activesteer.studies.engine.workers import Workers, in_parallel

RADIUS_M: Final = 100.0
"""Radius for cars and light vans [m], from extracts of UN R79, revision 4, annex 4, and of GB 17675-2021."""
SPEED_MPS: Final = 80.0 / 3.6
"""Speed on it [m/s]."""
CIRCLES: Final = {"left": 1.0, "right": -1.0}
"""Direction -> sign of its curvature."""
YAW_RATE_RADPS: Final = math.radians(3.0)
"""Largest change of the yaw rate [rad/s]. Drivers control steps of 2 to 5 deg/s and 1 m/s2: assumptions both."""
AY_MPS2: Final = 1.0
"""Largest change of the lateral acceleration [m/s2]."""
LANE_M: Final = 3.5
"""Width of the lane, in whose middle the car is [m]. Its edge is the largest lateral offset after 1 s."""
_ENTRY_S: Final = 2.0
_BEGIN_S: Final = _ENTRY_S + 2.5
"""Time at which the fault begins, in the steady circle [s]."""
_WINDOW_S: Final = 2.0
"""Evaluated time after it [s]."""
_SPACING_M: Final = 1.0
OFFSET_AT_S: Final = 1.0
"""Time after the beginning of a fault at which the lateral offset is taken [s]."""
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
    """Return the manoeuvre: a path that bends smoothly into the circle, some seconds longer than the run."""
    duration_s = _BEGIN_S + _WINDOW_S
    times = (np.arange(math.ceil(SPEED_MPS * (duration_s + 4.0) / _SPACING_M)) + 0.5) * _SPACING_M / SPEED_MPS
    entry = 0.5 - 0.5 * np.cos(np.pi * np.minimum(times / _ENTRY_S, 1.0))
    heading = np.cumsum([0.0, *(_SPACING_M * CIRCLES[direction] / RADIUS_M * entry)])
    along = 0.5 * (heading[:-1] + heading[1:])
    x, y = (np.concatenate(([0.0], _SPACING_M * np.cumsum(part))) for part in (np.cos(along), np.sin(along)))
    return {
        "kind": "follow_path", "name": f"circle_100m_{direction}", "speed_mps": SPEED_MPS, "duration_s": duration_s,
        "path": {"x_m": x.tolist(), "y_m": y.tolist()},
    }  # fmt: skip


def fault_circles(
    controller: Any,
    vehicle: FileOrTable,
    overrides: Mapping[str, Any],
    driver: Any,
    workers: Workers,
    progress: Callable[[int, int], None],
) -> list[dict[str, Any]]:
    """Drive every usual fault in both circles."""
    faults = usual_faults(str(controller))
    drive = functools.partial(fault_circle, controller, driver, vehicle, overrides, faults)
    done = in_parallel(
        drive, [(direction,) for direction in CIRCLES], None, lambda _, count: progress(count, len(CIRCLES)),
        workers=workers,
    )  # fmt: skip
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
    """Evaluated signals of a run from the beginning of the fault, shape (n,) each."""

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
    """Driver that replays the commands of the car without a fault."""

    def __init__(self, commands: Sequence[DriverCommand]) -> None:
        self._next = iter(commands)

    def step(self, *_: Any) -> DriverCommand:
        return next(self._next)


class _FaultRuns:
    """The runs in a circle, from one state shortly before the faults begin."""

    def __init__(self, loop: ClosedLoop, lead_s: float, largest_offset_m: float) -> None:
        self.loop, self.largest_offset_m = loop, largest_offset_m
        self.timestep_s = loop.vehicle.timestep_s
        lead = min(round(_BEGIN_S / self.timestep_s), round(lead_s / self.timestep_s) + 10)
        loop.advance(round(_BEGIN_S / self.timestep_s) - lead)
        self._start, self._lead = loop.save_state(), lead
        loop.driver = driver = _RecordingDriver(loop.driver)
        self.in_order = self._driven()
        self._commands = driver.commands

    def hands_fixed(self, fault: Fault) -> _Signals:
        """Return the motion with a fault and hands fixed."""
        return self.again(fault, _HandsFixed(self._commands))

    def again(self, fault: Fault, driver: Any = None) -> _Signals:
        """Return the motion with a fault; without a driver, that of the loop responds."""
        loop = self.loop
        loop.fail(())
        loop.restore_state(self._start)
        ends = None if fault.end_s is None else _BEGIN_S + fault.end_s
        loop.fail((replace(fault, start_s=_BEGIN_S, end_s=ends),))
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
    """Return the values of a fault, or nan for an incomplete run."""
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
    """Return the lateral offset from the path without the fault, one second after its beginning, left positive [m]."""
    row, good = round(OFFSET_AT_S / runs.timestep_s) - 1, runs.in_order
    yaw = good.yaw_rad[row]
    across = math.cos(yaw) * (motion.y_m[row] - good.y_m[row]) - math.sin(yaw) * (motion.x_m[row] - good.x_m[row])
    return float(across)


def _first_broken_s(runs: _FaultRuns, motion: _Signals) -> float | None:
    """Return the time from the beginning of the fault until a limit is exceeded [s], or None if none is."""
    good = runs.in_order
    broken = np.abs(motion.yaw_rate_radps - good.yaw_rate_radps) > YAW_RATE_RADPS
    broken |= np.abs(motion.ay_mps2 - good.ay_mps2) > AY_MPS2
    if abs(_offset_m(runs, motion)) > runs.largest_offset_m:
        broken[round(OFFSET_AT_S / runs.timestep_s) - 1] = True
    return float(np.argmax(broken)) * runs.timestep_s if broken.any() else None


def _tolerant_s(runs: _FaultRuns, fault: Fault, broken_s: float) -> float:
    """Find the time by bisection, below the time at which the lasting fault exceeds a limit.

    The search assumes that a longer fault has a larger effect. It returns the bound that keeps the limits.
    """
    good, bad = 0, round(broken_s / runs.timestep_s)
    while bad - good > max(1.0, _RESOLUTION_S / runs.timestep_s):
        middle = (good + bad) // 2
        motion = runs.hands_fixed(replace(fault, end_s=middle * runs.timestep_s))
        if _first_broken_s(runs, motion) is None:
            good = middle
        else:
            bad = middle
    return good * runs.timestep_s
