"""The closed loop: maneuver -> driver -> controller -> vehicle -> recorder, once every millisecond."""

from __future__ import annotations

import copy
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Source
from activesteer.controllers import Controller, find_controller
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.driver import Driver
from activesteer.errors import ManeuverError, ParameterError, shown
from activesteer.faults import Fault, check_faults
from activesteer.maneuver.phases import seen_of
from activesteer.scenario import Scenario
from activesteer.scenario.changing import changed
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, Motion, Setpoint
from activesteer.simulation.control_unit import ControlUnit, control_unit, told_by_sensor
from activesteer.simulation.native_cars import NativeCars, has_law, is_own, law_of, tabulate
from activesteer.simulation.native_loop import STEP_ADDRESS
from activesteer.simulation.recorder import Recorder
from activesteer.simulation.retuning import retuned
from activesteer.vehicle import Uncopyable, engine_warnings_held
from activesteer.vehicle.faults import Faults

_PIECE: Final = 1000
"""Most steps of a native call."""


class LoopState(NamedTuple):
    """State from which a loop continues bit-identically."""

    engine: NDArray[np.float64]
    faults: tuple[Fault, ...]
    fault_memories: list[Any]
    driver: Any
    controller: Any
    measurement: Measurement
    motion: Motion
    commands: tuple[DriverCommand, ActuatorCommand]
    step: int
    changes: tuple[tuple[str, Any, float], ...]
    sequence: Any
    inputs: str


class Given(NamedTuple):
    """A driver or controller that repeats one command."""

    command: Any

    def step(self, *_: Any, **__: Any) -> Any:
        """Return the command."""
        return self.command


