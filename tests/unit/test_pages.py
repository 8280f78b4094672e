"""Pages: all content of a recording or a reference remains text."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from jinja2 import UndefinedError
from markupsafe import Markup

from activesteer.analysis.report import report_page
from activesteer.pages import _environment, render_page
from activesteer.pages.model import Page, Section, Table, picture_values
from activesteer.plotting import Curve, Panel, Picture, draw
from tests.contrast import contrast
from tests.reference.chrono.comparison import Comparison
from tests.reference.chrono.kinematics import Curves
from tests.reference.chrono.programme import Validation
from tests.reference.chrono.reference import ReferenceData
from tests.reference.chrono.study import Response
from tests.reference.chrono.validation_page import validation_page
from tests.unit.analysis.synthetic import step_steer
from tests.unit.analysis.synthetic_files import recording_of

EVIL = "--></title></style></script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&{{ version }}{% raise %}"


def scripts(text: str) -> int:
    return len(re.findall(r"<script\b", text))


def result(word: str) -> Validation:
    reference = ReferenceData(word, word, word, (0.0, 0.0, 0.0), Path(), (), (word,))
    rows = [Comparison(word, word, word, 1.0, 2.0, -1.0, 0.5), Comparison("rack", word, "m", 1.0, 1.0, 0.0, None)]
    x = np.linspace(0.0, 1.0, 5)
    curves = [Curves("rack", word, word, x, x, x, 0.1 + 0.0 * x)]
    return Validation(reference, rows, curves, {}, {})


def test_names_in_a_validation_stay_text():
    studies = {EVIL: [Response(EVIL, *([1.0] * 6))]}
    evil = render_page(validation_page(result(EVIL), studies))
    assert scripts(evil) == 4
    assert "<img" not in evil
    assert evil.count('<div class="plots"') == 1
    assert 'class="outside"' in evil


def test_both_pages_have_one_frame_and_one_stylesheet():
    texts = [report_page({"a": recording_of(step_steer())}), render_page(validation_page(result("plain")))]
    frames = [re.search(r"<meta http-equiv.*?>", text, re.DOTALL) for text in texts]
    styles = [re.search(r":root \{.*?</style>", text, re.DOTALL) for text in texts]
    assert frames[0]
    assert frames[1]
    assert frames[0][0] == frames[1][0]
    assert styles[0]
    assert styles[1]
    assert styles[0][0] == styles[1][0]


def test_every_text_can_be_read_on_every_page():
    """All pages have one stylesheet: its colours by day and by night."""
    modes = [
        dict(re.findall(r"--(\w+): (#\w{6})", each))
        for each in re.split(r"@media", render_page(validation_page(result("plain"))), maxsplit=1)
    ]
    inks = ("ink", "quiet", "link", "passed", "failed", "known")
    pairs = [(ink, paper) for ink in inks for paper in ("paper", "shade", "differs")] + [("ink", "outside")]
    assert min(contrast(colours[ink], colours[paper]) for colours in modes for ink, paper in pairs) >= 4.5


def test_what_a_template_needs_must_be_given():
    with pytest.raises(UndefinedError):
        _environment().get_template("document.html").render()


def test_lines_of_a_cell_are_apart_in_the_terminal():
    cell = Markup('{}<br><code class="key">{}</code>').format("anti-roll bar <1>", "factors.anti_roll_bar")
    assert list(Table("", ["parameter"], [[cell]]).lines())[1] == "  anti-roll bar <1>, factors.anti_roll_bar"


def test_the_terminal_shows_the_titles_of_sections_and_tables():
    table = Table("Correlation", ["parameter"], [["mass"]])
    assert list(Page("t", "Fit", [], [Section("Steps", tables=[table])]).lines())[:3] == ["Fit", "Steps", "Correlation"]


def test_a_long_curve_keeps_its_shortest_peak():
    y = np.zeros(100_000)
    y[54_321] = 7.0
    (panel,) = picture_values(Picture("", [Panel("x", "y", [Curve(np.arange(len(y)), y)])]))["panels"]
    (curve,) = panel["curves"]
    assert len(curve["x"]) == len(curve["y"]) <= 2002
    assert curve["x"][curve["y"].index(7.0)] == 54_321


def test_a_number_in_a_heading_keeps_its_unit():
    page = Page("t", "Sine with dwell, 80 km/h, 5 A, dry", [], [])
    assert "<h1>Sine with dwell, 80\N{NO-BREAK SPACE}km/h, 5\N{NO-BREAK SPACE}A, dry</h1>" in render_page(page)


@pytest.mark.parametrize("runs", [[2], [1, 2, 3]])
def test_a_figure_over_whole_numbers_has_whole_ticks(runs: list[int]):
    pytest.importorskip("matplotlib")
    (axis,) = draw(Picture("", [Panel("runs", "margin [-]", [Curve(runs, [1.0] * len(runs))])])).axes
    low, high = axis.get_xlim()
    assert [tick for tick in axis.get_xticks() if low <= tick <= high] == runs


def test_a_spread_has_its_sign():
    table = Table("", ["quantity", "value"], [["angle", "-94.0 +- 1.3"]])
    assert "\N{MINUS SIGN}94.0 \N{PLUS-MINUS SIGN} 1.3" in render_page(Page("a", "A", [], [Section(tables=[table])]))


def test_a_column_of_the_controller_none_is_no_column_of_numbers():
    assert Table("", ["file", "controller", "duration"], [["a", "none", "5"], ["b", "none", "-"]]).number_columns == {2}
