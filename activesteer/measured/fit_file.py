"""The study file of a fit: recordings in place of manoeuvres, factors that are looked for, and the table [fit]."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from activesteer.config import Range, build
from activesteer.scenario import FileOrTable
from activesteer.scenario.recorded_inputs import is_recording
from activesteer.studies.engine.study_file import StudyFile, read_study


@dataclass(frozen=True)
class FitTable:
    """The table [fit] of a study file."""

    noise: dict[str, Annotated[float, Range(1e-12)]]
    """Channel -> standard deviation of its noise, in the unit of the key, as `yaw_rate_degps`: what a difference of
    that channel is measured by."""
    start: dict[str, float] = field(default_factory=dict)
    """Factor -> where the search begins; where not given at what the files say, or in the middle of its range."""
    from_s: float | None = None
    """Differences before this instant of the recordings do not count; its inputs are driven from its first row."""
    until_s: float | None = None
    """Those behind it neither."""
    intervals: Literal["residuals", "noise"] = "residuals"
    """What the intervals rest on: what is left in the end, with its autocorrelation, or `noise` as it is stated."""


def read_fit(given: FileOrTable) -> tuple[StudyFile, FitTable]:
    """Read a study file with a table [fit].

    Args:
        given: Name or path of the file, or its table.

    Raises:
        StudyError: it cannot be read, a key or value is wrong, or it is no study that can be fitted.
    """
    study = read_study(given, "fit")
    fail = study.source.fail
    table = build(FitTable, study.fit or {}, study.source, ("fit",))
    if not table.noise:
        raise fail(("fit", "noise"), "is empty; at least one channel is needed, as yaw_rate_degps = 0.2")
    if study.case_list is not None or not study.factors:
        raise fail(("factors",), "a fit needs factors: what is looked for, and in which range")
    for key in ("vehicles", "controllers"):
        if len(getattr(study, key)) != 1:
            raise fail((key,), f"a fit has one of them, not {len(getattr(study, key))}")
    for maneuver in study.maneuvers:
        if not is_recording(maneuver):
            raise fail(("maneuvers",), f"{maneuver!r} is no recording (.mcap), whose inputs could be driven", maneuver)
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
