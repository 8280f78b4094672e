"""Data of the plots of a report: thinned signals in display units, on one time axis."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, Final

import numpy as np

from activesteer.analysis.lanes import front_axle, path_distance, struck_cones, view_of
from activesteer.analysis.metrics import stands
from activesteer.analysis.report.groups import MOST_EVENTS, Group, ReportedRun
from activesteer.analysis.series import changed_friction
from activesteer.analysis.sine_with_dwell import marks
from activesteer.analysis.source import read_course, read_footprint
from activesteer.core.conventions import Array
from activesteer.drawing import wheel_angles
from activesteer.drawing.panels import PATH_DISTANCE, REPORT, Panel, panels_in
from activesteer.errors import RecordingError
from activesteer.recording import Recording
from activesteer.road.course import CONE_RADIUS_M, Course
from activesteer.road.road import road_of

RATE_HZ: Final = 200.0
"""Largest number of samples of a signal per second. The car's own motion ends below 20 Hz."""
MAX_SAMPLES: Final = 4000
"""Largest number of samples of a signal: twice the pixels of the widest screen, before zooming in."""
MAX_STEP_S: Final = 0.02
"""Longest interval between samples that still represent the signal [s]: they show up to 25 Hz."""
OFF_COURSE_M: Final = 6.0
"""Distance from the course up to which the plot shows a car that leaves it while another car stays on it [m]."""
BESIDE_M: Final = 60.0
"""Distance from the tracks up to which areas of a different friction and obstacles are drawn [m]."""
DIGITS: Final = 4
"""Digits after the first digit of a signal's range. More cannot be seen."""


def _signals(panel: Panel, view: str, recording: Recording) -> Iterator[tuple[bool, Array]]:
    """Yield the lines of a run, each with a flag for a dotted line."""
    if panel.extreme is not None:
        yield False, panel.extreme.reduce([recording[line.channel] for line in panel.lines])
        return
    for place, line in enumerate(panel.lines_in(view)):
        # A run of an older version or of another program may lack the signal.
        with suppress(RecordingError):
            if line.channel == PATH_DISTANCE:
                path = read_course(recording).path
                values = path_distance(*front_axle(recording), path.x_m, path.y_m)
            else:
                values = line.of(recording)
            if values is not None and np.isfinite(values).any():
                yield place > 0, values


def plots(group: Group, view: str = REPORT) -> dict[str, Any]:
    """Return the plots of a group as JSON values."""
    grid = time_grid([run.recording.time_s for run in group.runs])
    panels = [shown for panel in panels_in(view) if (shown := _panel(panel, view, group.runs, grid))["series"]]
    at_rest = all(_stands(run.recording) for run in group.runs)
    zero = [shown["title"] for shown in panels if at_rest and _is_zero(shown)]
    return {
        "name": group.name,
        "step_s": float(grid[1] - grid[0]) if len(grid) > 1 else 0.0,
        "start_s": float(grid[0]),
        "samples": len(grid),
        "runs": [
            {
                "name": run.name,
                "label": run.look.label,
                "place": run.look.place,
                "dashes": run.look.dashes,
                "patches_s": changed_friction(run.recording)[0],
            }
            for run in group.runs
        ],
        "panels": [shown for shown in panels if shown["title"] not in zero],
        "zero": zero,
        "marks": [{"time_s": at_s, "text": text} for at_s, text in _marks(group)],
        "slip_limit_deg": _slip_limit_deg(group),
        "track": _track(group, grid),
    }


def _stands(recording: Recording) -> bool:
    """Return whether a recording has a speed, and its car stands."""
    with suppress(RecordingError):
        return stands(recording)
    return False


def _is_zero(panel: Mapping[str, Any]) -> bool:
    """Return whether all lines of a panel are negligibly small, compared with its shortest axis."""
    values = (value for line in panel["series"] for value in line["values"] if value is not None)
    return all(abs(value) < 1e-3 * panel["min_span"] for value in values)


def _marks(group: Group) -> list[tuple[float, str]]:
    """Return the times to mark in the plots, with their labels: marks of the manoeuvre, and changes during the runs."""
    changes = [
        (it.time_s, it.what if all(it in other.events for other in group.runs) else f"{run.name}: {it.what}")
        for run in group.runs
        for it in run.events[:MOST_EVENTS]
        if it.kind != "phase" and it.time_s > 0.0
    ]
    return [*marks(group.runs[0].recording), *dict.fromkeys(changes)]


