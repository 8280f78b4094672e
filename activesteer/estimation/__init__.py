"""From what the sensors say to how the car moves over the road, and how far that can be trusted."""

from activesteer.estimation.parameters import EstimatorParameters
from activesteer.estimation.setup import EstimatorSetup, KnownTyre

__all__ = ["EstimatorParameters", "EstimatorSetup", "KnownTyre"]
