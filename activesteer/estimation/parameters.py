"""Parameters of the estimator; keys of the table [controllers.estimator] in a vehicle file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range

_Positive = Annotated[float, Range(1e-9)]


@dataclass(frozen=True)
class EstimatorParameters:
    """How far the estimator trusts its model."""

    friction: Annotated[float, Range(0.05, 1.5)] = 0.9
    """Friction of the road, relative to that of the tyres' files, until it shows [-]: dry asphalt."""
    friction_std: _Positive = 0.2
    """Standard deviation of that."""
