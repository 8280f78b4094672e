"""The page of a test: complete, without external resources, and with markup in names escaped."""

from __future__ import annotations

import datetime
import re
from dataclasses import replace

from activesteer.pages import Table, render_page
from activesteer.plotting import Curve, Panel, Picture
from activesteer.standards.catalogue import Standard
from activesteer.standards.examination import Examination, _side_by_side, _together, examination_page
from activesteer.standards.standard import Findings, metrics_table

EVIL = '</td><script>alert(1)</script><img src="http://example.org/x">{{ version }}'


def examination(word: str, **values: bool) -> Examination:
    picture = Picture(word, [Panel(word, word, [Curve([1.0, 2.0], [1.0, 2.0], word)], word, limits=[(1.5, word)])])
    shaded = Picture(word, [Panel("x", "y", [Curve([1.0, 2.0], [1.0, 2.0], shade=0.5)], log="x")], (word, 0.0, 1.0))
    found = Findings(dict(values), word, [Table(word, [word], [[word]], frozenset([0]))], [picture, shaded])
    standard = Standard(word, word, (word,), (word,), name="one")
    return Examination(standard, word, word, {"road.mu": word}, {word: found}, {"activesteer": word}, datetime.date.min)


def test_page_shows_all_and_fetches_nothing():
    text = render_page(examination_page(examination("plain", **{"pass": False})))
    assert len(re.findall(r"data-picture=\"\d", text)) == 2
    assert ">\N{BALLOT X} fail<" in text
    assert 'class="outside"' in text
    assert "0001-01-01" in text


def test_names_stay_text():
    text = render_page(examination_page(examination(EVIL)))
    assert text.count("<script") == 4
    assert "<script>alert" not in text
    assert "<img" not in text
    assert "{{ version }}" in text


def test_a_method_without_limits_never_says_pass():
    text = render_page(examination_page(examination("plain")))
    assert ">pass<" not in text
    assert ">fail<" not in text
    assert "No limits in the standard" in text


def test_a_table_stands_above_the_plots_of_its_runs():
    line = Panel("x", "y", [Curve([0.0, 1.0], [0.0, 1.0])])
    tables = [Table(title, ["of"], [["1"]]) for title in ("Circle", "Limits")]
    pictures = [Picture(title, [line]) for title in ("Track", "Circle")]
    page = examination_page(replace(examination("word"), findings={"none": Findings({}, "", tables, pictures)}))
    parts = [
        [section.level, *([part.title for part in each] for each in (section.tables, section.pictures))]
        for section in page.sections[:4]
    ]
    assert parts == [[2, [], []], [3, ["Circle"], [""]], [3, ["Limits"], []], [3, [], ["Track"]]]


def test_runs_that_fail_at_once_have_no_empty_plots():
    nothing = Picture("Stop", [Panel("x", "y", [Curve([], [])]), Panel("x", "z")])
    page = examination_page(replace(examination("word"), findings={"none": Findings({}, "", (), [nothing])}))
    assert not any(section.pictures for section in page.sections)


def test_metrics_of_several_controllers_stand_side_by_side_once():
    def findings(**metrics: float) -> Findings:
        table = metrics_table("Circle", {side: metrics for side in ("left", "right")})
        return Findings({}, "one; two", [table, Table("Own", ["of"], [["1"]])])

    found = {"none": findings(cones_hit=1.0), "ars": findings(cones_hit=2.0, lane_overstep_m=3.0)}
    first, _, side_by_side, *others = examination_page(replace(examination("word"), findings=found)).sections
    assert [row[2] for row in first.tables[0].rows] == ["one<br>two"] * 2
    (table,) = side_by_side.tables
    assert list(table.columns) == ["", "unit", "none, left", "none, right", "ars, left", "ars, right"]
    assert [[cell[:1] for cell in row[2:]] for row in table.rows] == [["1", "1", "2", "2"], ["-", "-", "3", "3"]]
    assert [section.tables[0].title for section in others if section.tables] == ["Own", "Own"]
    assert _side_by_side({str(number): findings(cones_hit=1.0) for number in range(5)}) == {}  # ten columns


def test_overlaid_controllers_share_their_pictures_and_sides_differ_in_width():
    def findings(height: float) -> Findings:
        curves = [Curve([0.0, 1.0], [0.0, height + place], side) for place, side in enumerate(("left", "right"))]
        return Findings({}, "", (), [Picture("Circle", [Panel("x", "y", curves)])])

    found = {"none": findings(1.0), "ars": findings(2.0)}
    (picture,) = _together(found).values()
    (panel,) = picture.panels
    assert isinstance(panel, Panel)
    assert [curve.label for curve in panel.curves] == ["none, left", "none, right", "ars, left", "ars, right"]
    assert len({curve.colour for curve in panel.curves}) == 4
    wide, thin = (panel.curves[place::2] for place in (0, 1))
    assert min(curve.width for curve in wide) > 2.0 * max(curve.width for curve in thin)
    assert _together({"none": findings(1.0)}) == {}


def test_a_picture_whose_curves_could_not_be_told_apart_stays_with_its_controller():
    line = Curve([0.0, 1.0], [0.0, 1.0])
    single, many = Picture("One", [Panel("x", "y", [line])]), Picture("Many", [Panel("x", "y", [line] * 3)])
    cones = Picture("Cones", [Panel("x", "y", [line, line._replace(dashes="", marker="o")])])
    found = {name: Findings({}, "", (), [single, many, cones]) for name in ("none", "ars")}
    together = _together(found)
    assert list(together) == ["One"]
    (panel,) = together["One"].panels
    assert isinstance(panel, Panel)
    assert [curve.label for curve in panel.curves] == ["none", "ars"]
    example = examination("word")
    page = examination_page(replace(example, findings=found))
    assert [[picture.title for picture in section.pictures] for section in page.sections if section.pictures] == [
        ["One"], *[["Many"], ["Cones"]] * 2
    ]  # fmt: skip
