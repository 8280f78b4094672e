"""Panels over one time axis that shows the transient; the cars that do not spin set the scale."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from activesteer.analysis.figures.style import (
    ADDED,
    COLUMN_IN,
    PATCH_COLOUR,
    SIDESLIP,
    SPEED,
    TEXT_PT,
    YAW_RATE,
    DrawnRun,
    curves,
    draw,
    draw_added,
    friction_label,
    name_curves,
    plain,
    present,
)
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import CORNERS
from activesteer.errors import RecordingError
from activesteer.plotting import new_figure
from activesteer.recording.contents import events_of
from activesteer.units import Quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
_SAME_FRICTION: Final = 1e-3
_LETTER_IN: Final = 0.066
"""Mean width of a letter of 8 pt, with some room [in]."""
_SIDES_IN: Final = 0.6
"""Width of the labels beside the axes [in]."""
_BEFORE: Final = 0.08
_AFTER: Final = 0.2
"""Time shown before and after the transient, as fractions of its duration."""


def fill_panels(axes: Sequence[Axes], drawn: Sequence[DrawnRun], panels: Sequence[Quantity]) -> None:
    """Draw panels over one time axis that shows the transient; the curves of the first panel carry the labels."""
    for row, (axis, panel) in enumerate(zip(axes, panels, strict=True)):
        for curve in drawn:
            label = curve.look.label if row == 0 else ""
            if panel is ADDED:
                draw_added(axis, curve)
            else:
                draw(axis, curve, panel, label=label)
        plain(axis, panel.axis_title)
    finish_time(axes, drawn)
    for axis, panel in zip(axes, panels, strict=True):
        show_lost_beside(axis, drawn, panel)


def finish_time(axes: Sequence[Axes], drawn: Sequence[DrawnRun]) -> None:
    """Set the time axis below all panels to the transient."""
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(*transient(drawn))


def transient(drawn: Sequence[DrawnRun]) -> tuple[float, float]:
    """Return the time from before the first motion to after the last run has settled [s]; runs that spin do not count.

    If no run settles, this is the whole time.
    """
    start, end = 0.0, max(float(curve.recording.time_s[-1]) for curve in drawn)
    begins, ends = [], []
    for curve in [curve for curve in drawn if not curve.lost] or drawn:
        for panel in (YAW_RATE, SIDESLIP, SPEED):
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


def show_lost_beside(axis: Axes, drawn: Sequence[DrawnRun], panel: Quantity) -> None:
    """Keep the scale of the cars that do not spin, and draw all cars over the whole time in an inset.

    The inset stands in the corner that the curves leave free.
    """
    kept = [curve for curve in drawn if not curve.lost]
    if len(kept) in (0, len(drawn)) or panel is ADDED:
        return
    left, right = axis.get_xlim()
    corner = right - _INSET_WIDTH * (right - left)
    low, high, corner_low, corner_high = math.inf, -math.inf, math.inf, -math.inf
    for curve in kept:
        values, time_s = curve.recording[panel.channel] * panel.factor, curve.recording.time_s
        seen, beside = values[(time_s >= left) & (time_s <= right)], values[(time_s >= corner) & (time_s <= right)]
        low, high = min(low, float(seen.min())), max(high, float(seen.max()))
        corner_low = min(corner_low, float(beside.min(initial=0.0)))
        corner_high = max(corner_high, float(beside.max(initial=0.0)))
    whole = max(float(np.abs(curve.recording[panel.channel]).max()) for curve in drawn) * panel.factor
    if whole < _INSET_FROM * max(abs(low), abs(high)):
        return
    margin = 0.08 * max(high - low, panel.min_span)
    low, high = low - margin, high + margin
    # Above or below, wherever the axis grows less to keep the inset clear of the curves.
    top = max(high, low + (corner_high + margin - low) / (1.0 - _INSET_HEIGHT - _INSET_CAPTION))
    bottom = min(low, high - (high - corner_low + margin) / (1.0 - _INSET_HEIGHT - _INSET_CAPTION))
    above = top - low <= high - bottom
    axis.set_ylim(*((low, top) if above else (bottom, high)))
    place = (1.0 - _INSET_WIDTH, 1.02 - _INSET_HEIGHT if above else 0.02, _INSET_WIDTH, _INSET_HEIGHT - 0.04)
    inset = axis.inset_axes(place, zorder=5)
    for curve in drawn:
        draw(inset, curve, panel, width=0.8)
    start, end = inset.get_xlim()
    # The numbers of the inset stand inside, before the curves begin.
    inset.set_xlim(start - 0.35 * (end - start), end)
    inset.tick_params(labelsize=TEXT_PT, length=0.0, labelbottom=False)
    inset.tick_params(axis="y", pad=-3.0)
    inset.locator_params(axis="y", nbins=3, min_n_ticks=2)
    for label in inset.get_yticklabels():
        label.set_horizontalalignment("left")
    axis.annotate(
        "whole run", (place[0], place[1] + (0.0 if above else place[3])), (0, -2 if above else 2),
        xycoords="axes fraction", textcoords="offset points", va="top" if above else "bottom", fontsize=TEXT_PT,
        color="#555555", bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
    )  # fmt: skip
    inset.grid(visible=True, axis="y", color="#dddddd", linewidth=0.5)


def mark_phases(axes: Sequence[Axes], drawn: Sequence[DrawnRun]) -> None:
    """Draw the borders of the manoeuvre's phases, with their names above the first axis.

    Runs that reach a border at different times have their own lines. The figure is as wide as a column.
    """
    listed = [[e for e in events_of(curve.recording.metadata) if e.kind == "phase"] for curve in drawn]
    left, right = axes[0].get_xlim()
    for curve, events in zip(drawn, listed, strict=True):
        for place, event in enumerate(events):
            times = [others[place].time_s for others in listed if place < len(others)]
            same = max(times) - min(times) <= _SAME_BORDER * (right - left)
            if left < event.time_s < right and not (same and curve is not drawn[0]):
                for axis in axes:
                    axis.axvline(
                        event.time_s, color="#777777" if same else curve.look.colour, linewidth=0.8, linestyle=":",
                        zorder=1,
                    )  # fmt: skip
    width_in = COLUMN_IN - _SIDES_IN
    ends: list[float] = []
    for event in (event for event in listed[0] if event.time_s < right):
        at_in = max(0.0, (event.time_s - left) / (right - left)) * width_in
        row = next((row for row, end in enumerate(ends) if end <= at_in), len(ends))
        ends[row : row + 1] = [at_in + _LETTER_IN * (len(event.what) + 1)]
        axes[0].annotate(
            event.what, (max(event.time_s, left), 1.0), (0, 2 + (TEXT_PT + 1.0) * row),
            xycoords=("data", "axes fraction"), textcoords="offset points", va="bottom", fontsize=TEXT_PT,
            color="#555555", ha="right" if ends[row] > width_in + _LETTER_IN else "left",
        )  # fmt: skip


def shade_friction(axes: Sequence[Axes], drawn: Sequence[DrawnRun]) -> None:
    """Shade the times at which a wheel stands on another friction than at the start; one shade for each run."""
    for curve in drawn:
        try:
            mu = np.array([curve.recording[f"{corner}_mu"] for corner in CORNERS])
        except RecordingError:  # a recording of another program
            continue
        changed = np.abs(mu - mu[:, :1]) > _SAME_FRICTION
        edges = np.flatnonzero(np.diff(changed.any(axis=0).astype(int), prepend=0, append=0))
        time_s = curve.recording.time_s.tolist()
        label = friction_label(float(mu[changed].min()), float(mu[changed].max())) if edges.size else ""
        for begin, end in edges.reshape(-1, 2).tolist():
            for axis in axes:
                axis.axvspan(
                    time_s[begin], time_s[end - 1], color=PATCH_COLOUR, alpha=1.0 / len(drawn), linewidth=0.0,
                    zorder=0, label=label,
                )  # fmt: skip


def time_figure(recordings: Mapping[str, RecordingLike], panels: Sequence[Quantity]) -> Figure:
    """Draw panels over one time axis, as wide as a column."""
    drawn = curves(recordings)
    shown = present(panels, drawn)
    figure = new_figure(width_in=COLUMN_IN, height_in=0.8 + PANEL_IN * len(shown))
    axes: list[Axes] = list(figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0])
    fill_panels(axes, drawn, shown)
    shade_friction(axes, drawn)
    mark_phases(axes, drawn)
    figure.align_ylabels(axes)
    name_curves(figure, axes[0])
    return figure
