"""Results of runs for the top of a report: failures, and key figures beside each other."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final, NamedTuple

from activesteer.analysis.harm import LOST, is_controlled, kept, losses, shown
from activesteer.analysis.report.groups import Group, Run
from activesteer.analysis.report.significance import Change, is_near, significance
from activesteer.analysis.report.tables import difference_text, number
from activesteer.metric_table import CONES_HIT, CONES_MISSED, LANE_OVERSTEP, SIDESLIP_PEAKS, Better, recorded_metric

MAX_FIGURES: Final = 6
"""Most key figures that can be read at a glance."""


class KeyFigure(NamedTuple):
    """A key figure of runs.

    Attributes:
        title: Its name.
        metrics: Names of metrics; the first one that a run has is shown.
    """

    title: str
    metrics: tuple[str, ...]


class Figure(NamedTuple):
    """A key figure of a run, as text.

    Attributes:
        text: Its value.
        difference: Difference from the first run; empty for the first run and without a difference.
        change: Significance of the difference.
    """

    text: str
    difference: str = ""
    change: Change = Change.OTHER


class Result(NamedTuple):
    """Result of a run.

    Attributes:
        run: The run.
        losses: Its failures, in words.
        kept: The requirements that it met, in words.
        figures: Its key figures.
    """

    run: Run
    losses: tuple[str, ...]
    kept: tuple[str, ...]
    figures: tuple[Figure, ...]


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
"""Key figures in the order of their columns; a manoeuvre has some of them."""


HEADLINE: Final = "Peak sideslip [deg]"
"""Title of the key figure that is shown where there is room for only one."""


def key_titles(group: Group) -> list[str]:
    """Return the titles of the columns of key figures, with their units."""
    return [
        f"{figure.title} [{unit}]" if (unit := recorded_metric(name).unit_name) else figure.title
        for figure, name in _chosen(group)
    ]


def results(group: Group) -> list[Result]:
    """Return the result of each run of a group, compared with the first run."""
    chosen = list(_chosen(group))
    first = group.runs[0].recording.metrics
    lost = [(*(["incomplete"] if run.problem else []), *losses(run.recording.metrics)) for run in group.runs]
    found = []
    for place, run in enumerate(group.runs):
        metrics = run.recording.metrics
        well = tuple(kept(metrics)) or (("keeps the car",) if any(lost) and not lost[place] else ())
        figures = [_figure(name, metrics, first if place else None) for _, name in chosen]
        if not (_is_judged(group.runs[0]) and _is_judged(run)):
            figures = [figure._replace(change=Change.OTHER) for figure in figures]
        found.append(Result(run, lost[place], well, tuple(figures)))
    return found


def _is_judged(run: Run) -> bool:
    """Return whether a change from or to this run can be good or bad: it is complete, and the car is controlled."""
    return not run.problem and is_controlled(run.recording.metrics)


def _chosen(group: Group) -> Iterator[tuple[KeyFigure, str]]:
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
