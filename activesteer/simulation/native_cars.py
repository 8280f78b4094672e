"""Closed loops as records that one native call drives: see `native_loop`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.controllers.law_interface import N_HELD, N_STEERING
from activesteer.controllers.native_laws import LAWS, fetch, put
from activesteer.conventions import Array
from activesteer.driver.human import HumanDriver
from activesteer.errors import SimulationDiverged
from activesteer.native_blocks import take, values
from activesteer.road.path_search import PathSearch
from activesteer.signals import (
    ActuatorCommand,
    DriverCommand,
    Estimate,
    Measurement,
    Motion,
    Setpoint,
    WheelTorques,
    message_of,
    numbers_in,
    numbers_of,
    steering,
)
from activesteer.simulation import native_loop
from activesteer.simulation.control_unit import ControlUnit
from activesteer.simulation.native_loop import (
    ANGLE,
    CAR,
    CURVATURE,
    GIVEN,
    HUMAN,
    INSANE,
    PATH,
    SETPOINT,
    TORQUES,
)
from activesteer.vehicle import Vehicle

if TYPE_CHECKING:
    from activesteer.road.path import Path

_SPEED: Final = Motion._fields.index("speed_mps")

_STEPS: Final = {kind: kind.step for kind in (Vehicle, HumanDriver, *LAWS[1:]) if kind is not None}


class SetpointTable(NamedTuple):
    """Setpoints of successive steps for compiled code; the last one holds on.

    Attributes:
        rows: Records of `SETPOINT`.
        torques: Records of `TORQUES`, or empty.
        path: The path of all steps.
    """

    rows: NDArray[Any]
    torques: NDArray[Any]
    path: Path | None


def tabulate(setpoints: Sequence[Setpoint], rack_per_steering_wheel_m: float | None) -> SetpointTable | None:
    """Return setpoints as a table; None if compiled code cannot follow them.

    Args:
        setpoints: Setpoints of successive steps.
        rack_per_steering_wheel_m: Rack travel per steering wheel angle [m/rad]; None without a rack.
    """
    count = len(setpoints)
    while count > 1 and setpoints[count - 1] is setpoints[count - 2]:
        count -= 1
    rows, torques, path = [], [], setpoints[0].path
    for angle, speed, pedal, holds, curvature, rack, wheels, own_path, parking in setpoints[:count]:
        kind, turn = ANGLE, angle
        if own_path is not None:
            kind = PATH
        elif curvature is not None:
            kind = CURVATURE
        elif rack is not None:
            if rack_per_steering_wheel_m is None:
                return None
            turn = rack / rack_per_steering_wheel_m
        if own_path is not path:
            return None
        rows.append((turn, speed, pedal, parking, curvature or 0.0, kind, holds, wheels is not None))
        if wheels is not None:
            torques.append((*wheels,))
    if torques and len(torques) != count:
        return None
    return SetpointTable(np.array(rows, SETPOINT), np.array(torques, TORQUES), path)


def law_of(controller: Any) -> int:
    """Return the place of a controller in `LAWS`; 0 if compiled code cannot carry it out."""
    if type(controller) is ControlUnit and not controller.uses_truth:
        controller = controller.inner
    return LAWS.index(type(controller)) if type(controller) in LAWS and is_own(controller) else 0


def has_law(driver: Any) -> bool:
    """Return whether compiled code can carry out a driver."""
    return type(driver) is HumanDriver and is_own(driver)


def is_own(block: Any) -> bool:
    """Return whether nobody has replaced the method of a block, for example to watch it."""
    return "step" not in vars(block) and type(block).step is _STEPS[type(block)]


class NativeCars:
    """The loops of some cars with the same step, driven by one native call.

    While they are driven, the state of driver, controller and loop is in the records. `load` brings it there from the
    objects, `store` brings it back.

    Attributes:
        cars: Records of `CAR`.
        driver_commands: Numbers of the last commands of the drivers, shape (n, numbers).
        actuator_commands: Numbers of the last commands of the controllers, shape (n, numbers).
        measurements: Numbers of the present measurements, shape (n, numbers).
        motions: Present motions, shape (n, 6).
        rows: These four by the kind of their message.
    """

    def __init__(self, loops: Sequence[Any]) -> None:
        """Bind the cars.

        Args:
            loops: The loops.
        """
        self._loops, count = loops, len(loops)
        self.cars = np.zeros(count, CAR)
        kinds = ("driver_command", DriverCommand), ("actuator_command", ActuatorCommand), ("measurement", Measurement)
        self.rows: dict[type[Any], Array] = {}
        for name, kind in (*kinds, ("motion", Motion)):
            self.rows[kind] = row = np.zeros((count, len(numbers_of(kind))))
            self.cars[name] = row.ctypes.data + row.strides[0] * np.arange(count)
        self.driver_commands, self.actuator_commands, self.measurements, self.motions = self.rows.values()
        self._tables: list[SetpointTable | None] = [None] * count
        self._buses: list[Array] = [np.zeros((0, 0))] * count
        self._blocks: list[NDArray[Any] | None] = [None] * count
        for index, loop in enumerate(loops):
            drive: Any = loop.driver_setup.drive  # the vehicle's own
            self.cars["drive_fractions"][index], self.cars["drive_numbers"][index] = drive.fractions, drive.numbers
            self.cars["bindings"][index] = loop.vehicle.address

    def load(self, index: int) -> None:
        """Copy the state of a loop into its record; its native driver and controller act, other commands hold."""
        loop, cars = self._loops[index], self.cars
        estimate = loop.vehicle.rows.estimate
        cars["estimate"][index] = estimate.ctypes.data if estimate.size else 0
        cars["step"][index] = loop.step_count
        self.measurements[index], self.motions[index] = numbers_in(loop.measurement), loop.motion
        self.driver_commands[index], self.actuator_commands[index] = map(numbers_in, loop.commands)
        cars["driver_kind"][index] = GIVEN
        if has_law(loop.driver):
            cars["driver_kind"][index] = HUMAN
            cars["driver"][index] = values(loop.driver)  # type: ignore[arg-type]
        cars["controller_kind"][index] = law = law_of(loop.controller)
        if law:
            self._load_unit(index, law, loop.controller)

    def _load_unit(self, index: int, law: int, controller: Any) -> None:
        every, calls, ratio, held, on_bus = 1, 0, 0.0, ActuatorCommand(), []
        if isinstance(controller, ControlUnit):
            every, calls, ratio, held, on_bus = controller.memory()
            controller = controller.inner
        cars, delay = self.cars, max(len(on_bus) - 1, 0) if calls else len(on_bus)
        self._blocks[index] = block = put(cars, index, law, controller)
        numbers = N_STEERING if block is None else N_HELD
        bus = self._buses[index] = np.zeros((delay + 1, numbers))
        for back, command in enumerate(reversed(on_bus), 1):
            bus[(calls - back) % (delay + 1)] = _numbers(command)[:numbers]
        unit = {
            "every": every, "calls": calls, "on_bus": delay, "bus": (bus.ctypes.data, bus.size),
            "numbers": numbers, "held": _numbers(held), "steering_ratio": ratio,
        }  # fmt: skip
        for name, value in unit.items():
            cars[name][index] = value
        self.actuator_commands[index, N_STEERING:] = 0.0

    def store(self, index: int) -> None:
        """Copy the record of a car back into its loop."""
        loop, cars = self._loops[index], self.cars
        step = loop.step_count = int(cars["step"][index])
        loop.measurement = message_of(Measurement, self.measurements[index].tolist())
        loop.motion = message_of(Motion, self.motions[index].tolist())
        driver_command = message_of(DriverCommand, self.driver_commands[index].tolist())
        if has_law(loop.driver):
            take(loop.driver, cars["driver"][index].item())  # type: ignore[arg-type]
            if cars["driver_kind"][index] == HUMAN:
                driver_command = driver_command._replace(wheel_torques=self._torques_of(index, step - 1))
        command = message_of(ActuatorCommand, self.actuator_commands[index].tolist())
        if law := law_of(loop.controller):
            controller, calls, bus = loop.controller, int(cars["calls"][index]), self._buses[index]
            on_bus = [_command(bus[(calls - back) % len(bus)]) for back in range(len(bus), 0, -1)]
            if isinstance(controller, ControlUnit):
                held = _command(cars["held"][index][: bus.shape[1]])
                controller.put_memory(calls, held, on_bus if calls else on_bus[1:])
                controller = controller.inner
            fetch(cars, index, law, controller, self._blocks[index])
            if cars["controller_kind"][index]:
                command = command._replace(estimate=on_bus[0].estimate)
        loop.commands = driver_command, command

    def follow(self, index: int, table: SetpointTable, first: int) -> None:
        """Give the driver of a car its setpoints.

        Args:
            index: Number of the car.
            table: The setpoints.
            first: Step of the first one.
        """
        if self._tables[index] is not table:
            self._tables[index] = table
            given: dict[str, Any] = {
                "setpoints": table.rows.ctypes.data,
                "n_setpoints": len(table.rows),
                "torques": table.torques.ctypes.data,
            }
            if table.path is not None:
                spacing_m, xs, ys, *headings = PathSearch(table.path).line
                given |= {"spacing_m": spacing_m, "headings_rad": headings}
                given |= {"path_x_m": (xs.ctypes.data, xs.size), "path_y_m": (ys.ctypes.data, ys.size)}
            for name, value in given.items():
                self.cars[name][index] = value
        self.cars["first"][index] = first

    def drive(self, call: Callable[[NDArray[Any]], None] | None = None) -> dict[int, SimulationDiverged]:
        """Drive each car for the number of steps in `left`.

        Args:
            call: The native call for all cars; by default in this thread.

        Returns:
            Number of each car that has diverged -> its error.
        """
        cars, failed = self.cars, {}
        while True:
            if call is None:
                native_loop.drive_cars(cars, 0, len(cars), native_loop.STEP_ADDRESS)
            else:
                call(cars)
            stopped = np.flatnonzero(cars["status"]).tolist() if len(cars) > 1 else [0] if cars["status"][0] else []
            if not stopped:
                return failed
            for index in stopped:
                try:
                    if cars["status"][index] == INSANE:
                        self._loops[index].vehicle.check()
                    else:
                        self._prepare(index)
                except SimulationDiverged as error:
                    failed[index] = error
                    cars["left"][index] = 0

    def _prepare(self, index: int) -> None:
        """Compute the gains of a driver for the present speed."""
        driver: Any = self._loops[index].driver
        speed_mps = float(self.motions[index, _SPEED])
        self.cars["driver"]["_path"]["_row_size"][index] = driver.prepare(speed_mps)

    def _torques_of(self, index: int, step: int) -> WheelTorques | None:
        table = self._tables[index]
        if table is None or not len(table.torques):
            return None
        row = table.torques[min(step - int(self.cars["first"][index]), len(table.rows) - 1)].tolist()
        drive, brake = map(tuple, row)
        return WheelTorques(drive, brake)


def _numbers(command: ActuatorCommand) -> Array:
    """Return the numbers of a command and of its estimate, shape (`N_HELD`,); nan without an estimate."""
    estimate = command.estimate or [math.nan] * (N_HELD - N_STEERING)
    return np.array([*command[:N_STEERING], *estimate])


def _command(numbers: Array) -> ActuatorCommand:
    """Return a command from its numbers; see `_numbers`."""
    row = numbers.tolist()
    estimate = Estimate(*row[N_STEERING:]) if len(row) > N_STEERING and not math.isnan(row[N_STEERING]) else None
    rear, front, desired, prediction, correction, saturated = row[:N_STEERING]
    return steering(rear, front, desired, prediction, correction, bool(saturated), estimate)
