"""Estimator of speed, sideslip, yaw rate, friction and axle stiffness with standard deviations, from the sensors."""

from activesteer.estimation.setup import EstimatorParameters, EstimatorSetup, KnownTyre

__all__ = ["EstimatorParameters", "EstimatorSetup", "KnownTyre"]
