"""One style for all figures: colours, dashes and numbers of the systems, panels over time. Degrees, as in the paper.

Made to be printed at the width that they have, in grey too: text of 8 pt, lines that their dashes tell apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.bands import Band, bands_of
from activesteer.analysis.claims.sine_with_dwell import LOST_SIDESLIP_RAD
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import RunLook, run_looks
from activesteer.errors import ParameterError
from activesteer.plotting import new_figure
from activesteer.quantities import Quantity, quantity_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LineStyle = Literal["-"] | tuple[float, tuple[float, ...]]
"""A full line, or dashes, as matplotlib takes them."""
COLUMN_IN: Final = 3.5
"""Width of a column of a two-column journal [in]."""
PAGE_IN: Final = 7.2
"""Width of both [in]."""
TEXT_PT: Final = 8.0
PANEL_IN: Final = 1.05
"""Height of a panel over time [in]."""
LINE_PT: Final = 1.3
DOTTED: Final[LineStyle] = (0.0, (1.0, 1.6))
"""Style of what stands beside a run's own line."""
_INSET_FROM: Final = 2.0
"""By how much a lost car must exceed the others for an inset."""
_INSET_WIDTH: Final = 0.34
_INSET_HEIGHT: Final = 0.48
_INSET_CAPTION: Final = 0.16
"""Parts of the axis."""
_SETTLED: Final = 0.05
"""A signal has settled when it stays this near to its end, of its range."""
_BEFORE: Final = 0.08
_AFTER: Final = 0.2
"""What is shown before and after the transient, of its duration."""
BAND_ALPHA: Final = 0.16
BAND_LABEL: Final = "80 % of the population"
"""From 10 to 90 %."""
MAX_POINTS: Final = 5000
"""A curve with more samples than this is drawn with fewer: a picture cannot show them, and its file would hold them."""


YAW_RATE: Final = quantity_of("yaw_rate_radps")
DESIRED: Final = quantity_of("yaw_rate_desired_radps")
STEERING_WHEEL: Final = quantity_of("steering_wheel_rad")
LATERAL: Final = quantity_of("ay_mps2")
SIDESLIP: Final = quantity_of("sideslip_rad")
ROLL: Final = quantity_of("roll_rad")
SPEED: Final = quantity_of("speed_mps")
ADDED: Final = quantity_of("rear_steer_rad")._replace(channel="", short="added angle")
"""The angles that the systems add: not one channel, but `ADDED_CHANNELS` of those that ask for any."""
ADDED_CHANNELS: Final = ("rear_steer_rad", "superposition_rad")


class Curve(NamedTuple):
    """A run as it is drawn.

    Attributes:
        recording: The run.
        look: Label, colour and dashes.
        bands: Where the curves of the population lie, by channel; empty where the run belongs to none.
    """

    recording: RecordingLike
    look: RunLook
    bands: Mapping[str, Band] = MappingProxyType({})

    @property
    def linestyle(self) -> LineStyle:
        """Its dashes, as matplotlib takes them."""
        return (0.0, self.look.dashes) if self.look.dashes else "-"

    @property
    def lost(self) -> bool:
        """Whether the car has spun."""
        return bool(np.abs(self.recording["sideslip_rad"]).max() > LOST_SIDESLIP_RAD)


def curves(recordings: Mapping[str, RecordingLike]) -> list[Curve]:
    """The runs in the paper's order, the three systems always in the same colours.

    Raises:
        ParameterError: there is no run to draw.
    """
    if not recordings:
        raise ParameterError("there is no recording to draw, at least one is needed")
    return [Curve(recordings[name], look, bands_of(recordings[name])) for name, look in run_looks(recordings).items()]


def draw(
    axis: Axes,
    curve: Curve,
    panel: Quantity,
    label: str = "",
    width: float = LINE_PT,
    style: LineStyle | None = None,
) -> None:
    """One channel of one run over time; without a label it stays out of the legend, without a style it has its own."""
    draw_band(axis, curve, panel.channel, panel.factor)
    values = thinned(curve.recording[panel.channel]) * panel.factor
    # A leading underscore keeps a line out of the legend.
    axis.plot(
        thinned(curve.recording.time_s), values, color=curve.look.colour, linewidth=width,
        linestyle=curve.linestyle if style is None else style, label=label or "_hidden",
    )  # fmt: skip


def draw_band(axis: Axes, curve: Curve, channel: str, factor: float = 1.0) -> None:
    """Where a channel lies in the population, behind all curves."""
    band = curve.bands.get(channel)
    if band is not None:
        edges = band.low * factor, band.high * factor
        axis.fill_between(
            band.at,
            *edges,
            color=curve.look.colour,
            alpha=BAND_ALPHA,
            linewidth=0.0,
            zorder=1.5,
            label=f"_{BAND_LABEL}",
        )


