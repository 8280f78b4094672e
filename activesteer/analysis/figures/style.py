"""One style for all figures: colours and numbers of the three systems, panels over time. Degrees, as in the paper."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.bands import Band, bands_of
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import RunLook, run_looks
from activesteer.errors import ParameterError
from activesteer.plotting import new_figure
from activesteer.quantities import Quantity, quantity_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BAND_ALPHA: Final = 0.16
BAND_LABEL: Final = "10 to 90 % of the population"
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


def curves(recordings: Mapping[str, RecordingLike]) -> list[Curve]:
    """The runs in the paper's order, the three systems always in the same colours.

    Raises:
        ParameterError: there is no run to draw.
    """
    if not recordings:
        raise ParameterError("there is no recording to draw, at least one is needed")
    return [Curve(recordings[name], look, bands_of(recordings[name])) for name, look in run_looks(recordings).items()]


def draw(axis: Axes, curve: Curve, panel: Quantity, label: str = "", width: float = 1.4, style: str = "-") -> None:
    """One channel of one run over time; without a label it stays out of the legend."""
    draw_band(axis, curve, panel.channel, panel.factor)
    values = thinned(curve.recording[panel.channel]) * panel.factor
    # A leading underscore keeps a line out of the legend.
    line = label or "_hidden"
    axis.plot(thinned(curve.recording.time_s), values, style, color=curve.look.colour, linewidth=width, label=line)


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


def draw_added(axis: Axes, curve: Curve, width: float = 1.4) -> None:
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
    """Grid and spines of every axis here."""
    if title:
        axis.set_ylabel(title)
    axis.grid(visible=True, color="#dddddd", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)


def explain(axis: Axes, lines: Sequence[tuple[str, float, str]]) -> None:
    """What the kinds of line mean: text, width, style."""
    handles = [axis.plot([], [], style, color="#777777", linewidth=width)[0] for _, width, style in lines]
    axis.legend(handles, [text for text, _, _ in lines], loc="best", fontsize="small", frameon=False)


def name_curves(figure: Figure, axis: Axes) -> None:
    """The legend of the runs, above all axes."""
    handles, labels = axis.get_legend_handles_labels()
    if any(collection.get_label() == f"_{BAND_LABEL}" for collection in axis.collections):
        from matplotlib.patches import Patch  # noqa: PLC0415 - an extra, and slow to import

        handles.append(Patch(color="#777777", alpha=2.0 * BAND_ALPHA, linewidth=0.0))
        labels.append(BAND_LABEL)
    figure.legend(handles, labels, loc="outside upper center", ncols=min(len(labels), 3), frameon=False)


def fill_panels(axes: Sequence[Axes], drawn: Sequence[Curve], panels: Sequence[Quantity]) -> None:
    """Draws panels over one time axis.

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
        if panel is ADDED:
            explain(axis, [("rear wheels (2), superposition (3)", 1.4, "-")])
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(0.0, max(float(curve.recording.time_s[-1]) for curve in drawn))


def time_figure(recordings: Mapping[str, RecordingLike], panels: Sequence[Quantity]) -> Figure:
    """A figure of panels over one time axis.

    Raises:
        ParameterError: matplotlib is not installed, or there is no run to draw.
        RecordingError: a channel is missing.
    """
    drawn = curves(recordings)
    shown = present(panels, drawn)
    figure = new_figure(width_in=7.5, height_in=1.2 + 1.75 * len(shown))
    axes: list[Axes] = list(figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0])
    fill_panels(axes, drawn, shown)
    figure.align_ylabels(axes)
    name_curves(figure, axes[0])
    return figure
