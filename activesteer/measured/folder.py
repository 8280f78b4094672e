"""Validation of a car against the measured runs of a folder: prediction, fit and check.

The *prediction* uses the vehicle file; of the factors, only those in `predict.factors` are free. The *fit* frees all
factors. Both use only the fit windows and are judged in the check windows. The band around the prediction contains
the curves with each interval at either end, after `predict.factors` were fitted again; effects of several intervals
are added.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.analysis.series import rms
from activesteer.config import field_in_unit
from activesteer.core.conventions import Array
from activesteer.errors import ParameterError, RecordingError, StudyError
from activesteer.measured.comparison import Compared, assumptions, compare
from activesteer.measured.fit_result import Fit
from activesteer.measured.fitting import SPEED_HOLD, fit
from activesteer.measured.folder_file import MeasuredFile, RunTable
from activesteer.measured.importing import import_file
from activesteer.recording import Recording
from activesteer.simulation.runner import simulate
from activesteer.studies.engine.workers import in_parallel

PARTS: Final = ("fit", "check")
_LEAST_SAMPLES: Final = 10


class Part(NamedTuple):
    """Comparison of one channel in one window."""

    run: str  # name of the run
    part: str  # one of `PARTS`
    stage: str  # `predicted` or `fitted`
    compared: Compared  # the comparison
    # lower and upper edge of the band around a prediction, without the tolerance, shape (n,) each; None without a band
    band: tuple[Array, Array] | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the comparison as JSON values, SI."""
        return {"run": self.run, "part": self.part, "stage": self.stage, **self.compared.to_json()}

    def box(self) -> dict[str, Any]:
        """Return the mean width of the band [SI], and the share of measured samples in it."""
        assert self.band is not None
        one, (low, high) = self.compared, self.band
        inside = (one.measured >= low - one.noise) & (one.measured <= high + one.noise)
        width = float(np.mean(high - low))
        return {"run": self.run, "channel": one.channel, "width": width, "share_inside": float(np.mean(inside))}


class End(NamedTuple):
    """Effect of both ends of an interval on the prediction."""

    key: str  # key of the value
    source: str  # where its ends come from
    ends: tuple[float, ...]  # the ends
    found: tuple[dict[str, float], ...]  # values of the free factors of the prediction at either end
    effect: dict[str, float]  # channel -> rms of its change in the check windows at the end that changes it more, SI


@dataclass(frozen=True)
class MeasuredValidation:
    """Result of a validation against measured runs."""

    file: MeasuredFile  # the checked file
    predicted: Fit | None  # fit of the free factors of the prediction; None if nothing is free
    fitted: Fit | None  # fit of all factors; None without further factors
    parts: tuple[Part, ...]  # the comparisons; with intervals, predictions in check windows have a band
    ends: tuple[End, ...]  # effect of each interval
    notes: tuple[str, ...]  # what the import noted, by run
    assumptions: tuple[str, ...]  # what was assumed, by the file and by the method

    @property
    def judged(self) -> list[Part]:
        """Comparisons that decide the verdict: the last stage, in the check windows."""
        stage = "predicted" if self.fitted is None else "fitted"
        return [one for one in self.parts if one.stage == stage and one.part == "check"]

    @property
    def inside(self) -> bool:
        """True if every quantity of the last stage is inside its tolerance in the check windows."""
        return all(one.compared.inside for one in self.judged)

    def to_json(self) -> dict[str, Any]:
        """Return the result as JSON values, SI."""
        return {
            "vehicle": self.file.table.vehicle, "title": self.file.table.title, "inside": self.inside,
            "predicted": None if self.predicted is None else self.predicted.to_json(),
            "fitted": None if self.fitted is None else self.fitted.to_json(),
            "quantities": [one.to_json() for one in self.parts],
            "box": [one.box() for one in self.parts if one.band],
            "intervals": [end._asdict() for end in self.ends],
            "notes": list(self.notes), "assumptions": list(self.assumptions),
        }  # fmt: skip