def _slip_limit_deg(group: Group) -> float | None:
    """Return the slip angle at which the side force of the rear tyres peaks [deg], if it is the same in all runs."""
    limits: set[Any] = {run.recording.metadata.get("slip_limit_rad") for run in group.runs}
    if len(limits) > 1 or None in limits or any(event.kind == "set" for run in group.runs for event in run.events):
        return None
    return round(math.degrees(limits.pop()), 1)


def time_grid(times_s: Sequence[Array]) -> Array:
    """Return the times of all plots [s]."""
    first = times_s[0]
    start = min(float(time_s[0]) for time_s in times_s)
    end = max(float(time_s[-1]) for time_s in times_s)
    step = float(np.median(np.diff(first))) if len(first) > 1 else 1.0 / RATE_HZ
    # A value slightly below a whole number is due to rounding.
    every = max(
        1, math.ceil(1.0 / (RATE_HZ * step) - 1e-6), math.ceil((end - start) / (step * (MAX_SAMPLES - 1)) - 1e-6)
    )
    count = math.floor((end - start) / (every * step) + 1e-6) + 1
    # Times are whole nanoseconds in a recording: rounded to them, the instants are those of samples.
    return np.rint((start + np.arange(count) * (every * step)) * 1e9) / 1e9


def _panel(panel: Panel, view: str, runs: Sequence[ReportedRun], grid: Array) -> dict[str, Any]:
    series = []
    for number, run in enumerate(runs):
        with suppress(RecordingError):
            for dotted, values in _signals(panel, view, run.recording):
                sampled = _reduced(run.recording.time_s, values * panel.quantity.factor, grid)
                if panel.lines[0].channel.endswith("sideslip_rad"):
                    sampled = _within_half_turn(sampled)
                series.append({"run": number, "dotted": dotted, "values": _rounded(sampled)})
    note = panel.note if any(item["dotted"] for item in series) else panel.lines[0].name if not panel.extreme else ""
    shown = panel.quantity
    return {"title": panel.title, "unit": shown.unit.name, "note": note, "min_span": shown.min_span, "series": series}


def _within_half_turn(angle_deg: Array) -> Array:
    """Return a continuous angle within 180 deg, with a gap at each jump, so that no line crosses the plot."""
    turns = np.round(angle_deg / 360.0)
    # nan differs from itself, and stays nan.
    return np.where(np.diff(turns, prepend=turns[:1]) == 0.0, angle_deg - 360.0 * turns, math.nan)


def _sampled(time_s: Array, values: Array, grid: Array) -> Array:
    """Return the values at the times of the grid, or nan before and after the run."""
    return np.interp(grid, time_s, values, left=math.nan, right=math.nan)


def _reduced(time_s: Array, values: Array, grid: Array) -> Array:
    """Return the values of a curve, reduced to extremes for a long run so that no peak is lost."""
    # Each pair of instants takes the least and the greatest value up to the next pair.
    if len(grid) < 2 or grid[1] - grid[0] <= MAX_STEP_S:
        return _sampled(time_s, values, grid)
    starts = np.searchsorted(time_s, grid[::2])
    ends = np.append(starts[1:], len(time_s))
    filled = starts < ends
    first, last = starts[filled], ends[filled] - 1
    low, high = np.fmin.reduceat(values, first), np.fmax.reduceat(values, first)
    rising = values[last] >= values[first]
    pairs = np.full((len(starts), 2), math.nan)
    pairs[filled] = np.column_stack([np.where(rising, low, high), np.where(rising, high, low)])
    return pairs.reshape(-1)[: len(grid)]


def _rounded(values: Array, decimals: int | None = None) -> list[float | None]:
    """Return numbers for JSON with the visible digits, and None for nan."""
    finite = np.isfinite(values)
    if decimals is None:
        known = values[finite]
        span = float(np.ptp(known)) if known.size else 0.0
        span = span or float(np.abs(known).max(initial=0.0))
        # The upper limit keeps the rounding of a constant signal from becoming a staircase.
        decimals = min(9, max(0, DIGITS - math.floor(math.log10(span)))) if span > 0.0 else 0
    numbers = np.round(np.where(finite, values, 0.0), decimals) + 0.0  # no -0.0
    listed = [int(number) if number == int(number) else number for number in numbers.tolist()]
    return [number if exists else None for number, exists in zip(listed, finite.tolist(), strict=True)]


