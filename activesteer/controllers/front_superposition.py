"""Active front steering: an angle from the yaw rate error, added to the driver's angle (Dorsch 2012, section V.B)."""

from __future__ import annotations

from activesteer.controllers.corrector import Corrector, cut_off, decide
from activesteer.controllers.desired_yaw_rate import MIN_SPEED_MPS, DesiredYawRate
from activesteer.controllers.parameters import ControllerSetup, FrontSuperpositionParameters
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, steering
from activesteer.theory.single_track import SingleTrack


class FrontSuperposition:
    """Active front steering (AFS): the corrector of the rear steering with the opposite sign, without prediction."""

    reads = ("afs", "desired_yaw_rate")

    def __init__(self, desired: DesiredYawRate, parameters: FrontSuperpositionParameters, timestep_s: float) -> None:
        """Make the controller of one run.

        Args:
            desired: Desired yaw rate for the driver's own angle.
            parameters: Gains and limit.
            timestep_s: Time between two steps [s].
        """
        self._desired = desired
        self._corrector = Corrector(parameters.corrector, timestep_s)
        self._limit_rad = parameters.limit_rad
        self._saturated = 0

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> FrontSuperposition:
        """Make the controller for a car."""
        desired = DesiredYawRate(SingleTrack(setup.single_track), setup.gains.desired_yaw_rate, setup.timestep_s)
        return cls(desired, setup.gains.afs, setup.timestep_s)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the angle to add at the front wheels."""
        speed = measurement.speed_mps
        desired = self._desired.step(command.front_steer_demand_rad, speed)
        if speed < MIN_SPEED_MPS:
            self._corrector.reset()
            self._saturated = 0
            return steering(0.0, 0.0, desired, 0.0, 0.0, False)
        yaw_rate = measurement.yaw_rate_radps
        feedback = self._corrector.step(desired - yaw_rate, self._saturated)
        correction = decide(yaw_rate, feedback).front * abs(feedback)
        angle, self._saturated = cut_off(correction, self._limit_rad)
        return steering(0.0, angle, desired, 0.0, correction, self._saturated != 0)
