"""Drawing of figures with matplotlib."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from activesteer.core.conventions import RUN_COLOURS, Array
from activesteer.core.files import atomic_write, make_folder, shown_path
from activesteer.errors import ActiveSteerError, ParameterError, not_installed
from activesteer.plotting.model import Heat, Panel, Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike


DOTS_PER_INCH: Final = 300
"""Resolution of figures that are saved as pixels, as journals require."""


def new_figure(width_in: float, height_in: float, title: str = "") -> Figure:
    """Return an empty matplotlib figure of the given size."""
    try:
        from matplotlib.figure import Figure  # noqa: PLC0415 - an extra, and slow to import
    except ImportError as error:
        raise not_installed(ParameterError, "a plot", "matplotlib", "plot") from error
    # A Figure of its own instead of pyplot: no backend is chosen and no global state changes for the caller.
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    if title:
        figure.suptitle(title, fontsize="medium")
    return figure


def plain_axis(axis: Axes) -> None:
    """Draw a grid, and remove the frame above and on the right."""
    axis.grid(visible=True, color="#dddddd", linewidth=0.6)
    axis.spines[["top", "right"]].set_visible(False)


def save(figure: Figure, path: Path, error: type[ActiveSteerError] = ParameterError) -> Path:
    """Write a figure in all formats with the same layout, and return the first path."""
    with atomic_write(path, error) as part:
        try:
            figure.savefig(part, dpi=DOTS_PER_INCH)
        except ValueError as reason:  # an ending that is no format of matplotlib's
            raise error(f"cannot write {shown_path(path)}: {reason}", value=path) from reason
    figure.set_layout_engine("none")
    return path


_BESIDE: Final = 3
"""Largest number of panels next to each other."""
_ROW_IN: Final = 2.7
_NAME_IN: Final = 0.17
"""Height of a row of panels, and of a name of an ordinate [in]."""
_LONG_NAME: Final = 6
"""Longest name of a column that stands upright."""
_LIMIT: Final = "#b3261e"
_ZERO: Final = "#999999"
_SCALE: Final = "viridis"


def draw(picture: Picture) -> Figure:
    """Draw the panels into a matplotlib figure."""
    count = len(picture.panels)
    columns = picture.columns or (2 if count == 4 else min(count, _BESIDE))
    rows = math.ceil(count / columns)
    names = max(len(panel.names) if isinstance(panel, Panel) else 0 for panel in picture.panels)
    height_in = picture.height_in or max(_ROW_IN, 0.8 + _NAME_IN * names) * rows + 0.4
    figure = new_figure(picture.width_in, height_in, picture.title)
    axes = figure.subplots(rows, columns, squeeze=False, width_ratios=picture.widths or None)
    for axis in axes.flat[count:]:
        axis.set_visible(False)
    used: list[Axes] = list(axes.flat[:count])
    for axis, panel in zip(used, picture.panels, strict=True):
        if isinstance(panel, Heat):
            _fill_heat(axis, panel)
        else:
            _fill(axis, panel)
    if picture.scale is not None:
        from matplotlib.cm import ScalarMappable  # noqa: PLC0415 - an extra, and slow to import

        label, low, high = picture.scale
        colours = ScalarMappable(cmap=_SCALE)
        colours.set_clim(low, high)
        figure.colorbar(colours, ax=used, label=label)
    _add_legends(figure, used, picture)
    figure.align_ylabels(axes)
    return figure


def save_all(pictures: Mapping[str, Picture], folder: str | os.PathLike[str], title: str) -> list[Path]:
    """Draw figures and write them as PNG files."""
    directory = make_folder(folder, ParameterError)
    return [
        save(draw(picture._replace(title=f"{title}{picture.title}")), directory / f"{name}.png")
        for name, picture in pictures.items()
    ]


def _fill(axis: Axes, panel: Panel) -> None:
    for area in panel.areas:
        axis.fill_between(
            np.asarray(area.x), area.low, area.high, facecolor=area.colour, alpha=area.alpha, label=area.label or None,
            edgecolor=area.edge or "none", linewidth=1.0 if area.edge else 0.0,
        )  # fmt: skip
    _draw_curves(axis, panel)
    for value, label in panel.limits:
        axis.axhline(value, color=_LIMIT, lw=1.0, ls=(0, (4, 2)), label=label)
    for x, y, text in panel.notes:
        beside: dict[str, Any] = {"xytext": (6, 0), "va": "center"} if panel.names else {"xytext": (0, -4), "va": "top"}
        aside = "left" if panel.names else "center"
        axis.annotate(text, (x, y), textcoords="offset points", ha=aside, fontsize="xx-small", **beside)
    _set_axes(axis, panel)


def _draw_curves(axis: Axes, panel: Panel) -> None:
    from matplotlib import colormaps  # noqa: PLC0415 - an extra, and slow to import

    own = 0
    for curve in panel.curves:
        colour, dashes = curve.colour, curve.dashes
        if curve.shade is not None:
            colour = colormaps[_SCALE](curve.shade)
        elif not colour:
            colour = RUN_COLOURS[own % len(RUN_COLOURS)]
            dashes = ("--" if own % 2 else "-") if dashes is None else dashes
            own += 1
        axis.plot(
            np.asarray(curve.x), np.asarray(curve.y), color=colour, ls="-" if dashes is None else dashes,
            lw=curve.width, marker=curve.marker or None, ms=curve.size, mew=curve.width, label=curve.label or None,
        )  # fmt: skip


def _set_axes(axis: Axes, panel: Panel) -> None:
    if panel.log:
        from matplotlib.ticker import LogLocator, NullFormatter  # noqa: PLC0415 - an extra

        axis.set(**{f"{letter}scale": "log" for letter in panel.log})
        for of in (axis.xaxis, axis.yaxis)[: len(panel.log)]:
            of.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            of.set_major_formatter("{x:g}")
            of.set_minor_formatter(NullFormatter())
    elif panel.curves and all(np.all(np.asarray(curve.x) % 1 == 0) for curve in panel.curves):
        axis.locator_params(axis="x", integer=True, min_n_ticks=1)  # such as runs, of which there is no half
    if panel.names:
        axis.set_yticks(range(len(panel.names)), panel.names)
        axis.invert_yaxis()
    if panel.zero:
        low, high = axis.get_ylim()
        if low < 0.0 < high:
            axis.axhline(0.0, color=_ZERO, linewidth=0.7, zorder=0.5)
        axis.axvline(0.0, color=_ZERO, linewidth=0.7, zorder=0.5)
        axis.margins(x=0.0)
    if panel.x_range is not None:
        axis.set_xlim(*panel.x_range)
    if panel.y_range is not None:
        axis.set_ylim(*panel.y_range)
    if panel.equal:
        axis.set_aspect("equal")
    if panel.above is not None:
        _add_abscissa(axis, *panel.above)
    plain_axis(axis)
    axis.set_axisbelow(True)
    axis.set_title(panel.title, fontsize="small")
    axis.set_xlabel(panel.x_label, fontsize="small")
    axis.set_ylabel(panel.y_label, fontsize="small")
    axis.tick_params(labelsize="small", labelbottom=bool(panel.x_label))


def _add_abscissa(axis: Axes, label: str, first: Array, second: Array) -> None:
    """Add a second abscissa above a panel, with values that increase with the first abscissa."""

    def to_second(x: ArrayLike) -> ArrayLike:
        return np.interp(np.asarray(x), first, second)

    def to_first(x: ArrayLike) -> ArrayLike:
        return np.interp(np.asarray(x), second, first)

    above = axis.secondary_xaxis("top", functions=(to_second, to_first))
    widest = int(min(-np.min(second), np.max(second)))
    above.set_xticks(range(-widest, widest + 1, 2 if widest % 2 == 0 else 1))
    above.set_xlabel(label, fontsize="small")
    above.tick_params(labelsize="small")


def _fill_heat(axis: Axes, heat: Heat) -> None:
    from matplotlib.colors import LinearSegmentedColormap  # noqa: PLC0415 - an extra, and slow to import

    colours = heat.colours
    if not isinstance(colours, str):
        colours = LinearSegmentedColormap.from_list("own", list(colours))
    low, high = heat.span
    axis.imshow(np.asarray(heat.values), cmap=colours, vmin=low, vmax=high, aspect="auto")
    for row, texts in enumerate(heat.texts):
        for column, text in enumerate(texts):
            axis.text(column, row, text, ha="center", va="center", fontsize="x-small")
    for ticks, count in ((axis.set_xticks, len(heat.columns)), (axis.set_yticks, len(heat.rows))):
        ticks(np.arange(count + 1) - 0.5, minor=True)
    axis.grid(visible=True, which="minor", color="0.7", linewidth=0.6)
    axis.tick_params(which="minor", length=0)
    long = any(len(name) > _LONG_NAME for name in heat.columns)
    axis.set_xticks(range(len(heat.columns)), heat.columns, fontsize="x-small")
    axis.tick_params(axis="x", labelrotation=45.0 if long else 0.0)
    if not heat.title and not heat.x_label:
        axis.xaxis.tick_top()
    axis.set_yticks(range(len(heat.rows)), heat.rows, fontsize="x-small")
    axis.set_title(heat.title, fontsize="small")
    axis.set_xlabel(heat.x_label, fontsize="small")
    for row in heat.rules:
        axis.axhline(row - 0.5, color="black", linewidth=0.8)


def _add_legends(figure: Figure, axes: Sequence[Axes], picture: Picture) -> None:
    """Add a legend to each labelled panel, or one legend below all panels if they share their labels."""
    from matplotlib.patches import Patch  # noqa: PLC0415 - an extra, and slow to import

    look: dict[str, Any] = {"frameon": False, "fontsize": "x-small", "title_fontsize": "x-small"}
    shared: list[Any] = [Patch(facecolor=colour, edgecolor="0.6", label=label) for label, colour in picture.legend]
    named = []
    for axis, panel in zip(axes, picture.panels, strict=True):
        handles, labels = axis.get_legend_handles_labels()
        if labels and isinstance(panel, Panel) and panel.legend is not None:
            named.append((axis, panel.legend or None, handles, labels))
    if len(named) > 1 and all(labels == named[0][3] for *_, labels in named):
        _, look["title"], handles, _ = named.pop(0)
        shared = [*handles, *shared]
        named.clear()
    for axis, title, *_ in named:
        axis.legend(**look, title=title)
    if shared:
        figure.legend(handles=shared, **look, loc="outside lower center", ncols=min(len(shared), 4))
