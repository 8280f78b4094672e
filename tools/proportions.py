"""Proportion of a population with a property, its confidence interval and the verdict."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final

from activesteer.errors import ParameterError

HOLDS_FROM: Final = 0.8
"""A claim holds if its proportion is at least this, with 97.5 % confidence."""
FAILS_UP_TO: Final = 0.2
"""A claim does not hold if its proportion is at most this, with 97.5 % confidence."""


class ProportionVerdict(StrEnum):
    """Verdict of a proportion on a claim."""

    HOLDS = "holds"
    DEPENDS = "depends"
    DOES_NOT_HOLD = "does not hold"


@dataclass(frozen=True)
class Proportion:
    """Number of samples with a property, of all samples."""

    count: int = 0
    number: int = 0

    def __add__(self, other: Proportion) -> Proportion:
        """Return the proportion of both sets together."""
        return Proportion(self.count + other.count, self.number + other.number)

    @property
    def value(self) -> float:
        """The proportion, or nan without samples."""
        return self.count / self.number if self.number else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Ends of the 95 % interval."""
        return wilson_interval(self.count, self.number)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, with the 95 % interval."""
        low, high = self.interval
        share = self.value if self.number else None
        return {"count": self.count, "number": self.number, "share": share, "low": low, "high": high}

    def __str__(self) -> str:
        """Return the proportion in percent, with the interval."""
        if not self.number:
            return "-"
        low, high = self.interval
        return f"{percent(self.value)} % ({percent(low)} to {percent(high)})"


def percent(proportion: float) -> str:
    """Write a proportion in whole percent, near 0 and 100 with the digit that differs from them."""
    value = 100.0 * proportion
    beyond = float(f"{min(value, 100.0 - value):.1g}")
    decimals = max(0, -math.floor(math.log10(beyond))) if beyond > 0.0 else 0
    return f"{value:.{decimals}f}"


def wilson_interval(passed: int, number: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of a proportion.

    Returns:
        Lower and upper end; 0 and 1 for a total of 0.

    Raises:
        ParameterError: `passed` is negative or larger than `number`.

    Source: E. B. Wilson, Journal of the American Statistical Association 22 (1927), 209-212.
    """
    if not 0 <= passed <= number:
        raise ParameterError(f"{passed} of {number} is not a proportion", value=(passed, number))
    if number == 0:
        return 0.0, 1.0
    from scipy.stats import binomtest  # noqa: PLC0415 - slow to import

    low, high = binomtest(passed, number).proportion_ci(method="wilson")
    return float(low), float(high)


def proportion_verdict(low: float, high: float) -> ProportionVerdict:
    """Return the verdict for a confidence interval."""
    if low >= HOLDS_FROM:
        return ProportionVerdict.HOLDS
    return ProportionVerdict.DOES_NOT_HOLD if high <= FAILS_UP_TO else ProportionVerdict.DEPENDS
