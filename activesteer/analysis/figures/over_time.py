"""The paper's figures over time, limited to the transient, and the style of all figures.

The figures can be printed at their own width and in grey: text of 8 pt, and lines with different dashes. The cars that
do not spin set the scale. Figures 2 and 11 (step steer), 12 and 13 (sine with dwell), 16, 17, 20, 21, 23 and 24 (along
a path) have a time axis.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.harm import LOST_SIDESLIP_RAD
from activesteer.analysis.series import changed_friction, counted_sideslip
from activesteer.analysis.sine_with_dwell import END_OF_STEER, marks
from activesteer.analysis.source import RecordingLike
from activesteer.core.conventions import RUN_COLOURS, RUN_DASHES, Array, RunLook, run_looks
from activesteer.core.units import Quantity, quantity_of
from activesteer.drawing.panels import FIGURE, PANELS, Panel, added_lines, drawn_values, panels_in
from activesteer.errors import ParameterError, RecordingError
from activesteer.plotting import new_figure, plain_axis, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LineStyle = Literal["-"] | tuple[float, tuple[float, ...]]
"""A full line, or dashes in the notation of matplotlib."""
COLUMN_IN: Final = 3.5
"""Width of a column of a two-column journal [in]."""
PAGE_IN: Final = 7.2
"""Width of both columns [in]."""
TEXT_PT: Final = 8.0
LINE_PT: Final = 1.3
DOTTED: Final[LineStyle] = (0.0, (1.0, 1.6))
"""Style of a further line of a run."""
FRONT_LABEL: Final = "added in front"
"""Legend of the dotted line of a run that adds angles at both axles."""
PATCH_COLOUR: Final = "#c3d9ec"
"""Colour of a place with a different friction."""
MAX_POINTS: Final = 5000
"""Largest number of samples of a curve: a plot cannot show more, and its file would be large."""


class DrawnRun(NamedTuple):
    """Data of a run in a figure."""

    recording: RecordingLike  # the run
    look: RunLook  # label, colour and dashes

    @property
    def linestyle(self) -> LineStyle:
        """Dashes in the notation of matplotlib."""
        return (0.0, self.look.dashes) if self.look.dashes else "-"

    @property
    def lost(self) -> bool:
        """Return True if the car spins."""
        return bool(np.abs(counted_sideslip(self.recording)).max() > LOST_SIDESLIP_RAD)


def drawn_runs(recordings: Mapping[str, RecordingLike]) -> list[DrawnRun]:
    """Return the runs in the paper's order, with the fixed colours of the three systems."""
    if not recordings:
        raise ParameterError("there is no recording to draw; at least one is needed")
    return [DrawnRun(recordings[name], look) for name, look in run_looks(recordings).items()]


def draw(
    axis: Axes, curve: DrawnRun, shown: Quantity, label: str = "", width: float = LINE_PT,
    style: LineStyle | None = None,
) -> None:  # fmt: skip
    """Draw a channel of a run over time. Without a label, the curve has no entry in the legend."""
    values = thinned(drawn_values(curve.recording, shown.channel)) * shown.factor
    # A leading underscore keeps a line out of the legend.
    axis.plot(
        thinned(curve.recording.time_s), values, color=curve.look.colour, linewidth=width,
        linestyle=style or curve.linestyle, label=label or "_hidden",
    )  # fmt: skip


def draw_panel(axis: Axes, curve: DrawnRun, panel: Panel, label: str = "", width: float = LINE_PT) -> None:
    """Draw the lines of a run, with all lines but the first dotted."""
    lines = panel.lines_in(FIGURE)
    # A panel of one line needs it; of several, a run has some.
    shown = lines if len(lines) == 1 else [line for line in lines if line.of(curve.recording) is not None]
    for place, line in enumerate(shown):
        quantity = panel.quantity._replace(channel=line.channel)
        draw(axis, curve, quantity, f"_{FRONT_LABEL}" if place else label, width, DOTTED if place else None)


def friction_label(low: float, high: float) -> str:
    """Return the label of areas with a different friction. The legend of the axis leaves it out."""
    return f"_friction {low:.2g}" + (f" to {high:.2g}" if f"{low:.2g}" != f"{high:.2g}" else "")


def present(panels: Sequence[Panel], drawn: Sequence[DrawnRun]) -> list[Panel]:
    """Return the panels to draw, without the panel of the added angles if no run has any."""
    return [
        panel for panel in panels if panel is not PANELS["added"] or any(added_lines(each.recording) for each in drawn)
    ]


