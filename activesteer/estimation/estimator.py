"""The estimator of a car's motion, called at the rate of its controller."""

from __future__ import annotations

import functools
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import Array
from activesteer.core.signals import Estimate, Measurement, new_message
from activesteer.estimation.records import MEMORY, SAID, known_of
from activesteer.estimation.setup import GRID, EstimatorParameters, EstimatorSetup
from activesteer.native.records import NativeBlock

_pack_into = struct.Struct(f"{len(SAID)}d").pack_into


@functools.cache
def _advance() -> Any:
    from activesteer.estimation.advance import advance  # noqa: PLC0415 - compiled code, which lists of controllers do without

    return advance


class Estimator(NativeBlock):
    """Estimator of speed, sideslip, yaw rate and friction from the sensors.

    Examples:
        >>> import activesteer
        >>> class Watching:
        ...     def __init__(self, setup):
        ...         self.estimator = setup.estimator()
        ...
        ...     def step(self, command, measurement):
        ...         estimate = self.estimator.step(measurement)
        ...         angle_rad = -0.2 * estimate.sideslip_rad
        ...         return activesteer.ActuatorCommand(rear_steer_demand_rad=angle_rad, estimate=estimate)
        >>> recording = activesteer.simulate("step_steer", Watching, overrides={"sensors.preset": "production"})
    """

    _known: NDArray[Any]
    _tyres: Array
    _memory: NDArray[Any]
    _line: Array

    def __init__(self, setup: EstimatorSetup, parameters: EstimatorParameters, timestep_s: float) -> None:
        """Create the estimator of one run for a known car, uncertainties of the model and a time between steps [s]."""
        self._known = known_of(setup, parameters, timestep_s)
        self._tyres = np.array([tyre.force_N for tyre in setup.tyres]).reshape(2, *GRID)
        self._memory, self._said = np.zeros(1, MEMORY), np.zeros(len(SAID))
        # One row for each call within the delay of the inertial sensors, and this call.
        self._line = np.zeros((round(float(self._known["age_s"][0]) / timestep_s) + 2, len(SAID)))

    @property
    def innovation(self) -> float:
        """Squared error of the last measured yaw rate and lateral acceleration, divided by its expected covariance."""
        return float(self._memory["innovation"][0])

    @property
    def rate_innovation(self) -> float:
        """Squared error of the last measured yaw rate only, divided by its expected variance."""
        return float(self._memory["rate_innovation"][0])

    def step(self, measurement: Measurement) -> Estimate:
        """Process a measurement, and return the estimate."""
        _, _, yaw_rate, ay, ax, steering_wheel, rear, superposition, spins, pressures = measurement
        _pack_into(self._said.data, 0, yaw_rate, ay, ax, steering_wheel, rear, superposition, *spins, *pressures)
        _advance()(self._known, self._tyres, self._memory, self._said, self._line)
        return new_message(Estimate, self._memory["estimate"][0].tolist())
