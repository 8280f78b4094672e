"""The closed loop: maneuver -> driver -> controller -> vehicle -> recorder, once every millisecond."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.controllers import Controller
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.driver import Driver
from activesteer.faults import Fault
from activesteer.scenario import Scenario
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, Motion, Setpoint
from activesteer.simulation.control_unit import control_unit, told_by_sensor
from activesteer.simulation.recorder import Recorder
from activesteer.vehicle import engine_warnings_held
from activesteer.vehicle.faults import Faults


class LoopState(NamedTuple):
    """Everything that a loop continues from."""

    engine: NDArray[np.float64]
    faults: list[Any]
    driver: Any
    controller: Any
    measurement: Measurement
    motion: Motion
    commands: tuple[DriverCommand, ActuatorCommand]
    step: int


class ClosedLoop:
    """A manoeuvre, a driver, a controller and a car.

    Attributes:
        maneuver: What is asked of the driver.
        driver: Who drives.
        controller: The active steering.
        vehicle: The car.
        faults: What goes wrong with its actuators and sensors; see `fail`.
        driver_setup: What a driver may know of the car.
        controller_setup: What a controller may know of it.
        measurement: What the sensors say.
        motion: Where the car is and how it moves.
        commands: What driver and controller last asked for.
        step_count: How many steps of the manoeuvre were made.
    """

    def __init__(
        self,
        scenario: Scenario,
        controller: Any = "none",
        timestep_s: float = DEFAULT_TIMESTEP_S,
    ) -> None:
        """Builds the blocks and lets the car settle at the speed of the manoeuvre, at the origin of the road.

        Args:
            scenario: Manoeuvre, car and driver.
            controller: The controller; see `activesteer.plugins.find`.
            timestep_s: Step of engine, driver and controller [s].

        Raises:
            ModelError: the car cannot be built.
            ControllerError: the controller cannot be made, or returns nonsense while the car settles.
            DriverError: the driver, likewise.
            SimulationDiverged: the car does not settle.
        """
        self.maneuver = maneuver = scenario.maneuver
        self.vehicle = vehicle = scenario.car.on(maneuver.road, timestep_s)
        vehicle.limit_hands(scenario.driver.parameters.steering_torque_limit_Nm)
        self.driver_setup = scenario.driver_setup(timestep_s, vehicle.rack_per_steering_wheel_m, vehicle.wheel_radius_m)
        self.driver: Driver = scenario.driver.plugin.make(self.driver_setup)
        self.controller_setup, self.controller = control_unit(controller, scenario, vehicle)
        settling, steps = maneuver.settling_setpoint(), round(maneuver.settle_s / timestep_s)
        self.measurement = vehicle.start(maneuver.speed_mps, -steps * timestep_s)
        self.motion, self.step_count = vehicle.motion(), 0
        self.commands = DriverCommand(front_steer_demand_rad=0.0), ActuatorCommand()
        self.faults = Faults(vehicle)
        self._advance(lambda _: settling, self.driver, self.controller, steps, None)
        if (estimate := self.commands[1].estimate) is not None:
            vehicle.record_estimate(estimate)
        vehicle.rebase()
        self.fail(maneuver.fault)
        self.measurement = self.measurement._replace(time_s=0.0)
        self.motion, self.step_count = vehicle.motion(), 0

    @property
    def steps(self) -> int:
        """Number of steps of the manoeuvre."""
        return round(self.maneuver.duration_s / self.vehicle.timestep_s)

    def fail(self, faults: Sequence[Fault]) -> None:
        """From now on these faults act, each at its time, and no others.

        Raises:
            ManeuverError: one is of a part that this car does not have.
        """
        self.faults.release()
        self.faults = Faults(self.vehicle, faults)

    def run(self, recorder: Recorder | None = None) -> None:
        """Drives the manoeuvre to its end; see `advance`."""
        self.advance(self.steps - self.step_count, recorder)

    def advance(
        self,
        steps: int,
        recorder: Recorder | None = None,
        *,
        driver: Driver | None = None,
        controller: Controller | None = None,
    ) -> None:
        """Drives on for some steps.

        Args:
            steps: How many.
            recorder: Where every step is recorded.
            driver: Who drives in these steps; the loop's own where not given.
            controller: What steers in them, likewise.

        Raises:
            ControllerError: the controller returned nonsense.
            DriverError: the driver did.
            SimulationDiverged: the state became non-finite, or the engine raised a warning.
        """
        self._advance(self.maneuver.setpoint, driver or self.driver, controller or self.controller, steps, recorder)

    def _advance(
        self,
        setpoint_at: Callable[[float], Setpoint],
        driver: Driver,
        controller: Controller,
        steps: int,
        recorder: Recorder | None,
    ) -> None:
        vehicle, (command, asked) = self.vehicle, self.commands
        timestep_s, measurement, motion = vehicle.timestep_s, self.measurement, self.motion
        tape_address = 0 if recorder is None else recorder.tape_address
        vehicle.follow_model()
        with engine_warnings_held():
            for first, last, step_car, angle_fails in self.faults.stretches(self.step_count, self.step_count + steps):
                stretch = range(first, last)
                unit = told_by_sensor(controller, vehicle.parameters.steering.ratio) if angle_fails else controller
                for block in (stretch,) if recorder is None else recorder.blocks(stretch):
                    for step in block:
                        setpoint = setpoint_at(step * timestep_s)
                        command = driver.step(setpoint, measurement, motion)
                        asked = unit.step(command, measurement)
                        measurement, motion = step_car(command, asked, tape_address)
        self.step_count, self.commands = self.step_count + steps, (command, asked)
        self.measurement, self.motion = measurement, motion

    def save_state(self) -> LoopState:
        """Everything that the loop continues from."""
        return LoopState(
            self.vehicle.save_state(),
            self.faults.save_state(),
            copy.deepcopy(self.driver),
            copy.deepcopy(self.controller),
            self.measurement,
            self.motion,
            self.commands,
            self.step_count,
        )

    def restore_state(self, state: LoopState) -> None:
        """Goes back to a saved state; what follows is bit-identical to what followed then."""
        self.vehicle.restore_state(state.engine)
        self.faults.restore_state(state.faults)
        self.driver, self.controller = copy.deepcopy(state.driver), copy.deepcopy(state.controller)
        self.measurement, self.motion = state.measurement, state.motion
        self.commands, self.step_count = state.commands, state.step
