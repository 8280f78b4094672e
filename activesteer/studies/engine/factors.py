"""Factors of a study: keys of manoeuvre or vehicle and the values that they take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from activesteer.config import Source, build
from activesteer.core.limits import MAX_NUMBER
from activesteer.errors import shown

KINDS: Final = ("grid", "choice", "uniform", "log_uniform", "normal")
"""Kinds of factors. A factor's table has exactly one of these keys."""
_OPTIONS: Final = {"weights": "choice", "truncate": "normal"}
"""Option -> the kind that it belongs to."""
_ANYWHERE: Final = ("nominal", "of", "grows_with", "maneuvers", "when")
"""Keys that every kind allows."""
_DEFAULT_TRUNCATION: Final = 3.0
"""Default truncation of a normal distribution, in standard deviations."""

Value = Any
"""A number, a text, true or false, or a list of these."""


@dataclass(frozen=True)
class Factor:
    """A factor: a key and its values."""

    key: str  # dotted key, as for `--set`
    kind: str  # one of `KINDS`
    values: tuple[Value, ...] = ()  # values of a grid or a choice
    weights: tuple[float, ...] = ()  # probability of each value of a choice
    low: float = 0.0  # lower end of a range
    high: float = 0.0  # upper end of a range
    mean: float = 0.0  # mean of a normal distribution before truncation
    deviation: float = 0.0  # standard deviation of a normal distribution before truncation
    nominal: str = ""  # `times` or `plus` if the values multiply the value of the files or are added to it; else empty
    # Earlier factor to whose value the values are relative, in place of the value of the files; empty for none
    of: str = ""
    # Other factor -> exponent. The value is also multiplied by that factor, over its value in the files, to the power
    # of the exponent.
    grows_with: Mapping[str, float] = field(default_factory=dict)
    maneuvers: tuple[str, ...] = ()  # names of the manoeuvres in which the factor varies; empty for all
    # Other factor -> its values with which the factor varies; empty for all
    when: Mapping[str, Value] = field(default_factory=dict)

    def acts(self, values: Mapping[str, Value]) -> bool:
        """Return whether the factor varies with these values of the others."""
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
            below, above = ndtr((np.array([self.low, self.high]) - self.mean) / self.deviation)
            found = self.mean + self.deviation * ndtri(below + unit * (above - below))
        elif self.kind == "log_uniform":
            found = self.low * (self.high / self.low) ** unit
        else:
            found = self.low + unit * (self.high - self.low)
        return np.clip(found, self.low, self.high).tolist()

    @property
    def extremes(self) -> tuple[Value, ...]:
        """Return the extreme values, or all values if they have no order."""
        return self.values or (self.low, self.high)

    def to_table(self) -> dict[str, Any]:
        """Return the factor as the table that `read_factor` takes."""
        table: dict[str, Any] = {self.kind: list(self.values) or [self.low, self.high]}
        if self.kind == "normal":
            table |= {"normal": [self.mean, self.deviation], "truncate": [self.low, self.high]}
        for name in ("weights", *_ANYWHERE):
            if value := getattr(self, name):
                table[name] = list(value) if isinstance(value, tuple) else value
        return table


@dataclass(frozen=True)
class FactorTable:
    """Keys of a factor in a study file (see `Factor`)."""

    grid: tuple[Any, ...] = ()
    choice: tuple[Any, ...] = ()
    uniform: tuple[float, ...] = ()
    log_uniform: tuple[float, ...] = ()
    normal: tuple[float, ...] = ()
    weights: tuple[float, ...] = ()
    truncate: tuple[float, ...] = ()
    nominal: Literal["times", "plus"] | None = None
    of: str = ""
    grows_with: dict[str, float] = field(default_factory=dict)
    maneuvers: tuple[str, ...] = ()
    when: dict[str, Any] = field(default_factory=dict)


def read_factor(key: str, table: object, source: Source) -> Factor:
    """Read a factor from its table in a study file."""
    where, kinds = ("factors", key), ", ".join(KINDS)
    if not isinstance(table, Mapping):
        problem = f"{shown(table)} is no table; {{ uniform = [low, high] }} or another of {kinds} is needed"
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
        raise source.fail((*where, "of"), "names an earlier factor, and stands beside nominal", given.of)
    if given.grows_with and given.nominal != "times":
        raise source.fail((*where, "grows_with"), 'belongs to nominal = "times"', given.grows_with)
    return replace(
        _read(key, found[0], given, source),
        **{name: getattr(given, name) for name in ("of", "grows_with", "maneuvers", "when")},
        nominal=given.nominal or "",
    )


def _read(key: str, kind: str, table: FactorTable, source: Source) -> Factor:
    """Return the factor of a table whose keys are consistent, after checking its values."""
    where = ("factors", key, kind)
    given = getattr(table, kind)
    if kind in ("grid", "choice"):
        return _listed_values(key, kind, given, table.weights, source)
    first, second = _pair(given, source, where)
    if kind == "normal":
        if second <= 0.0:
            raise source.fail(where, f"the standard deviation is {second:g}; it must be above 0")
        around = (first - _DEFAULT_TRUNCATION * second, first + _DEFAULT_TRUNCATION * second)
        place = ("factors", key, "truncate")
        low, high = _pair(table.truncate, source, place) if table.truncate else around
        if low >= high or ndtr((low - first) / second) == ndtr((high - first) / second):
            raise source.fail(place, f"between {low:g} and {high:g} there is nothing of the distribution")
        return Factor(key, kind, low=low, high=high, mean=first, deviation=second)
    if first >= second:
        raise source.fail(where, f"the lower end {first:g} is not below the upper end {second:g}")
    if kind == "log_uniform" and first <= 0.0:
        raise source.fail(where, f"the lower end is {first:g}; it must be above 0")
    return Factor(key, kind, low=first, high=second)


def _listed_values(key: str, kind: str, given: tuple[Value, ...], weights: tuple[float, ...], source: Source) -> Factor:
    where = ("factors", key, kind)
    for value in given:
        if not is_plain(value):
            raise source.fail(where, f"{shown(value)} is no number, text, true or false", value)
    if any(given.count(value) > 1 for value in given):
        raise source.fail(where, "a value stands in it twice")
    place = ("factors", key, "weights")
    if weights and len(weights) != len(given):
        raise source.fail(place, f"as many weights as values are needed: {len(given)}")
    if weights and not (min(weights) >= 0.0 and sum(weights) > 0.0):
        raise source.fail(place, f"{shown(list(weights))} are no weights: at least 0, not all of them 0")
    return Factor(key, kind, given, weights)


def _pair(given: Sequence[float], source: Source, where: Sequence[str]) -> tuple[float, float]:
    if len(given) != 2:
        raise source.fail(where, f"{shown(list(given))} is not two numbers")
    return given[0], given[1]


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= MAX_NUMBER


def is_plain(value: object) -> bool:
    """Return whether a value can be varied: a number, a text or a truth value."""
    return isinstance(value, (bool, str)) or _is_number(value)
