"""The factor that an outcome of a study depends on most.

The outcome, yes or no, is fitted by least squares with every factor and its square, so that a factor with its optimum
in the middle is found too. A factor counts if leaving it out worsens the fit by more than chance (F test, 5 % for all
factors together, Bonferroni). Interactions are not examined.

Source: A. Saltelli et al., Global Sensitivity Analysis (2008), section 1.2.5, on regression of Monte Carlo samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as f_distribution

SIGNIFICANCE: Final = 0.05
"""Probability at which chance alone would name a factor."""
_SAMPLES_PER_COEFFICIENT: Final = 3
"""Smallest number of samples: in a short Sobol' sequence the factors correlate with each other's squares."""


class Dependence(NamedTuple):
    """The factor that explains most of an outcome.

    Attributes:
        factor: Its key.
        explained: Fraction of the outcome's variance that is lost without the factor, 0 to 1.
        direction: 1 if a larger factor makes the outcome more frequent, -1 if a smaller one does, 0 if the middle or
            the ends of its range do.
    """

    factor: str
    explained: float
    direction: int


def strongest(
    factors: Mapping[str, Sequence[float] | NDArray[np.float64]], outcome: Sequence[bool] | NDArray[np.bool_]
) -> Dependence | None:
    """Return the factor that an outcome depends on most, or None if none is significant or samples are too few."""
    happened = np.asarray(outcome, dtype=np.float64)
    if happened.size == 0:
        return None
    columns = {key: np.asarray(values, dtype=np.float64) for key, values in factors.items()}
    columns = {key: (values - values.mean()) / values.std() for key, values in columns.items() if np.ptp(values) > 0.0}
    number = 2 * len(columns) + 1
    spare = len(happened) - number
    if not columns or len(happened) < _SAMPLES_PER_COEFFICIENT * number or np.ptp(happened) == 0.0:
        return None
    left, coefficients = _fit(list(columns.values()), happened)
    total = float(np.sum((happened - happened.mean()) ** 2))
    found: list[Dependence] = []
    for place, key in enumerate(columns):
        without, _ = _fit([values for other, values in columns.items() if other != key], happened)
        lost = max(0.0, without - left)
        chance = float(f_distribution.sf(0.5 * lost / max(left / spare, 1e-300), 2, spare))
        if chance * len(columns) < SIGNIFICANCE:
            linear, square = coefficients[1 + 2 * place], coefficients[2 + 2 * place]
            # Over a uniform sample, x spans 3.5 and x^2 3 standard units: the larger change counts.
            direction = int(np.sign(linear)) if abs(linear) * 3.46 > abs(square) * 3.0 else 0
            found.append(Dependence(key, lost / total, direction))
    return max(found, key=lambda dependence: dependence.explained, default=None)


def _fit(columns: Sequence[NDArray[np.float64]], outcome: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
    """Return the residual sum of squares and the coefficients: constant, then each column and its square."""
    design = np.column_stack([np.ones_like(outcome), *(part for x in columns for part in (x, x * x))])
    coefficients = np.asarray(np.linalg.lstsq(design, outcome, rcond=None)[0], dtype=np.float64)
    return float(np.sum((outcome - design @ coefficients) ** 2)), coefficients
