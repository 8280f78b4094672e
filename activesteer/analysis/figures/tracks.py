"""Figures seen from above: courses with lanes and cones (14, 18), tracks of the front axle centre (15, 19, 22)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from activesteer.analysis import track
from activesteer.analysis.bands import TRACK
from activesteer.analysis.course_view import CourseView, view_of
from activesteer.analysis.figures import style
from activesteer.analysis.source import RecordingLike, read_course
from activesteer.plotting import new_figure
from activesteer.road.course import Course

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LANE_COLOUR: Final = "#f0e6c8"
CONE_COLOUR: Final = "#e69f00"
WIDTH_IN: Final = 8.5
COURSE_ASPECT: Final = 0.2
TRACK_ASPECT: Final = 0.35
"""Height over width of the axes of courses and of tracks, about."""


def course_figure(recordings: Mapping[str, RecordingLike]) -> Figure:
    """The course: path, lanes with their sizes, cones. It says by how much lateral positions are stretched."""
    course = read_course(style.curves(recordings)[0].recording)
    figure = new_figure(width_in=WIDTH_IN, height_in=0.65 + _axis_height_in(course, COURSE_ASPECT))
    axis: Axes = figure.subplots()
    _draw_course(axis, course, COURSE_ASPECT)
    for lane in course.lanes:
        text = f"{lane.name}\n" if lane.name else ""
        axis.annotate(
            f"{text}{lane.end_x_m - lane.start_x_m:.1f} m x {lane.left_y_m - lane.right_y_m:.2f} m",
            (0.5 * (lane.start_x_m + lane.end_x_m), lane.left_y_m), (0, 5), textcoords="offset points",
            ha="center", va="bottom", fontsize="x-small", color="#555555",
        )  # fmt: skip
    return figure


def track_figure(recordings: Mapping[str, RecordingLike]) -> Figure:
    """Tracks of the front axle centre along the course. It says by how much lateral positions are stretched."""
    course = read_course(style.curves(recordings)[0].recording)
    figure = new_figure(width_in=WIDTH_IN, height_in=1.3 + _axis_height_in(course, TRACK_ASPECT))
    axis: Axes = figure.subplots()
    _draw_tracks(axis, recordings)
    style.name_curves(figure, axis)
    return figure


def overview(recordings: Mapping[str, RecordingLike]) -> Figure:
    """Tracks, and below them what driver, car and systems do over time."""
    drawn = style.curves(recordings)
    wanted = (style.STEERING_WHEEL, style.YAW_RATE, style.ADDED, style.LATERAL, style.SIDESLIP)
    panels = style.present(wanted, drawn)
    figure = new_figure(width_in=WIDTH_IN, height_in=4.6 + 1.5 * len(panels))
    grid = figure.add_gridspec(1 + len(panels), 1, height_ratios=[2.6, *(1.0 for _ in panels)])
    above = figure.add_subplot(grid[0])
    _draw_tracks(above, recordings)
    axes: list[Axes] = [figure.add_subplot(grid[1])]
    axes += [figure.add_subplot(grid[row], sharex=axes[0]) for row in range(2, 1 + len(panels))]
    style.fill_panels(axes, drawn, panels)
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    figure.align_ylabels(axes)
    style.name_curves(figure, above)
    return figure


def _draw_tracks(axis: Axes, recordings: Mapping[str, RecordingLike]) -> None:
    """Draws the course, and the track of the front axle centre of every run."""
    drawn = style.curves(recordings)
    for curve in drawn:
        style.draw_band(axis, curve, TRACK[1])
        x, y = (style.thinned(values) for values in track.front_axle(curve.recording))
        axis.plot(x, y, color=curve.look.colour, linewidth=1.4, label=curve.look.label)
    _draw_course(axis, read_course(drawn[0].recording), TRACK_ASPECT)


def _draw_course(axis: Axes, course: Course, aspect: float) -> None:
    """Lanes, path and cones, with a legend of their own, and the limits of the axis."""
    from matplotlib.patches import Rectangle  # noqa: PLC0415 - an extra, and slow to import

    shown: list[Artist] = []
    for lane in course.lanes:
        corner = lane.start_x_m, lane.right_y_m
        length_m, width_m = lane.end_x_m - lane.start_x_m, lane.left_y_m - lane.right_y_m
        patch = axis.add_patch(Rectangle(corner, length_m, width_m, color=LANE_COLOUR, linewidth=0.0, zorder=0))
        shown = [patch]
    view = view_of(course)
    shown += axis.plot(view.path_x_m, view.path_y_m, ":", color="#888888", linewidth=1.2, zorder=1)
    if len(course.cones_m):
        x, y = course.cones_m.T
        shown += axis.plot(x, y, "^", color=CONE_COLOUR, markersize=4.5, markeredgewidth=0.0, zorder=3)
    names = [*(["lane"] if course.lanes else []), "path asked for", "cone"]
    axis.legend(shown, names[: len(shown)], loc="upper right", fontsize="small", frameon=False)
    style.plain(axis)
    axis.set_xlim(view.x_m)
    axis.set_ylim(view.y_m)
    axis.set_xlabel("x [m]")
    stretch = _stretch(view, aspect)
    axis.set_aspect(stretch)
    axis.set_ylabel("y [m]" + (f"\n(stretched {stretch} times)" if stretch > 1 else ""))


def _stretch(view: CourseView, aspect: float) -> int:
    """By how much lateral positions are stretched for an axis about `aspect` times as high as it is wide."""
    (left, right), (low, high) = view.x_m, view.y_m
    return max(1, round(aspect * (right - left) / (high - low)))


def _axis_height_in(course: Course, aspect: float) -> float:
    view = view_of(course)
    (left, right), (low, high) = view.x_m, view.y_m
    return (WIDTH_IN - 0.9) * _stretch(view, aspect) * (high - low) / (right - left)
