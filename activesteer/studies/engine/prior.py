"""Nominal values of a study's factors, and the plausibility of a setting: its distance from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum
from typing import Any, Final

import numpy as np

from activesteer.scenario import resolve, value_of
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.study_file import StudyFile, label_of

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
        nominal: Nominal value of every factor.
    """

    def __init__(self, study: StudyFile) -> None:
        """Find the nominal values: those of the files, and no change for factors that are relative to them."""
        self._searched = [factor for factor in study.factors if not factor.values]
        self.nominal: dict[str, Any] = {}
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
            self.nominal[factor.key] = factor.values[0] if factor.values and found not in factor.values else found

    def distances(self, values: Mapping[str, Any]) -> dict[str, float]:
        """Return the distance of each number from its nominal value, in units of its range on that side.

        Choices have no distance, nor have numbers that do not act with the other values. A number outside its range has
        a distance above 1.
        """
        found = {}
        for factor in self._searched:
            acts = all(values.get(other) == wanted for other, wanted in factor.when.items())
            value = values.get(factor.key)
            if acts and value is not None:
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
