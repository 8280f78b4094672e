"""Study file of a fit: recordings as manoeuvres, factors to be found, and the table [fit]."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from activesteer.config import Range, build
from activesteer.scenario import FileOrTable
from activesteer.scenario.recorded_inputs import is_recording
from activesteer.studies.engine.study_file import StudyFile, read_study


@dataclass(frozen=True)
class FitTable:
    """Table [fit] of a study file."""

    noise: dict[str, Annotated[float, Range(1e-12)]]
    """Channel -> standard deviation of its noise, in the unit of the key, such as `yaw_rate_degps`; the scale of its
    differences."""
    start: dict[str, float] = field(default_factory=dict)
    """Factor -> start of the search; by default the value of the files, or the middle of the range."""
    from_s: float | None = None
    """Start of the compared part of the recordings [s]; inputs are driven from the first row."""
    until_s: float | None = None
    """End of the compared part [s]."""
    windows: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Recording -> its own start and end of the compared part [s]."""
    intervals: Literal["residuals", "noise"] = "residuals"
    """Basis of the intervals: the final residuals with their autocorrelation, or the stated `noise`."""


def read_fit(given: FileOrTable) -> tuple[StudyFile, FitTable]:
    """Read a study file with a table [fit].

    Args:
        given: Name or path of the file, or its table.

    Raises:
        StudyError: the file cannot be read, a key or value is wrong, or the study cannot be fitted.
    """
    study = read_study(given, "fit")
    fail = study.source.fail
    table = build(FitTable, study.fit or {}, study.source, ("fit",))
    if not table.noise:
        raise fail(("fit", "noise"), "is empty; give at least one channel, such as yaw_rate_degps = 0.2")
    if study.case_list is not None or not study.factors:
        raise fail(("factors",), "a fit needs factors with ranges")
    for key in ("vehicles", "controllers"):
        if len(getattr(study, key)) != 1:
            raise fail((key,), f"a fit needs exactly one, not {len(getattr(study, key))}")
    for maneuver in study.maneuvers:
        if not is_recording(maneuver):
            raise fail(("maneuvers",), f"{maneuver!r} is no recording (.mcap) with inputs to drive", maneuver)
    for factor in study.factors:
        if factor.kind != "uniform":
            raise fail(("factors", factor.key, factor.kind), "a fit needs a range: uniform = [low, high]")
    ranges = {factor.key: Range(factor.low, factor.high) for factor in study.factors}
    for key, value in table.start.items():
        if key not in ranges:
            raise fail(("fit", "start", key), f"is no factor; factors are {', '.join(ranges)}", value, list(ranges))
        if not ranges[key].low <= value <= ranges[key].high:
            raise fail(
                ("fit", "start", key), f"{value:g} is out of its range; that is {ranges[key]}", value, ranges[key]
            )
    return study, table