def _track(group: Group, grid: Array) -> dict[str, Any] | None:
    """Return the data of the track plot: course, tracks and headings, and sizes of the cars."""
    tracks = []
    factors = wheel_angles.factors([run.recording for run in group.runs])
    for number, run in enumerate(group.runs):
        try:
            x, y = (_sampled(run.recording.time_s, values, grid) for values in front_axle(run.recording))
        except RecordingError:
            continue
        track: dict[str, Any] = {"run": number, "x": _rounded(x, 2), "y": _rounded(y, 3)}
        with suppress(RecordingError):
            yaw = _rounded(_sampled(run.recording.time_s, run.recording["yaw_rad"], grid), 3)
            car = read_footprint(run.recording)
            wheels = [[round(float(value), 3) for value in wheel] for wheel in wheel_angles.wheel_centres(car)]
            size = {"ends": [car.rear_m, car.front_m], "width": car.width_m, "wheels": wheels, "factors": factors}
            track |= {"yaw": yaw, "car": size}
            angles = wheel_angles.angles_at(run.recording, np.clip(grid, *run.recording.time_s[[0, -1]]))
            if np.isfinite(angles).any():
                track["steer"] = [_rounded(angles[:, axle : axle + 2].mean(axis=1), 3) for axle in (0, 2)]
        tracks.append(track)
    if not tracks:
        return None
    course = None
    for run in group.runs:
        with suppress(RecordingError):  # an open-loop manoeuvre has no course
            course = course or read_course(run.recording)
    table = {"lanes": [], "cones": [], "path": None, "view": None} if course is None else _course(course, group)
    return {"tracks": tracks, **_road(group, tracks), **table}


def _road(group: Group, tracks: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the friction patches and obstacles near the tracks, each with its corners [m] and its label."""
    ends = []
    for key in ("x", "y"):
        seen = [value for track in tracks for value in track[key] if value is not None]
        ends += [min(seen, default=0.0) - BESIDE_M, max(seen, default=0.0) + BESIDE_M]
    road = road_of(group.runs[0].recording.metadata)
    patches = [{"corners": np.round(it.corners_m, 2).tolist(), "mu": round(it.mu, 3)} for it in road.pieces(*ends)]
    obstacles = [{"corners": np.round(corners, 2).tolist(), "text": text} for text, corners in road.outlines(*ends)]
    return {"patches": patches, "obstacles": obstacles}


def _course(course: Course, group: Group) -> dict[str, Any]:
    view = view_of(course)
    hit = struck_cones([run.recording for run in group.runs], course)
    low, high = least, most = view.y_m
    tracks = []
    for run in group.runs:
        with suppress(RecordingError):
            x, y = front_axle(run.recording)
            tracks.append(np.stack([x, y])[:, np.isfinite(x) & np.isfinite(y)])
            seen = y[(x >= view.x_m[0]) & (x <= view.x_m[1]) & np.isfinite(y)]
            low = min(low, max(seen.min(initial=low), least - OFF_COURSE_M))
            high = max(high, min(seen.max(initial=high), most + OFF_COURSE_M))
    # Without a car that stays near the course, its details matter less than where all cars go.
    left = all(
        y.min(initial=least) < least - OFF_COURSE_M or y.max(initial=most) > most + OFF_COURSE_M for _, y in tracks
    )
    # A drive shows all of its way to the gates.
    by_hand = any(run.by_hand for run in group.runs)
    start = min([view.x_m[0], *(float(x[0]) for x, _ in tracks if by_hand and x.size)])
    x, y = np.column_stack([*tracks, [view.x_m, view.y_m]])
    return {
        "lanes": [
            {"name": name, "x": [start, end], "y": [below, above]} for name, start, end, below, above in course.lanes
        ],
        "cones": [
            [round(x, 3), round(y, 3), struck]
            for (x, y), struck in zip(course.cone_centres_m().tolist(), hit.tolist(), strict=True)
        ],
        "cone_radius": CONE_RADIUS_M,
        "path": {"x": _rounded(view.path_x_m, 2), "y": _rounded(view.path_y_m, 3)},
        "view": None if left else {"x": [start, view.x_m[1]], "y": [float(low), float(high)]},
        "whole": {"x": [float(x.min()), float(x.max())], "y": [float(y.min()), float(y.max())]},
    }
