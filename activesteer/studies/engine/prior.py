"""The priors of a study's factors: the unit cube of the searches, and the plausibility of a setting."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.scenario import resolve, value_of
from activesteer.studies.engine.factor_values import label_of
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.study_file import StudyFile

Values = dict[str, Any]
_ORDINARY: Final = 0.6
_UNUSUAL: Final = 0.8
"""Largest root mean squares of the distances; settings drawn from uniform ranges around their nominal values have
1/sqrt(3) = 0.58."""


class Plausibility(StrEnum):
    """Plausibility of a setting in words."""

    ORDINARY = "ordinary"
    UNUSUAL = "unusual"
    EXTREME = "extreme"


class Prior:
    """Ranges of the factors, and their nominal values.

    Attributes:
        searched: Factors that a search varies, in the order of the coordinates.
        nominal: Nominal value of every factor.
    """

    def __init__(self, study: StudyFile) -> None:
        """Find the nominal values: those of the files, and no change for factors that are relative to them."""
        self.searched = [factor for factor in study.factors if len(factor.values) != 1]
        self._all = study.factors
        self.nominal: Values = {}
        for factor in study.factors:
            if len(factor.values) == 1:
                self.nominal[factor.key] = factor.values[0]
                continue
            names = factor.maneuvers or tuple(label_of(item) for item in study.maneuvers)
            maneuver = next(item for item in study.maneuvers if label_of(item) in names)
            scenario = resolve(maneuver, study.vehicles[0], study.overrides, study.driver, study.controllers)
            found = value_of(scenario, factor.key, study.controllers)
            if factor.of:  # the ratio or difference that the files have
                other = value_of(scenario, factor.of, study.controllers)
                found = found / other if factor.nominal == "times" else found - other
            elif factor.nominal:
                found = 1.0 if factor.nominal == "times" else 0.0
            if factor.values:
                self.nominal[factor.key] = found if found in factor.values else factor.values[0]
            else:
                self.nominal[factor.key] = found

    def values(self, point: Sequence[float] | NDArray[np.float64]) -> Values:
        """Return the setting at a point of the unit cube."""
        inside = np.clip(np.asarray(point, dtype=np.float64), 0.0, 1.0)
        found = {factor.key: factor.values[0] for factor in self._all if len(factor.values) == 1}
        return found | {factor.key: factor.from_unit(inside[[place]])[0] for place, factor in enumerate(self.searched)}

    def point(self, values: Mapping[str, Any]) -> NDArray[np.float64]:
        """Return the point of the unit cube for a setting; a key without a value has its nominal value."""
        return np.array([_unit(factor, values.get(factor.key, self.nominal[factor.key])) for factor in self.searched])

    def distances(self, values: Mapping[str, Any]) -> dict[str, float]:
        """Return the distance of each number from its nominal value, in units of its range on that side.

        Choices have no distance, nor have numbers that do not act with the other values. A number outside its range has
        a distance above 1.
        """
        found = {}
        for factor in self.searched:
            acts = all(values.get(other) == wanted for other, wanted in factor.when.items())
            value = values.get(factor.key)
            if not factor.values and acts and value is not None:
                low, centre, high, at = (
                    _linear(factor, number) for number in (factor.low, self.nominal[factor.key], factor.high, value)
                )
                centre = min(max(centre, low), high)
                side = (high if at > centre else low) - centre
                found[factor.key] = (
                    (at - centre) / abs(side) if side else math.copysign(0.0 if at == centre else 2.0, at)
                )
        return found

    def implausibility(self, values: Mapping[str, Any]) -> float:
        """Return the root mean square of `distances`."""
        return float(np.sqrt(np.mean(np.square(list(self.distances(values).values()) or [0.0]))))

    def plausibility(self, values: Mapping[str, Any]) -> Plausibility:
        """Return the plausibility of a setting in words."""
        if any(abs(distance) > 1.0 + 1e-9 for distance in self.distances(values).values()):
            return Plausibility.EXTREME
        size = self.implausibility(values)
        if size <= _ORDINARY:
            return Plausibility.ORDINARY
        return Plausibility.UNUSUAL if size <= _UNUSUAL else Plausibility.EXTREME


def _linear(factor: Factor, value: float) -> float:
    """Return a value on the scale on which its range is even."""
    return math.log(max(value, 1e-300)) if factor.kind == "log_uniform" else float(value)


def _unit(factor: Factor, value: Any) -> float:
    """Return the cumulative probability of a value; of a choice, the middle of its part."""
    if factor.values:
        weights = np.asarray(factor.weights or [1.0] * len(factor.values))
        ends = np.cumsum(weights) / np.sum(weights)
        place = factor.values.index(value) if value in factor.values else 0
        return float(ends[place] - 0.5 * weights[place] / np.sum(weights))
    low, high, at = (_linear(factor, number) for number in (factor.low, factor.high, value))
    if factor.kind == "normal":
        grid = np.linspace(0.0, 1.0, 1001)
        return float(np.interp(value, factor.from_unit(grid), grid))
    return min(max((at - low) / (high - low), 0.0), 1.0)
