"""Plan of a study: the ordered list of its runs, with all keys checked before the first run."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.analysis.claims.judge import SYSTEMS
from activesteer.config import leaves
from activesteer.controllers import is_read, keys_read, load_controller
from activesteer.errors import ActiveSteerError, ParameterError, nearest_names, shown
from activesteer.scenario import Scenario, check_gains, describe
from activesteer.studies.engine.design import Samples
from activesteer.studies.engine.factor_values import FactorValues, label_of
from activesteer.studies.engine.runs import Request, Settings, digest, present_inputs
from activesteer.studies.engine.study_file import SEARCHES, StudyFile

_LABELS: Final = ("name", "title")
"""Keys of manoeuvres and vehicles that affect texts only."""


class Plan:
    """The runs of a study: every sample in each manoeuvre and vehicle, and every controller in each sample."""

    def __init__(self, study: StudyFile, folder: Path | None = None) -> None:
        """Check the study and enumerate its runs."""
        self.study = study
        self.samples = study.samples()
        self._values = FactorValues(study)
        labels = {key: _labels(study, key) for key in ("maneuvers", "vehicles", "controllers")}
        self.settings = Settings(
            replace(study, case_list=None, **dict.fromkeys(SEARCHES)),
            folder=None if study.recordings == "none" else folder,
            named=tuple(self._named()),
            expected={},
        )
        _check(study, self.samples, self._values)
        self.settings.expected.update(present_inputs(self.settings))
        table = {key: value for key, value in study.to_table().items() if key not in (*labels, "title", *SEARCHES)}
        table["design"] = [samples.columns for samples in self.samples]
        self._maneuver_of: list[int] | None = None
        if study.design.maneuvers == "one":
            order = np.random.default_rng([study.seed, len(study.maneuvers)]).permutation(len(self.samples[0]))
            table["maneuver_of"] = self._maneuver_of = (order % len(study.maneuvers)).tolist()
        self.digest = digest({"study": table | labels, "inputs": self.settings.expected})

    def __len__(self) -> int:
        driven = len(self.study.maneuvers) if self._maneuver_of is None else 1
        return driven * len(self.study.vehicles) * len(self.samples[0]) * len(self.study.controllers)

    def _named(self) -> Iterator[tuple[int, int, dict[str, Any]]]:
        """Yield indices of manoeuvre and vehicle with overrides, for each combination of string values."""
        study = self.study
        places = list(itertools.product(range(len(study.maneuvers)), range(len(study.vehicles))))
        for samples in self.samples:
            texts = {factor.key: factor.values for factor in study.factors if _has_text(factor.values)}
            columns = {key: drawn for key, drawn in samples.columns.items() if key in texts or _has_text(drawn)}
            rows: Iterable[tuple[Any, ...]] = dict.fromkeys(zip(*columns.values(), strict=True))
            if study.tune:  # a search combines values as it proceeds
                rows = itertools.product(*texts.values())
            elif texts:  # the check for factors without effect changes one of them
                rows = dict.fromkeys(other for row in rows for other in _with_one_changed(row, list(texts.values())))
            for row in rows if columns else ():
                sample = samples[0] | dict(zip(columns, row, strict=True))
                for place in places:
                    yield *place, study.overrides | self._values.overrides(*place, sample)

    def request(self, run: int) -> Request:
        """Return a run by its number."""
        place, controller = divmod(run, len(self.study.controllers))
        place, sample = divmod(place, len(self.samples[0]))
        maneuver, vehicle = divmod(place, len(self.study.vehicles))
        if self._maneuver_of is not None:
            maneuver = self._maneuver_of[sample]
        samples = self.samples[controller if len(self.samples) > 1 else 0]
        return self.request_with(run, sample, (maneuver, vehicle, controller), samples[sample])

    def request_with(self, run: int, sample: int, place: tuple[int, int, int], factors: dict[str, Any]) -> Request:
        """Return a run with other values of some keys."""
        overrides = self.study.overrides | self._values.overrides(*place[:2], factors)
        return Request(run, sample, *place, factors, overrides)

    def requests(self, runs: Iterable[int]) -> list[Request]:
        """Return several runs by their numbers."""
        return [self.request(run) for run in runs]


def _has_text(values: Iterable[Any]) -> bool:
    return any(isinstance(value, str) for value in values)


def _with_one_changed(row: tuple[Any, ...], values: Sequence[Sequence[Any]]) -> Iterator[tuple[Any, ...]]:
    """Yield a combination, and all combinations that differ from it in one value."""
    yield row
    for place, allowed in enumerate(values):
        yield from ((*row[:place], value, *row[place + 1 :]) for value in allowed)


def _labels(study: StudyFile, key: str) -> list[str]:
    """Return the unique names of the items without folders, so that results are equal on every machine."""
    labels = [label_of(item) for item in getattr(study, key)]
    for label in labels:
        if labels.count(label) > 1:
            raise study.source.fail((key,), f"two of them have the name {label!r}; names must be unique")
    return labels


def _check(study: StudyFile, samples: Sequence[Samples], factor_values: FactorValues) -> None:
    """Check that every key exists in every manoeuvre and vehicle, allows its extreme values, and has an effect."""
    if study.claims and not set(SYSTEMS) <= set(study.controllers):
        raise study.source.fail(("claims",), f"needs the controllers {', '.join(SYSTEMS)}")
    first = samples[0][0] if len(samples[0]) else {}
    effective: set[str] = set()
    for place in itertools.product(range(len(study.maneuvers)), range(len(study.vehicles))):
        base = _resolved(factor_values, place, first)
        for controller in study.controllers:
            load_controller(controller, base.controller_setup(study.timestep_s))
        _check_curves(study, base)
        for key, values in _extremes(study, samples).items():
            if len(values) == 1:
                if key in factor_values.overrides(*place, {key: values[0]}):
                    effective.add(key)
                continue
            one, *others = _described(factor_values, place, samples[0], key, values)
            differing = (
                path for other in others for path in one.keys() | other.keys() if one.get(path) != other.get(path)
            )
            if any(_is_read(path, base, study.controllers) for path in differing):
                effective.add(key)
    try:
        check_gains(study.overrides, study.controllers)
    except ParameterError as reason:
        raise study.source.placed(("overrides",), reason) from reason
    for key in study.keys:
        if key not in effective:
            place = ("design", "cases", key) if study.case_list else ("factors", key)
            raise study.source.fail(place, "has no effect in any of the study's runs")


def _resolved(
    factor_values: FactorValues, place: tuple[int, int], sample: Mapping[str, Any], key: str = ""
) -> Scenario:
    study, (maneuver, vehicle) = factor_values.study, place
    try:
        return study.scenario(maneuver, vehicle, study.overrides | factor_values.overrides(*place, sample))
    except ActiveSteerError as error:
        where = f"in {label_of(study.maneuvers[maneuver])} with {label_of(study.vehicles[vehicle])}"
        error.add_note(where + (f", factor {key}" if key else ""))
        raise


def _described(
    factor_values: FactorValues, place: tuple[int, int], samples: Samples, key: str, values: Sequence[Any]
) -> list[dict[tuple[str, ...], Any]]:
    """Return the inputs of a run at each value of a key, with the other keys from the first sample if possible."""
    study = factor_values.study
    conditions = next((factor.conditions for factor in study.factors if factor.key == key), {})
    needed = {other: wanted[0] for other, wanted in conditions.items()}
    first, cases = {**samples[0], **needed}, study.case_list
    whole = []
    if cases is not None:
        rows = [cases[cases.columns[key].index(value)] for value in values]
        whole = [_leaves(_resolved(factor_values, place, row, key)) for row in rows]
    try:
        return [_leaves(_resolved(factor_values, place, {**first, key: value}, key)) for value in values]
    except ActiveSteerError:
        if not whole:
            raise
        return whole  # the keys of a case may depend on each other: one alone may be invalid


def _check_curves(study: StudyFile, scenario: Scenario) -> None:
    """Check that every channel in `curves` is recorded."""
    if not study.curves:
        return
    known = [channel.name for channel in scenario.car.on(scenario.maneuver.ground).channels.channels]
    for name in study.curves:
        if name not in known:
            raise study.source.fail(
                ("curves",), f"there is no channel {shown(name)}; {nearest_names(name, known)}", name
            )


def _extremes(study: StudyFile, samples: Sequence[Samples]) -> dict[str, list[Any]]:
    """Return the extreme values of each key, or all values of an unordered key."""
    if study.case_list is None:
        return {factor.key: list(factor.extremes) for factor in study.factors}
    found: dict[str, list[Any]] = {}
    for key, column in samples[0].columns.items():
        present = [value for value in column if value is not None]
        numbers = all(isinstance(value, (int, float)) for value in present)
        different = {str(value): value for value in present}
        found[key] = sorted({min(present), max(present)}) if numbers else list(different.values())
        if len(present) < len(column):
            found[key].append(None)  # without a value, the key keeps the value of the files
    return found


def _leaves(scenario: Scenario) -> dict[tuple[str, ...], Any]:
    """Return all inputs of a run by path."""
    return leaves(describe(scenario) | {"overrides": {}, "files": scenario.files})


def _is_read(path: tuple[str, ...], scenario: Scenario, controllers: Sequence[str]) -> bool:
    """Return whether a key affects any run: a gain needs its controller, a preview needs a path."""
    part, first, *rest = [*path, "", ""]
    follows_path = scenario.maneuver.course is not None
    if part == "files":
        return True
    if first in _LABELS:
        return False
    others = [name for name in controllers if name != "none"]
    if part == "vehicle" and first == "controllers":
        return any(is_read(".".join(path[2:]), keys_read(name)) for name in others)
    if part == "vehicle" and first == "single_track" and rest[0] != "mass_kg":  # the speed controller uses it too
        return bool(others) or follows_path or scenario.maneuver.settling_setpoint().curvature_demand_1pm is not None
    if part == "driver":
        return not scenario.driver.plugin.is_builtin or follows_path or first.startswith("speed_")
    return True


def task_size(runs: int, controllers: int, in_flight: int) -> int:
    """Return the number of runs per task, from 8 to 64 and in complete samples."""
    wanted = int(np.clip(runs // (8 * in_flight), 8, 64))
    if runs < 8 * in_flight:
        wanted = max(1, runs // in_flight)
    return max(controllers, wanted // controllers * controllers)
