"""Figures of matplotlib: made without a screen and written to files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from activesteer.errors import ActiveSteerError, ParameterError, not_installed
from activesteer.files import atomic_write, shown_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DOTS_PER_INCH: Final = 300
"""Resolution of pictures that are saved as pixels: journals ask for it."""


def new_figure(width_in: float, height_in: float, title: str = "") -> Figure:
    """Return an empty figure.

    Raises:
        ParameterError: matplotlib is not installed.
    """
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
    """Write a figure and return its path. The first file fixes the layout, which other formats keep.

    Raises:
        ActiveSteerError: the file cannot be written; of class `error`.
    """
    with atomic_write(path, error) as part:
        try:
            figure.savefig(part, dpi=DOTS_PER_INCH)
        except ValueError as reason:  # an ending that is no format of matplotlib's
            raise error(f"cannot write {shown_path(path)}: {reason}", value=path) from reason
    figure.set_layout_engine("none")
    return path
