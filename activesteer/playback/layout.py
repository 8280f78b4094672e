"""Layout of the viewer: chase view, map, plan view of the wheels, plots and summary."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from activesteer.config.faults import fault_words
from activesteer.drawing.cars import CHASSIS, bytes_of
from activesteer.drawing.panels import BODY, DRIVING, MOTION, WHEELS, Panel, panels_in
from activesteer.playback import plots
from activesteer.playback.car import body_path, ghost_path
from activesteer.playback.course import COURSE, MAP, ROAD, map_bounds
from activesteer.playback.runs import TIMELINE, ReplayedRun, times
from activesteer.playback.wheel_angles import plan_view, wedges_path
from activesteer.recording.contents import events_of

LEGEND: Final = "legend"
"""Parent entity of the legends."""
LEGEND_OF_RUNS: Final = f"{LEGEND}/runs"
"""Entity of the legend of the runs, which have the same colours in all plots."""
_WIDTH: Final = 500.0
"""Width of a legend, for a window of 1280 x 800 [screen points]."""
_ROW: Final = 26.0
_LETTER: Final = 6.6
_GAP: Final = 26.0
_BELOW: Final = 12.0
"""Distance from a marker to the middle of its text."""


def legend(path: str, curves: Mapping[str, str]) -> rrb.Spatial2DView:
    """Return a legend as a view."""
    return rrb.Spatial2DView(
        origin=f"/{path}",
        name=f"Curves: {path.removeprefix(LEGEND)[1:]}",
        titlebar=False,
        visual_bounds=rrb.VisualBounds2D(x_range=(0.0, _WIDTH), y_range=(0.0, height(curves))),
    )


def height(curves: Mapping[str, str]) -> float:
    """Return the height of a legend."""
    return _ROW * (1 + max((row for row, _ in _places(curves)), default=0))


def send_legend(stream: rr.RecordingStream, path: str, curves: Mapping[str, str]) -> None:
    """Send a legend: names and colours."""
    points = rr.Points2D(
        [(middle, (row + 0.5) * _ROW - _BELOW) for row, middle in _places(curves)],
        labels=list(curves),
        show_labels=True,
        colors=[bytes_of(colour) for colour in curves.values()],
        radii=0.0,
    )
    stream.log(path, points, static=True)


def _places(curves: Mapping[str, str]) -> list[tuple[int, float]]:
    """Return the row and the centre of each name."""
    places, row, at = [], 0, 0.0
    for name in curves:
        wide = _LETTER * len(name) + _GAP
        if at > 0.0 and at + wide > _WIDTH:
            row, at = row + 1, 0.0
        places.append((row, at + 0.5 * wide))
        at += wide
    return places


_LIMIT: Final = "_saturated"
_SHORTEST_S: Final = 0.05
"""Longest interruption of a saturation that is ignored [s]."""


class Event(NamedTuple):
    """Start or end of a fault or a saturation, or a recorded event."""

    time_s: float
    text: str
    level: rr.TextLogLevel


def events(run: ReplayedRun) -> list[Event]:
    """Return the faults of the manoeuvre, the recorded events and the saturations, sorted by time."""
    return sorted([*_faults(run), *_recorded(run), *_limits(run)], key=lambda event: event.time_s)


def _recorded(run: ReplayedRun) -> Iterator[Event]:
    levels = {"fail": ("FAULT ", rr.TextLogLevel.ERROR)}
    for event in events_of(run.recording.metadata):
        start, level = levels.get(event.kind, (f"{event.kind}: ", rr.TextLogLevel.INFO))
        yield Event(event.time_s, start + event.what, level)


def _faults(run: ReplayedRun) -> Iterator[Event]:
    maneuver = run.recording.metadata.get("maneuver")
    faults = maneuver.get("fault") if isinstance(maneuver, Mapping) else None
    last_s = float(run.recording.time_s[-1])
    for fault in faults if isinstance(faults, list | tuple) else ():
        if not isinstance(fault, Mapping):
            continue
        name = fault_words(fault)
        ends = (("start_s", f"FAULT {name}", rr.TextLogLevel.ERROR), ("end_s", f"{name} is over", rr.TextLogLevel.INFO))
        for key, text, level in ends:
            time_s = fault.get(key)
            if isinstance(time_s, int | float) and time_s <= last_s:
                yield Event(float(time_s), text, level)


def _limits(run: ReplayedRun) -> Iterator[Event]:
    time_s = run.recording.time_s
    for channel in run.recording.channels:
        if not channel.name.endswith(_LIMIT):
            continue
        begins, ends = _spans(run.channel(channel.name) > 0.5, time_s)
        what = channel.name.removesuffix(_LIMIT).replace("_", " ")
        yield from (Event(float(when), f"{what} at its limit", rr.TextLogLevel.WARN) for when in begins)
        yield from (Event(float(when), f"{what} no longer at its limit", rr.TextLogLevel.INFO) for when in ends)


def _spans(active: np.ndarray, time_s: np.ndarray) -> tuple[list[float], list[float]]:
    """Return the times when a flag rises and falls, with short gaps closed."""
    edges = np.diff(np.concatenate(([False], active)).astype(np.int8))
    begins, ends = list(time_s[edges > 0]), list(time_s[edges < 0])
    kept_begins, kept_ends = begins[:1], []
    for end, begin in zip(ends, begins[1:], strict=False):
        if begin - end >= _SHORTEST_S:
            kept_ends.append(end)
            kept_begins.append(begin)
    return kept_begins, kept_ends + ends[len(begins) - 1 :] if begins else []


def send_events(stream: rr.RecordingStream, run: ReplayedRun) -> None:
    """Send the warnings of a run, if it has any."""
    found = events(run)
    if found:
        when = times(np.array([event.time_s for event in found]))
        texts, levels = [event.text for event in found], [event.level for event in found]
        stream.send_columns(_warnings_path(run), when, rr.TextLog.columns(text=texts, level=levels))


def _warnings_path(run: ReplayedRun) -> str:
    return f"{run.name}/warnings"


SUMMARY: Final = "summary"
"""Entity of the summary text."""

_PLOTS: Final = 690.0
"""Height of a page of plots with its legend in a window of 1280 x 800 [points]."""
_SKY: Final = (176, 196, 214)
_BEHIND: Final = rrb.EyeControls3D(position=(-7.6, 0.0, 3.5), look_target=(-0.4, 0.0, 0.2), eye_up=(0.0, 0.0, 1.0))
# Left is up in the picture, so that the car drives to the right.
_ABOVE: Final = rrb.EyeControls3D(position=(-1.3, 0.0, 6.5), look_target=(-1.3, 0.0, 0.0), eye_up=(0.0, 1.0, 0.0))
"""Eye positions in the frame that follows the car. Its origin is on the road below the front axle."""


def blueprint(runs: Sequence[ReplayedRun], *, compare: bool, page: int = 0) -> rrb.Blueprint:
    """Return the layout of the viewer."""
    if len(runs) == 1:
        content = _page(runs[0], runs, page)
    elif compare:
        content = _comparison(runs, page)
    else:
        content = rrb.Tabs(_comparison(runs, page), *(_page(run, runs, page) for run in runs), active_tab=0)
    return rrb.Blueprint(
        content,
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, loop_mode="all"),
        auto_views=False,
        auto_layout=False,
    )


def _page(run: ReplayedRun, runs: Sequence[ReplayedRun], page: int) -> rrb.Horizontal:
    """Return the layout of the page of a single run, with all its views."""
    return rrb.Horizontal(
        rrb.Vertical(
            _chase(run, runs),
            _map(runs),
            rrb.Horizontal(
                _car_view(run, runs, "From above", _ABOVE, numbers=False),
                plan_view([run]),
                _words([run]),
                column_shares=[6, 5.8, 9.2],
            ),
            row_shares=[5, 1.5, 4],
        ),
        rrb.Tabs(
            *(_tab(name, shown, run, alone=len(runs) == 1) for name, shown in plots.pages(run).items()),
            active_tab=page,
        ),
        column_shares=[3, 2],
        name=run.label,
    )


def _tab(name: str, shown: Sequence[Panel], run: ReplayedRun, *, alone: bool) -> rrb.Vertical:
    views, curves = plots.views(shown, [run]), plots.curves(shown, run, alone=alone)
    names = legend(f"{LEGEND}/{run.name}/{name}", curves)
    high = height(curves)
    return rrb.Vertical(
        names, *views, row_shares=[high, *([(_PLOTS - high) / max(1, len(views))] * len(views))], name=name
    )


def _comparison(runs: Sequence[ReplayedRun], page: int) -> rrb.Horizontal:
    """Return the layout of the page of all runs: a view for each car, with the others as ghosts, and overlaid plots."""
    loads, use = panels_in(WHEELS)[:2]
    return rrb.Horizontal(
        rrb.Vertical(
            rrb.Horizontal(*(_chase(run, runs) for run in runs)),
            _map(runs),
            rrb.Horizontal(plan_view(runs), _words(runs), column_shares=[2, 3]),
            row_shares=[4, 1.3, 4],
        ),
        rrb.Vertical(
            legend(LEGEND_OF_RUNS, {run.label: run.colour for run in runs}),
            rrb.Tabs(
                *(rrb.Vertical(*plots.views(panels_in(name), runs), name=name) for name in (MOTION, DRIVING, BODY)),
                rrb.Vertical(*plots.views_by_corner(loads, runs), name="Wheel loads"),
                rrb.Vertical(*plots.views_by_corner(use, runs), name="Friction utilisation"),
                active_tab=page,
            ),
            row_shares=[1, 22],
        ),
        column_shares=[3, 2],
        name="Comparison",
    )


def _chase(run: ReplayedRun, runs: Sequence[ReplayedRun]) -> rrb.Spatial3DView:
    return _car_view(run, runs, run.label, _BEHIND, numbers=len(runs) == 1)


def _car_view(
    run: ReplayedRun, runs: Sequence[ReplayedRun], name: str, eye: rrb.EyeControls3D, *, numbers: bool
) -> rrb.Spatial3DView:
    others = [other for other in runs if other is not run]
    return rrb.Spatial3DView(
        origin=f"/{run.name}/chase",
        contents=[
            f"+ /{ROAD}/**",
            f"+ /{COURSE}/**",
            f"+ /{run.scene}/**",
            f"+ /{wedges_path(run)}/**",
            # The numbers would hide the car in a small view; the plan shows them too.
            *([] if numbers else [f"- /{wedges_path(run)}/angle"]),
            f"- /{body_path(run, CHASSIS)}/ghost/**",
            *(f"+ /{ghost_path(other, run)}/**" for other in others),
            *(f"+ /{other.scene}/driven" for other in others),
        ],
        name=name,
        background=rrb.Background(color=_SKY, kind=rrb.BackgroundKind.SolidColor),
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=eye,
    )


def _map(runs: Sequence[ReplayedRun]) -> rrb.Spatial2DView:
    across, down = map_bounds(runs)
    return rrb.Spatial2DView(
        origin=f"/{MAP}",
        name="Course [m]",
        visual_bounds=rrb.VisualBounds2D(x_range=across, y_range=down),
    )


def _words(runs: Sequence[ReplayedRun]) -> rrb.Tabs | rrb.TextDocumentView:
    """Return the views of the summary and of the warnings, if there are any."""
    summary = rrb.TextDocumentView(origin=f"/{SUMMARY}", name="Summary")
    paths = [f"/{_warnings_path(run)}" for run in runs if events(run)]
    if not paths:
        return summary
    return rrb.Tabs(summary, rrb.TextLogView(origin="/", contents=paths, name="Warnings"), active_tab=0)