def thinned(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """Thin samples to at most `MAX_POINTS`."""
    return np.asarray(values[:: -(-len(values) // MAX_POINTS) or 1], dtype=np.float64)


def plain(axis: Axes, title: str = "") -> None:
    """Set the grid, spines and text size of an axis."""
    if title:
        axis.set_ylabel(title)
    plain_axis(axis)
    axis.set_axisbelow(True)
    axis.tick_params(labelsize=TEXT_PT, length=2.5, pad=2.0)
    for label in (axis.xaxis.label, axis.yaxis.label):
        label.set_fontsize(TEXT_PT)


def note(axis: Axes, text: str, at: tuple[float, float], offset_pt: tuple[float, float], **look: Any) -> None:
    """Write a small grey text next to a point."""
    look = {"color": "#555555", **look}
    axis.annotate(text, at, offset_pt, textcoords="offset points", fontsize=TEXT_PT, **look)


def name_curves(figure: Figure, axis: Axes, lines: Sequence[tuple[str, float, LineStyle]] = ()) -> None:
    """Draw the legend of the runs above all axes, with entries for other line styles."""
    # Angles added in front and places with another friction get an entry if they are drawn.
    from matplotlib.lines import Line2D  # noqa: PLC0415 - an extra, and slow to import
    from matplotlib.patches import Patch  # noqa: PLC0415

    handles, labels = axis.get_legend_handles_labels()
    for text, width, style in lines:
        handles.append(Line2D([], [], color="#777777", linewidth=width, linestyle=style))
        labels.append(text)
    everywhere = figure.get_axes()
    lines_drawn = [line for axes in everywhere for line in axes.lines]
    if front := [line.get_linewidth() for line in lines_drawn if line.get_label() == f"_{FRONT_LABEL}"]:
        handles.append(Line2D([], [], color="#777777", linewidth=front[0], linestyle=DOTTED))
        labels.append(FRONT_LABEL)
    hidden = {str(patch.get_label()) for axes in everywhere for patch in axes.patches}
    for label in sorted(label for label in hidden if label.startswith("_friction ")):
        handles.append(Patch(color=PATCH_COLOUR, linewidth=0.0))
        labels.append(label[1:])
    columns = 2 if figure.get_figwidth() < PAGE_IN else 3
    figure.legend(
        handles, labels, loc="outside upper center", ncols=min(len(labels), columns), frameon=False, fontsize=TEXT_PT,
        handlelength=2.3, handletextpad=0.5, columnspacing=1.0, borderpad=0.0,
    )  # fmt: skip


_SETTLING: Final = ("yaw_rate", "sideslip", "speed")
"""Panels whose signals show the end of a transient."""
PANEL_IN: Final = 1.05
"""Height of a panel over time [in]."""
_INSET_FROM: Final = 2.0
"""Least ratio of the curve of a lost car to the others for an inset."""
_INSET_WIDTH: Final = 0.34
_INSET_HEIGHT: Final = 0.48
_INSET_CAPTION: Final = 0.16
"""Sizes of the inset, as fractions of the axis."""
_SETTLED: Final = 0.05
"""Distance from the last value within which a signal has settled, as a fraction of its range."""
_SAME_BORDER: Final = 0.002
"""Largest distance between borders of runs that share a line, as a fraction of the time shown."""
_AFTER_MARK: Final = 0.12
"""Time shown after the last time of a criterion, as a fraction of the time before it."""
_LETTER_IN: Final = 0.066
"""Mean width of a letter of 8 pt, with some margin [in]."""
_SIDES_IN: Final = 0.6
"""Width of the labels next to the axes [in]."""
_BEFORE: Final = 0.08
_AFTER: Final = 0.2
"""Time shown before and after the transient, as fractions of its duration."""


def fill_panels(axes: Sequence[Axes], drawn: Sequence[DrawnRun], panels: Sequence[Panel]) -> None:
    """Draw panels over one time axis that shows the transient, with the labels in the first panel."""
    for row, (axis, panel) in enumerate(zip(axes, panels, strict=True)):
        for curve in drawn:
            label = curve.look.label if row == 0 else ""
            draw_panel(axis, curve, panel, label)
        plain(axis, panel.quantity.axis_title)
        keep_span(axis, panel.quantity)
    finish_time(axes, drawn)
    for axis, panel in zip(axes, panels, strict=True):
        show_lost_beside(axis, drawn, panel)


def keep_span(axis: Axes, shown: Quantity) -> None:
    """Keep a nearly constant signal flat, so that rounding noise is not visible."""
    low, high = axis.get_ylim()
    if high - low < shown.min_span:
        middle = 0.5 * (low + high)
        axis.set_ylim(middle - 0.5 * shown.min_span, middle + 0.5 * shown.min_span)


def finish_time(axes: Sequence[Axes], drawn: Sequence[DrawnRun]) -> None:
    """Set the time axis below all panels to the transient."""
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(*transient(drawn))


def transient(drawn: Sequence[DrawnRun]) -> tuple[float, float]:
    """Return the time range from before the first motion to after the last run has settled [s]."""
    # Runs that spin do not count. If no run settles, this is the whole time.
    start, end = 0.0, max(float(curve.recording.time_s[-1]) for curve in drawn)
    begins, ends = [], []
    for curve in [curve for curve in drawn if not curve.lost] or drawn:
        for panel in (PANELS[name].quantity for name in _SETTLING):
            values = curve.recording[panel.channel]
            band = _SETTLED * float(np.ptp(values))
            moving = np.flatnonzero(np.abs(values - values[0]) > band)
            unsettled = np.flatnonzero(np.abs(values - values[-1]) > band)
            if moving.size and unsettled.size and float(np.ptp(values)) * panel.factor > panel.min_span:
                begins.append(float(curve.recording.time_s[moving[0]]))
                ends.append(float(curve.recording.time_s[unsettled[-1]]))
    if not begins:
        return start, end
    lasts = max(ends) - min(begins)
    return max(start, min(begins) - _BEFORE * lasts), min(end, max(ends) + _AFTER * lasts)


def show_lost_beside(axis: Axes, drawn: Sequence[DrawnRun], panel: Panel) -> None:
    """Scale the axis for the cars that do not spin, and draw all cars in an inset."""
    # The inset stands in the corner that the curves leave free.
    kept = [curve for curve in drawn if not curve.lost]
    if len(kept) in (0, len(drawn)) or panel is PANELS["added"]:
        return
    quantity = panel.quantity
    left, right = axis.get_xlim()

    def between(begin: float, curve: DrawnRun) -> Array:
        time_s = curve.recording.time_s
        return quantity.factor * curve.recording[quantity.channel][(time_s >= begin) & (time_s <= right)]

    corner = right - _INSET_WIDTH * (right - left)
    seen = np.concatenate([between(left, curve) for curve in kept])
    beside = np.concatenate([np.zeros(1), *(between(corner, curve) for curve in kept)])
    low, high, corner_low, corner_high = map(float, (seen.min(), seen.max(), beside.min(), beside.max()))
    whole = max(float(np.abs(curve.recording[quantity.channel]).max()) for curve in drawn) * quantity.factor
    if whole < _INSET_FROM * max(abs(low), abs(high)):
        return
    margin = 0.08 * max(high - low, quantity.min_span)
    low, high = low - margin, high + margin
    # Above or below, wherever the axis grows less to keep the inset clear of the curves.
    top = max(high, low + (corner_high + margin - low) / (1.0 - _INSET_HEIGHT - _INSET_CAPTION))
    bottom = min(low, high - (high - corner_low + margin) / (1.0 - _INSET_HEIGHT - _INSET_CAPTION))
    above = top - low <= high - bottom
    axis.set_ylim(*((low, top) if above else (bottom, high)))
    place = (1.0 - _INSET_WIDTH, 1.02 - _INSET_HEIGHT if above else 0.02, _INSET_WIDTH, _INSET_HEIGHT - 0.04)
    inset = axis.inset_axes(place, zorder=5)
    for curve in drawn:
        draw_panel(inset, curve, panel, width=0.8)
    start, end = inset.get_xlim()
    # The numbers of the inset stand inside, before the curves begin.
    inset.set_xlim(start - 0.35 * (end - start), end)
    inset.tick_params(labelsize=TEXT_PT, length=0.0, labelbottom=False)
    inset.tick_params(axis="y", pad=-3.0)
    inset.locator_params(axis="y", nbins=3, min_n_ticks=2)
    for label in inset.get_yticklabels():
        label.set_horizontalalignment("left")
    below, white = place[1] + (0.0 if above else place[3]), {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
    at, side = (place[0], below), "top" if above else "bottom"
    note(axis, "whole run", at, (0, -2 if above else 2), xycoords="axes fraction", va=side, bbox=white)
    inset.grid(visible=True, axis="y", color="#dddddd", linewidth=0.5)


def mark_times(axes: Sequence[Axes], drawn: Sequence[DrawnRun]) -> None:
    """Draw the times of `sine_with_dwell.marks`, with their labels above the first axis."""
    # Runs that reach a mark at different times have their own lines. The figure is as wide as a column.
    listed = [marks(curve.recording) for curve in drawn]
    left, right = axes[0].get_xlim()
    if listed[0] and listed[0][0][1] == END_OF_STEER and listed[0][-1][0] >= right:
        right = listed[0][-1][0] + _AFTER_MARK * (right - left)
        axes[0].set_xlim(left, right)
    for curve, times in zip(drawn, listed, strict=True):
        for place, (at_s, _) in enumerate(times):
            all_s = [others[place][0] for others in listed if place < len(others)]
            same = max(all_s) - min(all_s) <= _SAME_BORDER * (right - left)
            if left < at_s < right and not (same and curve is not drawn[0]):
                for axis in axes:
                    axis.axvline(
                        at_s, color="#777777" if same else curve.look.colour, linewidth=0.8, linestyle=":", zorder=1
                    )
    width_in = COLUMN_IN - _SIDES_IN
    ends: list[float] = []
    for at_s, words in (mark for mark in listed[0] if mark[0] < right):
        at_in = max(0.0, (at_s - left) / (right - left)) * width_in
        row = next((row for row, end in enumerate(ends) if end <= at_in), len(ends))
        ends[row : row + 1] = [at_in + _LETTER_IN * (len(words) + 1)]
        aligned = "right" if ends[row] > width_in + _LETTER_IN else "left"
        above, high = (max(at_s, left), 1.0), 2 + (TEXT_PT + 1.0) * row
        note(axes[0], words, above, (0, high), xycoords=("data", "axes fraction"), va="bottom", ha=aligned)


def shade_friction(axes: Sequence[Axes], drawn: Sequence[DrawnRun]) -> None:
    """Shade the times when a wheel's friction differs from its initial friction, once for each run."""
    for curve in drawn:
        spans_s, frictions = changed_friction(curve.recording)
        label = friction_label(*frictions) if spans_s else ""
        for begin_s, end_s in spans_s:
            for axis in axes:
                axis.axvspan(
                    begin_s, end_s, color=PATCH_COLOUR, alpha=1.0 / len(drawn), linewidth=0.0,
                    zorder=0, label=label,
                )  # fmt: skip


def time_figure(recordings: Mapping[str, RecordingLike], panels: Sequence[Panel] = panels_in(FIGURE)) -> Figure:
    """Draw panels over one time axis in the width of a text column, with phases or the times of a standard."""
    drawn = drawn_runs(recordings)
    shown = present(panels, drawn)
    figure = new_figure(width_in=COLUMN_IN, height_in=0.8 + PANEL_IN * len(shown))
    axes: list[Axes] = list(figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0])
    fill_panels(axes, drawn, shown)
    shade_friction(axes, drawn)
    mark_times(axes, drawn)
    figure.align_ylabels(axes)
    name_curves(figure, axes[0])
    return figure


def figure_11(recordings: Mapping[str, RecordingLike]) -> Figure:
    """Draw the response to a step steer, as the paper's figure 11 does."""
    # From the top: yaw rate (dotted: desired by the controller), steering angles (front wheels thin, added angles
    # thick), lateral acceleration, sideslip and roll.
    drawn = drawn_runs(recordings)
    figure = new_figure(width_in=COLUMN_IN, height_in=1.1 + 5 * PANEL_IN)
    axes: list[Axes] = list(figure.subplots(5, 1, sharex=True))
    yaw_rate, front = PANELS["yaw_rate"], quantity_of("front_steer_rad")._replace(short="steering angles")
    desired = yaw_rate.lines[1]
    for curve in drawn:
        draw_panel(axes[0], curve, yaw_rate, curve.look.label)
        if desired.of(curve.recording) is not None:
            draw(axes[0], curve, quantity_of(desired.channel), width=1.0, style=DOTTED)
        draw(axes[1], curve, front, width=0.8)
        draw_panel(axes[1], curve, PANELS["added"], width=2.2)
    plain(axes[0], yaw_rate.quantity.axis_title)
    plain(axes[1], front.axis_title)
    fill_panels(axes[2:], drawn, [PANELS[name] for name in ("lateral", "sideslip", "roll")])
    shade_friction(axes, drawn)
    figure.align_ylabels(axes)
    name_curves(
        figure, axes[0], [("desired", 1.0, DOTTED), ("front wheels", 0.8, "-"), ("added by a system", 2.2, "-")]
    )
    return figure


def figure_2(recording: RecordingLike, path: str | os.PathLike[str], models: Mapping[str, Mapping[str, Array]]) -> Path:
    """Draw yaw rate and roll angle of a run and of models, in the form of the paper's figure 2, and save them."""
    figure = new_figure(width_in=COLUMN_IN, height_in=3.6)
    axes: list[Axes] = list(figure.subplots(2, 1, sharex=True))
    car = DrawnRun(recording, RunLook("multibody car", 0, ()))
    for axis, name in zip(axes, ("yaw_rate", "roll"), strict=True):
        panel = PANELS[name].quantity
        draw(axis, car, panel, label=car.look.label, width=2.0)
        for place, (label, channels) in enumerate(models.items(), start=1):
            if panel.channel in channels:
                axis.plot(
                    recording.time_s, channels[panel.channel] * panel.factor, color=RUN_COLOURS[place], linewidth=1.2,
                    linestyle=(0.0, RUN_DASHES[place]), label=label,
                )  # fmt: skip
        plain(axis, panel.axis_title)
    finish_time(axes, [car])
    figure.align_ylabels(axes)
    name_curves(figure, axes[0])
    return save(figure, Path(path), RecordingError)
