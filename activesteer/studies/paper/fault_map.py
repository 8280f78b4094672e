"""Fault map: the effect of each fault at several speeds in several situations, and its tolerated duration.

Every cell is driven at least three times from one state: without a fault; with the fault and hands fixed (steering
wheel and pedals move as without the fault); and with the fault and the driver. The fault-tolerant time is the longest
duration of the fault, hands fixed, without exceeding a limit.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, NamedTuple

import numpy as np

from activesteer.config import Range, Source, build
from activesteer.controllers import system_of
from activesteer.conventions import Array
from activesteer.errors import ParameterError, SimulationDiverged, nearest_names
from activesteer.faults import Fault, fault_table
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable, check_gains, check_parts, resolve
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.recorder import Recorder
from activesteer.studies.engine.task_queue import in_parallel
from activesteer.studies.engine.workers import Workers
from activesteer.studies.paper.fault_situations import FIGURES, LANE_M, PRESETS, SITUATIONS, path_of

OFFSET_AT_S: Final = 1.0
"""Time after the beginning of a fault at which the lateral offset is taken [s]."""
_RESOLUTION_S: Final = 0.005
"""Resolution of the fault-tolerant time [s]."""


@dataclass(frozen=True)
class Limits:
    """Limits for the effect of a fault, set by the user; the defaults are assumptions.

    The literature gives steps of 2 to 5 deg/s of yaw rate and 1 m/s2 as controllable by drivers.
    """

    yaw_rate_radps: Annotated[float, Range(1e-4, 10.0)] = math.radians(3.0)
    """Largest change of the yaw rate [rad/s]."""
    ay_mps2: Annotated[float, Range(1e-3, 20.0)] = 1.0
    """Largest change of the lateral acceleration [m/s2]."""
    lateral_offset_m: Annotated[float, Range(1e-3, 20.0)] | None = None
    """Largest lateral offset after 1 s [m]; default: to the edge of a lane of 3.5 m, for a car in its middle."""
    window_s: Annotated[float, Range(OFFSET_AT_S, 10.0)] = 2.0
    """Evaluated time after the beginning of a fault [s]."""


_ALL_KINDS: Final = (
    "stuck", "runaway=left", "runaway=right", "float", "offset=1deg", "reversed", "delayed=0.1s", "dropout",
)  # fmt: skip
_REAR: Final = tuple(f"rear:{kind}" for kind in _ALL_KINDS)
_FRONT: Final = tuple(f"superposition:{kind}" for kind in _ALL_KINDS)
_TOLD: Final = ("yaw_rate_sensor:stuck", "yaw_rate_sensor:offset=2degps", "yaw_rate_sensor:dropout")


def usual_faults(controller: str) -> tuple[str, ...]:
    """Return the default faults of a map: of the actuators and sensors that a controller uses."""
    known = {"ars": (*_REAR, *_TOLD), "afs": (*_FRONT, *_TOLD)}
    return known.get(system_of(controller), (*_REAR, *_FRONT, *_TOLD))


@dataclass(frozen=True)
class FaultMap:
    """Result of a fault map.

    Attributes:
        limits: The limits.
        rows: A row for each fault, speed and situation: `fault`, `speed_kmh`, `situation`, `yaw_rate_change_radps`,
            `ay_change_mps2`, `lateral_offset_1s_m` (left positive; these three with hands fixed),
            `lateral_offset_1s_driver_m`, `steering_correction_rad` (largest change of the driver's steering wheel
            angle), `fault_tolerant_time_s` (None if no limit is exceeded within the evaluated time). An incomplete run
            has nan and `error`.
    """

    limits: Limits
    rows: list[dict[str, Any]]


def fault_map(
    controller: Any = "none",
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    *,
    faults: Sequence[str] = (),
    speeds_kmh: Sequence[float] = PRESETS["usual"].speeds_kmh,
    situations: Sequence[str] = PRESETS["usual"].situations,
    limits: Limits | None = None,
    driver: Any = DEFAULT_DRIVER,
    jobs: int | None = None,
    scheduler: str | None = None,
    workers: Workers | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> FaultMap:
    """Drive every fault at every speed [km/h] in every situation, a name of `SITUATIONS`.

    Faults have no time, such as `rear:offset=1deg`; by default they are those of the controller's actuators and
    sensors. `progress` is called after every pair of speed and situation with the finished pairs and the total.
    """
    limits = Limits() if limits is None else limits
    chosen = {
        text: build(Fault, fault_table(text, start_s=0.0), Source(f"--fault {text}"))
        for text in faults or usual_faults(str(controller))
    }
    check_gains(overrides or {}, [controller])
    for name in situations:
        if name not in SITUATIONS:
            known = nearest_names(name, SITUATIONS)
            raise ParameterError(f"there is no situation {name!r}; {known}", key="situation", value=name)
    for speed in speeds_kmh:
        if not 20.0 <= speed <= 250.0:
            raise ParameterError(f"is {speed:g} km/h; allowed is 20 to 250", key="speed_kmh", value=speed)
    cells = [(name, speed) for name in situations for speed in speeds_kmh]
    drive = functools.partial(_cell, controller, driver, vehicle, dict(overrides or {}), chosen, limits)
    tell = (lambda _, count: progress(count, len(cells))) if progress else lambda _, __: None
    done = in_parallel(drive, cells, jobs, tell, scheduler=scheduler, workers=workers)
    rows = [row for cell in done for row in cell]
    order = list(chosen)
    return FaultMap(limits, sorted(rows, key=lambda row: order.index(row["fault"])))


def _cell(
    controller: Any,
    driver: Any,
    vehicle: FileOrTable,
    overrides: Mapping[str, Any],
    faults: Mapping[str, Fault],
    limits: Limits,
    situation: str,
    speed_kmh: float,
) -> list[dict[str, Any]]:
    """Drive all faults at one speed in one situation."""
    begin_s = SITUATIONS[situation].fault_s(speed_kmh / 3.6)
    table = path_of(situation, speed_kmh / 3.6, begin_s + limits.window_s)
    scenario = resolve(table, vehicle, overrides, driver, [controller])
    check_parts(overrides, scenario, ("vehicle", "driver"))
    width_m = scenario.car.config.width_m
    if limits.lateral_offset_m is None:
        limits = replace(limits, lateral_offset_m=0.5 * (LANE_M - width_m))
    longest_delay_s = max(fault.delay_s or 0.0 for fault in faults.values())
    runs = _FaultRuns(ClosedLoop(scenario, controller), begin_s, longest_delay_s)
    return [
        {"fault": text, "speed_kmh": speed_kmh, "situation": situation, **_judged(runs, fault, limits)}
        for text, fault in faults.items()
    ]


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
    """The runs of a cell, from one state shortly before the faults begin."""

    def __init__(self, loop: ClosedLoop, begin_s: float, lead_s: float) -> None:
        self.loop, self.begin_s = loop, begin_s
        self.timestep_s = loop.vehicle.timestep_s
        lead = min(round(begin_s / self.timestep_s), round(lead_s / self.timestep_s) + 10)
        loop.advance(round(begin_s / self.timestep_s) - lead)
        self._start, self._lead = loop.save_state(), lead
        driver = _RecordingDriver(loop.driver)
        self.in_order = self._driven(driver)
        self._commands = driver.commands

    def hands_fixed(self, fault: Fault) -> _Signals:
        """Return the motion with a fault and hands fixed."""
        return self.again(fault, _HandsFixed(self._commands))

    def again(self, fault: Fault, driver: Any = None) -> _Signals:
        """Return the motion with a fault; without a driver, that of the loop responds."""
        loop = self.loop
        loop.fail(())
        loop.restore_state(self._start)
        ends = None if fault.end_s is None else self.begin_s + fault.end_s
        loop.fail((replace(fault, start_s=self.begin_s, end_s=ends),))
        return self._driven(driver)

    def _driven(self, driver: Any) -> _Signals:
        loop = self.loop
        recorder = Recorder(loop.vehicle, loop.steps - loop.step_count)
        loop.advance(loop.steps - loop.step_count, recorder, driver=driver)
        names = [channel.name for channel in recorder.channels]
        values = recorder.result()[1][self._lead :]
        return _Signals(*(values[:, names.index(name)].copy() for name in _Signals._fields))


def _judged(runs: _FaultRuns, fault: Fault, limits: Limits) -> dict[str, Any]:
    """Return the values of a fault; nan for an incomplete run."""
    try:
        fixed = runs.hands_fixed(fault)
        driven = runs.again(fault)
        broken_s = _first_broken_s(runs, fixed, limits)
        tolerant_s = None if broken_s is None else _tolerant_s(runs, fault, limits, broken_s)
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


def _first_broken_s(runs: _FaultRuns, motion: _Signals, limits: Limits) -> float | None:
    """Return the time from the beginning of the fault until a limit is exceeded [s]; None if none is."""
    good = runs.in_order
    broken = np.abs(motion.yaw_rate_radps - good.yaw_rate_radps) > limits.yaw_rate_radps
    broken |= np.abs(motion.ay_mps2 - good.ay_mps2) > limits.ay_mps2
    assert limits.lateral_offset_m is not None
    if abs(_offset_m(runs, motion)) > limits.lateral_offset_m:
        broken[round(OFFSET_AT_S / runs.timestep_s) - 1] = True
    return float(np.argmax(broken)) * runs.timestep_s if broken.any() else None


def _tolerant_s(runs: _FaultRuns, fault: Fault, limits: Limits, broken_s: float) -> float:
    """Find the time by bisection, below the time at which the lasting fault exceeds a limit.

    The search assumes that a longer fault has a larger effect. It returns the bound that keeps the limits.
    """
    good, bad = 0, round(broken_s / runs.timestep_s)
    while bad - good > max(1.0, _RESOLUTION_S / runs.timestep_s):
        middle = (good + bad) // 2
        motion = runs.hands_fixed(replace(fault, end_s=middle * runs.timestep_s))
        if _first_broken_s(runs, motion, limits) is None:
            good = middle
        else:
            bad = middle
    return good * runs.timestep_s
