"""Confidence in the estimator: how far a controller may act against the driver, and whether it may act at all."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from activesteer.controllers.parameters import ControllerSetup
from activesteer.estimation.estimator import Estimator
from activesteer.native_blocks import NativeBlock
from activesteer.shared_laws import shared
from activesteer.signals import Estimate, new_message

_AVERAGED_S: Final = 0.2
"""Time constant of the mean of the squared innovations [s]: some twenty samples."""
_EXPLAINED, _UNEXPLAINED = 8.0, 16.0
"""Mean squared innovation, over its covariance, up to which the model explains the car, and from which it does not [-].
Two measured values give 2 on average; the largest mean in 14 ordinary runs was 4.7."""
_FALL_S, _RISE_S = 0.3, 2.0
"""Times in which the authority falls from 1 to 0, and rises again [s]."""


class Confidence(NamedTuple):
    """Confidence of an instant.

    Attributes:
        friction: Part of the variance of the assumed friction that the measurements have removed, 0 to 1.
        authority: Factor on the demands of the controller: 1 while the model explains the car, falling to 0 otherwise.
    """

    friction: float
    authority: float


class ConfidenceMonitor(NativeBlock):
    """Monitor of an estimator's friction and innovations."""

    _prior: float
    _fraction: float
    _fall: float
    _rise: float
    _mean: float
    _authority: float

    def __init__(self, setup: ControllerSetup, estimator: Estimator) -> None:
        """Watch an estimator.

        Args:
            setup: Setup of the controller.
            estimator: Its estimator, which the controller calls.
        """
        self._estimator, self._prior = estimator, setup.gains.estimator.friction_std
        self._fraction = -math.expm1(-setup.timestep_s / _AVERAGED_S)
        self._fall, self._rise = setup.timestep_s / _FALL_S, setup.timestep_s / _RISE_S
        self._mean, self._authority = 0.0, 1.0

    @property
    def innovation(self) -> float:
        """Present innovation of the estimator."""
        return self._estimator.innovation

    @property
    def authority(self) -> float:
        """Present factor on the demands of the controller."""
        return self._authority

    def step(self, now: Estimate) -> Confidence:
        """Return the confidence in the estimate of this call."""
        return new_message(Confidence, confidence(self, self.innovation, now.friction_std))


@shared
def confidence(block: ConfidenceMonitor, innovation: float, friction_std: float) -> tuple[float, float]:
    """Law of `ConfidenceMonitor.step`; returns the fields of `Confidence`."""
    block._mean += block._fraction * (innovation - block._mean)
    if block._mean > _EXPLAINED or block._authority < 1.0:
        wanted = min(max((_UNEXPLAINED - block._mean) / (_UNEXPLAINED - _EXPLAINED), 0.0), 1.0)
        block._authority += min(max(wanted - block._authority, -block._fall), block._rise)
    left = friction_std / block._prior
    known = 1.0 - left * left
    return known if known > 0.0 else 0.0, block._authority
