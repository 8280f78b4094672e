"""The comparison on a measured circle as one HTML page."""

from __future__ import annotations

from pathlib import Path
from typing import Final

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
        "Steering wheel angle on the measured circle: simulated {} deg with measured kinematics and compliance only, "
        "measured {} deg. The difference of <b>{} deg</b> is {} the tolerance of ISO 19364, {} deg (5 deg + 3 %). Area "
        "metric {} deg, overlap {} %. With the assumed compliances too, the angle is {} deg. No parameter of the car "
        "is fitted to this measurement."
    ).format(
        f"{result.samples_deg.mean():.1f}", f"{result.measured_deg.mean():.1f}",
        typeset(f"{result.difference_deg:+.1f}"),
        passed("inside") if result.inside else failed("outside"), f"{result.tolerance_deg:.1f}",
        f"{result.area_metric_deg:.1f}", f"{100.0 * result.overlap:.0f}", f"{result.assumed_deg:.1f}",
    )  # fmt: skip
    effects = [(effect.name, f"{result.contribution_deg(effect):+.1f}") for effect in result.effects]
    decisions = [("as decided", f"{result.assumed_deg:.1f}")]
    decisions += [(decision.name, f"{decision.angle_deg:.1f}") for decision in result.decisions]
    sections = [
        Section(pictures=[as_svg(draw(_picture(result)))]),
        *_box_sections(result),
        Section(
            "Contributions to the angle with the assumed compliances",
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


def _box_sections(result: CircleResult) -> list[Section]:
    box = result.box
    if box is None:
        return []
    inside, count = box.inside(result.measured_deg), len(result.measured_deg)
    ends = [(name, f"{low:.1f}", f"{high:.1f}", source) for name, source, low, high in box.ends_deg]
    falls = [(step.name, step.kind, f"{step.angle_deg:.1f}") for step in result.steps]
    text = (
        f"From {box.low_deg:.1f} to {box.high_deg:.1f} deg, {box.high_deg - box.low_deg:.1f} deg wide: {inside} of "
        f"{count} measured angles lie inside. Values with one unknown true value are intervals; mass, lateral "
        "acceleration and radius vary from lap to lap. The table gives the second prediction with the ends of "
        "each interval alone."
    )
    head = ["interval", "low end, deg", "high end, deg", "source"]
    steps = Table("", ["with", "origin", "deg"], falls, kind="comparisons")
    return [
        Section("Probability box", [text], tables=[Table("", head, ends)]),
        Section("From geometry to the second prediction", pictures=[as_svg(draw(_waterfall(result)))], tables=[steps]),
    ]


_KINDS: Final = {"geometry": "#8a9097", "measured": RUN_COLOURS[2], "assumed": RUN_COLOURS[1]}
"""Origin of a step -> colour."""


def _waterfall(result: CircleResult) -> Picture:
    """Draw the angle of each step as a bar from the angle of the step before."""
    areas, before, named = [], 80.0, set()
    for place, step in enumerate(result.steps):
        low, high = sorted((before, step.angle_deg))
        label = "" if step.kind in named else step.kind
        areas.append(Area([place + 0.1, place + 0.9], low, high, label, _KINDS[step.kind]))
        before = step.angle_deg
        named.add(step.kind)
    measured = float(result.measured_deg.mean())
    line = Curve([0.0, float(len(result.steps))], [measured, measured], "measured mean", "#777777")
    panel = Panel("step of the table", "steering wheel angle [deg]", [line], areas=areas)
    return Picture("", [panel], width_in=7.0, height_in=3.2)


def _picture(result: CircleResult) -> Picture:
    middle = float(result.measured_deg.mean())
    tolerance = [middle - result.tolerance_deg, middle + result.tolerance_deg]
    curves = [
        _cumulative(result.measured_deg, "measured", "#777777"),
        _cumulative(result.samples_deg, "predicted, measured K&C only", RUN_COLOURS[2]),
    ]
    area = Area(tolerance, 0.0, 1.0, "tolerance", "#777777", 0.15)
    if result.box is not None:
        curves += [
            _cumulative(result.box.lower_deg, "probability box", RUN_COLOURS[1]),
            _cumulative(result.box.upper_deg, "", RUN_COLOURS[1]),
        ]
    panel = Panel("steering wheel angle [deg]", "cumulative fraction", curves, areas=[area])
    return Picture("", [panel], width_in=7.0, height_in=3.2)


def _cumulative(values: Array, label: str, colour: str) -> Curve:
    """Return the empirical distribution as a step curve."""
    ordered = np.repeat(np.sort(values), 2)
    fraction = np.repeat(np.arange(len(values) + 1) / len(values), 2)[1:-1]
    return Curve(ordered, fraction, label, colour)
