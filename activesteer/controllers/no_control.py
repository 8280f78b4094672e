"""No control; only the desired yaw rate is computed, for comparison."""

from __future__ import annotations

from activesteer.controllers.desired_yaw_rate import DesiredYawRate
from activesteer.controllers.parameters import ControllerSetup
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, steering
from activesteer.theory.single_track import SingleTrack


class NoControl:
    """The car without active steering."""

    reads = ("desired_yaw_rate",)

    def __init__(self, desired: DesiredYawRate) -> None:
        """Take the reference model."""
        self._desired = desired

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> NoControl:
        """Make the controller for a car."""
        single_track = SingleTrack(setup.single_track)
        return cls(DesiredYawRate(single_track, setup.gains.desired_yaw_rate, setup.timestep_s))

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return no angles; the desired yaw rate is recorded."""
        desired = self._desired.step(command.front_steer_demand_rad, measurement.speed_mps)
        return steering(0.0, 0.0, desired, 0.0, 0.0, False)
