"""The share of a population in which something holds, its confidence interval and the verdict."""

from __future__ import annotations

from enum import StrEnum
from typing import Final

from activesteer.errors import ParameterError

HOLDS_FROM: Final = 0.8
"""A claim holds if its share is at least this, with 97.5 % confidence."""
FAILS_UP_TO: Final = 0.2
"""A claim does not hold if its share is at most this, with 97.5 % confidence."""


class ShareVerdict(StrEnum):
    """Verdict of a share on a claim."""

    HOLDS = "holds"
    DEPENDS = "depends"
    DOES_NOT_HOLD = "does not hold"


def wilson_interval(passed: int, number: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of a share.

    Args:
        passed: Number that passed.
        number: Total number.

    Returns:
        Lower and upper end; 0 and 1 for a total of 0.

    Raises:
        ParameterError: `passed` is negative or larger than `number`.

    Source: E. B. Wilson, Journal of the American Statistical Association 22 (1927), 209-212.
    """
    if not 0 <= passed <= number:
        raise ParameterError(f"{passed} of {number} is not a share", value=(passed, number))
    if number == 0:
        return 0.0, 1.0
    from scipy.stats import binomtest  # noqa: PLC0415 - slow to import

    low, high = binomtest(passed, number).proportion_ci(method="wilson")
    return float(low), float(high)


def share_verdict(low: float, high: float) -> ShareVerdict:
    """Return the verdict for a confidence interval."""
    if low >= HOLDS_FROM:
        return ShareVerdict.HOLDS
    return ShareVerdict.DOES_NOT_HOLD if high <= FAILS_UP_TO else ShareVerdict.DEPENDS