def validate_measured(
    file: MeasuredFile,
    jobs: int | None = None,
    *,
    fitted: bool = True,
    scheduler: str | None = None,
    progress: Callable[[float, str], None] = lambda _share, _what: None,
) -> MeasuredValidation:
    """Predict, fit and check a car against measured runs."""
    free = [factor.key for factor in file.factors if factor.key in file.table.predict.factors]
    with tempfile.TemporaryDirectory() as scratch:
        progress(0.0, "import")
        case = _Case(file, Path(scratch))
        progress(0.1, "prediction")
        predicted = case.fit(free, file.predict_channels, {}, jobs, scheduler)
        known = {} if predicted is None else predicted.overrides
        stages = {"predicted": case.runs(known)}
        parts = case.parts("predicted", stages["predicted"])
        found = None
        if fitted and len(file.factors) > len(free):
            progress(0.3, "fit")
            found = case.fit([factor.key for factor in file.factors], tuple(file.noise), known, jobs, scheduler)
            assert found is not None
            stages["fitted"] = case.runs(found.overrides)
            parts += case.parts("fitted", stages["fitted"])
        calls = [(case, free, known, {key: end}) for key, each in file.table.intervals.items() for end in each.ends]
        beside = in_parallel(
            _at_end, calls, jobs, lambda _, done: progress(0.5 + 0.5 * done / len(calls), "band"), scheduler=scheduler
        )
    parts, ends = _with_bands(file, parts, beside)
    method = [*case.assumptions, "The measured steering and speed are driven again; their errors are in the residuals."]
    if ends:
        method.append("Effects of several intervals add up in the band; each is taken at its two ends only.")
    return MeasuredValidation(
        file, predicted, found, tuple(parts), ends, case.notes, (*file.table.assumptions, *method)
    )


class _Case:
    """Imported runs, and the car that repeats them."""

    def __init__(self, file: MeasuredFile, scratch: Path) -> None:
        self.file, self._scratch = file, scratch
        self._recordings: dict[str, Recording] = {}
        self._windows: dict[tuple[str, str], list[float]] = {}  # (run, part) -> start and end in the recording [s]
        notes = []
        for number, run in enumerate(file.table.runs):
            try:
                recording = import_file(
                    [file.folder / name for name in run.files], file.folder / run.map if run.map else None
                )
            except RecordingError as reason:
                raise RecordingError(
                    f"run {run.name}: {reason.problem}", file=reason.file, line=reason.line, key=reason.key
                ) from reason
            recording.save(scratch / f"{run.name}.mcap")
            self._recordings[run.name] = recording
            self._keep_windows(run, number)
            notes += [f"{run.name}: {note}" for note in recording.metadata["measured"]["notes"]]
        self.notes = tuple(notes)
        self.assumptions: tuple[str, ...] = ()

    def _keep_windows(self, run: RunTable, number: int) -> None:
        recording = self._recordings[run.name]
        offset = float(recording.metadata["measured"]["time_offset_s"])
        first, last = offset + recording.time_s[0], offset + recording.time_s[-1]
        for part, window in zip(PARTS, (run.fit_s, run.check_s), strict=True):
            if window and (window[0] < first - 0.01 or window[1] > last + 0.01):
                raise self.file.source.fail(
                    ("runs", str(number), f"{part}_s"),
                    f"{list(window)} s is not inside the imported part, {first:.2f} to {last:.2f} s", window,
                )  # fmt: skip
            if window:
                self._windows[run.name, part] = [second - offset for second in window]
        for channel in self.file.tolerances:
            if channel not in recording:
                key = next(key for key in self.file.table.quantities if field_in_unit(key, (channel,))[0])
                raise self.file.source.fail(("quantities", key), f"run {run.name} has no such channel", channel)

    def fit(
        self,
        keys: list[str],
        channels: tuple[str, ...],
        start: Mapping[str, Any],
        jobs: int | None,
        scheduler: str | None,
        overrides: Mapping[str, Any] | None = None,
    ) -> Fit | None:
        """Fit factors in the fit windows, or return None without factors."""
        if not keys:
            return None
        windows = {run: window for (run, part), window in self._windows.items() if part == "fit"}
        study = {
            "maneuvers": [str(self._scratch / f"{run}.mcap") for run in windows],
            "vehicles": [self.file.vehicle],
            "overrides": {**self.file.table.overrides, **(overrides or {})},
            "factors": {key: self.file.table.factors[key] for key in keys},
            "fit": {
                "noise": {channel: self.file.noise[channel] for channel in channels},
                "start": {key: value for key, value in start.items() if key in keys},
                "windows": windows,
            },
        }
        try:
            return fit(study, jobs=jobs, scheduler=scheduler)
        except StudyError as reason:  # its keys are those of a study, of which the file has the factors
            where = reason.key.split(".", 1) if reason.key else []
            raise self.file.source.fail(where, reason.problem, reason.value, reason.allowed) from reason

    def runs(self, overrides: Mapping[str, Any]) -> dict[str, Recording]:
        """Drive all runs with these overrides, and return their recordings by name."""
        values = {**SPEED_HOLD, **self.file.table.overrides, **overrides}
        return {
            name: simulate(str(self._scratch / f"{name}.mcap"), "none", self.file.vehicle, values)
            for name in self._recordings
        }

    def parts(self, stage: str, runs: Mapping[str, Recording]) -> list[Part]:
        """Compare the runs in all windows, and return the comparisons."""
        table, found = self.file.table, []
        for run in table.runs:
            result = compare(
                [self._recordings[run.name]], runs[run.name], filtered=table.filter, noise=table.noise_allowance,
                tolerances=self.file.tolerances, aligned=False,
            )  # fmt: skip
            self.assumptions = tuple(assumptions(result))
            for part in PARTS:
                if window := self._windows.get((run.name, part)):
                    found += [Part(run.name, part, stage, _cut(one, *window)) for one in result.quantities]
        return found


