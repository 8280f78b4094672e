"""From what the sensors say to how the car moves over the road, and how far that can be trusted."""

from activesteer.estimation.estimator import Estimator
from activesteer.estimation.parameters import EstimatorParameters
from activesteer.estimation.setup import EstimatorSetup, KnownTyre

__all__ = ["Estimator", "EstimatorParameters", "EstimatorSetup", "KnownTyre"]
