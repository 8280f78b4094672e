"""Active rear steering: a predicted angle for zero sideslip, corrected by the yaw rate error (Dorsch 2012, Fig. 8)."""

from __future__ import annotations

import math

from activesteer.controllers.corrector import Corrector, cut_off, decide
from activesteer.controllers.desired_yaw_rate import MIN_SPEED_MPS, DesiredYawRate
from activesteer.controllers.parameters import ControllerSetup, RearSteerParameters
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, steering
from activesteer.theory.single_track import SingleTrack


class RearPrediction:
    """The transfer function G(s) of eq. 5 in the time domain, with coefficients of the present speed.

    State form: T_1 dx/dt = delta_V - x, delta_H = K_H x + K_H T_z dx/dt; exact for an input held between steps.
    """

    def __init__(self, single_track: SingleTrack, timestep_s: float) -> None:
        """Take the model.

        Args:
            single_track: Model for the coefficients.
            timestep_s: Time between two steps [s].
        """
        self._single_track = single_track
        self._timestep_s = timestep_s
        self._state_rad = 0.0

    def step(self, front_steer_rad: float, speed_mps: float) -> float:
        """Return the predicted rear angle, left positive [rad].

        Args:
            front_steer_rad: The driver's demand at the road wheel [rad].
            speed_mps: Speed > 0 [m/s].
        """
        gain, lead_s, lag_s = self._single_track.rear_prediction(speed_mps)
        difference = front_steer_rad - self._state_rad
        angle = gain * self._state_rad + lead_s / lag_s * difference
        self._state_rad += (1.0 - math.exp(-self._timestep_s / lag_s)) * difference
        return angle


class RearSteer:
    """Active rear steering (ARS): prediction less correction, limited.

    Lag and rate limit belong to the actuator, in the vehicle.
    """

    reads = ("ars", "desired_yaw_rate")

    def __init__(
        self,
        desired: DesiredYawRate,
        prediction: RearPrediction,
        parameters: RearSteerParameters,
        timestep_s: float,
    ) -> None:
        """Make the controller of one run.

        Args:
            desired: Desired yaw rate.
            prediction: Feedforward.
            parameters: Gains and limit.
            timestep_s: Time between two steps [s].
        """
        self._desired = desired
        self._prediction = prediction
        self._corrector = Corrector(parameters.corrector, timestep_s)
        self._prediction_gain = parameters.prediction_gain
        self._limit_rad = parameters.limit_rad
        self._saturated = 0

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> RearSteer:
        """Make the controller for a car."""
        single_track = SingleTrack(setup.single_track)
        return cls(
            DesiredYawRate(single_track, setup.gains.desired_yaw_rate, setup.timestep_s),
            RearPrediction(single_track, setup.timestep_s),
            setup.gains.ars,
            setup.timestep_s,
        )

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the demanded rear angle and its parts."""
        front_steer, speed = command.front_steer_demand_rad, measurement.speed_mps
        desired = self._desired.step(front_steer, speed)
        if speed < MIN_SPEED_MPS:
            self._corrector.reset()
            self._saturated = 0
            return steering(0.0, 0.0, desired, 0.0, 0.0, False)
        yaw_rate = measurement.yaw_rate_radps
        prediction = self._prediction_gain * self._prediction.step(front_steer, speed)
        # The rear wheels turn against the angle of the corrector, so the limit changes its sign too.
        feedback = self._corrector.step(desired - yaw_rate, -self._saturated)
        correction = decide(yaw_rate, feedback).rear * abs(feedback)
        angle, self._saturated = cut_off(prediction + correction, self._limit_rad)
        return steering(angle, 0.0, desired, prediction, correction, self._saturated != 0)
