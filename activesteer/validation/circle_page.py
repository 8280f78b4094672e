"""The comparison on a measured circle as one HTML page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from markupsafe import Markup

from activesteer.conventions import RUN_COLOURS, Array
from activesteer.display_units import typeset
from activesteer.errors import ParameterError
from activesteer.files import make_folder, write_text
from activesteer.pages import Page, Section, Table, failed, passed, render_page
from activesteer.plotting import Area, Curve, Panel, Picture, as_svg, draw
from activesteer.validation.measured_circle import CircleResult


def write_circle_page(result: CircleResult, path: Path) -> Path:
    """Write the page and return its path; an existing file is replaced.

    Args:
        result: Result of the comparison.
        path: The HTML file.

    Raises:
        ParameterError: matplotlib is not installed, or the file cannot be written.
    """
    make_folder(path.parent, ParameterError)
    return write_text(path, render_page(_page(result)), ParameterError)


def _page(result: CircleResult) -> Page:
    lead = Markup(
        "Steering wheel angle on the measured circle: simulated {} deg, measured {} deg. The difference of "
        "<b>{} deg</b> is {} the tolerance of ISO 19364, {} deg (5 deg + 3 %). Area metric {} deg, overlap {} %. "
        "No parameter of the car is fitted to this measurement."
    ).format(
        f"{result.samples_deg.mean():.1f}", f"{result.measured_deg.mean():.1f}",
        typeset(f"{result.difference_deg:+.1f}"),
        passed("inside") if result.inside else failed("outside"), f"{result.tolerance_deg:.1f}",
        f"{result.area_metric_deg:.1f}", f"{100.0 * result.overlap:.0f}",
    )  # fmt: skip
    effects = [(effect.name, f"{result.contribution_deg(effect):+.1f}") for effect in result.effects]
    decisions = [("as decided", f"{result.nominal_deg:.1f}")]
    decisions += [(decision.name, f"{decision.angle_deg:.1f}") for decision in result.decisions]
    sections = [
        Section(pictures=[as_svg(draw(_picture(result)))]),
        Section(
            "Contributions to the angle",
            ["Each effect is switched off alone; the table gives the decrease of the angle."],
            tables=[Table("", ["effect", "deg"], effects, kind="comparisons")],
        ),
        Section(
            "Angle with each open decision reversed, one at a time",
            tables=[Table("", ["decision", "deg"], decisions, kind="comparisons")],
        ),
    ]
    title = f"{result.vehicle} against a measurement on the road"
    return Page(f"activesteer validate: {result.vehicle}", title, [lead], sections)


def _picture(result: CircleResult) -> Picture:
    middle = float(result.measured_deg.mean())
    tolerance = [middle - result.tolerance_deg, middle + result.tolerance_deg]
    curves = [
        _cumulative(result.measured_deg, "measured", "#777777"),
        _cumulative(result.samples_deg, "predicted", RUN_COLOURS[2]),
    ]
    area = Area(tolerance, 0.0, 1.0, "tolerance", "#777777", 0.15)
    panel = Panel("steering wheel angle [deg]", "cumulative fraction", curves, areas=[area])
    return Picture("", [panel], width_in=7.0, height_in=3.2)


def _cumulative(values: Array, label: str, colour: str) -> Curve:
    """Return the empirical distribution as a step curve."""
    ordered = np.repeat(np.sort(values), 2)
    fraction = np.repeat(np.arange(len(values) + 1) / len(values), 2)[1:-1]
    return Curve(ordered, fraction, label, colour)
