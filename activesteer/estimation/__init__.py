"""Estimation of the motion of the car from its sensors, with standard deviations.

In: measurements and the controllers' demands.
Out: speed, sideslip angle, yaw rate, friction and axle stiffness, with standard deviations.
"""

from activesteer.estimation.setup import EstimatorParameters, EstimatorSetup, KnownTyre

__all__ = ["EstimatorParameters", "EstimatorSetup", "KnownTyre"]
