"""Cars with their loops: the records that `native_loop` drives, and what Python does where it stops."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.controllers.native_laws import N_COMMAND, N_HELD, law_address
from activesteer.conventions import Array
from activesteer.driver.human import HumanDriver, SetpointTable, setpoint_row, tabulate
from activesteer.errors import SimulationDiverged
from activesteer.native_records import record_type, take, values
from activesteer.road.native_path import PathSearch
from activesteer.signals import (
    NO_TORQUES,
    ActuatorCommand,
    DriverCommand,
    Estimate,
    Measurement,
    Motion,
    WheelTorques,
    message_of,
    nested_fields,
    new_message,
    numbers_of,
)
from activesteer.simulation.native_loop import (
    AT_CHANGE,
    CAR,
    CONTROL,
    DRIVE,
    GIVEN,
    INSANE,
    NATIVE,
    NEEDS_CONTROLLER,
    NEEDS_DRIVER,
    NEEDS_GAINS,
    NEEDS_SETPOINTS,
    PASS_ON,
    PYTHON,
    STEP_ADDRESS,
    TAPE_FULL,
    drive_cars,
)
from activesteer.vehicle.car import check_gear
from activesteer.vehicle.step_bindings import torque_numbers, write_command

_WINDOW: Final = 250
"""Steps whose setpoints are tabulated at a time."""
_MAX_TABLES: Final = 64
"""Tables that are kept for cars that share a manoeuvre."""
_NEVER: Final = 2**62
_SPEED: Final = Motion._fields.index("speed_mps")
_ROWS: Final[dict[str, type[Any]]] = {
    "driver_command": DriverCommand, "actuator_command": ActuatorCommand, "measurement": Measurement, "motion": Motion,
}  # fmt: skip
"""Field of `CAR` with the address of the numbers of a message -> the message."""


class NativeCars:
    """The loops of some cars with the same step, driven together.

    While they are driven, the state of drivers, controllers and buses is in the records. `load` brings it there from
    the objects, `store` brings it back.

    Attributes:
        cars: Records of `CAR`.
        rows: Kind of message -> its numbers, shape (n, numbers): last commands, present measurements and motions.
        buses: Decisions on the bus of each controller, shape (delay + 1, `N_HELD`).
    """

    def __init__(self, loops: Sequence[Any]) -> None:
        """Bind cars that stand before their first step."""
        self._loops, count = loops, len(loops)
        self.cars = np.zeros(count, CAR)
        self.rows: dict[type[Any], Array] = {}
        for name, kind in _ROWS.items():
            self.rows[kind] = row = np.zeros((count, len(numbers_of(kind))))
            self.cars[name] = row.ctypes.data + row.strides[0] * np.arange(count)
        self.buses: list[Array] = [np.zeros((0, N_HELD))] * count
        self._blocks: list[Any] = [None] * count
        self._tables: list[SetpointTable | None] = [None] * count
        self._shared: dict[tuple[int, int, float | None], tuple[Any, SetpointTable]] = {}
        self._loaded = np.zeros(count, dtype=bool)
        self._driver_kinds, self._controller_kinds = np.full(count, PYTHON), np.full(count, PYTHON)
        # Views and addresses of what Python uses in every step.
        self._status, self._step, self._stage, self._last, self._first, self._ratio, self._set = (
            self.cars[name] for name in ("status", "step", "stage", "last", "first", "steering_ratio", "torques_set")
        )
        self._held, self._seen = self.cars["held"], self.cars["seen"]
        self._held_at = [self._held[index : index + 1].ctypes.data for index in range(count)]
        self._driver_at, self._actuator_at = (
            self.cars[name].tolist() for name in ("driver_command", "actuator_command")
        )
        self._driver_rows, self._measured, self._motions = (
            self.rows[kind].view(np.dtype(nested_fields(kind)))[:, 0] for kind in (DriverCommand, Measurement, Motion)
        )
        self._acts: dict[int, Callable[[int], None]] = {
            AT_CHANGE: self._change_faults,
            TAPE_FULL: self._make_room,
            NEEDS_SETPOINTS: self._tabulate,
            NEEDS_GAINS: self._prepare,
            NEEDS_DRIVER: self._ask_driver,
            NEEDS_CONTROLLER: self._ask_controller,
            INSANE: self._check,
        }
        for index, loop in enumerate(loops):
            drive: Any = loop.driver_setup.drive  # the vehicle's own
            self.cars["drive_fractions"][index], self.cars["drive_numbers"][index] = drive.fractions, drive.numbers
            self.cars["bindings"][index] = loop.vehicle.address
            self.connect(index)

    def connect(self, index: int) -> None:
        """Connect a new controller of a car with its bus, on which nothing is yet."""
        unit = self._loops[index].unit
        self.buses[index] = bus = np.zeros((unit.delay + 1, N_HELD))
        self.cars["bus"][index] = bus.ctypes.data, bus.size
        self.cars["every"][index], self.cars["on_bus"][index] = unit.every, unit.delay
        self.cars["calls"][index], self._held[index] = 0, 0.0
        self._loaded[index] = False

    def adopt(self, index: int, other: NativeCars, place: int) -> None:
        """Take over a car from other records, with all its state."""
        own = {name: int(self.cars[name][index]) for name in _ROWS}
        self.cars[index] = other.cars[place]
        for name, address in own.items():
            self.cars[name][index] = address
        for kind, row in self.rows.items():
            row[index] = other.rows[kind][place]
        for name in ("buses", "_blocks", "_tables", "_loaded", "_driver_kinds", "_controller_kinds"):
            getattr(self, name)[index] = getattr(other, name)[place]

    def load(self, index: int) -> None:
        """Copy driver and controller of a car into its record."""
        loop, cars = self._loops[index], self.cars
        loop.vehicle.follow_model()
        driver, controller = loop.blocks
        self._driver_kinds[index] = self._controller_kinds[index] = PYTHON
        if type(driver) is HumanDriver and not driver.is_watched:
            self._driver_kinds[index] = NATIVE
            cars["driver"][index] = values(driver)
        if not loop.unit.uses_truth and (law := law_address(controller)):
            self._controller_kinds[index] = NATIVE
            self._blocks[index] = block = np.array([values(controller)], record_type(type(controller)))
            cars["law"][index], cars["block"][index] = law, block.ctypes.data
        estimate = loop.vehicle.rows.estimate
        cars["estimate"][index] = estimate.ctypes.data if estimate.size else 0
        # Faults that act are found again before the next step, and setpoints are looked up.
        cars["next_change"][index], cars["last"][index], self._tables[index] = self._step[index], 0, None
        self._stage[index] = DRIVE
        self._loaded[index] = True

    def store(self, index: int) -> None:
        """Copy the record of a car back into its driver and controller, which may be changed before the next step."""
        if self._loaded[index]:
            self._loaded[index] = False
            loop = self._loops[index]
            if self._driver_kinds[index] == NATIVE:
                take(loop.blocks[0], self.cars["driver"][index].item())
            if self._controller_kinds[index] == NATIVE:
                take(loop.blocks[1], self._blocks[index][0].item())

    def drive(
        self,
        left: NDArray[np.intp],
        *,
        drivers_given: bool = False,
        controllers_given: bool = False,
        call: Callable[[NDArray[Any]], None] | None = None,
    ) -> dict[int, SimulationDiverged]:
        """Drive each car for a number of steps."""
        cars, failed, moving = self.cars, {}, left > 0
        for index in np.flatnonzero(moving & ~self._loaded).tolist():
            self.load(index)
        cars["driver_kind"][moving] = GIVEN if drivers_given else self._driver_kinds[moving]
        cars["controller_kind"][moving] = GIVEN if controllers_given else self._controller_kinds[moving]
        cars["left"] = left
        stopped = [0]
        while stopped:
            if call is None:
                drive_cars(cars, 0, len(cars), STEP_ADDRESS)
            else:
                call(cars)
            # One car stops in every step of a block in Python, and numpy's search takes as long as the block.
            stopped = np.flatnonzero(self._status).tolist() if len(cars) > 1 else [0] if self._status.item(0) else []
            for index in stopped:
                try:
                    self._acts[self._status.item(index)](index)
                except SimulationDiverged as error:
                    failed[index] = error
                    cars["left"][index] = 0
        return failed

    def measurement(self, index: int) -> Measurement:
        """Return the present measurement of a car."""
        return new_message(Measurement, self._measured.item(index))

    def motion(self, index: int) -> Motion:
        """Return the present motion of a car."""
        return new_message(Motion, self._motions.item(index))

    def commands(self, index: int) -> tuple[DriverCommand, ActuatorCommand]:
        """Return the last commands of driver and controller."""
        driver = self._driver_command(index, self._driver_rows.item(index))
        command = message_of(ActuatorCommand, self.rows[ActuatorCommand][index].tolist())
        arrived = self.buses[index][int(self.cars["calls"][index]) % len(self.buses[index])]
        if self.cars["controller_kind"][index] != GIVEN and arrived[-1]:
            command = command._replace(estimate=Estimate(*arrived[N_COMMAND:-1].tolist()))
        return driver, command

    def give_driver_command(self, index: int, command: Any) -> None:
        """Let a car have a command of its driver."""
        write_command(DriverCommand, self._driver_at[index], command)
        torques = command.wheel_torques
        self._set[index] = torques is not None
        if torques is None:
            check_gear(command.gear)
        else:
            self.cars["torques_Nm"][index] = torque_numbers(torques)

    def give_actuator_command(self, index: int, command: Any) -> None:
        """Let a car have a command that reaches its actuators at once."""
        write_command(ActuatorCommand, self._actuator_at[index], command)
        self._check_driven(index, command)
        if command.estimate is not None:
            self._loops[index].vehicle.note_estimate(command.estimate)

    def _check_driven(self, index: int, command: ActuatorCommand) -> None:
        if command.wheel_torque_demand_Nm is not NO_TORQUES:
            self._loops[index].vehicle.wheels.check_driven(command.wheel_torque_demand_Nm)

    def _driver_command(self, index: int, numbers: Sequence[float]) -> DriverCommand:
        angle, drive, pedal, saturated, gear, front, parking = numbers
        torques = None
        if self._set.item(index):
            every = self.cars["torques_Nm"][index].tolist()
            torques = WheelTorques(tuple(every[:4]), tuple(every[4:]))
        return new_message(DriverCommand, (angle, drive, pedal, saturated != 0.0, torques, int(gear), front, parking))

    def _change_faults(self, index: int) -> None:
        """Let the faults of a step begin and end."""
        loop, step = self._loops[index], int(self._step[index])
        loop.faults.act(step)
        self.cars["next_change"][index] = loop.faults.next_change(step)
        ratio = loop.unit.steering_ratio
        if loop.faults.angle_fails and not loop.unit.uses_truth:
            ratio = loop.vehicle.parameters.steering.ratio
        self.cars["steering_ratio"][index] = ratio

    def _make_room(self, index: int) -> None:
        self._loops[index].recorder.make_room()

    def _tabulate(self, index: int) -> None:
        """Give the driver of a car the setpoints of its next steps."""
        loop, step = self._loops[index], self._step.item(index)
        rack = loop.driver_setup.rack_per_steering_wheel_m
        if loop.settling is not None:
            table, first = tabulate([loop.settling], rack)._replace(steps=_NEVER), 0
        elif not loop.foresees:
            setpoint, table = loop.setpoint_at(step), self._tables[index]
            if table is None or table.path is not setpoint.path or len(table.rows) > 1:
                self._follow(index, tabulate([setpoint], rack), step)
            else:
                table.rows[0] = setpoint_row(setpoint, rack)
                self._first[index], self._last[index] = step, step + 1
            return
        else:
            first = step // _WINDOW * _WINDOW
            key = id(loop.maneuver), first, rack
            maneuver, table = self._shared.get(key, (None, None))
            if table is None or maneuver is not loop.maneuver:
                while len(self._shared) >= _MAX_TABLES:
                    del self._shared[next(iter(self._shared))]
                table = self._tabulated(loop, first, rack)
                self._shared[key] = loop.maneuver, table
            if step >= first + table.steps:  # the path changes on the way
                table, first = self._tabulated(loop, step, rack), step
        self._follow(index, table, first)

    def _tabulated(self, loop: Any, first: int, rack_m: float | None) -> SetpointTable:
        return tabulate([loop.setpoint_at(first + place) for place in range(_WINDOW)], rack_m)

    def _follow(self, index: int, table: SetpointTable, first: int) -> None:
        given: dict[str, Any] = {
            "setpoints": table.rows.ctypes.data, "n_setpoints": len(table.rows), "first": first,
            "last": first + table.steps,
        }  # fmt: skip
        for name, value in given.items():
            self.cars[name][index] = value
        before, self._tables[index] = self._tables[index], table
        if table.path is not None and (before is None or before.path is not table.path):
            spacing_m, xs, ys, *headings = PathSearch(table.path).line
            line = spacing_m, (xs.ctypes.data, xs.size), (ys.ctypes.data, ys.size), headings
            self.cars["path"][index] = line

    def _prepare(self, index: int) -> None:
        """Compute the gains of a driver for the present speed."""
        driver: Any = self._loops[index].blocks[0]
        speed_mps = float(self.rows[Motion][index, _SPEED])
        self.cars["driver"]["_path"]["_row_size"][index] = driver.prepare(speed_mps)

    def _ask_driver(self, index: int) -> None:
        """Call a driver in Python."""
        loop = self._loops[index]
        setpoint = loop.setpoint_at(self._step.item(index))
        self.give_driver_command(index, loop.blocks[0].step(setpoint, self.measurement(index), self.motion(index)))
        self._stage[index] = CONTROL

    def _ask_controller(self, index: int) -> None:
        """Call a controller in Python, and hold its decision."""
        loop = self._loops[index]
        told = self._driver_rows.item(index) if self._ratio.item(index) == 0.0 else self._seen[index].tolist()
        driver_command = self._driver_command(index, told)
        if loop.unit.uses_truth:
            command = loop.blocks[1].step(driver_command, *loop.vehicle.truth())
        else:
            command = loop.blocks[1].step(driver_command, self.measurement(index))
        write_command(ActuatorCommand, self._held_at[index], command)
        self._check_driven(index, command)
        if command.estimate is not None:
            self._held[index, N_COMMAND:-1], self._held[index, -1] = command.estimate, 1.0
        elif self._held.item(index, -1):
            self._held[index, -1] = 0.0
        self._stage[index] = PASS_ON

    def _check(self, index: int) -> None:
        self._loops[index].vehicle.check()
