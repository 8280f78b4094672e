"""The car without active steering, watched by an estimator: nothing is asked for, what is estimated is recorded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from activesteer.controllers.parameters import ControllerSetup
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement

if TYPE_CHECKING:
    from activesteer.estimation.estimator import Estimator


class Observer:
    """No additional steer angles; speed, sideslip, yaw rate and friction as an estimator sees them."""

    reads = ("estimator",)

    def __init__(self, estimator: Estimator) -> None:
        """Takes the estimator."""
        self._estimator = estimator

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> Observer:
        """Makes the controller for a car; raises as `ControllerSetup.estimator` does."""
        return cls(setup.estimator())

    def step(self, _command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """No angles; the estimate for the recording."""
        return ActuatorCommand(estimate=self._estimator.step(measurement))
