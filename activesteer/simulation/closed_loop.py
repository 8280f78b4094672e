"""Closed loop of one car: blocks, record, work in Python between native steps, and changes.

While a car is driven, the state of native blocks and of the controller's bus is in its record.
"""

from __future__ import annotations

import copy
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Source
from activesteer.config.faults import Fault, check_faults, fault_from
from activesteer.controllers import controller_spec
from activesteer.core.conventions import DEFAULT_TIMESTEP_S, Array
from activesteer.core.signals import (
    NO_TORQUES,
    ActuatorCommand,
    DriverCommand,
    Estimate,
    Measurement,
    Motion,
    Setpoint,
    WheelTorques,
    message_of,
    nested_fields,
    new_message,
    numbers_in,
)
from activesteer.core.version import __version__
from activesteer.driver.human import HumanDriver, SetpointTable, SharedTables, setpoint_row, tabulate
from activesteer.errors import ManeuverError, ParameterError, SimulationDiverged, shown
from activesteer.maneuver import Maneuver
from activesteer.maneuver.phases import seen_of
from activesteer.native.memory import N_COMMAND, N_HELD, law_address
from activesteer.native.records import Uncopyable, record_type, take, values
from activesteer.plugins.retuned import retuned
from activesteer.road.native_path import PathSearch
from activesteer.scenario import Scenario
from activesteer.scenario.scenario import changed
from activesteer.simulation import native_loop as native
from activesteer.simulation.recorder import Recorder
from activesteer.simulation.sampled_controller import control_unit
from activesteer.vehicle import engine_warnings_held
from activesteer.vehicle.car import check_gear
from activesteer.vehicle.faults import Faults
from activesteer.vehicle.step_bindings import torque_numbers, write_command

Given = tuple[DriverCommand | None, ActuatorCommand | None]
"""Commands that replace driver and controller."""
_NOTHING_GIVEN: Final[Given] = (None, None)
_NEVER: Final = 2**62
_TIME: Final = Measurement._fields.index("time_s")
_SPEED: Final = Motion._fields.index("speed_mps")
_STATE: Final = (*native.MESSAGES, "step", "torques_set", "torques_Nm", "controller_given", "calls", "held")
"""Fields of a car's record that belong to its state."""


class NonReentrantLock:
    """A context that rejects a second caller."""

    def __init__(self) -> None:
        """Create an unlocked context."""
        self._lock = threading.Lock()

    def __enter__(self) -> None:
        """Acquire the lock, or raise an error if another caller holds it."""
        if not self._lock.acquire(False):
            raise ManeuverError(
                "this simulation is already being driven, by another thread or by the caller of its own block; use a "
                "copy of it (Simulation.copy) for each thread"
            )

    def __exit__(self, *_: object) -> None:
        """Release the lock."""
        self._lock.release()


@dataclass(frozen=True)
class LoopState:
    """Saved state of a loop for a bit-identical continuation, with the inputs of compatible loops."""

    inputs: tuple[Any, ...]
    engine: NDArray[np.float64]
    faults: tuple[Fault, ...]
    fault_memories: list[Array]
    blocks: tuple[Any, Any]
    numbers: dict[str, NDArray[Any]]
    bus: Array
    changes: tuple[tuple[str, Any, float], ...]
    sequence: Any


