"""Content of the tables of a report, as text."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from typing import Any, Final, NamedTuple

from activesteer.analysis.claims.scorecard import Scorecard, Verdict
from activesteer.analysis.harm import LOST, is_controlled, kept, losses, shown
from activesteer.analysis.report.groups import Group, ReportedRun, entry
from activesteer.metric_table import CONES_HIT, CONES_MISSED, LANE_OVERSTEP, SIDESLIP_PEAKS, Better, recorded_metric
from activesteer.recording import Recording
from activesteer.units import display_unit, parameter_label, typeset


class Change(StrEnum):
    """Significance of a difference from the first run."""

    BETTER = "better"
    WORSE = "worse"
    SAME = "same"
    """Neither a driver nor a sensor in a test car could tell the values apart."""
    OTHER = "other"
    """The values differ, and neither is better."""


def significance(name: str, value: float, first: float) -> Change:
    """Compare a metric with its value in the first run."""
    metric = recorded_metric(name)
    if metric.better is None or not math.isfinite(value - first):
        return Change.OTHER
    size, before = metric.cost(value), metric.cost(first)
    if is_near(name, size, before):
        return Change.SAME
    return Change.BETTER if size < before else Change.WORSE


def is_near(name: str, value: float, first: float) -> bool:
    """Return whether neither a driver nor a sensor could tell two values [SI] apart."""
    near = abs(value - first) <= recorded_metric(name).significance
    return near or difference_text(name, value, first).text == "0"


class Row(NamedTuple):
    """A parameter."""

    key: str  # its name, with the names of its tables
    values: tuple[str, ...]  # its value in each run; a single value if all runs have the same

    @property
    def differs(self) -> bool:
        """True if the runs differ in this parameter."""
        return len(self.values) > 1


def rows(recordings: Sequence[Recording], *tables: str) -> list[Row]:
    """Return the entries of tables of the metadata: those of the first run in its order, then those of later runs."""
    flat = [dict(_flat(_chosen(run.metadata, tables))) for run in recordings]
    found = []
    for key in dict.fromkeys(key for entries in flat for key in entries):
        values = tuple(entries.get(key, "") for entries in flat)
        found.append(Row(key, values if len(set(values)) > 1 else values[:1]))
    return found


def _chosen(metadata: Mapping[str, Any], tables: Sequence[str]) -> Mapping[str, Any]:
    if len(tables) == 1:
        table = metadata.get(tables[0], {})
        return table if isinstance(table, Mapping) else {tables[0]: table}
    return {key: metadata[key] for key in tables if key in metadata}


def _flat(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", _text(key, value)


def _text(key: str, value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return str(value).lower() if value is not None else "none"
    if isinstance(value, int | float):
        unit, factor = display_unit(key)
        return typeset(f"{value:.6g}" if factor == 1.0 else f"{value:.6g} ({value * factor:.4g} {unit})")
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


MAX_FIGURES: Final = 6
"""Most key figures that can be read at a glance."""


class KeyFigure(NamedTuple):
    """A key figure of runs."""

    title: str  # its name
    metrics: tuple[str, ...]  # names of metrics; the first one that a run has is shown


class Figure(NamedTuple):
    """A key figure of a run, as text."""

    text: str  # its value
    difference: str = ""  # difference from the first run; empty for the first run and without a difference
    change: Change = Change.OTHER  # significance of the difference


class Result(NamedTuple):
    """Result of a run."""

    run: ReportedRun  # the run
    losses: tuple[str, ...]  # its failures, in words
    kept: tuple[str, ...]  # the requirements that it met, in words
    figures: tuple[Figure, ...]  # its key figures


KEY_FIGURES: Final = (
    KeyFigure("Cones hit", (CONES_HIT,)),
    KeyFigure("Cones missed", (CONES_MISSED,)),
    KeyFigure("Beyond the lane", (LANE_OVERSTEP,)),
    KeyFigure("Stopping distance", ("stopping_distance_m",)),
    KeyFigure("Peak sideslip", SIDESLIP_PEAKS),
    KeyFigure("Settled yaw rate", ("yaw_rate_steady_state_radps",)),
    KeyFigure("Yaw rate overshoot", ("yaw_rate_overshoot",)),
    KeyFigure("Yaw rate response time", ("yaw_rate_response_time_s",)),
    KeyFigure("Yaw rate left at 1.75 s", ("yaw_rate_after_1750ms_share",)),
    KeyFigure("Yaw rate error at 1 s", ("yaw_rate_deviation_after_1000ms_radps",)),
    KeyFigure("Peak yaw rate", ("yaw_rate_peak_abs_radps", "yaw_rate_peak_radps")),
    KeyFigure("Mean deceleration", ("mean_deceleration_mps2",)),
    KeyFigure("Off the path", ("track_deviation_max_m",)),
    KeyFigure("Steering effort, rms rate", ("steering_wheel_rate_rms_radps",)),
    KeyFigure("Seat acceleration rms", ("seat_acceleration_rms_mps2",)),
    KeyFigure("Heading at the end", ("heading_end_rad",)),
    KeyFigure("Delay of the yaw rate", ("yaw_rate_delay_s",)),
    KeyFigure("Delay of the lateral acceleration", ("ay_delay_s",)),
    KeyFigure("Lap time", ("lap_time_s",)),
    KeyFigure("Beyond the edge of the road", ("road_overstep_m",)),
    KeyFigure("Time on two wheels", ("two_wheel_lift_time_s",)),
    KeyFigure("Energy from the battery", ("battery_energy_J",)),
    KeyFigure("Largest wheel load variation", ("wheel_load_coefficient_max",)),
    KeyFigure("Share of time with a wheel lifted", ("wheel_lift_share",)),
    KeyFigure("Share of time beyond the known surface", ("extended_road_share",)),
    KeyFigure("Largest suspension travel", ("suspension_travel_max_m",)),
)
"""Key figures in the order of their columns. A manoeuvre has some of them."""


HEADLINE: Final = "Peak sideslip [deg]"
"""Title of the key figure that is shown where there is room for only one."""


def key_titles(group: Group) -> list[str]:
    """Return the titles of the columns of key figures, with their units."""
    return [
        f"{figure.title} [{unit}]" if (unit := recorded_metric(name).unit_name) else figure.title
        for figure, name in _chosen_figures(group)
    ]


def results(group: Group) -> list[Result]:
    """Return the result of each run of a group, compared with the first run."""
    chosen = list(_chosen_figures(group))
    first = group.runs[0].recording.metrics
    lost = [(*(["incomplete"] if run.problem else []), *losses(run.recording.metrics)) for run in group.runs]
    found = []
    for place, run in enumerate(group.runs):
        metrics = run.recording.metrics
        well = tuple(kept(metrics)) or (("stays under control",) if any(lost) and not lost[place] else ())
        figures = [_figure(name, metrics, first if place else None) for _, name in chosen]
        if not (_is_judged(group.runs[0]) and _is_judged(run)):
            figures = [figure._replace(change=Change.OTHER) for figure in figures]
        found.append(Result(run, lost[place], well, tuple(figures)))
    return found


def _is_judged(run: ReportedRun) -> bool:
    """Return whether a change from or to this run can be good or bad: it is complete, and the car is controlled."""
    return not run.problem and is_controlled(run.recording.metrics)


def _chosen_figures(group: Group) -> Iterator[tuple[KeyFigure, str]]:
    """Yield the key figures that any run has, with their metrics."""
    names = {name for run in group.runs for name in run.recording.metrics}
    having = (
        (figure, name) for figure in KEY_FIGURES if (name := next(filter(names.__contains__, figure.metrics), ""))
    )
    yield from list(having)[:MAX_FIGURES]


def _figure(name: str, metrics: Mapping[str, float], first: Mapping[str, float] | None) -> Figure:
    sizes = abs if recorded_metric(name).better is Better.SMALLER else float
    value = sizes(metrics.get(name, math.nan))
    text = shown(name, metrics, number(name, value))
    if LOST in (text, shown(name, first or {}, "")):
        return Figure(text)
    before = math.nan if first is None else sizes(first.get(name, math.nan))
    if not math.isfinite(value - before):
        return Figure(text)
    difference = difference_text(name, value, before)
    if is_near(name, value, before):
        return Figure(text, difference.text, Change.SAME)
    return Figure(text, difference.percent or difference.text, significance(name, value, before))


class Cell(NamedTuple):
    """A number, or a difference with its percentage of the first run's value, if that has a meaning."""

    text: str
    percent: str = ""


