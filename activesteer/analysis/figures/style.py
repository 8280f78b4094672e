"""One style for all figures: colours, dashes and numbers of the systems, curves and legends. Degrees, as in the paper.

The figures can be printed at their own width and in grey: text of 8 pt, and lines with different dashes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.harm import LOST_SIDESLIP_RAD
from activesteer.analysis.series import counted_sideslip
from activesteer.analysis.source import RecordingLike
from activesteer.core.conventions import RunLook, run_looks
from activesteer.core.units import Quantity
from activesteer.drawing.panels import FIGURE, PANELS, Panel, added_lines, drawn_values
from activesteer.errors import ParameterError
from activesteer.plotting import plain_axis

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
"""Colour of a place with another friction."""
MAX_POINTS: Final = 5000
"""Most samples of a curve: a picture cannot show more, and its file would be large."""


class DrawnRun(NamedTuple):
    """A run as it is drawn."""

    recording: RecordingLike  # the run
    look: RunLook  # label, colour and dashes

    @property
    def linestyle(self) -> LineStyle:
        """Its dashes in the notation of matplotlib."""
        return (0.0, self.look.dashes) if self.look.dashes else "-"

    @property
    def lost(self) -> bool:
        """Return True if the car spins."""
        return bool(np.abs(counted_sideslip(self.recording)).max() > LOST_SIDESLIP_RAD)


def curves(recordings: Mapping[str, RecordingLike]) -> list[DrawnRun]:
    """Return the runs in the paper's order. The three systems always have the same colours."""
    if not recordings:
        raise ParameterError("there is no recording to draw, at least one is needed")
    return [DrawnRun(recordings[name], look) for name, look in run_looks(recordings).items()]


def draw(
    axis: Axes, curve: DrawnRun, shown: Quantity, label: str = "", width: float = LINE_PT,
    style: LineStyle | None = None,
) -> None:  # fmt: skip
    """Draw a channel of a run over time: without a label outside the legend, by default in the run's own style."""
    values = thinned(drawn_values(curve.recording, shown.channel)) * shown.factor
    # A leading underscore keeps a line out of the legend.
    axis.plot(
        thinned(curve.recording.time_s), values, color=curve.look.colour, linewidth=width,
        linestyle=style or curve.linestyle, label=label or "_hidden",
    )  # fmt: skip


def draw_panel(axis: Axes, curve: DrawnRun, panel: Panel, label: str = "", width: float = LINE_PT) -> None:
    """Draw the lines of a run. Those after the first are dotted."""
    lines = panel.lines_in(FIGURE)
    # A panel of one line needs it; of several, a run has some.
    shown = lines if len(lines) == 1 else [line for line in lines if line.of(curve.recording) is not None]
    for place, line in enumerate(shown):
        quantity = panel.quantity._replace(channel=line.channel)
        draw(axis, curve, quantity, f"_{FRONT_LABEL}" if place else label, width, DOTTED if place else None)


def friction_label(low: float, high: float) -> str:
    """Return the label of places with another friction, which keeps them out of the legend of their own axis."""
    return f"_friction {low:.2g}" + (f" to {high:.2g}" if f"{low:.2g}" != f"{high:.2g}" else "")


def present(panels: Sequence[Panel], drawn: Sequence[DrawnRun]) -> list[Panel]:
    """Return the panels, without the added angles if no run has any."""
    return [
        panel for panel in panels if panel is not PANELS["added"] or any(added_lines(each.recording) for each in drawn)
    ]


def thinned(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return every n-th sample, with n for at most `MAX_POINTS` samples."""
    return np.asarray(values[:: -(-len(values) // MAX_POINTS) or 1], dtype=np.float64)


def plain(axis: Axes, title: str = "") -> None:
    """Set grid, spines and size of text of an axis."""
    if title:
        axis.set_ylabel(title)
    plain_axis(axis)
    axis.set_axisbelow(True)
    axis.tick_params(labelsize=TEXT_PT, length=2.5, pad=2.0)
    for label in (axis.xaxis.label, axis.yaxis.label):
        label.set_fontsize(TEXT_PT)


def name_curves(figure: Figure, axis: Axes, lines: Sequence[tuple[str, float, LineStyle]] = ()) -> None:
    """Draw the legend of the runs above all axes, with further kinds of line by text, width and style."""
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
