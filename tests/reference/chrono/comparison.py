"""Comparison of one of our numbers with its reference and a tolerance."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any, Literal

from activesteer.core.files import finite

Kind = Literal["relative", "absolute"]


@dataclass(frozen=True)
class Comparison:
    """Comparison of one of our numbers with its reference.

    Attributes:
        run: Run or rig of the number.
        quantity: Name of the compared quantity.
        unit: Unit of both numbers.
        ours: Our number; for curves, at the largest difference.
        reference: The reference at the same place.
        error: Difference, as defined by `kind`.
        tolerance: Largest permitted size of the error; None where the two codes define the quantity differently and
            the difference is only reported.
        kind: `relative`: error and tolerance are fractions (0.02 is 2 %) of the reference or of the base in
            `quantity`; `absolute`: they have the unit.
    """

    run: str
    quantity: str
    unit: str
    ours: float
    reference: float
    error: float
    tolerance: float | None
    kind: Kind = "absolute"

    @property
    def inside(self) -> bool | None:
        """True if the error is within the tolerance, False if not or if the error is nan; None without a tolerance."""
        return None if self.tolerance is None else bool(abs(self.error) <= self.tolerance)

    def row(self) -> dict[str, Any]:
        """Return the JSON values."""
        return {**asdict(self), "inside": self.inside}

    def words(self) -> tuple[str, str, str, str, str, str]:
        """Return run, quantity, ours, reference, error and tolerance as printed."""
        unit = f" {self.unit}" if self.unit else ""
        if self.kind == "relative":
            error = f"{100.0 * self.error:+.2f} %"
            tolerance = "-" if self.tolerance is None else f"{100.0 * self.tolerance:g} %"
        else:
            error = f"{self.error:+.4g}{unit}"
            tolerance = "-" if self.tolerance is None else f"{self.tolerance:g}{unit}"
        return self.run, self.quantity, f"{self.ours:.5g}{unit}", f"{self.reference:.5g}{unit}", error, tolerance


def relative(run: str, quantity: str, unit: str, ours: float, reference: float, tolerance: float | None) -> Comparison:
    """Return a comparison whose error is a fraction of the reference."""
    error = ours / reference - 1.0 if reference else math.inf
    return Comparison(run, quantity, unit, ours, reference, error, tolerance, "relative")


def absolute(run: str, quantity: str, unit: str, ours: float, reference: float, tolerance: float | None) -> Comparison:
    """Return a comparison whose error is the difference."""
    return Comparison(run, quantity, unit, ours, reference, ours - reference, tolerance)


def to_json(comparisons: Iterable[Comparison]) -> dict[str, list[dict[str, Any]]]:
    """Return the comparisons as JSON values; a number that is not finite is None."""
    return finite({"comparisons": [comparison.row() for comparison in comparisons]})
