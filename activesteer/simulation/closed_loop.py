"""The closed loop of one car: its blocks, its state, and what changes on the way. `native_loop` drives it."""

from __future__ import annotations

import copy
import threading
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Source, build
from activesteer.controllers import controller_spec
from activesteer.controllers.native_laws import N_HELD
from activesteer.conventions import DEFAULT_TIMESTEP_S, Array
from activesteer.driver import Driver
from activesteer.errors import ManeuverError, ParameterError, shown
from activesteer.faults import Fault, check_faults, fault_table
from activesteer.maneuver import Maneuver
from activesteer.maneuver.phases import seen_of
from activesteer.scenario import Scenario
from activesteer.scenario.scenario import changed
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, Motion, Setpoint, numbers_in
from activesteer.simulation.copies import retuned
from activesteer.simulation.native_cars import NativeCars
from activesteer.simulation.native_loop import GIVEN, PYTHON
from activesteer.simulation.recorder import Recorder
from activesteer.simulation.sampled_controller import control_unit
from activesteer.vehicle import Uncopyable, engine_warnings_held
from activesteer.vehicle.faults import Faults

Given = tuple[DriverCommand | None, ActuatorCommand | None]
"""Commands that replace driver and controller."""
_NOTHING_GIVEN: Final[Given] = (None, None)


class LoopState(NamedTuple):
    """State from which a loop continues bit-identically."""

    engine: NDArray[np.float64]
    faults: tuple[Fault, ...]
    fault_memories: list[Array]
    driver: Any
    controller: Any
    calls: int
    held: Array
    bus: Array
    measurement: Measurement
    motion: Motion
    commands: tuple[DriverCommand, ActuatorCommand]
    step: int
    changes: tuple[tuple[str, Any, float], ...]
    sequence: Any
    inputs: str


class NonReentrantLock:
    """A context that a second caller cannot enter while the first is inside."""

    def __init__(self) -> None:
        """Make a context that nobody has entered."""
        self._lock = threading.Lock()

    def __enter__(self) -> None:
        """Enter, or refuse."""
        if not self._lock.acquire(False):
            raise ManeuverError(
                "this simulation is already being driven, by another thread or by the caller of its own block; use a "
                "copy of it (Simulation.copy) for each thread"
            )

    def __exit__(self, *_: object) -> None:
        """Leave."""
        self._lock.release()


