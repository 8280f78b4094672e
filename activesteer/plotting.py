"""Figures on paper, in a file or in a page: made without a screen, saved with an error that says where."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

from markupsafe import Markup

from activesteer.errors import ActiveSteerError, ParameterError, not_installed
from activesteer.files import make_folder, replacing, shown_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

T = TypeVar("T")

DOTS_PER_INCH: Final = 300
"""Of pictures that are saved as pixels: what journals ask for."""


def new_figure(width_in: float, height_in: float, title: str = "") -> Figure:
    """An empty figure.

    Raises:
        ParameterError: matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure  # noqa: PLC0415 - an extra, and slow to import
    except ImportError as error:
        raise not_installed(ParameterError, "a plot", "matplotlib", "plot") from error
    # A Figure of its own instead of pyplot: no backend is chosen and no global state touched for the caller.
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    if title:
        figure.suptitle(title, fontsize="medium")
    return figure


def plain_axis(axis: Axes) -> None:
    """A grid, and no frame above and on the right: what all axes of ours have."""
    axis.grid(visible=True, color="#dddddd", linewidth=0.6)
    axis.spines[["top", "right"]].set_visible(False)


def zero_line(draw: Callable[..., object]) -> None:
    """The line through zero, by `axhline` or `axvline` of an axis."""
    draw(0.0, color="#999999", linewidth=0.7, zorder=0.5)


def page_axis(axis: Axes, title: str, x_label: str) -> None:
    """An axis of a page: small words, and a legend where curves have names."""
    plain_axis(axis)
    axis.set_title(title, fontsize="small")
    axis.set_xlabel(x_label, fontsize="small")
    axis.tick_params(labelsize="small")
    if axis.get_legend_handles_labels()[1]:
        axis.legend(frameon=False, fontsize="x-small")


def as_svg(figure: Figure) -> Markup:
    """The picture as an SVG element, to stand on a page of any colour; matplotlib escapes its texts."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None}, transparent=True)
    svg = text.getvalue()
    return Markup(svg[svg.index("<svg") :])


def save(figure: Figure, path: Path, error: type[ActiveSteerError] = ParameterError) -> Path:
    """Writes a figure and returns the path.

    Raises:
        ActiveSteerError: it cannot be written; of class `error`.
    """
    with replacing(path, error) as part:
        try:
            figure.savefig(part, dpi=DOTS_PER_INCH)
        except ValueError as reason:  # an ending that is no format of matplotlib's
            raise error(f"cannot write {shown_path(path)}: {reason}", value=path) from reason
    return path


def save_all(pictures: Mapping[str, Callable[[T], Figure]], subject: T, folder: str | os.PathLike[str]) -> list[Path]:
    """Draws several figures of one thing and writes them as PNG files.

    Args:
        pictures: File name without its ending -> what draws the figure.
        subject: What is drawn.
        folder: Directory for the files; created where it does not exist.

    Returns:
        The paths written, in the order given.

    Raises:
        ParameterError: matplotlib is not installed, or a file cannot be written.
    """
    directory = make_folder(folder, ParameterError)
    return [save(draw(subject), directory / f"{name}.png") for name, draw in pictures.items()]
