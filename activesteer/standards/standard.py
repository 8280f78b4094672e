"""Shared parts of the standards: test runner, runs, findings, tables and panels."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.analysis.series import value_at
from activesteer.config import Range
from activesteer.core.conventions import CURVE_STEP_S, Array
from activesteer.core.metric_table import metric
from activesteer.core.units import quantity_of
from activesteer.errors import ManeuverError, RecordingError
from activesteer.pages import Table
from activesteer.plotting import Curve, Panel, Picture
from activesteer.scenario import FileOrTable, Scenario, resolve
from activesteer.studies.engine.runs import CURVE, Status
from activesteer.studies.engine.study import study
from activesteer.studies.engine.workers import Progress, Workers

_LEAD_S: Final = 0.2
"""Time by which a curve begins before time zero [s]."""
SIDES: Final = {"left": 1.0, "right": -1.0}
"""Sign of the steering wheel angle for each side of the steering (ISO 8855)."""


class NoResult(ManeuverError):  # noqa: N818 - named as the outcome of a test
    """Failure of a prerequisite run, without which a car cannot be tested."""


@dataclass(frozen=True)
class StandardRun:
    """A finished run in the form of a recording for the analysis."""

    case: Mapping[str, Any]  # values in which it differs from the other runs of its series
    metrics: Mapping[str, float]  # its metrics; empty if it failed or could not be evaluated
    channels: Mapping[str, Array]  # kept channels over time, every `CURVE_STEP_S`
    error: str  # reason for missing metrics; empty if there are metrics

    @property
    def time_s(self) -> Array:
        """Times of the samples [s]."""
        return np.asarray(CURVE_STEP_S * np.arange(len(next(iter(self.channels.values()), ()))), dtype=np.float64)

    @property
    def metadata(self) -> Mapping[str, Any]:
        """Empty metadata, because the test runner knows the car."""
        return {}

    def __getitem__(self, channel: str) -> Array:
        """Return a channel over `time_s`."""
        if channel not in self.channels:
            raise RecordingError(self.error or f"{channel} was not kept", value=channel, allowed=tuple(self.channels))
        return self.channels[channel]

    def at(self, channel: str, time_s: float) -> float:
        """Return the interpolated value of a channel at a time, or nan after the end of the run."""
        values = self.channels.get(channel, np.empty(0))
        return value_at(self.time_s, values, time_s) if len(values) else math.nan

    @property
    def values(self) -> dict[str, Any]:
        """Return case and metrics as JSON values, or the reason for missing metrics."""
        return {**self.case, **(dict(self.metrics) if not self.error else {"error": self.error})}

    def metric(self, name: str) -> float:
        """Return a metric, or nan if the run does not have it."""
        return self.metrics.get(name, math.nan)

    def over_time(self, channel: str, *, begin_s: float = 0.0, **words: Any) -> Curve:
        """Return a channel in its unit for display, from shortly before time zero."""
        values = self.channels.get(channel, np.empty(0))
        time_s = self.time_s[: len(values)] - begin_s
        shown = time_s >= -_LEAD_S
        return Curve(time_s[shown], quantity_of(channel).factor * values[shown], **words)


@dataclass
class StandardRunner:
    """Runner of a standard's tests: a car, a controller, a driver, and one set of workers."""

    standard: str
    vehicle: FileOrTable  # name, path or table of the vehicle
    driver: FileOrTable  # name, path or table of the driver, or the file of a driver plug-in
    controller: str  # name or file of the controller
    overrides: Mapping[str, Any]  # overrides of the car: dotted key -> value
    folder: Path | None  # folder for the studies, which can be resumed; None if they are not kept
    workers: Workers  # processes that make the runs
    progress: Progress  # called with the series, number of finished runs, and number of all runs

    def scenario(self, maneuver: FileOrTable, overrides: Mapping[str, Any] | None = None) -> Scenario:
        """Resolve a manoeuvre with the car of the runner."""
        changes = {**(overrides or {}), **self.overrides}
        return resolve(maneuver, self.vehicle, changes, self.driver, [self.controller])

    def drive(
        self,
        series: str,
        maneuver: FileOrTable,
        cases: Sequence[Mapping[str, Any]],
        overrides: Mapping[str, Any] | None = None,
        curves: Sequence[str] = (),
    ) -> list[StandardRun]:
        """Drive a series of runs."""
        table = study(
            {
                "title": f"{self.standard}: {series}",
                "maneuvers": [maneuver],
                "vehicles": [self.vehicle],
                "driver": self.driver,
                "controllers": [self.controller],
                "overrides": {**(overrides or {}), **self.overrides},
                "design": {"kind": "list", "cases": [dict(case) for case in cases]},
                **({"curves": list(curves)} if curves else {}),
            },
            output=None if self.folder is None else self.folder / series,
            workers=self.workers,
            progress=lambda counted: self.progress(series, counted.done, counted.total),
        )
        return [_run(row, case) for row, case in zip(table.to_pylist(), cases, strict=True)]