class ClosedLoop(Uncopyable):
    """Closed loop of a manoeuvre, a driver, a controller and a car.

    Attributes:
        scenario: Manoeuvre, car and driver, with the changes made during the run.
        changes: Keys changed during the run and their values, and the times of the changes [s].
        sequence: Phases of the manoeuvre in this run; None without phases.
        blocks: Driver and controller; a native one is behind its record while it is driven, see `driver`.
        unit: How the loop calls the controller.
        vehicle: The car.
        faults: Faults of its actuators and sensors; see `fail`.
        driver_setup: Properties of the car that a driver may know.
        controller_setup: Properties of the car that a controller may know.
        settling: Setpoint while the car settles.
        in_use: Context that rejects a second caller while the loop is driven.
    """

    def __init__(
        self,
        scenario: Scenario,
        controller: Any = "none",
        timestep_s: float = DEFAULT_TIMESTEP_S,
        *,
        settled: LoopState | None = None,
    ) -> None:
        """Build the blocks and let the car settle at the speed of the manoeuvre, at the origin of the road.

        Args:
            scenario: Manoeuvre, car and driver.
            controller: The controller; see `activesteer.plugins.find`.
            timestep_s: Step of engine, driver and controller [s].
            settled: State of a loop with the same inputs, to start from instead of settling.

        Raises:
            ModelError: the car cannot be built.
            ControllerError: the controller cannot be created, or fails while the car settles.
            DriverError: the driver cannot be created, or fails while the car settles.
            SimulationDiverged: the car does not settle.
        """
        self.scenario, self._plugin, self.sequence = scenario, controller_spec(controller), None
        self._start, self.changes, self._ended = scenario, (), False
        self._inputs = scenario.digest, self._plugin.name, timestep_s, __version__
        self._maneuver = maneuver = scenario.maneuver
        self.vehicle = vehicle = scenario.car.on(maneuver.ground, timestep_s)
        vehicle.limit_hands(scenario.driver.parameters.steering_torque_limit_Nm)
        self.driver_setup = scenario.driver_setup(timestep_s, vehicle.rack_per_steering_wheel_m, vehicle.wheel_radius_m)
        driver = scenario.driver.plugin.make(self.driver_setup)
        self.controller_setup, self.unit, block = control_unit(self._plugin, scenario, vehicle)
        self.blocks: tuple[Any, Any] = driver, block
        self._recorder: Recorder | None = None
        self.in_use = NonReentrantLock()
        self._table: SetpointTable | None = None
        self._block: NDArray[Any] | None = None
        self._record = np.zeros(1, native.CAR)
        self.join(self._record, 0, SharedTables())
        self._connect()
        steps = round(maneuver.settle_s / timestep_s)
        measurement = vehicle.start(maneuver.speed_mps, -steps * timestep_s, placed=True)
        drive: Any = self.driver_setup.drive  # the vehicle's own
        first = {
            "bindings": vehicle.address, "drive_fractions": drive.fractions, "drive_numbers": drive.numbers,
            "driver_command": numbers_in(DriverCommand(front_steer_demand_rad=0.0)),
            "measurement": numbers_in(measurement), "motion": vehicle.motion(),
        }  # fmt: skip
        for name, value in first.items():
            self._record[name] = value
        self.faults, self._fault_list = Faults(vehicle), ()
        self.settling: Setpoint | None = maneuver.settling_setpoint()
        self.drive(0 if settled else steps)
        self.settling = None
        self._store()
        bus, calls = (self._bus, self._record["calls"]) if settled is None else (settled.bus, settled.numbers["calls"])
        arrived = _arrived(bus, calls)
        if arrived[-1]:
            vehicle.record_estimate(Estimate(*arrived[N_COMMAND:-1].tolist()))
        vehicle.rebase()
        self.fail(maneuver.fault)
        self.sequence = maneuver.sequence()
        self._record["measurement"][0, _TIME] = 0.0
        self._record["motion"], self._record["step"] = vehicle.motion(), 0
        if settled:
            self.restore_state(settled)

    def join(self, records: NDArray[Any], place: int, tables: SharedTables) -> None:
        """Move the record of the car into the records of a batch, whose cars share tables."""
        records[place] = self._record[0]
        self._record = record = records[place : place + 1]
        self._tables = tables
        # Views and addresses of what Python uses in every step.
        self._step, self._stage, self._torques_set, self._ratio = (
            record[name] for name in ("step", "stage", "torques_set", "steering_ratio")
        )
        self._held, self._seen = record["held"][0], record["seen"][0]
        self._driver_numbers, self._measured, self._motion = (
            record[name].view(np.dtype(nested_fields(native.MESSAGES[name])))[:, 0]
            for name in ("driver_command", "measurement", "motion")
        )
        self._driver_at, self._actuator_at, self._held_at = (
            record[name].ctypes.data for name in ("driver_command", "actuator_command", "held")
        )

    def _connect(self) -> None:
        """Connect a new controller to an empty bus."""
        record, unit = self._record, self.unit
        self._bus = np.zeros((unit.delay + 1, N_HELD))
        record["bus"]["address"], record["bus"]["size"] = self._bus.ctypes.data, self._bus.size
        record["every"], record["on_bus"] = unit.every, unit.delay
        record["calls"] = record["held"] = record["loaded"] = 0

    @property
    def driver(self) -> Any:
        """Driver of the loop. You may replace it from the next step on."""
        self._store()
        return self.blocks[0]

    @driver.setter
    def driver(self, driver: Any) -> None:
        self._store()
        self.blocks = driver, self.blocks[1]

    @property
    def controller(self) -> Any:
        """Controller of the loop. You may replace it from the next step on. The control unit stays."""
        self._store()
        return self.blocks[1]

    @controller.setter
    def controller(self, controller: Any) -> None:
        self._store()
        self.blocks = self.blocks[0], controller

    def replace_controller(self, controller: Any) -> None:
        """Replace the controller by another controller with a new control unit (see `activesteer.plugins.find`).

        Raises:
            ControllerError: there is no such controller, or it cannot be created.
        """
        self._plugin = controller_spec(controller)
        self.controller_setup, self.unit, self.controller = control_unit(self._plugin, self.scenario, self.vehicle)
        self._connect()

    @property
    def maneuver(self) -> Maneuver:
        """Manoeuvre that gives the setpoints."""
        return self._maneuver

    @maneuver.setter
    def maneuver(self, maneuver: Maneuver) -> None:
        self._store()
        self._maneuver = maneuver

    def _setpoint_at(self, step: int) -> Setpoint:
        """Return the setpoint of a step."""
        if self.settling is not None:
            return self.settling
        time_s = step * self.vehicle.timestep_s
        if self.sequence is None:
            return self._maneuver.setpoint(time_s)
        truth = self.measurement if self.vehicle.sensors is None else self.vehicle.truth()[0]
        return self.sequence.setpoint(time_s, seen_of(truth, self.motion, self.vehicle.roll_rate_radps))

    @property
    def measurement(self) -> Measurement:
        """Current signals of the sensors."""
        return new_message(Measurement, self._measured.item(0))

    @property
    def motion(self) -> Motion:
        """Current position and motion of the car."""
        return new_message(Motion, self._motion.item(0))

    @property
    def commands(self) -> tuple[DriverCommand, ActuatorCommand]:
        """Last commands of driver and controller."""
        command = message_of(ActuatorCommand, self._record["actuator_command"][0].tolist())
        arrived = _arrived(self._bus, self._record["calls"])
        if arrived[-1] and not self._record["controller_given"][0]:
            command = command._replace(estimate=Estimate(*arrived[N_COMMAND:-1].tolist()))
        return self._driver_command(self._driver_numbers.item(0)), command

    @property
    def step_count(self) -> int:
        """Steps of the manoeuvre driven so far."""
        return self._step.item(0)

    @property
    def steps(self) -> int:
        """Number of steps of the manoeuvre, or up to `end`."""
        return self.step_count if self._ended else round(self.maneuver.duration_s / self.vehicle.timestep_s)

    def end(self) -> None:
        """End the run at the current step, before the end of the manoeuvre."""
        self._ended = True

    def fail(self, faults: Sequence[Fault], *, more: bool = False) -> None:
        """Replace the faults by other faults, with their own times.

        Args:
            faults: The faults.
            more: Whether to keep the current faults, with their memory.

        Raises:
            ManeuverError: a fault concerns a part that this car does not have, or that has a fault at this time.
        """
        before = self.faults if more else None
        if before is not None:
            faults = (*self._fault_list, *faults)
            check_faults(faults, self.maneuver.duration_s, Source("", error=ManeuverError).fail)
        self.faults.release()
        self.faults, self._fault_list = Faults(self.vehicle, faults), tuple(faults)
        if before is not None:
            self.faults.take_memory_of(before)
        self._store()

    def add_fault(self, fault: str | Fault) -> str:
        """Set a fault in addition to the active faults, and return it in words (see `Simulation.fail`)."""
        now_s = self.step_count * self.vehicle.timestep_s
        given = fault_from(fault, now_s)
        self.fail([given], more=True)
        return given.name_at(now_s)

    def change(self, key: str, value: Any) -> None:
        """Change a key of the manoeuvre, its road, the controller or the driver, from the next step on.

        A controller or driver keeps its memory, see `activesteer.plugins.retuned`.

        Raises:
            ParameterError: there is no such key, it cannot change during a run, or nothing reads it.
            ManeuverError: a value of the manoeuvre is wrong.
        """
        time_s = self.step_count * self.vehicle.timestep_s
        part, after = changed(self.scenario, key, value, self._plugin, time_s)
        if part:
            old, new = (self._new_block(part, scenario) for scenario in (self.scenario, after))
            setattr(self, part, retuned(getattr(self, part), old, new))
        self._adopt(after)
        self.changes = (*self.changes, (key, value, time_s))

    def _new_block(self, part: str, scenario: Scenario) -> Any:
        """Create the driver or the controller of a scenario, and record the properties of the car that it knows."""
        if part == "controller":
            self.controller_setup, _, block = control_unit(self._plugin, scenario, self.vehicle)
            return block
        who = scenario.driver
        setup = replace(self.driver_setup, parameters=who.parameters, user_parameters=who.user_parameters)
        block = who.plugin.make(setup)
        self.driver_setup = setup
        return block

    def _adopt(self, scenario: Scenario) -> None:
        """Adopt a changed scenario, except driver and controller."""
        if scenario.maneuver is not self.scenario.maneuver:
            self.vehicle.change_road(scenario.maneuver.ground)
        self.scenario, self.maneuver = scenario, scenario.maneuver
        if self.sequence is not None:
            self.sequence.maneuver = scenario.maneuver
        self.vehicle.limit_hands(scenario.driver.parameters.steering_torque_limit_Nm)

    def run(self, recorder: Recorder | None = None) -> None:
        """Drive the manoeuvre to its end (see `advance`)."""
        self.advance(self.steps - self.step_count, recorder)

    def advance(self, steps: int, recorder: Recorder | None = None, given: Given = _NOTHING_GIVEN) -> None:
        """Drive a number of steps.

        Args:
            steps: Number of steps.
            recorder: Recorder of every step.
            given: Commands that replace driver and controller in all of these steps, or None.

        Raises:
            ControllerError: the controller failed.
            DriverError: the driver failed.
            ManeuverError: the loop is already being driven.
            SimulationDiverged: the state became non-finite, or the engine raised a warning.
        """
        with self.in_use:
            self.drive(steps, recorder, given)

    def drive(self, steps: int, recorder: Recorder | None = None, given: Given = _NOTHING_GIVEN) -> None:
        """Drive a number of steps, with the loop locked (see `advance`)."""
        vehicle, record = self.vehicle, self._record
        driver_command, actuator_command = given
        if driver_command is not None:
            self._give_driver_command(driver_command)
        if actuator_command is not None:
            self._give_actuator_command(actuator_command)
        record["left"] = steps
        if steps:
            record["driver_given"] = driver_command is not None
            record["controller_given"] = actuator_command is not None
        self._recorder = recorder
        vehicle.follow_model()
        with engine_warnings_held():
            vehicle.record_on(None if recorder is None else recorder.tape)
            try:
                failed = drive_together([self], record)
            finally:
                vehicle.record_on(None)
                self._recorder = None
        if failed:
            raise failed[0]
        if recorder is not None:
            recorder.make_room()

    def save_state(self) -> LoopState:
        """Return the state for a bit-identical continuation of the loop."""
        self._store()
        return LoopState(
            self._inputs,
            self.vehicle.save_state(),
            self._fault_list,
            self.faults.save_state(),
            (copy.deepcopy(self.blocks[0]), copy.deepcopy(self.blocks[1])),
            {name: self._record[name].copy() for name in _STATE},
            self._bus.copy(),
            self.changes,
            copy.deepcopy(self.sequence),
        )

    def restore_state(self, state: LoopState) -> None:
        """Go back to a saved state for a bit-identical continuation of the loop.

        Args:
            state: A state of this loop, or of another one with the same inputs.

        Raises:
            ParameterError: `state` is something else.
        """
        if not isinstance(state, LoopState):
            raise ParameterError(f"is {shown(state)}; a state of this loop is needed", key="state", value=state)
        if state.inputs != self._inputs:
            raise ParameterError("was saved by a simulation with other inputs", key="state")
        self._ended = False
        if state.changes != self.changes:
            scenario = self._start
            for key, value, time_s in state.changes:
                _, scenario = changed(scenario, key, value, self._plugin, time_s)
            for part in ("driver", "controller"):
                self._new_block(part, scenario)
            self._adopt(scenario)
            self.changes = state.changes
        if state.faults != self._fault_list:
            self.fail(state.faults)
        self.vehicle.restore_state(state.engine)
        self.faults.restore_state(state.fault_memories)
        self._store()
        self.blocks = copy.deepcopy(state.blocks[0]), copy.deepcopy(state.blocks[1])
        for name, value in state.numbers.items():
            self._record[name] = value
        self._stage[0], self._bus[:] = native.DRIVE, state.bus
        self.sequence = copy.deepcopy(state.sequence)

    def _load(self) -> None:
        """Copy driver and controller into the record."""
        record, vehicle, (driver, controller) = self._record, self.vehicle, self.blocks
        vehicle.follow_model()
        record["driver_kind"] = record["controller_kind"] = native.PYTHON
        if type(driver) is HumanDriver and not driver.is_watched:
            record["driver_kind"], record["driver"][0] = native.NATIVE, values(driver)
        if not self.unit.uses_truth and (law := law_address(controller)):
            self._block = np.array([values(controller)], record_type(type(controller)))
            record["controller_kind"], record["law"] = native.NATIVE, law
            record["block"] = self._block.ctypes.data
        estimate = vehicle.rows.estimate
        record["estimate"] = estimate.ctypes.data if estimate.size else 0
        # Faults that act are found again before the next step, and setpoints are looked up.
        record["next_change"], record["last"], self._table = self._step, 0, None
        record["loaded"] = 1

    def _store(self) -> None:
        """Copy the record back into driver and controller, which may be changed before the next step."""
        record = self._record
        if record["loaded"][0]:
            record["loaded"] = 0
            if record["driver_kind"][0] == native.NATIVE:
                take(self.blocks[0], record["driver"][0].item())
            if self._block is not None and record["controller_kind"][0] == native.NATIVE:
                take(self.blocks[1], self._block[0].item())

    def _give_driver_command(self, command: Any) -> None:
        write_command(DriverCommand, self._driver_at, command)
        torques = command.wheel_torques
        self._torques_set[0] = torques is not None
        if torques is None:
            check_gear(command.gear)
        else:
            self._record["torques_Nm"] = torque_numbers(torques)

    def _give_actuator_command(self, command: Any) -> None:
        """Send the car a command that takes effect immediately."""
        write_command(ActuatorCommand, self._actuator_at, command)
        self._check_driven(command)
        if command.estimate is not None:
            self.vehicle.note_estimate(command.estimate)

    def _check_driven(self, command: ActuatorCommand) -> None:
        if command.wheel_torque_demand_Nm is not NO_TORQUES:
            self.vehicle.wheels.check_driven(command.wheel_torque_demand_Nm)

    def _driver_command(self, numbers: Sequence[float]) -> DriverCommand:
        angle, drive, pedal, saturated, gear, front, parking = numbers
        torques = None
        if self._torques_set.item(0):
            every = self._record["torques_Nm"][0].tolist()
            torques = WheelTorques(tuple(every[:4]), tuple(every[4:]))
        return new_message(DriverCommand, (angle, drive, pedal, saturated != 0.0, torques, int(gear), front, parking))

    def _change_faults(self) -> None:
        """Start and end the faults of a step."""
        step = self.step_count
        self.faults.act(step)
        ratio = self.unit.steering_ratio
        if self.faults.angle_fails and not self.unit.uses_truth:
            ratio = self.vehicle.parameters.steering.ratio
        self._record["next_change"], self._record["steering_ratio"] = self.faults.next_change(step), ratio

    def _make_room(self) -> None:
        if self._recorder is not None:
            self._recorder.make_room()

    def _tabulate(self) -> None:
        """Give the driver the setpoints of the next steps."""
        step, rack = self.step_count, self.driver_setup.rack_per_steering_wheel_m
        if self.settling is not None:
            table, first = tabulate([self.settling], rack)._replace(steps=_NEVER), 0
        elif self.sequence is None:
            table, first = self._tables.of(self.maneuver, step, rack, self.vehicle.timestep_s)
        else:
            setpoint, table = self._setpoint_at(step), self._table
            if table is not None and table.path is setpoint.path and len(table.rows) == 1:
                table.rows[0] = setpoint_row(setpoint, rack)
                self._record["first"], self._record["last"] = step, step + 1
                return
            table, first = tabulate([setpoint], rack), step
        self._follow(table, first)

    def _follow(self, table: SetpointTable, first: int) -> None:
        record = self._record
        record["setpoints"], record["n_setpoints"] = table.rows.ctypes.data, len(table.rows)
        record["first"], record["last"] = first, first + table.steps
        before, self._table = self._table, table
        if table.path is not None and (before is None or before.path is not table.path):
            spacing_m, xs, ys, *headings = PathSearch(table.path).line
            record["path"][0] = spacing_m, (xs.ctypes.data, xs.size), (ys.ctypes.data, ys.size), headings

    def _prepare(self) -> None:
        """Compute the gains of the driver for the current speed."""
        speed_mps = float(self._record["motion"][0, _SPEED])
        self._record["driver"]["_path"]["_row_size"] = self.blocks[0].prepare(speed_mps)

    def _ask_driver(self) -> None:
        """Call a driver in Python."""
        setpoint = self._setpoint_at(self._step.item(0))
        self._give_driver_command(self.blocks[0].step(setpoint, self.measurement, self.motion))
        self._stage[0] = native.CONTROL

    def _ask_controller(self) -> None:
        """Call a controller in Python, and hold its command."""
        controller = self.blocks[1]
        told = self._driver_numbers.item(0) if self._ratio.item(0) == 0.0 else self._seen.tolist()
        driver_command = self._driver_command(told)
        if self.unit.uses_truth:
            command = controller.step(driver_command, *self.vehicle.truth())
        else:
            command = controller.step(driver_command, self.measurement)
        write_command(ActuatorCommand, self._held_at, command)
        self._check_driven(command)
        if command.estimate is not None:
            self._held[N_COMMAND:-1], self._held[-1] = command.estimate, 1.0
        elif self._held.item(-1):
            self._held[-1] = 0.0
        self._stage[0] = native.PASS_ON


