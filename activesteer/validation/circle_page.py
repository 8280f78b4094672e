"""The comparison on a measured circle as one HTML page."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from activesteer.errors import ParameterError
from activesteer.files import make_folder, write_text
from activesteer.pages import render
from activesteer.plotting import as_svg, new_figure
from activesteer.validation.measured_circle import CircleResult


def write_circle_page(result: CircleResult, path: Path) -> Path:
    """Writes the page; a file that exists is replaced.

    Args:
        result: What came out.
        path: The HTML file.

    Returns:
        The path.

    Raises:
        ParameterError: matplotlib is not installed, or the file cannot be written.
    """
    figure = new_figure(7.0, 3.2)
    axis = figure.subplots()
    for values, colour, label in (
        (result.measured_deg, "#777777", "measured"),
        (result.samples_deg, "#0072b2", "predicted"),
    ):
        ordered = np.sort(values)
        axis.step(ordered, np.arange(1, len(ordered) + 1) / len(ordered), where="post", color=colour, label=label)
    middle = float(result.measured_deg.mean())
    axis.axvspan(middle - result.tolerance_deg, middle + result.tolerance_deg, color="#777777", alpha=0.15, linewidth=0)
    axis.set(xlabel="steering wheel angle [deg]", ylabel="cumulative fraction")
    axis.legend()
    make_folder(path.parent, ParameterError)
    return write_text(path, render("measured_circle.html", result=result, figure=as_svg(figure)), ParameterError)
