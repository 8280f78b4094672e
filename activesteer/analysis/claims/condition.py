"""Conditions of a criterion, each with its distance to the limit: a verdict, and how far a run is from another one."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple


class Condition(NamedTuple):
    """A condition.

    Attributes:
        margin: Distance to the limit on the right side, in units of a scale [-]; below 0 if the condition is broken.
        strict: Whether a value at the limit breaks it.
    """

    margin: float
    strict: bool = False

    @property
    def holds(self) -> bool:
        """True if the condition holds."""
        return self.margin > 0.0 if self.strict else self.margin >= 0.0

    @property
    def distance(self) -> float:
        """Distance from holding: 0 if it holds, 0.5 a scale away from the limit, 1 far away or undefined."""
        if self.holds:
            return 0.0
        return 1.0 if math.isinf(self.margin) else max(1e-6, self.margin / (self.margin - 1.0))

    @property
    def negated(self) -> Condition:
        """The opposite condition."""
        return Condition(-self.margin, not self.strict)


def at_most(value: float, limit: float, scale: float | None = None, *, strict: bool = False) -> Condition:
    """Return the condition that a value is at most a limit, or below it; an undefined value (nan) breaks it.

    The difference that counts as 1 is by default the magnitude of the limit.
    """
    room = limit - value
    unit = abs(limit) if scale is None else scale
    return Condition(-math.inf if math.isnan(room) else room / max(unit, 1e-9), strict)


def at_least(value: float, limit: float, scale: float | None = None, *, strict: bool = False) -> Condition:
    """Return the condition that a value is at least a limit; see `at_most`."""
    return at_most(-value, -limit, scale, strict=strict)


def true(value: bool) -> Condition:
    """Return a condition without a distance."""
    return Condition(math.inf if value else -math.inf)


def either(conditions: Iterable[Condition]) -> Condition:
    """Return the condition that is nearest to holding: the alternative of all."""
    return max(conditions)


def both(conditions: Iterable[Condition]) -> Condition:
    """Return the condition that is furthest from holding: all of them as one."""
    return min(conditions)