class MetricRow(NamedTuple):
    """A metric of all runs of a group."""

    name: str  # its name in words
    unit: str  # unit of the numbers
    cells: tuple[Cell, ...]  # value of the first run, then value and difference from the first run of each other run


def verdict_counts(scorecards: Iterable[Scorecard]) -> dict[Verdict, int]:
    """Return the number of claims by verdict, without verdicts of no claim."""
    verdicts = [item.verdict for card in scorecards for item in card.judged]
    return {verdict: verdicts.count(verdict) for verdict in Verdict if verdict in verdicts}


def file_rows(groups: Sequence[Group]) -> tuple[list[str], list[list[str]]]:
    """Return the titles of the table of files, and a row for each run."""
    runs = [(group, run) for group in groups for run in group.runs]
    changed = [changed_parameters(run) for _, run in runs]
    titles = ["File", "Manoeuvre", "Controller", "Vehicle", "Duration", *(["Changed"] if any(changed) else [])]
    rows = []
    for (group, run), overrides in zip(runs, changed, strict=True):
        span_s = float(run.recording.time_s[-1] - run.recording.time_s[0])
        controller = str(run.recording.metadata.get("controller", ""))
        vehicle = entry(run.recording, "vehicle", "name")
        rows.append([run.source, group.name, controller, vehicle, f"{span_s:.3f} s", overrides][: len(titles)])
    return titles, rows


