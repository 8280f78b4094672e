"""Estimation of the motion of the car from its sensors, with standard deviations."""

from activesteer.estimation.parameters import EstimatorParameters
from activesteer.estimation.setup import EstimatorSetup, KnownTyre

__all__ = ["EstimatorParameters", "EstimatorSetup", "KnownTyre"]
