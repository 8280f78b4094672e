"""Factors of a study: keys of manoeuvre or vehicle, and their values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Source, build
from activesteer.core.limits import MAX_NUMBER
from activesteer.errors import shown

KINDS: Final = ("grid", "choice", "uniform", "log_uniform", "normal")
"""Kinds of factors. A factor's table has exactly one of these keys."""
_OPTIONS: Final = {"weights": "choice", "truncate": "normal"}
"""Kind that each option belongs to."""
_ANYWHERE: Final = ("nominal", "of", "grows_with", "maneuvers", "when")
"""Keys that every kind allows."""
_DEFAULT_TRUNCATION: Final = 3.0
"""Default truncation of a normal distribution, in standard deviations."""

Value = Any
"""A number, a string, true or false, or a list of these."""


@dataclass(frozen=True)
class FactorTable:
    """Keys of a factor in a study file."""

    grid: tuple[Value, ...] = ()  # values, each of which meets the whole sample
    choice: tuple[Value, ...] = ()  # values to draw from
    uniform: tuple[float, ...] = ()  # lower and upper end
    log_uniform: tuple[float, ...] = ()  # the same
    normal: tuple[float, ...] = ()  # mean and standard deviation, before truncation
    weights: tuple[float, ...] = ()  # probability of each value of a choice
    truncate: tuple[float, ...] = ()  # lower and upper end of a normal distribution
    # `times` or `plus` if the values multiply the value of the files or are added to it
    nominal: Literal["times", "plus"] | None = None
    # Earlier factor to whose value the values are relative, in place of the value of the files; empty for none
    of: str = ""
    # Other factor -> exponent. The value is also multiplied by that factor, over its value in the files, to the power
    # of the exponent.
    grows_with: dict[str, float] = field(default_factory=dict)
    maneuvers: tuple[str, ...] = ()  # names of the manoeuvres in which the factor varies; empty for all
    # Other factor -> its values with which the factor varies; empty for all
    when: dict[str, Value] = field(default_factory=dict)


@dataclass(frozen=True)
class Factor(FactorTable):
    """A factor: a key with its checked table."""

    key: str = ""  # dotted key, as for `--set`

    @property
    def kind(self) -> str:
        """Return the kind, one of `KINDS`."""
        return next(kind for kind in KINDS if getattr(self, kind))

    @property
    def values(self) -> tuple[Value, ...]:
        """Return the values of a grid or a choice, empty for a range."""
        return self.grid or self.choice

    @property
    def low(self) -> float:
        """Return the lower end of a range, or 0 without a range."""
        return self._ends[0]

    @property
    def high(self) -> float:
        """Return the upper end of a range, or 0 without a range."""
        return self._ends[1]

    @property
    def _ends(self) -> tuple[float, ...]:
        return self.uniform or self.log_uniform or self.truncate or (0.0, 0.0)

    def acts(self, values: Mapping[str, Value]) -> bool:
        """Return whether the factor varies for given values of the other factors."""
        return all(values.get(other) in wanted for other, wanted in self.conditions.items())

    @property
    def conditions(self) -> dict[str, list[Value]]:
        """Return `when` with a list of values for each other factor."""
        return {other: value if isinstance(value, list) else [value] for other, value in self.when.items()}

    def from_unit(self, unit: NDArray[np.float64]) -> list[Value]:
        """Convert cumulative probabilities, 0 to 1, shape (n,), to values of the factor."""
        if self.kind in ("grid", "choice"):
            weights = self.weights or [1.0] * len(self.values)
            ends = np.cumsum(weights) / np.sum(weights)
            places = np.minimum(np.searchsorted(ends, unit, side="right"), len(self.values) - 1)
            return [self.values[place] for place in places]
        if self.kind == "normal":
            from scipy.special import ndtr, ndtri  # noqa: PLC0415 - slow to import, and few studies need it

            mean, deviation = self.normal
            below, above = ndtr((np.array(self.truncate) - mean) / deviation)
            found = mean + deviation * ndtri(below + unit * (above - below))
        elif self.kind == "log_uniform":
            found = self.low * (self.high / self.low) ** unit
        else:
            found = self.low + unit * (self.high - self.low)
        return np.clip(found, self.low, self.high).tolist()

    @property
    def extremes(self) -> tuple[Value, ...]:
        """Return the extreme values, or all values of an unordered factor."""
        return self.values or (self.low, self.high)

    def to_table(self) -> dict[str, Any]:
        """Return the factor as the table that `read_factor` takes."""
        given = {name: getattr(self, name) for name in (*KINDS, "truncate", "weights", *_ANYWHERE)}
        return {name: list(value) if isinstance(value, tuple) else value for name, value in given.items() if value}


