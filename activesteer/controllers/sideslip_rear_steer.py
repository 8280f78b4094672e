"""Active rear steering with the sideslip angle in its law, which the paper (Dorsch 2012) names as the next step.

    delta_H = prediction - correction(desired - actual yaw rate) - k beta

The first two parts are the paper's, without change. For the rear axle's force, C_H (delta_H - beta + l_H r / v), the
third makes the axle stiffer against sideslip by the share k: a car that slides outwards (beta < 0 in a left turn) gets
its rear wheels turned with the front ones. Yaw rate, speed and sideslip are the estimator's.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from activesteer.controllers.desired_yaw_rate import MIN_SPEED_MPS
from activesteer.controllers.file_gains import SideslipRearSteerParameters
from activesteer.controllers.parameters import ControllerSetup
from activesteer.controllers.rear_steer import RearSteer
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement

if TYPE_CHECKING:
    from activesteer.estimation.estimator import Estimator


class SideslipRearSteer:
    """The paper's rear steering less a share of the sideslip angle."""

    interval_s = 0.005
    reads = (*RearSteer.reads, "ars_sideslip", "estimator")
    gains = SideslipRearSteerParameters

    def __init__(self, paper: RearSteer, estimator: Estimator, sideslip_gain: float, limit_rad: float) -> None:
        """Makes the controller of one run.

        Args:
            paper: Prediction and correction.
            estimator: Says yaw rate, speed and sideslip.
            sideslip_gain: k [rad/rad].
            limit_rad: Most rear angle demanded [rad].
        """
        self._paper, self._estimator = paper, estimator
        self._sideslip_gain, self._limit_rad = sideslip_gain, limit_rad

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> SideslipRearSteer:
        """Makes the controller for a car."""
        gains = setup.gains
        return cls(
            RearSteer.from_vehicle(setup), setup.estimator(), gains.ars_sideslip.sideslip_gain, gains.ars.limit_rad
        )

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Rear angle now.

        Args:
            command: What the driver does.
            measurement: What the car's sensors say.
        """
        now = self._estimator.step(measurement)
        known = measurement._replace(speed_mps=now.speed_mps, yaw_rate_radps=now.yaw_rate_radps)
        asked = self._paper.step(command, known)
        if now.speed_mps < MIN_SPEED_MPS:
            return asked._replace(estimate=now)
        correction = asked.correction_rad - self._sideslip_gain * now.sideslip_rad
        wanted = asked.prediction_rad + correction
        angle = min(max(wanted, -self._limit_rad), self._limit_rad)
        return asked._replace(
            rear_steer_demand_rad=angle, correction_rad=correction, saturated=angle != wanted, estimate=now
        )
