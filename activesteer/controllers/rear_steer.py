"""Active rear steering: the paper's law, and the same with a sideslip term.

    delta_H = prediction - correction(desired - actual yaw rate) - k beta

The paper (Dorsch 2012, Fig. 8) has the first two terms. The rear axle has the force C_H (delta_H - beta + l_H r / v),
so the third term makes it stiffer against sideslip by the fraction k. If the car slides outwards (beta < 0 in a left
turn), the rear wheels turn in the direction of the front wheels. Yaw rate, speed and sideslip come from the estimator.
"""

from __future__ import annotations

import math
from types import MappingProxyType

from activesteer.controllers.corrector import (
    MIN_SPEED_MPS,
    Corrector,
    DesiredYawRate,
    corrected,
    cut_off,
    desired_yaw_rate,
    rear_direction,
    reset,
)
from activesteer.controllers.parameters import ControllerSetup, SideslipRearSteerParameters
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement, steering
from activesteer.native.records import NativeBlock
from activesteer.native.shared_laws import law_of, shared
from activesteer.theory.single_track import SingleTrack, rear_prediction


class RearPrediction(NativeBlock):
    """Transfer function G(s) of eq. 5 in the time domain, with coefficients for the current speed.

    State form: T_1 dx/dt = delta_V - x, delta_H = K_H x + K_H T_z dx/dt; exact for an input held between steps.
    """

    _single_track: SingleTrack
    _timestep_s: float
    _state_rad: float

    def __init__(self, single_track: SingleTrack, timestep_s: float) -> None:
        """Store the model.

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
        return predicted(self, front_steer_rad, speed_mps)


@shared
def predicted(block: RearPrediction, front_steer_rad: float, speed_mps: float) -> float:
    """Computation of `RearPrediction.step`: the predicted rear angle."""
    gain, lead_s, lag_s = rear_prediction(block._single_track, speed_mps)
    difference = front_steer_rad - block._state_rad
    angle = gain * block._state_rad + lead_s / lag_s * difference
    block._state_rad += (1.0 - math.exp(-block._timestep_s / lag_s)) * difference
    return angle


class RearSteer(NativeBlock):
    """Active rear steering (ARS): prediction minus correction, limited.

    Lag and rate limit belong to the actuator, in the vehicle.
    """

    reads = ("ars", "desired_yaw_rate")
    rates_radps = MappingProxyType({"rear": math.radians(13.0)})
    """Actuator rate for a sine of 0.7 Hz (FMVSS 126) with an amplitude of 3 deg [rad/s]."""
    _desired: DesiredYawRate
    _prediction: RearPrediction
    _corrector: Corrector
    _prediction_gain: float
    _limit_rad: float
    _saturated: int

    def __init__(self, setup: ControllerSetup) -> None:
        """Create the controller of one run."""
        single_track, gains, timestep_s = SingleTrack(setup.single_track), setup.gains, setup.timestep_s
        self._desired = DesiredYawRate(single_track, gains.desired_yaw_rate, timestep_s)
        self._prediction = RearPrediction(single_track, timestep_s)
        self._corrector = Corrector(gains.ars.corrector, timestep_s)
        self._prediction_gain, self._limit_rad = gains.ars.prediction_gain, gains.ars.limit_rad
        self._saturated = 0

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the demanded rear angle and its parts."""
        return steering(rear_steer(self, command, measurement))


@law_of(RearSteer)
def rear_steer(
    block: RearSteer, command: DriverCommand, measurement: Measurement
) -> tuple[float, float, float, float, float, bool]:
    """Return the first fields of an `ActuatorCommand` by the law of `RearSteer.step`."""
    front_steer_rad, speed_mps = command.front_steer_demand_rad, measurement.speed_mps
    desired = desired_yaw_rate(block._desired, front_steer_rad, speed_mps)
    if speed_mps < MIN_SPEED_MPS:
        reset(block._corrector)
        block._saturated = 0
        return 0.0, 0.0, desired, 0.0, 0.0, False
    prediction = block._prediction_gain * predicted(block._prediction, front_steer_rad, speed_mps)
    # The rear wheels turn against the angle of the corrector, so the limit changes its sign too.
    feedback = corrected(block._corrector, desired - measurement.yaw_rate_radps, -block._saturated)
    correction = rear_direction(feedback) * abs(feedback)
    angle, block._saturated = cut_off(prediction + correction, block._limit_rad)
    return angle, 0.0, desired, prediction, correction, block._saturated != 0


class SideslipRearSteer:
    """The paper's rear steering with a sideslip term."""

    interval_s = 0.005
    reads = (*RearSteer.reads, "ars_sideslip", "estimator")
    rates_radps = RearSteer.rates_radps
    gains = SideslipRearSteerParameters

    def __init__(self, setup: ControllerSetup) -> None:
        """Create the controller of one run."""
        self._paper, self._estimator = RearSteer(setup), setup.estimator()
        self._sideslip_gain = setup.gains.ars_sideslip.sideslip_gain
        self._limit_rad = setup.gains.ars.limit_rad

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the demanded rear angle and its parts."""
        now = self._estimator.step(measurement)
        known = measurement._replace(speed_mps=now.speed_mps, yaw_rate_radps=now.yaw_rate_radps)
        result = self._paper.step(command, known)
        if now.speed_mps < MIN_SPEED_MPS:
            return result._replace(estimate=now)
        correction = result.correction_rad - self._sideslip_gain * now.sideslip_rad
        demand = result.prediction_rad + correction
        angle = min(max(demand, -self._limit_rad), self._limit_rad)
        return result._replace(
            rear_steer_demand_rad=angle, correction_rad=correction, saturated=angle != demand, estimate=now
        )
