"""One style for all figures: colours, dashes and numbers of the systems, curves and legends. Degrees, as in the paper.

Made to be printed at the width that they have, in grey too: text of 8 pt, lines that their dashes tell apart.
"""

from __future__ import annotations

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
from activesteer.plotting import plain_axis
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
LINE_PT: Final = 1.3
DOTTED: Final[LineStyle] = (0.0, (1.0, 1.6))
"""Style of what stands beside a run's own line."""
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
    plain_axis(axis)
    axis.set_axisbelow(True)
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
