"""The simulation: maneuver -> driver -> controller -> vehicle -> recorder, once every millisecond."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.controllers import Controller, find_controller
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.driver import Driver, find_driver
from activesteer.scenario import Scenario
from activesteer.signals import Measurement, Motion, Reference
from activesteer.simulation.recorder import Recorder
from activesteer.vehicle import engine_warnings_held


class SavedState(NamedTuple):
    """Everything that a simulation continues from."""

    engine: NDArray[np.float64]
    driver: Any
    controller: Any
    measurement: Measurement
    motion: Motion
    step: int


class Simulation:
    """A manoeuvre, a driver, a controller and a car.

    Attributes:
        maneuver: What is asked of the driver.
        driver: Who drives.
        controller: The active steering.
        vehicle: The car.
    """

    def __init__(
        self,
        scenario: Scenario,
        controller: Any = "none",
        timestep_s: float = DEFAULT_TIMESTEP_S,
        *,
        driver: Any = "standard",
    ) -> None:
        """Builds the blocks and lets the car settle at the speed of the manoeuvre, at the origin of the road.

        Args:
            scenario: Manoeuvre and car.
            controller: The controller; see `activesteer.plugins.find`.
            timestep_s: Step of engine, driver and controller [s].
            driver: The driver, likewise.

        Raises:
            ModelError: the car cannot be built.
            ControllerError: the controller cannot be made, or returns nonsense while the car settles.
            DriverError: the driver, likewise.
            SimulationDiverged: the car does not settle.
        """
        self.maneuver = maneuver = scenario.maneuver
        self.vehicle = vehicle = scenario.car.on(maneuver.road, timestep_s)
        setup = scenario.driver_setup(timestep_s, vehicle.rack_per_steering_wheel_m, vehicle.wheel_radius_m)
        self.driver: Driver = find_driver(driver).make(setup)
        self.controller: Controller = find_controller(controller).make(scenario.controller_setup(timestep_s))
        settling, steps = maneuver.settling_reference(), round(maneuver.settle_s / timestep_s)
        self._measurement = vehicle.start(maneuver.speed_mps, -steps * timestep_s)
        self._motion, self._step = vehicle.motion(), 0
        self._advance(lambda _: settling, steps, None)
        vehicle.rebase()
        self._measurement = self._measurement._replace(time_s=0.0)
        self._motion, self._step = vehicle.motion(), 0

    @property
    def steps(self) -> int:
        """Number of steps of the manoeuvre."""
        return round(self.maneuver.duration_s / self.vehicle.timestep_s)

    def run(self, recorder: Recorder | None = None) -> None:
        """Drives the manoeuvre to its end.

        Args:
            recorder: Where every step is recorded.

        Raises:
            ControllerError: the controller returned nonsense.
            DriverError: the driver did.
            SimulationDiverged: the state became non-finite, or the engine raised a warning.
        """
        self.advance(self.steps - self._step, recorder)

    def advance(self, steps: int, recorder: Recorder | None = None) -> None:
        """Drives on for some steps; see `run`."""
        self._advance(self.maneuver.reference, steps, recorder)

    def _advance(self, reference_at: Callable[[float], Reference], steps: int, recorder: Recorder | None) -> None:
        driver, controller, vehicle = self.driver, self.controller, self.vehicle
        timestep_s, measurement, motion = vehicle.timestep_s, self._measurement, self._motion
        with engine_warnings_held():
            for step in range(self._step, self._step + steps):
                reference = reference_at(step * timestep_s)
                command = driver.step(reference, measurement, motion)
                steer = controller.step(command, measurement)
                measurement, motion = vehicle.step(command, steer, recorder.row_address if recorder else 0)
                if recorder is not None:
                    recorder.record(command, steer)
        self._step, self._measurement, self._motion = self._step + steps, measurement, motion
        vehicle.check()

    def save_state(self) -> SavedState:
        """Everything that the simulation continues from."""
        return SavedState(
            self.vehicle.save_state(),
            copy.deepcopy(self.driver),
            copy.deepcopy(self.controller),
            self._measurement,
            self._motion,
            self._step,
        )

    def restore_state(self, state: SavedState) -> None:
        """Goes back to a saved state; what follows is bit-identical to what followed then."""
        self.vehicle.restore_state(state.engine)
        self.driver, self.controller = copy.deepcopy(state.driver), copy.deepcopy(state.controller)
        self._measurement, self._motion, self._step = state.measurement, state.motion, state.step