class ClosedLoop(Uncopyable):
    """A manoeuvre, a driver, a controller and a car.

    Attributes:
        scenario: Manoeuvre, car and driver, with the changes made on the way.
        changes: Keys changed on the way and their values, and the times of the changes [s].
        sequence: Phases of the manoeuvre in this run; None without phases.
        blocks: Driver and controller; a native one is behind its record while it is driven, see `driver`.
        unit: How the loop calls the controller.
        vehicle: The car.
        faults: Faults of its actuators and sensors; see `fail`.
        driver_setup: Properties of the car that a driver may know.
        controller_setup: Properties of the car that a controller may know.
        settling: Setpoint while the car settles.
        recorder: Recorder of the present steps.
        in_use: Context that refuses a second caller while the loop is driven.
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
        self._start, self.changes = scenario, ()
        self._maneuver = maneuver = scenario.maneuver
        self.vehicle = vehicle = scenario.car.on(maneuver.ground, timestep_s)
        vehicle.limit_hands(scenario.driver.parameters.steering_torque_limit_Nm)
        self.driver_setup = scenario.driver_setup(timestep_s, vehicle.rack_per_steering_wheel_m, vehicle.wheel_radius_m)
        driver: Driver = scenario.driver.plugin.make(self.driver_setup)
        self.controller_setup, self.unit, block = control_unit(self._plugin, scenario, vehicle)
        self.blocks = driver, block
        self.recorder: Recorder | None = None
        self.in_use = NonReentrantLock()
        self._cars, self._car = NativeCars([self]), 0
        steps = round(maneuver.settle_s / timestep_s)
        measurement = vehicle.start(maneuver.speed_mps, -steps * timestep_s)
        self._place(measurement, vehicle.motion(), (DriverCommand(front_steer_demand_rad=0.0), ActuatorCommand()), 0)
        self.faults, self._fault_list = Faults(vehicle), ()
        self.settling: Setpoint | None = maneuver.settling_setpoint()
        self.drive(0 if settled else steps)
        self.settling = None
        commands = self.commands
        if (estimate := (settled.commands if settled else commands)[1].estimate) is not None:
            vehicle.record_estimate(estimate)
        vehicle.rebase()
        self.fail(maneuver.fault)
        self.sequence = maneuver.sequence()
        self._place(self.measurement._replace(time_s=0.0), vehicle.motion(), commands, 0)
        if settled:
            self.restore_state(settled)

    def _place(
        self, measurement: Measurement, motion: Motion, commands: tuple[DriverCommand, ActuatorCommand], step: int
    ) -> None:
        """Set the present signals and the number of steps."""
        self._store()
        cars, car = self._cars, self._car
        cars.rows[Measurement][car], cars.rows[Motion][car] = numbers_in(measurement), motion
        cars.give_driver_command(car, commands[0])
        cars.rows[ActuatorCommand][car] = numbers_in(commands[1])
        cars.cars["step"][car] = step
        cars.cars["controller_kind"][car] = GIVEN if commands[1].estimate is None else PYTHON

    def join(self, cars: NativeCars, car: int) -> None:
        """Become one of several cars that are driven together."""
        cars.adopt(car, self._cars, self._car)
        self._cars, self._car = cars, car

    def _store(self) -> None:
        self._cars.store(self._car)

    @property
    def driver(self) -> Any:
        """The driver. A new one takes over from the next step on."""
        self._store()
        return self.blocks[0]

    @driver.setter
    def driver(self, driver: Any) -> None:
        self._store()
        self.blocks = driver, self.blocks[1]

    @property
    def controller(self) -> Any:
        """The controller. A new one takes over from the next step on, with the control unit of the former one."""
        self._store()
        return self.blocks[1]

    @controller.setter
    def controller(self, controller: Any) -> None:
        self._store()
        self.blocks = self.blocks[0], controller

    def replace_controller(self, controller: Any) -> None:
        """Let another controller take over, with a control unit of its own (see `activesteer.plugins.find`).

        Raises:
            ControllerError: there is no such controller, or it cannot be created.
        """
        self._plugin = controller_spec(controller)
        self.controller_setup, self.unit, self.controller = control_unit(self._plugin, self.scenario, self.vehicle)
        self._cars.connect(self._car)

    @property
    def maneuver(self) -> Maneuver:
        """Source of the setpoints."""
        return self._maneuver

    @maneuver.setter
    def maneuver(self, maneuver: Maneuver) -> None:
        self._store()
        self._maneuver = maneuver

    @property
    def foresees(self) -> bool:
        """True if the next setpoints are known before the car gets there."""
        return self.sequence is None

    def setpoint_at(self, step: int) -> Setpoint:
        """Return the setpoint of a step; with phases, of the present one only."""
        if self.settling is not None:
            return self.settling
        time_s = step * self.vehicle.timestep_s
        if self.sequence is None:
            return self._maneuver.setpoint(time_s)
        truth = self.measurement if self.vehicle.sensors is None else self.vehicle.truth()[0]
        return self.sequence.setpoint(time_s, seen_of(truth, self.motion, self.vehicle.roll_rate_radps))

    @property
    def measurement(self) -> Measurement:
        """Present signals of the sensors."""
        return self._cars.measurement(self._car)

    @property
    def motion(self) -> Motion:
        """Present position and motion of the car."""
        return self._cars.motion(self._car)

    @property
    def commands(self) -> tuple[DriverCommand, ActuatorCommand]:
        """Last commands of driver and controller."""
        return self._cars.commands(self._car)

    @property
    def step_count(self) -> int:
        """Steps of the manoeuvre driven so far."""
        return int(self._cars.cars["step"][self._car])

    @property
    def steps(self) -> int:
        """Number of steps of the manoeuvre."""
        return round(self.maneuver.duration_s / self.vehicle.timestep_s)

    def fail(self, faults: Sequence[Fault], *, more: bool = False) -> None:
        """Replace the faults by these, each of which acts at its time.

        Args:
            faults: The faults.
            more: Whether to keep the present faults, with their memory.

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
        """Set a fault, beside those that act already, and return it in words (see `Simulation.fail`)."""
        now_s = self.step_count * self.vehicle.timestep_s
        if isinstance(fault, str):
            start_s = None if "@" in fault else now_s
            fault = build(Fault, fault_table(fault, start_s), Source("", error=ManeuverError))
        if not isinstance(fault, Fault):
            raise ParameterError(f"is {shown(fault)}; a fault or its text is needed", key="fault", value=fault)
        if fault.start_s < now_s - 1e-9:
            raise ManeuverError(f"is {fault.start_s:g} s; the run is at {now_s:g} s", key="start_s")
        self.fail([fault], more=True)
        later = "" if fault.start_s <= now_s + 1e-9 and fault.end_s is None else f"@{fault.start_s:g}"
        return f"{fault.name}{later}{'' if fault.end_s is None else f'-{fault.end_s:g}'}"

    def change(self, key: str, value: Any) -> None:
        """Change a key of the manoeuvre, its road, the controller or the driver, from the next step on.

        A controller or driver keeps its memory, see `activesteer.simulation.copies`.

        Raises:
            ParameterError: there is no such key, it cannot change during a run, or nothing reads it.
            ManeuverError: a value of the manoeuvre is wrong.
        """
        time_s = self.step_count * self.vehicle.timestep_s
        part, after = changed(self.scenario, key, value, self._plugin, time_s)
        if part == "controller":
            _, _, old = control_unit(self._plugin, self.scenario, self.vehicle)
            self.controller_setup, _, new = control_unit(self._plugin, after, self.vehicle)
            self.controller = retuned(self.controller, old, new)
        elif part == "driver":
            make, who = after.driver.plugin.make, after.driver
            old = make(self.driver_setup)
            self.driver_setup = replace(
                self.driver_setup, parameters=who.parameters, user_parameters=who.user_parameters
            )
            self.driver = retuned(self.driver, old, make(self.driver_setup))
        self._adopt(after)
        self.changes = (*self.changes, (key, value, time_s))

    def _adopt(self, scenario: Scenario) -> None:
        """Take over a changed scenario, apart from the blocks that controller and driver are."""
        if scenario.maneuver is not self.scenario.maneuver:
            self.vehicle.change_road(scenario.maneuver.ground)
        self.scenario, self.maneuver = scenario, scenario.maneuver
        if self.sequence is not None:
            self.sequence.maneuver = scenario.maneuver
        self.vehicle.limit_hands(scenario.driver.parameters.steering_torque_limit_Nm)

    def _changed_by(self, changes: Sequence[tuple[str, Any, float]]) -> Scenario:
        scenario = self._start
        for key, value, time_s in changes:
            scenario = changed(scenario, key, value, self._plugin, time_s).scenario
        return scenario

    def run(self, recorder: Recorder | None = None) -> None:
        """Drive the manoeuvre to its end (see `advance`)."""
        self.advance(self.steps - self.step_count, recorder)

    def advance(self, steps: int, recorder: Recorder | None = None, given: Given = _NOTHING_GIVEN) -> None:
        """Drive some steps.

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
        """Drive some steps inside `in_use` (see `advance`)."""
        vehicle, cars, car = self.vehicle, self._cars, self._car
        driver_command, actuator_command = given
        if driver_command is not None:
            cars.give_driver_command(car, driver_command)
        if actuator_command is not None:
            cars.give_actuator_command(car, actuator_command)
        left = np.zeros(len(cars.cars), dtype=np.intp)
        left[car] = steps
        self.recorder = recorder
        vehicle.follow_model()
        with engine_warnings_held():
            vehicle.record_on(None if recorder is None else recorder.tape)
            try:
                failed = cars.drive(
                    left, drivers_given=driver_command is not None, controllers_given=actuator_command is not None
                )
            finally:
                vehicle.record_on(None)
                self.recorder = None
        for error in failed.values():
            raise error
        if recorder is not None:
            recorder.make_room()

    def save_state(self) -> LoopState:
        """Return the state from which the loop continues bit-identically."""
        driver, controller = self.driver, self.controller
        cars, car = self._cars, self._car
        return LoopState(
            self.vehicle.save_state(),
            self._fault_list,
            self.faults.save_state(),
            copy.deepcopy(driver),
            copy.deepcopy(controller),
            int(cars.cars["calls"][car]),
            cars.cars["held"][car].copy(),
            cars.buses[car].copy(),
            self.measurement,
            self.motion,
            self.commands,
            self.step_count,
            self.changes,
            copy.deepcopy(self.sequence),
            self._start.digest,
        )

    def restore_state(self, state: LoopState) -> None:
        """Go back to a saved state, from which the loop continues bit-identically.

        Args:
            state: A state of this loop, or of another one with the same inputs.

        Raises:
            ParameterError: `state` is something else.
        """
        if not isinstance(state, LoopState) or not _is_sound(state, self._cars.buses[self._car].shape):
            raise ParameterError(f"is {shown(state)}; a state of this loop is needed", key="state", value=state)
        if state.inputs != self._start.digest:
            raise ParameterError("was saved by a simulation with other inputs", key="state")
        if state.changes != self.changes:
            self._adopt(self._changed_by(state.changes))
            self.changes, who = state.changes, self.scenario.driver
            self.driver_setup = replace(
                self.driver_setup, parameters=who.parameters, user_parameters=who.user_parameters
            )
            self.controller_setup, _, _ = control_unit(self._plugin, self.scenario, self.vehicle)
        if state.faults != self._fault_list:
            self.fail(state.faults)
        self.vehicle.restore_state(state.engine)
        self.faults.restore_state(state.fault_memories)
        self.driver, self.controller = copy.deepcopy(state.driver), copy.deepcopy(state.controller)
        cars, car = self._cars, self._car
        cars.cars["calls"][car], cars.cars["held"][car], cars.buses[car][:] = state.calls, state.held, state.bus
        self._place(state.measurement, state.motion, state.commands, state.step)
        self.sequence = copy.deepcopy(state.sequence)


def _is_sound(state: LoopState, bus: tuple[int, ...]) -> bool:
    """Return whether the parts of a state have the right types; the vehicle checks its own part."""
    commands = state.commands if isinstance(state.commands, tuple) else ()
    return (
        isinstance(state.faults, tuple)
        and all(isinstance(fault, Fault) for fault in state.faults)
        and isinstance(state.fault_memories, list)
        and all(callable(getattr(block, "step", None)) for block in (state.driver, state.controller))
        and isinstance(state.calls, int)
        and all(isinstance(part, np.ndarray) for part in (state.held, state.bus))
        and (state.held.shape, state.bus.shape) == ((N_HELD,), bus)
        and isinstance(state.measurement, Measurement)
        and isinstance(state.motion, Motion)
        and [type(command) for command in commands] == [DriverCommand, ActuatorCommand]
        and isinstance(state.step, int)
        and isinstance(state.changes, tuple)
        and all(isinstance(change, tuple) and len(change) == 3 for change in state.changes)
    )
