"""Values of factors for a manoeuvre and a vehicle, and the plausibility of a setting."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import StrEnum
from typing import Any, Final

import numpy as np

from activesteer.errors import nearest_names, shown
from activesteer.scenario import value_of
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.study_file import StudyFile, label_of


class FactorValues:
    """Conversion of sample values to overrides, with each pair of manoeuvre and vehicle resolved once."""

    def __init__(self, study: StudyFile) -> None:
        """Prepare the conversion for a study."""
        self.study = study
        self._factors = {factor.key: factor for factor in study.factors}
        self._nominal: dict[tuple[int, int], dict[str, Any]] = {}
        labels = [label_of(item) for item in study.maneuvers]
        for number, factor in enumerate(study.factors):
            if factor.of and factor.of not in (earlier := [other.key for other in study.factors[:number]]):
                where = ("factors", factor.key, "of")
                problem = f"is not an earlier factor; {nearest_names(factor.of, earlier)}"
                raise study.source.fail(where, problem, factor.of)
            for name in factor.maneuvers:
                if name not in labels:
                    place = ("factors", factor.key, "maneuvers")
                    problem = f"the study has no manoeuvre {shown(name)}; {nearest_names(name, labels)}"
                    raise study.source.fail(place, problem, name)
            for other, wanted in factor.conditions.items():
                place = ("factors", factor.key, "when", other)
                if other not in self._factors:
                    raise study.source.fail(
                        place, f"is not another factor; {nearest_names(other, list(self._factors))}", other
                    )
                for value in wanted:
                    if value not in self._factors[other].values:
                        raise study.source.fail(place, f"{shown(value)} is not a value of that factor", value)
            for other in factor.grows_with:
                if other not in self._factors or self._factors[other].nominal or self._factors[other].values:
                    ranges = [key for key, of in self._factors.items() if not (of.nominal or of.values)]
                    place = ("factors", factor.key, "grows_with", other)
                    raise study.source.fail(place, f"is not another range; {nearest_names(other, ranges)}", other)

    def overrides(self, maneuver: int, vehicle: int, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the overrides of a run, with None for a key that keeps the value of the files."""
        label = label_of(self.study.maneuvers[maneuver])
        found = {}
        # In the order of the file, in which a factor follows the one to which it is relative.
        for key in dict.fromkeys([*(key for key in self._factors if key in values), *values]):
            value, factor = values[key], self._factors.get(key)
            if value is None or (factor is not None and factor.maneuvers and label not in factor.maneuvers):
                continue
            if factor is not None and not factor.acts(values):
                continue
            if factor is not None and factor.nominal:
                nominals = self._nominal_of(maneuver, vehicle)
                nominal = found.get(factor.of, nominals[key])
                found[key] = nominal * value if factor.nominal == "times" else nominal + value
                for other, power in factor.grows_with.items():
                    if other in nominals and values.get(other) is not None:
                        found[key] *= (values[other] / nominals[other]) ** power
            else:
                found[key] = value
        return found

    def _nominal_of(self, maneuver: int, vehicle: int) -> dict[str, Any]:
        """Return the values in the files of the relative factors, by key."""
        place = maneuver, vehicle
        if place not in self._nominal:
            study = self.study
            label = label_of(study.maneuvers[maneuver])
            scenario = study.scenario(maneuver, vehicle, study.overrides)
            here = {key: of for key, of in self._factors.items() if not of.maneuvers or label in of.maneuvers}
            needed = {key for key, of in here.items() if of.nominal}
            needed |= {other for of in here.values() for other in of.grows_with if other in here}
            relative = {key: value_of(scenario, key, study.controllers) for key in self._factors if key in needed}
            for key, value in relative.items():
                if not isinstance(value, int | float) or isinstance(value, bool):
                    raise study.source.fail(
                        ("factors", key, "nominal"), f"is {shown(value)} in {label}: no value can be relative to it"
                    )
            self._nominal[place] = relative
        return self._nominal[place]


_ORDINARY: Final = 0.6
_UNUSUAL: Final = 0.8
"""Largest rms of the distances; settings from uniform ranges about nominal values have 1/sqrt(3) = 0.58."""


class Plausibility(StrEnum):
    """Plausibility of a setting as a word."""

    ORDINARY = "ordinary"
    UNUSUAL = "unusual"
    EXTREME = "extreme"


class Prior:
    """Ranges of the factors, and the nominal value of every factor."""

    def __init__(self, study: StudyFile) -> None:
        """Find the nominal values: the values of the files, or no change for relative factors."""
        self._searched = [factor for factor in study.factors if not factor.values]
        self.nominal: dict[str, Any] = {}
        for factor in study.factors:
            if len(factor.values) == 1:
                self.nominal[factor.key] = factor.values[0]
                continue
            labels = [label_of(item) for item in study.maneuvers]
            maneuver = next(place for place, label in enumerate(labels) if label in (factor.maneuvers or labels))
            scenario = study.scenario(maneuver, 0, study.overrides)
            found = value_of(scenario, factor.key, study.controllers)
            if factor.of:  # the ratio or difference that the files have
                other = value_of(scenario, factor.of, study.controllers)
                found = found / other if factor.nominal == "times" else found - other
            elif factor.nominal:
                found = 1.0 if factor.nominal == "times" else 0.0
            self.nominal[factor.key] = factor.values[0] if factor.values and found not in factor.values else found

    def distances(self, values: Mapping[str, Any]) -> dict[str, float]:
        """Return the distance of each active number from its nominal value, in units of its range on that side."""
        found = {}
        for factor in self._searched:
            value = values.get(factor.key)
            if factor.acts(values) and value is not None:
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
        """Return the plausibility of a setting."""
        if any(abs(distance) > 1.0 + 1e-9 for distance in self.distances(values).values()):
            return Plausibility.EXTREME
        size = self.implausibility(values)
        if size <= _ORDINARY:
            return Plausibility.ORDINARY
        return Plausibility.UNUSUAL if size <= _UNUSUAL else Plausibility.EXTREME


def _linear(factor: Factor, value: float) -> float:
    """Return a value on the scale of its range, linear or logarithmic."""
    return math.log(max(value, 1e-300)) if factor.kind == "log_uniform" else float(value)
