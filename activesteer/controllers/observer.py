"""The car without active steering but with an estimator, whose estimate is recorded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from activesteer.controllers.parameters import ControllerSetup
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement

if TYPE_CHECKING:
    from activesteer.estimation.estimator import Estimator


class Observer:
    """No control; an estimator records speed, sideslip, yaw rate and friction."""

    reads = ("estimator",)

    def __init__(self, estimator: Estimator) -> None:
        """Take the estimator."""
        self._estimator = estimator

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> Observer:
        """Make the controller for a car; raises as `ControllerSetup.estimator` does."""
        return cls(setup.estimator())

    def step(self, _command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return no angles; the estimate is recorded."""
        return ActuatorCommand(estimate=self._estimator.step(measurement))