_ACTS: Final[dict[int, Callable[[ClosedLoop], None]]] = {
    native.NEEDS_BLOCKS: ClosedLoop._load,
    native.AT_CHANGE: ClosedLoop._change_faults,
    native.TAPE_FULL: ClosedLoop._make_room,
    native.NEEDS_SETPOINTS: ClosedLoop._tabulate,
    native.NEEDS_GAINS: ClosedLoop._prepare,
    native.NEEDS_DRIVER: ClosedLoop._ask_driver,
    native.NEEDS_CONTROLLER: ClosedLoop._ask_controller,
    native.INSANE: lambda loop: loop.vehicle.check(),
}


def _arrived(bus: Array, calls: Any) -> Array:
    """Return the command that a bus delivers after some calls."""
    return bus[int(calls[0]) % len(bus)]


def _drive_all(records: NDArray[Any]) -> None:
    native.drive_cars(records, 0, len(records), native.STEP_ADDRESS)


def drive_together(
    loops: Sequence[ClosedLoop], records: NDArray[Any], call: Callable[[NDArray[Any]], None] = _drive_all
) -> dict[int, SimulationDiverged]:
    """Drive each car for the steps in `left`, execute Python blocks at each stop, and return the diverged cars."""
    failed, status, several = {}, records["status"], len(records) > 1
    while True:
        call(records)
        # One car stops in every step of a block in Python, and numpy's search takes as long as the block.
        stopped = np.flatnonzero(status).tolist() if several else [0] if status.item(0) else []
        if not stopped:
            return failed
        for index in stopped:
            try:
                _ACTS[status.item(index)](loops[index])
            except SimulationDiverged as error:
                failed[index] = error
                records["left"][index] = 0