class OneAtATime:
    """A context that a second caller cannot enter while the first is inside."""

    def __init__(self) -> None:
        """Make a context that nobody has entered."""
        self._lock = threading.Lock()

    def __enter__(self) -> None:
        """Enter, or refuse.

        Raises:
            ManeuverError: another thread, or the same one further up, is inside.
        """
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
        maneuver: Source of the setpoints.
        sequence: Phases of the manoeuvre in this run; None without phases.
        driver: The driver.
        controller: The active steering, inside a control unit if it needs one.
        vehicle: The car.
        faults: Faults of its actuators and sensors; see `fail`.
        driver_setup: Properties of the car that a driver may know.
        controller_setup: Properties of the car that a controller may know.
        measurement: Present signals of the sensors.
        motion: Present position and motion of the car.
        commands: Last commands of driver and controller.
        step_count: Steps of the manoeuvre driven so far.
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
        self.scenario, self._plugin, self.sequence = scenario, find_controller(controller), None
        self._behind = False  # whether the objects are behind the record, see `_take_over`
        self._start, self.changes = scenario, ()
        self.maneuver = maneuver = scenario.maneuver
        self.vehicle = vehicle = scenario.car.on(maneuver.ground, timestep_s)
        vehicle.limit_hands(scenario.driver.parameters.steering_torque_limit_Nm)
        self.driver_setup = scenario.driver_setup(timestep_s, vehicle.rack_per_steering_wheel_m, vehicle.wheel_radius_m)
        self.driver: Driver = scenario.driver.plugin.make(self.driver_setup)
        self.controller_setup, self.controller = control_unit(self._plugin, scenario, vehicle)
        self.in_use = OneAtATime()
        settling, steps = maneuver.settling_setpoint(), round(maneuver.settle_s / timestep_s)
        self.measurement = vehicle.start(maneuver.speed_mps, -steps * timestep_s)
        self.motion, self.step_count = vehicle.motion(), 0
        self.commands = DriverCommand(front_steer_demand_rad=0.0), ActuatorCommand()
        self.faults, self._fault_list = Faults(vehicle), ()
        self.drive(0 if settled else steps, setpoint_at=lambda _: settling)
        if (estimate := (settled or self).commands[1].estimate) is not None:
            vehicle.record_estimate(estimate)
        vehicle.rebase()
        self.fail(maneuver.fault)
        self.sequence = maneuver.sequence()
        self.measurement = self.measurement._replace(time_s=0.0)
        self.motion, self.step_count = vehicle.motion(), 0
        if settled:
            self.restore_state(settled)

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

    def change(self, key: str, value: Any) -> None:
        """Change a key of the manoeuvre, its road, the controller or the driver, from the next step on.

        A controller or driver keeps its memory, see `activesteer.simulation.retuning`.

        Raises:
            ParameterError: there is no such key, it cannot change during a run, or nothing reads it.
            ManeuverError: a value of the manoeuvre is wrong.
        """
        time_s = self.step_count * self.vehicle.timestep_s
        part, after = changed(self.scenario, key, value, self._plugin, time_s)
        if part == "controller":
            _, old = control_unit(self._plugin, self.scenario, self.vehicle)
            self.controller_setup, new = control_unit(self._plugin, after, self.vehicle)
            self.controller = retuned(self.controller, old, new)
        elif part == "driver":
            make, who = after.driver.plugin.make, after.driver
            old, self.driver_setup = (
                make(self.driver_setup), replace(self.driver_setup, parameters=who.parameters, own=who.own)
            )  # fmt: skip
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
        """Drive the manoeuvre to its end; see `advance`."""
        self.advance(self.steps - self.step_count, recorder)

    def advance(
        self,
        steps: int,
        recorder: Recorder | None = None,
        *,
        driver: Driver | None = None,
        controller: Controller | None = None,
    ) -> None:
        """Drive some steps.

        Args:
            steps: Number of steps.
            recorder: Recorder of every step.
            driver: Driver of these steps; by default the loop's own.
            controller: Controller of these steps; by default the loop's own.

        Raises:
            ControllerError: the controller failed.
            DriverError: the driver failed.
            ManeuverError: the loop is already being driven.
            SimulationDiverged: the state became non-finite, or the engine raised a warning.
        """
        with self.in_use:
            self.drive(steps, recorder, driver, controller)

    def drive(
        self,
        steps: int,
        recorder: Recorder | None = None,
        driver: Driver | None = None,
        controller: Controller | None = None,
        setpoint_at: Callable[[float], Setpoint] | None = None,
    ) -> None:
        """Drive some steps inside `in_use`, with the manoeuvre's setpoints by default; see `advance`."""
        vehicle, timestep_s = self.vehicle, self.vehicle.timestep_s
        driving: Driver = driver or self.driver
        steering: Controller = controller or self.controller
        sequence: Any = self.sequence if setpoint_at is None else None

        def of_phase(time_s: float) -> Setpoint:
            truth = measurement if vehicle.sensors is None else vehicle.truth()[0]
            return sequence.setpoint(time_s, seen_of(truth, motion, vehicle.roll_rate_radps))

        setpoint_at = setpoint_at or (self.maneuver.setpoint if sequence is None else of_phase)
        vehicle.follow_model()
        with engine_warnings_held():
            vehicle.record_on(None if recorder is None else recorder.tape)
            try:
                end = self.step_count + steps
                while self.step_count < end:
                    self.faults.act(self.step_count)
                    stretch = range(self.step_count, min(end, self.faults.next_change(self.step_count)))
                    unit = steering
                    if self.faults.angle_fails:
                        unit = told_by_sensor(steering, vehicle.parameters.steering.ratio)
                    native = unit is self.controller and driving is self.driver and sequence is None
                    for block in _pieces(stretch) if recorder is None else recorder.blocks(stretch):
                        if native and self._drive_natively(block, setpoint_at):
                            continue
                        self._take_over()
                        driver_command, actuator_command = self.commands
                        measurement, motion = self.measurement, self.motion
                        for step in block:
                            setpoint = setpoint_at(step * timestep_s)
                            driver_command = driving.step(setpoint, measurement, motion)
                            actuator_command = unit.step(driver_command, measurement)
                            measurement, motion = vehicle.step(driver_command, actuator_command)
                        self.step_count, self.commands = block.stop, (driver_command, actuator_command)
                        self.measurement, self.motion = measurement, motion
                    self._take_over()
            finally:
                self._take_over()
                vehicle.record_on(None)

    @cached_property
    def _native(self) -> NativeCars:
        return NativeCars([self])

    def _take_over(self) -> None:
        """Bring driver, controller and loop up to date after native calls."""
        if self._behind:
            self._native.store(0)
            self._behind = False

    def _drive_natively(self, block: range, setpoint_at: Callable[[float], Setpoint]) -> bool:
        """Drive a block of steps in one native call; see `native_loop`.

        Returns:
            False, and nothing is driven, if driver, controller or setpoints have no native form.
        """
        if not (STEP_ADDRESS and is_own(self.vehicle) and has_law(self.driver) and law_of(self.controller)):
            return False
        timestep_s, native = self.vehicle.timestep_s, self._native
        setpoints = [setpoint_at(step * timestep_s) for step in block]
        table = tabulate(setpoints, self.driver_setup.rack_per_steering_wheel_m)
        if table is None:
            return False
        if not self._behind:
            native.load(0)
            self._behind = True
        native.follow(0, table, block.start)
        native.cars["left"] = len(block)
        for error in native.drive().values():
            raise error
        return True

    def save_state(self) -> LoopState:
        """Return the state from which the loop continues bit-identically."""
        return LoopState(
            self.vehicle.save_state(),
            self._fault_list,
            self.faults.save_state(),
            copy.deepcopy(self.driver),
            copy.deepcopy(self.controller),
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
        if not isinstance(state, LoopState) or not _is_sound(state):
            raise ParameterError(f"is {shown(state)}; a state of this loop is needed", key="state", value=state)
        if state.inputs != self._start.digest:
            raise ParameterError("was saved by a simulation with other inputs", key="state")
        if state.changes != self.changes:
            self._adopt(self._changed_by(state.changes))
            self.changes, who = state.changes, self.scenario.driver
            self.driver_setup = replace(self.driver_setup, parameters=who.parameters, own=who.own)
            self.controller_setup, _ = control_unit(self._plugin, self.scenario, self.vehicle)
        if state.faults != self._fault_list:
            self.fail(state.faults)
        self.vehicle.restore_state(state.engine)
        self.faults.restore_state(state.fault_memories)
        self.driver, self.controller = copy.deepcopy(state.driver), copy.deepcopy(state.controller)
        if isinstance(self.controller, ControlUnit):
            self.controller.read_truth_of(self.vehicle)
        self.measurement, self.motion = state.measurement, state.motion
        self.commands, self.step_count = state.commands, state.step
        self.sequence = copy.deepcopy(state.sequence)


def _pieces(stretch: range) -> Iterator[range]:
    """Divide steps into pieces whose setpoints need little memory."""
    for first in range(0, len(stretch), _PIECE):
        yield stretch[first : first + _PIECE]


def _is_sound(state: LoopState) -> bool:
    """Return whether the parts of a state have the right types; the vehicle checks its own part."""
    commands = state.commands if isinstance(state.commands, tuple) else ()
    return (
        isinstance(state.faults, tuple)
        and all(isinstance(fault, Fault) for fault in state.faults)
        and isinstance(state.fault_memories, list)
        and all(callable(getattr(block, "step", None)) for block in (state.driver, state.controller))
        and isinstance(state.measurement, Measurement)
        and isinstance(state.motion, Motion)
        and [type(command) for command in commands] == [DriverCommand, ActuatorCommand]
        and isinstance(state.step, int)
        and isinstance(state.changes, tuple)
        and all(isinstance(change, tuple) and len(change) == 3 for change in state.changes)
    )