def _cut(one: Compared, begin: float, end: float) -> Compared:
    """Return the part of a comparison in a window."""
    rows = (one.x >= begin) & (one.x <= end)
    if np.count_nonzero(rows) < _LEAST_SAMPLES:
        raise ParameterError(f"a window of {end - begin:g} s has fewer than {_LEAST_SAMPLES} samples")
    names = ("x", "measured", "confidence", "simulated", "low", "high", "within")
    return one._replace(**{name: getattr(one, name)[rows] for name in names})


def _at_end(
    case: _Case, free: list[str], start: Mapping[str, Any], end: dict[str, float]
) -> tuple[dict[str, float], list[Array]]:
    """Return the predictions with one uncertain value at an end of its interval, and the refitted factors."""
    found = case.fit(free, case.file.predict_channels, start, 1, None, end)
    known = end | ({} if found is None else found.overrides)
    parts = case.parts("predicted", case.runs(known))
    values = {} if found is None else {one.key: one.value for one in found.parameters}
    return values, [one.compared.simulated for one in parts if one.part == "check"]


def _with_bands(
    file: MeasuredFile, parts: list[Part], beside: list[tuple[dict[str, float], list[Array]]]
) -> tuple[list[Part], tuple[End, ...]]:
    """Return the comparisons, with bands if there are intervals, and the effect of each interval."""
    checked = [place for place, one in enumerate(parts) if one.part == "check" and one.stage == "predicted"]
    ends, effects = [], [dict[str, float]() for _ in file.table.intervals]
    for number, place in enumerate(checked if beside else ()):
        one = parts[place].compared
        pairs = np.stack([side[1][number] - one.simulated for side in beside]).reshape(len(effects), 2, -1)
        for effect, pair in zip(effects, pairs, strict=True):
            effect[one.channel] = max(effect.get(one.channel, 0.0), *map(rms, pair))
        low, high = np.minimum(pairs.min(axis=1), 0.0).sum(axis=0), np.maximum(pairs.max(axis=1), 0.0).sum(axis=0)
        parts[place] = parts[place]._replace(band=(one.simulated + low, one.simulated + high))
    found = [values for values, _ in beside]
    for (key, each), effect, both in zip(
        file.table.intervals.items(), effects, zip(found[::2], found[1::2], strict=True), strict=True
    ):
        ends.append(End(key, each.source, each.ends, both, effect))
    return parts, tuple(ends)
