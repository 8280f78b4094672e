"""Values of a sample for a manoeuvre and a vehicle: absolute, or relative to the files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from activesteer.errors import nearest_names, shown
from activesteer.scenario import resolve, value_of
from activesteer.studies.engine.study_file import StudyFile, label_of


class FactorValues:
    """Conversion of sample values to overrides; each pair of manoeuvre and vehicle is resolved once."""

    def __init__(self, study: StudyFile) -> None:
        """Prepare the conversion for a study.

        Raises:
            StudyError: a factor names a manoeuvre, or a value of another factor, that the study does not have.
        """
        self.study = study
        self._factors = {factor.key: factor for factor in study.factors}
        self._nominal: dict[tuple[int, int], dict[str, Any]] = {}
        labels = [label_of(item) for item in study.maneuvers]
        for number, factor in enumerate(study.factors):
            if factor.of and factor.of not in (earlier := [other.key for other in study.factors[:number]]):
                where = ("factors", factor.key, "of")
                raise study.source.fail(where, f"is no earlier factor; {nearest_names(factor.of, earlier)}", factor.of)
            for name in factor.maneuvers:
                if name not in labels:
                    place = ("factors", factor.key, "maneuvers")
                    raise study.source.fail(place, nearest_names(name, labels), name)
            for other, value in factor.when.items():
                place = ("factors", factor.key, "when", other)
                if other not in self._factors:
                    raise study.source.fail(
                        place, f"is no other factor; {nearest_names(other, list(self._factors))}", other
                    )
                if value not in self._factors[other].values:
                    raise study.source.fail(place, f"{shown(value)} is no value of that factor", value)
            for other in factor.grows_with:
                if other not in self._factors or self._factors[other].nominal or self._factors[other].values:
                    ranges = [key for key, of in self._factors.items() if not (of.nominal or of.values)]
                    place = ("factors", factor.key, "grows_with", other)
                    raise study.source.fail(place, f"is no other range; {nearest_names(other, ranges)}", other)

    def overrides(self, maneuver: int, vehicle: int, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return the overrides of a run for the keys that vary in its manoeuvre; None keeps the value of the files."""
        label = label_of(self.study.maneuvers[maneuver])
        found = {}
        # In the order of the file, in which a factor follows the one to which it is relative.
        for key in dict.fromkeys([*(key for key in self._factors if key in values), *values]):
            value, factor = values[key], self._factors.get(key)
            if value is None or (factor is not None and factor.maneuvers and label not in factor.maneuvers):
                continue
            if factor is not None and any(values.get(other) != needed for other, needed in factor.when.items()):
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
        """Return the values of the files for the relative factors, by key."""
        place = maneuver, vehicle
        if place not in self._nominal:
            study = self.study
            label = label_of(study.maneuvers[maneuver])
            items = study.maneuvers[maneuver], study.vehicles[vehicle]
            scenario = resolve(*items, study.overrides, study.driver, study.controllers)
            here = {key: of for key, of in self._factors.items() if not of.maneuvers or label in of.maneuvers}
            needed = {key for key, of in here.items() if of.nominal}
            needed |= {other for of in here.values() for other in of.grows_with if other in here}
            relative = {key: value_of(scenario, key, study.controllers) for key in self._factors if key in needed}
            for key, value in relative.items():
                if not isinstance(value, int | float) or isinstance(value, bool):
                    raise study.source.fail(
                        ("factors", key, "nominal"), f"is {shown(value)} in {label}: nothing can be relative to it"
                    )
            self._nominal[place] = relative
        return self._nominal[place]