def changed_parameters(run: ReportedRun) -> str:
    """Describe the overrides of a run, with their values and keys, or empty without overrides."""
    changed: Any = run.recording.metadata.get("overrides")
    return ", ".join(_told(*one) for one in changed.items()) if isinstance(changed, Mapping) else ""


def _told(key: str, value: Any) -> str:
    words, unit = parameter_label(key)
    return f"{words} {value} {unit}".rstrip() + f" ({key})"


def metric_titles(group: Group) -> list[str]:
    """Return the titles of the columns of `metric_rows`."""
    first, *others = (run.name for run in group.runs)
    return ["Metric", "Unit", first, *(title for name in others for title in (name, f"{name} against {first}"))]


def metric_rows(group: Group) -> list[MetricRow]:
    """Return the metrics, with their differences from the first run."""
    values = [run.recording.metrics for run in group.runs]
    rows = []
    for name in dict.fromkeys(name for metrics in values for name in metrics):
        metric = recorded_metric(name)
        first, *others = (metrics.get(name, math.nan) for metrics in values)
        texts = [shown(name, run, number(name, run.get(name, math.nan))) for run in values]
        cells = [Cell(texts[0])]
        for value, text in zip(others, texts[1:], strict=True):
            compared = difference_text(name, value, first) if LOST not in (text, texts[0]) else Cell("\N{EN DASH}")
            cells += [Cell(text), compared]
        rows.append(MetricRow(metric.label, metric.unit_name, tuple(cells)))
    return rows


def number(name: str, value: float) -> str:
    """Write the value of a metric [SI] for display: three decimals, fewer for large values; a dash for nan."""
    if not math.isfinite(value):
        return "\N{EN DASH}"
    metric = recorded_metric(name)
    return metric.text(value) if metric.whole else _decimal(value * metric.unit.factor)


def difference_text(name: str, value: float, first: float) -> Cell:
    """Write the difference of a metric [SI] from its value in the first run.

    The cell has a percentage too, if the first value is significant and positive.
    """
    if not (math.isfinite(value) and math.isfinite(first)):
        return Cell("\N{EN DASH}")
    metric = recorded_metric(name)
    difference = (value - first) * metric.unit.factor
    if metric.whole:
        return Cell(typeset(f"{difference:+.0f}") if difference else "0")
    if abs(difference) < 0.0005:
        return Cell("0")
    text = f"{'+' if difference > 0.0 else ''}{_decimal(difference)}"
    nearly_nothing = max(metric.significance * metric.unit.factor, 0.01)
    if metric.unit.name == "%" or first * metric.unit.factor <= nearly_nothing:
        return Cell(text)
    if not 0.005 <= abs(share := (value - first) / first) < 10.0:
        return Cell(text)
    return Cell(text, typeset(f"{share * 100.0:+.0f}\N{NO-BREAK SPACE}%"))


def _decimal(value: float) -> str:
    decimals = next((decimals for top, decimals in ((10.0, 3), (100.0, 2), (1000.0, 1)) if abs(value) < top), 0)
    text = f"{value:.{decimals}f}"
    return typeset(text.lstrip("-") if float(text) == 0.0 else text)
