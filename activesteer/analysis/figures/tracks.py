"""Figures seen from above: courses with lanes and cones (14, 18), tracks of the front axle centre (15, 19, 22)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis import lanes
from activesteer.analysis.figures import over_time
from activesteer.analysis.figures.over_time import PAGE_IN, TEXT_PT, DrawnRun, drawn_runs
from activesteer.analysis.lanes import CourseView, view_of
from activesteer.analysis.source import RecordingLike, read_course, read_footprint
from activesteer.drawing.panels import PANELS
from activesteer.errors import RecordingError
from activesteer.plotting import new_figure
from activesteer.road.course import CONE_RADIUS_M, Course
from activesteer.road.road import road_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PANELS_BELOW_TRACK: Final = ("steering_wheel", "yaw_rate", "added", "lateral", "sideslip")
LANE_COLOUR: Final = "#f0e6c8"
CONE_COLOUR: Final = "#e69f00"
STRUCK_COLOUR: Final = "#b3261e"
COURSE_ASPECT: Final = 0.2
TRACK_ASPECT: Final = 0.35
"""Approximate height over width of the axes of courses and of tracks."""


def course_figure(recordings: Mapping[str, RecordingLike]) -> Figure:
    """Draw a course (path, lanes with their sizes, cones) on an axis with stretched lateral positions."""
    course = read_course(drawn_runs(recordings)[0].recording)
    figure = new_figure(width_in=PAGE_IN, height_in=0.65 + _axis_height_in(course, COURSE_ASPECT))
    axis: Axes = figure.subplots()
    _draw_course(axis, course, COURSE_ASPECT, np.zeros(len(course.cones_m), bool))
    for lane in course.lanes:
        text = f"{lane.name}\n" if lane.name else ""
        size = f"{lane.end_x_m - lane.start_x_m:.1f} m x {lane.left_y_m - lane.right_y_m:.2f} m"
        middle = 0.5 * (lane.start_x_m + lane.end_x_m), lane.left_y_m
        over_time.note(axis, text + size, middle, (0, 5), ha="center", va="bottom", color="#444444")
    return figure


def track_figure(recordings: Mapping[str, RecordingLike]) -> Figure:
    """Draw tracks of the front axle centre along the course, on an axis with stretched lateral positions."""
    drawn = drawn_runs(recordings)
    course = read_course(drawn[0].recording)
    figure = new_figure(width_in=PAGE_IN, height_in=0.95 + _axis_height_in(course, TRACK_ASPECT))
    axis: Axes = figure.subplots()
    _draw_tracks(axis, drawn, course)
    over_time.name_curves(figure, axis)
    return figure


def overview(recordings: Mapping[str, RecordingLike]) -> Figure:
    """Draw tracks, and below them the actions of driver, car and systems over time."""
    drawn = drawn_runs(recordings)
    panels = over_time.present([PANELS[name] for name in PANELS_BELOW_TRACK], drawn)
    figure = new_figure(width_in=PAGE_IN, height_in=3.2 + 1.15 * len(panels))
    grid = figure.add_gridspec(1 + len(panels), 1, height_ratios=[2.6, *(1.0 for _ in panels)])
    above = figure.add_subplot(grid[0])
    _draw_tracks(above, drawn, read_course(drawn[0].recording))
    axes: list[Axes] = [figure.add_subplot(grid[1])]
    axes += [figure.add_subplot(grid[row], sharex=axes[0]) for row in range(2, 1 + len(panels))]
    over_time.fill_panels(axes, drawn, panels)
    over_time.shade_friction(axes, drawn)
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    figure.align_ylabels(axes)
    over_time.name_curves(figure, above)
    return figure


def _draw_tracks(axis: Axes, drawn: Sequence[DrawnRun], course: Course) -> None:
    """Draw the course, and the track of every run's front axle centre."""
    for curve in drawn:
        x, y = (over_time.thinned(values) for values in lanes.front_axle(curve.recording))
        axis.plot(
            x, y, color=curve.look.colour, linewidth=over_time.LINE_PT, linestyle=curve.linestyle,
            label=curve.look.label,
        )  # fmt: skip
    struck = lanes.struck_cones([curve.recording for curve in drawn], course)
    _draw_course(axis, course, TRACK_ASPECT, struck)
    _draw_friction(axis, drawn[0])
    for curve in drawn:
        _shade_body(axis, curve)


