"""The human driver, in Python and in compiled code, and the look-up of drivers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import PurePath
from typing import Any, Final, NamedTuple

import numpy as np
from numba import carray
from numpy.typing import NDArray

from activesteer.config import Range
from activesteer.core.path import Path
from activesteer.core.signals import DriverCommand, Measurement, Motion, Setpoint, WheelTorques, new_message, numbers_of
from activesteer.driver.base import DriverParameters, DriverSetup
from activesteer.driver.open_loop import (
    NO_RACK,
    ConstantRadiusDriver,
    OpenLoopDriver,
    circle_angle,
    correct_circle,
    turned,
)
from activesteer.driver.path_preview import N_SPEEDS, SPEED_STEP_MPS, PathPreviewDriver, look, looks, moved
from activesteer.errors import DriverError, ManeuverError, SimulationDiverged, shown
from activesteer.native.compilation import inlined
from activesteer.native.memory import array_of, f64_pointer, word_pointer
from activesteer.native.records import ARRAY, NativeBlock
from activesteer.plugins import Kind, Plugin, find
from activesteer.resources import list_drivers
from activesteer.theory.single_track import SingleTrack


class HumanDriver(NativeBlock):
    """Driver that follows a path, a curvature or a steering wheel angle, and holds the speed.

    The driver file sets the skill; see `DriverParameters`.
    """

    _open_loop: OpenLoopDriver
    _constant_radius: ConstantRadiusDriver
    _path: PathPreviewDriver

    def __init__(self, setup: DriverSetup) -> None:
        """Combine three drivers: for a steering wheel angle, for a curvature, and for a path."""
        robot, single_track = OpenLoopDriver.from_vehicle(setup), SingleTrack(setup.single_track)
        self._open_loop = robot
        self._constant_radius = ConstantRadiusDriver(robot, single_track.wheelbase_m, setup.timestep_s)
        self._path = PathPreviewDriver(robot, single_track.matrices, setup.parameters, setup.timestep_s)

    def prepare(self, speed_mps: float) -> int:
        """Compute the gains on a path at a speed for compiled code, and return their count.

        Raises:
            SimulationDiverged: the speed is implausibly high.
        """
        rounded = round(speed_mps / SPEED_STEP_MPS)
        if not 0 <= rounded < N_SPEEDS:
            raise SimulationDiverged(f"the car drives at {speed_mps:g} m/s", value="speed_mps")
        return self._path.gains_at(rounded).size

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """Return the command (see `Driver`)."""
        if setpoint.path is not None:
            return self._path.step(setpoint, measurement, motion)
        if setpoint.curvature_demand_1pm is not None:
            return self._constant_radius.step(setpoint, measurement, motion)
        return self._open_loop.step(setpoint, measurement, motion)


ANGLE, CURVATURE, PATH = range(3)
"""Kinds of a setpoint: steering wheel angle, curvature, path."""
SETPOINT: Final = np.dtype(
    (
        np.record,
        [
            *((name, np.float64) for name in ("steering_wheel_rad", "speed_mps", "brake_pedal", "parking_brake")),
            ("curvature_1pm", np.float64),
            *((name, np.intp) for name in ("kind", "holds_speed", "torques_set")),
            ("torques_Nm", np.float64, (8,)),
        ],
    )
)
"""A `Setpoint` for compiled code. `torques_Nm` holds the drive torques and the brake torques of the wheels."""
LINE: Final = np.dtype(
    (np.record, [("spacing_m", np.float64), ("x_m", ARRAY), ("y_m", ARRAY), ("headings_rad", np.float64, (2,))])
)
"""A path as `PathSearch.line` describes it."""

_NO_TORQUES: Final = (0.0,) * 8
_DRIVER: Final = [number.name for number in numbers_of(DriverCommand)]
_WHEEL, _DRIVE, _PEDAL, _SATURATED, _GEAR, _FRONT, _PARKING = map(
    _DRIVER.index,
    ("steering_wheel_demand_rad", "drive_torque_demand_Nm", "brake_pedal", "saturated", "gear",
     "front_steer_demand_rad", "parking_brake"),
)  # fmt: skip
_MEASURED: Final = [number.name for number in numbers_of(Measurement)]
_SPEED, _YAW_RATE = map(_MEASURED.index, ("speed_mps", "yaw_rate_radps"))
_MOTION_SPEED: Final = Motion._fields.index("speed_mps")


_WINDOW: Final = 250
"""Number of steps whose setpoints are tabulated together."""
_MAX_TABLES: Final = 64
"""Largest number of tables that are kept for cars that share a manoeuvre."""


class SetpointTable(NamedTuple):
    """Setpoints of successive steps for compiled code, as records of `SETPOINT`; the last one is held."""

    rows: NDArray[Any]
    path: Path | None
    steps: int  # number of steps that the table is for, at least as many as rows


def tabulate(setpoints: Sequence[Setpoint], rack_per_steering_wheel_m: float | None) -> SetpointTable:
    """Return setpoints as a table, up to a change of the path."""
    path = setpoints[0].path
    steps = next((step for step, setpoint in enumerate(setpoints) if setpoint.path is not path), len(setpoints))
    count = steps
    while count > 1 and setpoints[count - 1] is setpoints[count - 2]:
        count -= 1
    rows = [setpoint_row(setpoint, rack_per_steering_wheel_m) for setpoint in setpoints[:count]]
    return SetpointTable(np.array(rows, SETPOINT), path, steps)


class SharedTables:
    """Tabulated setpoints of the next steps, for the cars of a batch."""

    def __init__(self) -> None:
        """Start without tables."""
        self._kept: dict[tuple[Any, ...], tuple[Any, SetpointTable]] = {}

    def of(self, maneuver: Any, step: int, rack_m: float | None, timestep_s: float) -> tuple[SetpointTable, int]:
        """Return a table that holds the setpoint of a step, and its first step."""

        def from_step(first: int) -> SetpointTable:
            steps = range(first, first + _WINDOW)
            return tabulate([maneuver.setpoint(each * timestep_s) for each in steps], rack_m)

        first = step // _WINDOW * _WINDOW
        key = id(maneuver), first, rack_m
        if key not in self._kept:
            while len(self._kept) >= _MAX_TABLES:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = maneuver, from_step(first)  # with the manoeuvre, whose id then stays its own
        table = self._kept[key][1]
        if step >= first + table.steps:  # the path changes during the run
            return from_step(step), step
        return table, first


def setpoint_row(setpoint: Setpoint, rack_per_steering_wheel_m: float | None) -> tuple[Any, ...]:
    """Return a setpoint in the form of its record (see `tabulate`)."""
    turn, speed, pedal, holds, curvature, rack, wheels, path, parking = setpoint
    kind = ANGLE
    if path is not None:
        kind = PATH
    elif curvature is not None:
        kind = CURVATURE
    elif rack is not None:
        if rack_per_steering_wheel_m is None:
            raise ManeuverError(NO_RACK, key="steering.rack_m")
        turn = rack / rack_per_steering_wheel_m
    torques = _NO_TORQUES if wheels is None else (*wheels.drive_Nm, *wheels.brake_Nm)
    return turn, speed, pedal, parking, curvature or 0.0, kind, holds, wheels is not None, torques


@inlined
def follow(human, setpoint, line, measured, motion, engine_radps, low_Nm, high_Nm, command):
    """Write the command of a `HumanDriver`."""
    robot = human._open_loop
    angle, slow_arms = setpoint.steering_wheel_rad, False
    if setpoint.kind == PATH:
        path = human._path
        if path._steps % path._preview_every_steps == 0:
            decided, address = array_of(path._decided_rad), 0
            if looks(motion[_MOTION_SPEED]):
                rounded = int(np.rint(motion[_MOTION_SPEED] / SPEED_STEP_MPS))
                if rounded < path._known.size:
                    address = word_pointer(path._known.address)[rounded]
                if address == 0:
                    return False
            gains = carray(f64_pointer(address), (path._row_size,)) if address != 0 else decided
            look(
                path, robot.steering_wheel_limit_rad, decided,
                motion[0], motion[1], motion[2], motion[3], motion[4], motion[5],
                line.spacing_m, array_of(line.x_m), array_of(line.y_m), line.headings_rad[0], line.headings_rad[1],
                gains,
            )  # fmt: skip
        path._steps += 1
        angle, slow_arms = moved(path)
    elif setpoint.kind == CURVATURE:
        angle = circle_angle(human._constant_radius, robot, setpoint.curvature_1pm)
    turn, torque, saturated, gear = turned(
        robot, angle, setpoint.holds_speed != 0, setpoint.speed_mps, measured[_SPEED], engine_radps, low_Nm, high_Nm
    )
    if setpoint.kind == PATH:
        human._path._wheel_rad = turn
    elif setpoint.kind == CURVATURE and turn == angle:
        correct_circle(human._constant_radius, setpoint.curvature_1pm, measured[_YAW_RATE], measured[_SPEED])
    command[_WHEEL], command[_DRIVE], command[_PEDAL] = turn, torque, setpoint.brake_pedal
    command[_SATURATED], command[_GEAR] = 1.0 if saturated or slow_arms else 0.0, float(gear)
    command[_FRONT], command[_PARKING] = turn / robot.steering_ratio, setpoint.parking_brake
    return True


_MAX_ANGLE_RAD: Final = 50.0
"""Largest angle of a command. A larger one is treated as a mistake, such as degrees [rad]."""
_FRONT_STEER: Final = DriverCommand._fields.index("front_steer_demand_rad")
_GEARS: Final = (-1, 0, 1)
_MAX_TORQUE_NM: Final = 1e6
"""Largest torque of a command: more than any car has [N m]."""


@dataclass(frozen=True)
class _DriverKind(Kind):
    """Block kind of drivers, which adds the angle at the road wheel to each command."""

    def completed(self, command: Any, name: str, setup: DriverSetup, said: str) -> DriverCommand:
        """Return a command with the angle at the road wheel (see the base class)."""
        torques, front = command.wheel_torques, command.front_steer_demand_rad
        if torques is not None and not _are_torques(torques):
            needed = "an activesteer.core.signals.WheelTorques of finite numbers is needed"
            raise self.fail(name, f"{said} wheel_torques = {shown(torques)}; {needed}", torques)
        if command.gear not in _GEARS:
            raise self.fail(name, f"{said} gear = {shown(command.gear)}; -1, 0 or 1 is needed", command.gear, _GEARS)
        angle = command.steering_wheel_demand_rad / setup.steering_ratio
        if math.isnan(front):
            return new_message(DriverCommand, (*command[:_FRONT_STEER], angle, *command[_FRONT_STEER + 1 :]))
        if not math.isclose(front, angle, rel_tol=1e-9, abs_tol=1e-12):
            what = f"the steering wheel angle over the steering ratio is {angle:g}; leave it out"
            raise self.fail(name, f"{said} front_steer_demand_rad = {front:g}, but {what}", front)
        return command


DRIVER: Final = _DriverKind(
    word="driver",
    table="driver",
    example="my_file.py:MyDriver",
    inputs="setpoint, measurement, motion",
    built_in={},
    result=DriverCommand,
    ranges={
        "steering_wheel_demand_rad": Range(-_MAX_ANGLE_RAD, _MAX_ANGLE_RAD),
        "drive_torque_demand_Nm": Range(-_MAX_TORQUE_NM, _MAX_TORQUE_NM),
        "brake_pedal": Range(0.0, 1.0),
        "parking_brake": Range(0.0, 1.0),
        "gear": Range(-1, 1),
    },
    error=DriverError,
    unchecked=("wheel_torques",),
    data=list_drivers,
    reserved=tuple(field.name for field in fields(DriverParameters)),
    filled=("front_steer_demand_rad",),
)
"""Rules that all drivers follow."""


def driver_spec(given: Any) -> Plugin:
    """Find a driver by its name, its file or its code (see `activesteer.plugins.find`).

    Args:
        given: A name from `list_drivers`, a driver file or its table; or a user's own code:
            `path/to/file.py:ClassName`, a class, an object, a factory.

    Raises:
        DriverError: there is no such driver.
    """
    if not is_driver_file(given):
        return find(given, DRIVER)
    name = str(given.get("name", "driver")) if isinstance(given, Mapping) else PurePath(given).stem
    return Plugin(DRIVER, name, name, HumanDriver, {}, {}, is_builtin=True)


def is_driver_file(given: Any) -> bool:
    """Return whether a driver is given as data (name, file or table), not as code."""
    return isinstance(given, Mapping) or DRIVER.is_data(given)


def _are_torques(torques: Any) -> bool:
    try:
        return (
            isinstance(torques, WheelTorques)
            and len(torques) == len(WheelTorques._fields)
            and all(len(values) == 4 and all(abs(value) <= _MAX_TORQUE_NM for value in values) for values in torques)
        )
    except TypeError:
        return False
