"""Key metrics: the few metrics of a manoeuvre that are printed first and held against a baseline."""

from __future__ import annotations

from typing import Final, NamedTuple

RELATIVE_TOLERANCE: Final = 0.01
"""Fraction of a value by which it may always differ between two versions of the program."""


class KeyMetric(NamedTuple):
    """A key metric of a manoeuvre.

    Attributes:
        name: Name of the metric, ending in its unit.
        tolerance: Smallest difference between two versions of the program that a reader would notice, in the metric's
            SI unit; 0 for a count.
    """

    name: str
    tolerance: float

    def tolerance_of(self, value: float) -> float:
        """Return the difference from a value that counts as unchanged: `tolerance`, or 1 % of the value if larger."""
        return max(self.tolerance, RELATIVE_TOLERANCE * abs(value)) if self.tolerance else 0.0