def _shade_body(axis: Axes, curve: DrawnRun) -> None:
    """Shade the area that the front of the body covers. A drawn car would be distorted on the stretched map."""
    try:
        left, right, *_ = lanes.corners(curve.recording, read_footprint(curve.recording))
    except RecordingError:
        return
    edges = zip(map(over_time.thinned, left), map(over_time.thinned, right), strict=True)
    x, y = (np.concatenate([one, other[::-1]]) for one, other in edges)
    axis.fill(x, y, color=curve.look.colour, alpha=0.12, linewidth=0.0)


def _draw_friction(axis: Axes, curve: DrawnRun) -> None:
    """Draw the patches with a different friction, behind everything else."""
    from matplotlib.patches import Polygon  # noqa: PLC0415 - an extra, and slow to import

    road = road_of(curve.recording.metadata)
    pieces = road.pieces(*axis.get_xlim(), *axis.get_ylim())
    mu = {piece.area: [other.mu for other in pieces if other.area == piece.area] for piece in pieces}
    for piece in pieces:
        axis.add_patch(
            Polygon(
                piece.corners_m, closed=True, facecolor=over_time.PATCH_COLOUR, edgecolor="none", zorder=-1,
                label=over_time.friction_label(min(mu[piece.area]), max(mu[piece.area])),
            )
        )  # fmt: skip


def _draw_course(axis: Axes, course: Course, aspect: float, struck: NDArray[np.bool_]) -> None:
    """Draw lanes, path and cones with a separate legend, and set the limits of the axis."""
    from matplotlib.lines import Line2D  # noqa: PLC0415 - an extra, and slow to import
    from matplotlib.patches import Ellipse, Rectangle  # noqa: PLC0415

    shown: list[Artist] = []
    for lane in course.lanes:
        corner = lane.start_x_m, lane.right_y_m
        length_m, width_m = lane.end_x_m - lane.start_x_m, lane.left_y_m - lane.right_y_m
        patch = axis.add_patch(Rectangle(corner, length_m, width_m, color=LANE_COLOUR, linewidth=0.0, zorder=0))
        shown = [patch]
    view = view_of(course)
    shown += axis.plot(view.path_x_m, view.path_y_m, ":", color="#888888", linewidth=1.2, zorder=1)
    for (x, y), hit in zip(course.cone_centres_m(), struck, strict=True):
        colour = STRUCK_COLOUR if hit else CONE_COLOUR
        # The cone has its size; its edge keeps it visible.
        size = 2.0 * CONE_RADIUS_M
        axis.add_patch(Ellipse((x, y), size, size, facecolor=colour, edgecolor=colour, linewidth=1.6, zorder=3))
    names = [*(["lane"] if course.lanes else []), "path"]
    if len(course.cones_m):
        shown.append(Line2D([], [], linestyle="", marker="o", markersize=3.0, color=CONE_COLOUR))
        names.append("cone")
    if struck.any():
        axis.plot(
            *course.cone_centres_m()[struck].T, "x", color=STRUCK_COLOUR, markersize=5.0, zorder=4, label="_struck"
        )
        shown.append(axis.get_lines()[-1])
        names.append("cone hit")
    axis.legend(shown, names, loc="upper right", fontsize=TEXT_PT, frameon=False, handlelength=1.8, labelspacing=0.25)
    over_time.plain(axis)
    axis.set_xlim(view.x_m)
    axis.set_ylim(view.y_m)
    axis.set_xlabel("x [m]")
    stretch = _stretch(view, aspect)
    axis.set_aspect(stretch)
    axis.set_ylabel("y [m]" + (f"\n(stretched {stretch} times)" if stretch > 1 else ""))


def _stretch(view: CourseView, aspect: float) -> int:
    """Return the factor that stretches lateral positions on an axis with the ratio `aspect` of height to width."""
    (left, right), (low, high) = view.x_m, view.y_m
    return max(1, round(aspect * (right - left) / (high - low)))


def _axis_height_in(course: Course, aspect: float) -> float:
    view = view_of(course)
    (left, right), (low, high) = view.x_m, view.y_m
    return (PAGE_IN - 0.9) * _stretch(view, aspect) * (high - low) / (right - left)