def added_channels(curve: Curve) -> list[str]:
    """Which angles a system adds: what no controller asks for is the give of a hinge, not an added angle."""
    return [name for name in ADDED_CHANNELS if np.any(curve.recording[name.replace("_rad", "_demand_rad")])]


def draw_added(axis: Axes, curve: Curve, width: float = LINE_PT) -> None:
    """The angles that a system adds."""
    for channel in added_channels(curve):
        draw(axis, curve, ADDED._replace(channel=channel), width=width)


def present(panels: Sequence[Quantity], drawn: Sequence[Curve]) -> list[Quantity]:
    """The panels without that of the added angles where no run has any."""
    return [panel for panel in panels if panel is not ADDED or any(added_channels(curve) for curve in drawn)]


def thinned(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """Every n-th sample, n so that a picture has enough of them and not many more."""
    return np.asarray(values[:: -(-len(values) // MAX_POINTS) or 1], dtype=np.float64)


def plain(axis: Axes, title: str = "") -> None:
    """Grid, spines and size of text of every axis here."""
    if title:
        axis.set_ylabel(title)
    axis.grid(visible=True, color="#dddddd", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)
    axis.tick_params(labelsize=TEXT_PT, length=2.5, pad=2.0)
    for label in (axis.xaxis.label, axis.yaxis.label):
        label.set_fontsize(TEXT_PT)


def name_curves(figure: Figure, axis: Axes, lines: Sequence[tuple[str, float, LineStyle]] = ()) -> None:
    """The legend of the runs, above all axes, and what other kinds of line mean: text, width, style."""
    from matplotlib.lines import Line2D  # noqa: PLC0415 - an extra, and slow to import
    from matplotlib.patches import Patch  # noqa: PLC0415

    handles, labels = axis.get_legend_handles_labels()
    for text, width, style in lines:
        handles.append(Line2D([], [], color="#777777", linewidth=width, linestyle=style))
        labels.append(text)
    if any(collection.get_label() == f"_{BAND_LABEL}" for collection in axis.collections):
        handles.append(Patch(color="#777777", alpha=2.0 * BAND_ALPHA, linewidth=0.0))
        labels.append(BAND_LABEL)
    columns = 2 if figure.get_figwidth() < PAGE_IN else 3
    figure.legend(
        handles, labels, loc="outside upper center", ncols=min(len(labels), columns), frameon=False, fontsize=TEXT_PT,
        handlelength=2.3, handletextpad=0.5, columnspacing=1.0, borderpad=0.0,
    )  # fmt: skip


def fill_panels(axes: Sequence[Axes], drawn: Sequence[Curve], panels: Sequence[Quantity]) -> None:
    """Draws panels over one time axis, which shows the transient.

    Args:
        axes: As many as panels, from the top.
        drawn: The runs.
        panels: What each axis shows; the first one's curves carry the labels.
    """
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


def finish_time(axes: Sequence[Axes], drawn: Sequence[Curve]) -> None:
    """The time axis below all panels, over the transient."""
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(*transient(drawn))


def transient(drawn: Sequence[Curve]) -> tuple[float, float]:
    """From before the first run moves to after the last has settled [s]; those that spin do not settle, nor count.

    The whole time where there is nothing to settle to.
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


def show_lost_beside(axis: Axes, drawn: Sequence[Curve], panel: Quantity) -> None:
    """Where a car that spins would set the scale: that of the others, and all of them in an inset, over the whole time.

    The curves of the others fill the axis; the inset stands in the corner that they leave free.
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
    # Above or below, where it takes less to keep the inset clear of the others.
    top = max(high, low + (corner_high + margin - low) / (1.0 - _INSET_HEIGHT - _INSET_CAPTION))
    bottom = min(low, high - (high - corner_low + margin) / (1.0 - _INSET_HEIGHT - _INSET_CAPTION))
    above = top - low <= high - bottom
    axis.set_ylim(*((low, top) if above else (bottom, high)))
    place = (1.0 - _INSET_WIDTH, 1.02 - _INSET_HEIGHT if above else 0.02, _INSET_WIDTH, _INSET_HEIGHT - 0.04)
    inset = axis.inset_axes(place, zorder=5)
    for curve in drawn:
        draw(inset, curve, panel, width=0.8)
    start, end = inset.get_xlim()
    # Its numbers stand inside, before the curves begin.
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


def time_figure(recordings: Mapping[str, RecordingLike], panels: Sequence[Quantity]) -> Figure:
    """A figure of panels over one time axis, as wide as a column.

    Raises:
        ParameterError: matplotlib is not installed, or there is no run to draw.
        RecordingError: a channel is missing.
    """
    drawn = curves(recordings)
    shown = present(panels, drawn)
    figure = new_figure(width_in=COLUMN_IN, height_in=0.8 + PANEL_IN * len(shown))
    axes: list[Axes] = list(figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0])
    fill_panels(axes, drawn, shown)
    figure.align_ylabels(axes)
    name_curves(figure, axes[0])
    return figure