def read_factor(key: str, table: object, source: Source) -> Factor:
    """Read a factor from its table in a study file."""
    where, kinds = ("factors", key), ", ".join(KINDS)
    if not isinstance(table, Mapping):
        problem = f"{shown(table)} is not a table; {{ uniform = [low, high] }} or another of {kinds} is needed"
        raise source.fail(where, problem)
    given = build(FactorTable, table, source, where)
    found = [kind for kind in KINDS if kind in table]
    if len(found) != 1:
        raise source.fail(where, f"exactly one of {kinds} is needed")
    for name, value in table.items():
        if _OPTIONS.get(name, found[0]) != found[0]:
            raise source.fail((*where, name), f"belongs to {_OPTIONS[name]}, not to {found[0]}")
        if value in ([], {}, ""):
            raise source.fail((*where, name), "is empty", value)
    if given.of and given.nominal is None:
        raise source.fail((*where, "of"), "needs the key nominal of the same factor", given.of)
    if given.grows_with and given.nominal != "times":
        raise source.fail((*where, "grows_with"), 'has an effect only with nominal = "times"', given.grows_with)
    factor = Factor(**vars(given), key=key)
    if factor.values:
        _check_values(factor, source)
        return factor
    return replace(factor, truncate=_checked_ends(factor, source))


def _checked_ends(factor: Factor, source: Source) -> tuple[float, ...]:
    """Check the numbers of a range, and return the ends of a normal distribution."""
    kind = factor.kind
    where = ("factors", factor.key, kind)
    first, second = _pair(getattr(factor, kind), source, where)
    if kind == "normal":
        from scipy.special import ndtr  # noqa: PLC0415 - slow to import, and few studies need it

        if second <= 0.0:
            raise source.fail(where, f"the standard deviation is {second:g}; it must be above 0")
        around = (first - _DEFAULT_TRUNCATION * second, first + _DEFAULT_TRUNCATION * second)
        place = ("factors", factor.key, "truncate")
        low, high = _pair(factor.truncate, source, place) if factor.truncate else around
        if low >= high or ndtr((low - first) / second) == ndtr((high - first) / second):
            raise source.fail(place, f"the distribution has no values between {low:g} and {high:g}")
        return low, high
    if first >= second:
        raise source.fail(where, f"the lower end {first:g} is not below the upper end {second:g}")
    if kind == "log_uniform" and first <= 0.0:
        raise source.fail(where, f"the lower end is {first:g}; it must be above 0")
    return ()


def _check_values(factor: Factor, source: Source) -> None:
    """Check the values of a grid or a choice, and their weights."""
    where, given, weights = ("factors", factor.key, factor.kind), factor.values, factor.weights
    for value in given:
        if not is_plain(value):
            raise source.fail(where, f"{shown(value)} is not a number, string, true or false", value)
    if twice := [value for value in given if given.count(value) > 1]:
        raise source.fail(where, f"{shown(twice[0])} is given twice; leave one out", twice[0])
    place = ("factors", factor.key, "weights")
    if weights and len(weights) != len(given):
        raise source.fail(place, f"as many weights as values are needed: {len(given)}")
    if weights and not (min(weights) >= 0.0 and sum(weights) > 0.0):
        raise source.fail(place, f"{shown(list(weights))} are not weights: each must be at least 0, and not all 0")


def _pair(given: Sequence[float], source: Source, where: Sequence[str]) -> tuple[float, float]:
    if len(given) != 2:
        raise source.fail(where, f"{shown(list(given))} is not two numbers")
    return given[0], given[1]


def is_plain(value: object) -> bool:
    """Return whether a value can be varied: a number, a string or a boolean."""
    return isinstance(value, (bool, str)) or (isinstance(value, (int, float)) and abs(value) <= MAX_NUMBER)