def _run(row: Mapping[str, Any], case: Mapping[str, Any]) -> StandardRun:
    told = {*case, "run", "sample"}
    return StandardRun(
        case,
        {name: value for name, value in row.items() if isinstance(value, float) and name not in told},
        {
            name.removeprefix(CURVE): np.asarray(value, dtype=np.float64)
            for name, value in row.items()
            if name.startswith(CURVE) and value is not None
        },
        "" if row["status"] == Status.OK else row["error"] or row["status"],
    )


@dataclass(frozen=True)
class Findings:
    """Findings of a test of one car with one controller."""

    values: dict[str, Any]  # values that `--json` prints, with `pass` if the standard has limits
    summary: str  # verdict or findings in a sentence
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()

    @property
    def error(self) -> str:
        """Reason for a missing result, empty otherwise."""
        return self.values.get("error", "")

    @property
    def passed(self) -> bool | None:
        """True if the car meets the limits, or None for a method without limits."""
        return self.values.get("pass")


_RATE_DEGPS: Final = 5.0
"""Rate of the ramp [deg/s]. The car lags by about 0.1 s, which is half a degree."""
_LONGEST_S: Final = 30.0


def steering_wheel_at(runner: StandardRunner, speed_kmh: float, ay_mps2: float) -> float:
    """Return the steering wheel angle at a lateral acceleration, from a slow ramp steer to the left."""
    [run] = runner.drive(
        f"ramp_{speed_kmh:g}kmh",
        "slowly_increasing_steer",
        [{"speed_kmh": speed_kmh}],
        {"steer.rate_degps": _RATE_DEGPS, "duration_s": _LONGEST_S},
        ("steering_wheel_rad", "ay_mps2"),
    )
    try:
        ay = run["ay_mps2"]
    except RecordingError as reason:
        raise NoResult(f"the slow ramp at {speed_kmh:g} km/h cannot be driven: {reason}") from reason
    if ay.max() < ay_mps2:
        raise NoResult(
            f"the car reaches {ay.max():.3g} m/s2 at {speed_kmh:g} km/h; the test needs {ay_mps2:g} m/s2",
            value=ay.max(), allowed=Range(ay_mps2),
        )  # fmt: skip
    # Apart from noise, the acceleration rises until then.
    end = int(np.argmax(ay >= ay_mps2))
    rising = np.maximum.accumulate(ay[: end + 1])
    return round(math.degrees(float(np.interp(ay_mps2, rising, run["steering_wheel_rad"][: end + 1]))), 1)


def metrics_table(title: str, runs: Mapping[str, Mapping[str, float]]) -> Table:
    """Return a table of metrics (rows) and runs (columns), with empty cells for missing metrics."""
    names = list(dict.fromkeys(name for metrics in runs.values() for name in metrics))
    rows = [
        [shown.label, shown.unit.name, *(shown.text(metrics.get(shown.name, math.nan)) for metrics in runs.values())]
        for shown in map(metric, names)
    ]
    return Table(title, ("", "unit", *runs), rows)


def axis_label(name: str) -> str:
    """Return the axis label of a channel, with its unit."""
    shown = quantity_of(name)
    return f"{shown.label} [{shown.unit.name}]"


def time_panels(runs: Mapping[str, StandardRun], channels: Sequence[str], begin_s: float, begin: str) -> list[Panel]:
    """Return a panel of runs for each channel, versus the time from a described event."""
    return [
        Panel(
            f"time from {begin} [s]",
            axis_label(channel),
            [run.over_time(channel, begin_s=begin_s, label=label) for label, run in runs.items()],
        )
        for channel in channels
    ]


def cell(value: float | None, digits: int) -> str:
    """Format a number for a table: a hyphen for None or nan, and no minus before a zero."""
    return "-" if value is None or math.isnan(value) else f"{value:z.{digits}f}"
