"""The simulation: every millisecond the data go once round the loop."""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.controllers import Controller, load_controller
from activesteer.controllers.loading import check_command, is_sane
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.driver import LOOK_INTERVAL_S, ConstantRadiusDriver, OpenLoopDriver, PathPreviewDriver, SpeedHold
from activesteer.maneuver import Maneuver
from activesteer.scenario import Scenario
from activesteer.signals import Measurement, Reference, SteerCommand
from activesteer.simulation.recorder import Recorder
from activesteer.theory.single_track import SingleTrack
from activesteer.vehicle import Vehicle, engine_warnings_held

_CHECK_EVERY_STEPS = 100
"""How often the engine is asked for warnings; the speed is looked at in every step."""


class SavedState(NamedTuple):
    """Everything that a simulation continues from."""

    engine: NDArray[np.float64]
    driver: Any
    controller: Any
    measurement: Measurement
    step: int


class Simulation:
    """A manoeuvre, a driver, a controller and a car.

    Attributes:
        maneuver: What is asked of the driver.
        driver: Who drives.
        controller: The active steering.
        vehicle: The car.
    """

    def __init__(self, scenario: Scenario, controller: str = "none", timestep_s: float = DEFAULT_TIMESTEP_S) -> None:
        """Builds the blocks and lets the car settle at the speed of the manoeuvre, at the origin of the road.

        Args:
            scenario: Manoeuvre and car.
            controller: Name or file of the controller.
            timestep_s: Step of engine, driver and controller [s].

        Raises:
            ModelError: the car cannot be built.
            ControllerError: the controller cannot be made, or returns nonsense while the car settles.
            SimulationDiverged: the car does not settle.
        """
        car = scenario.car
        self.maneuver = scenario.maneuver
        self.vehicle = Vehicle(scenario.mjcf, car, scenario.tyres, scenario.maneuver.road, timestep_s)
        self.driver = _driver(scenario, timestep_s, self.vehicle.rack_per_steering_wheel_m)
        self.controller: Controller = load_controller(controller, scenario.controller_setup(timestep_s))
        self._controller_name = controller
        self._measurement = self.vehicle.start(self.maneuver.speed_mps)
        self._step = 0
        settling = _Settling(self.maneuver)
        self._advance(settling, round(self.maneuver.settle_s / timestep_s), None)
        self.vehicle.rebase()
        self._step = 0

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
            SimulationDiverged: the state became non-finite, or the engine raised a warning.
        """
        self.advance(self.steps - self._step, recorder)

    def advance(self, steps: int, recorder: Recorder | None = None) -> None:
        """Drives on for some steps; see `run`."""
        self._advance(self.maneuver, steps, recorder)

    def _advance(self, maneuver: Maneuver | _Settling, steps: int, recorder: Recorder | None) -> None:
        driver, controller, vehicle = self.driver, self.controller, self.vehicle
        timestep_s, measurement = vehicle.timestep_s, self._measurement
        # While the car settles there is no path yet: the one of the manoeuvre begins where the recording does.
        eyes = driver if isinstance(driver, PathPreviewDriver) and maneuver.course is not None else None
        look_every = max(1, round(LOOK_INTERVAL_S / timestep_s))
        with engine_warnings_held():
            for step in range(self._step, self._step + steps):
                reference = maneuver.reference(step * timestep_s)
                if eyes is not None and step % look_every == 0:
                    eyes.look(vehicle.motion())
                command = driver.step(reference, measurement)
                steer = controller.step(command, measurement)
                if steer.__class__ is not SteerCommand or not is_sane(steer):
                    check_command(steer, self._controller_name)
                vehicle.step(command, steer)
                if recorder is not None:
                    recorder.record(command, steer)
                measurement = vehicle.measure()
                if step % _CHECK_EVERY_STEPS == 0:
                    vehicle.check()
        self._step, self._measurement = self._step + steps, measurement
        vehicle.check()

    def save_state(self) -> SavedState:
        """Everything that the simulation continues from."""
        return SavedState(
            self.vehicle.save_state(),
            copy.deepcopy(self.driver),
            copy.deepcopy(self.controller),
            self._measurement,
            self._step,
        )

    def restore_state(self, state: SavedState) -> None:
        """Goes back to a saved state; what follows is bit-identical to what followed then."""
        self.vehicle.restore_state(state.engine)
        self.driver, self.controller = copy.deepcopy(state.driver), copy.deepcopy(state.controller)
        self._measurement, self._step = state.measurement, state.step


def _driver(
    scenario: Scenario, timestep_s: float, rack_per_steering_wheel_m: float | None
) -> OpenLoopDriver | ConstantRadiusDriver | PathPreviewDriver:
    """Who can do what the manoeuvre asks: a robot, one who keeps a curvature, or one who looks at a path."""
    maneuver, car = scenario.maneuver, scenario.car
    torque = car.powertrain
    speed_hold = SpeedHold(car.driver, torque.max_torque_Nm, torque.engine_brake_torque_Nm, timestep_s)
    steering = car.steering
    robot = OpenLoopDriver(speed_hold, steering.ratio, steering.steering_wheel_limit_rad, rack_per_steering_wheel_m)
    single_track = SingleTrack(car.single_track)
    if maneuver.course is not None:
        return PathPreviewDriver(robot, maneuver.course.path, single_track.matrices, car.driver, timestep_s)
    if maneuver.settling_reference().curvature_1pm is not None:
        return ConstantRadiusDriver(robot, single_track.wheelbase_m, timestep_s)
    return robot


class _Settling:
    """Stands in for the manoeuvre before it starts."""

    course = None

    def __init__(self, maneuver: Maneuver) -> None:
        self._reference = maneuver.settling_reference()

    def reference(self, _time_s: float) -> Reference:
        return self._reference
