"""The pictures of a test's page."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from activesteer.conventions import RUN_COLOURS
from activesteer.plotting import new_figure, page_axis
from activesteer.standards.page_parts import Panel, Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BESIDE: Final = 3
"""Most panels beside each other."""
_ROW_IN: Final = 2.7
_NAME_IN: Final = 0.17
"""Height of a row of panels, and of a name where ordinates are names [in]."""
_LIMIT: Final = "#b3261e"
_SCALE: Final = "viridis"


def draw(picture: Picture) -> Figure:
    """A picture.

    Raises:
        ParameterError: matplotlib is not installed.
    """
    columns = 2 if len(picture.panels) == 4 else min(len(picture.panels), _BESIDE)
    rows = math.ceil(len(picture.panels) / columns)
    names = max(len(panel.names) for panel in picture.panels)
    figure = new_figure(9.0, max(_ROW_IN, 0.8 + _NAME_IN * names) * rows + 0.4, picture.title)
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.flat[len(picture.panels) :]:
        axis.set_visible(False)
    used = list(axes.flat[: len(picture.panels)])
    for axis, panel in zip(used, picture.panels, strict=True):
        _fill(axis, panel)
    if picture.scale is not None:
        from matplotlib.cm import ScalarMappable  # noqa: PLC0415 - an extra, and slow to import

        label, low, high = picture.scale
        colours = ScalarMappable(cmap=_SCALE)
        colours.set_clim(low, high)
        figure.colorbar(colours, ax=used, label=label)
    return figure


def _fill(axis: Axes, panel: Panel) -> None:
    from matplotlib import colormaps  # noqa: PLC0415 - an extra, and slow to import

    scale = colormaps[_SCALE]
    own = 0
    for curve in panel.curves:
        colour, dashes = RUN_COLOURS[own % len(RUN_COLOURS)], "--" if own % 2 else "-"
        if curve.shade is None:
            own += 1
        else:
            colour, dashes = scale(curve.shade), "-"
        dashes = dashes if curve.joined else ""
        marker = "o" if curve.marked else None
        axis.plot(curve.x, curve.y, color=colour, ls=dashes, lw=1.2, marker=marker, ms=3, label=curve.label or None)
    for value, label in panel.limits:
        axis.axhline(value, color=_LIMIT, lw=1.0, ls=(0, (4, 2)), label=label)
    if panel.log:
        from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter  # noqa: PLC0415 - an extra

        axis.set_xscale("log")
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter(ScalarFormatter())
        axis.xaxis.set_minor_formatter(NullFormatter())
    if panel.names:
        axis.set_yticks(range(len(panel.names)), panel.names)
        axis.invert_yaxis()
    axis.set_ylabel(panel.y_label, fontsize="small")
    page_axis(axis, panel.title, panel.x_label)
