"""The estimator of a car's motion, called at the rate of the controller that it serves."""

from __future__ import annotations

import numpy as np

from activesteer.estimation.parameters import EstimatorParameters
from activesteer.estimation.setup import EstimatorSetup
from activesteer.signals import Estimate, Measurement
from activesteer.theory.single_track import SingleTrack

_LOWEST_MPS = 2.0
"""Below this speed the sideslip angle is taken for zero [m/s]."""


class Estimator:
    """Speed, sideslip, yaw rate and friction from what the sensors say."""

    def __init__(self, setup: EstimatorSetup, parameters: EstimatorParameters, timestep_s: float) -> None:
        """Makes the estimator of one run.

        Args:
            setup: What it knows of the car and its sensors.
            parameters: How far it trusts its model.
            timestep_s: Time between two steps [s].
        """
        self._setup, self._parameters, self._timestep_s = setup, parameters, timestep_s
        self._model = SingleTrack(setup.single_track)
        self._sideslip_rad = 0.0

    def step(self, measurement: Measurement) -> Estimate:
        """What the car does now.

        Args:
            measurement: What the car's sensors say.
        """
        setup, speed_mps, yaw_rate_radps = self._setup, measurement.speed_mps, measurement.yaw_rate_radps
        if speed_mps < _LOWEST_MPS:
            self._sideslip_rad = 0.0
        else:
            a, b = self._model.matrices(speed_mps)
            front_rad = measurement.steering_wheel_rad / setup.steering_ratio + measurement.superposition_rad
            inputs = np.array([front_rad, measurement.rear_steer_rad])
            rate_radps = a[1] @ np.array([yaw_rate_radps, self._sideslip_rad]) + b[1] @ inputs
            self._sideslip_rad += self._timestep_s * float(rate_radps)
        sideslip_rad, parameters = self._sideslip_rad, self._parameters
        return Estimate(
            speed_mps, speed_mps * sideslip_rad, sideslip_rad, yaw_rate_radps, parameters.friction,
            0.01 * speed_mps, 0.02 * speed_mps, 0.02, 0.005, parameters.friction_std,
        )  # fmt: skip
