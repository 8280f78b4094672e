"""Active rear steering with a sideslip term, the next step according to the paper (Dorsch 2012).

    delta_H = prediction - correction(desired - actual yaw rate) - k beta

The paper has the first two terms. The rear axle has the force C_H (delta_H - beta + l_H r / v), so the third
term makes it stiffer against sideslip by the fraction k. If the car slides outwards (beta < 0 in a left turn), the rear
wheels turn in the direction of the front wheels. Yaw rate, speed and sideslip come from the estimator.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from activesteer.controllers.corrector import MIN_SPEED_MPS
from activesteer.controllers.parameters import ControllerSetup, SideslipRearSteerParameters
from activesteer.controllers.rear_steer import RearSteer
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement

if TYPE_CHECKING:
    from activesteer.estimation.estimator import Estimator


class SideslipRearSteer:
    """The paper's rear steering with a sideslip term."""

    interval_s = 0.005
    reads = (*RearSteer.reads, "ars_sideslip", "estimator")
    rates_radps = RearSteer.rates_radps
    gains = SideslipRearSteerParameters

    def __init__(self, paper: RearSteer, estimator: Estimator, sideslip_gain: float, limit_rad: float) -> None:
        """Make the controller of one run.

        Args:
            paper: Prediction and correction.
            estimator: Estimator of yaw rate, speed and sideslip.
            sideslip_gain: k [rad/rad].
            limit_rad: Largest rear angle demanded [rad].
        """
        self._paper, self._estimator = paper, estimator
        self._sideslip_gain, self._limit_rad = sideslip_gain, limit_rad

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> SideslipRearSteer:
        """Make the controller for a car."""
        gains = setup.gains
        return cls(
            RearSteer.from_vehicle(setup), setup.estimator(), gains.ars_sideslip.sideslip_gain, gains.ars.limit_rad
        )

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
