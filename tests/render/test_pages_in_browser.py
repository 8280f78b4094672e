"""Every kind of page in a browser, by size and colour scheme: its structure, and that all of it can be read."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from activesteer import study
from activesteer.analysis.report import write_report
from activesteer.commands.cli import main
from activesteer.measured.comparison import compare
from activesteer.measured.fitting import fit
from activesteer.measured.pages import comparison_page, write_fit
from activesteer.pages import Page, Section, Table, write_page
from activesteer.plotting import Area, Curve, Panel, Picture
from activesteer.standards.examination import examination_page
from activesteer.studies.engine.report import write_report as write_study_report
from tests.conftest import PHONE
from tests.contrast import contrast
from tests.render.test_report_in_browser import TEXT_COLOURS, pixels
from tests.unit.analysis.synthetic_files import lane_changes
from tests.unit.measured.test_comparison import TIME_S, step
from tests.unit.measured.test_comparison import run as signals
from tests.unit.measured.test_fitting import STUDY, noisy, step_to_either_side
from tests.unit.standards.test_page import examination
from tests.unit.studies.short import RATIO, short_study

if TYPE_CHECKING:
    from playwright.sync_api import Browser
    from playwright.sync_api import Page as Shown

pytestmark = pytest.mark.render

DESK = {"viewport": {"width": 1440, "height": 900}}
DEVICES = {f"{name} {scheme}": device | {"color_scheme": scheme}
           for name, device in (("desk", DESK), ("phone", PHONE)) for scheme in ("light", "dark")}  # fmt: skip
# Texts with their size on the screen, drawn ones too.
SIZES = """() => {
  const found = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const part = walker.currentNode.parentElement, text = walker.currentNode.textContent.trim();
    const svg = part.closest("svg");
    if (!text || !part.checkVisibility() || part.closest("script, style")) continue;
    const scale = svg ? svg.getBoundingClientRect().width / svg.viewBox.baseVal.width : 1;
    found.push([parseFloat(getComputedStyle(part).fontSize) * scale, text]);
  }
  return found;
}"""
STRUCTURE = """() => Object.fromEntries(["h1", "h2", "h3", "figure", "table", "tr", "canvas", "details", "li"]
  .map((name) => [name, document.querySelectorAll(name).length]))"""


def every_panel(folder: Path) -> Path:
    """Write a page with every kind of panel."""
    x = np.linspace(0.1, 10.0, 50)
    wave = Curve(x, np.sin(x), "a wave", "#d55e00")
    panels = [
        Panel("time [s]", "yaw rate [deg/s]", [wave, Curve(x, x)], "lines", [Area(x, -1.0, np.cos(x), "band")],
              [(0.5, "a limit")], notes=[(3.0, 0.0, "a note")]),
        Panel("frequency [Hz]", "gain [-]", [Curve(x, x**2, marker="o", dashes="")], log="xy"),
        Panel("real", "imaginary", [Curve(np.cos(x), np.sin(x), shade=0.3)], equal=True, zero=True),
        Panel("place", "", [Curve([0.5], [0.0], marker="D", dashes="")],
              names=["a name so long that it would not fit beside the axis of any telephone"]),
        Panel("travel [mm]", "camber [deg]", [wave], above=("roll [deg]", x, -x)),
    ]  # fmt: skip
    picture = Picture("every kind of panel", panels, ("speed [km/h]", 60.0, 160.0))
    table = Table("", ["quantity", "value", "unit", "remark"], [["yaw rate", "-1.2", "deg/s", "a remark " * 12]] * 3)
    page = Page(
        "all", "A page with everything", ["A lead."], [Section("Part", ["Text."], [table], ["item"], [picture])]
    )
    return write_page(page, folder / "all.html")


def kc(folder: Path) -> Path:
    assert main(["kc", "-o", str(folder)]) == 0
    return folder / "kc.html"


def comparison(folder: Path) -> Path:
    """Write a comparison of two quantities, one inside its corridor and one outside."""
    steering, rate = step(TIME_S), 0.3 * step(TIME_S)
    measured = signals(steering_wheel_rad=steering, yaw_rate_radps=1.2 * rate, ay_mps2=4.0 * steering)
    found = compare([measured], signals(steering_wheel_rad=steering, yaw_rate_radps=rate, ay_mps2=4.0 * steering))
    return write_page(comparison_page(found, ["car"], "model"), folder / "compare.html")


def fitted(folder: Path) -> Path:
    noisy(step_to_either_side(), folder / "a.mcap", 4)
    found = fit({**STUDY, "maneuvers": [str(folder / "a.mcap")]}, jobs=1)
    return next(path for path in write_fit(found, "fit", folder) if path.suffix == ".html")


def linearised(name: str, *words: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        assert main(["linearise", *words, "-o", str(folder)]) == 0
        return folder / f"{name}.html"

    return write


def of_study(folder: Path) -> Path:
    table = short_study(0.8, 0.9, 1.0, key=RATIO, controllers=["none", "ars"], title="Ratio")
    table["factors"]["speed_kmh"] = {"grid": [70.0, 80.0]}
    study(table, output=folder / "s", jobs=1)
    return write_study_report(folder / "s")


PAGES: dict[str, Callable[[Path], Path]] = {
    "all": every_panel,
    "report": lambda folder: write_report(lane_changes(), folder / "report.html"),
    "standard": lambda folder: write_page(
        examination_page(examination("a word", **{"pass": False})), folder / "s.html"
    ),
    "kc": kc,
    "study": of_study,
    "compare": comparison,
    "fit": fitted,
    "modes": linearised("modes"),
    "driver": linearised("driver", "--loop", "driver", "--speed-kmh", "80,100"),
    "margins": linearised("margins", "--loop", "controller", "--speed-kmh", "80,100"),
}


@pytest.fixture
def shown(browser: Browser) -> Iterator[Callable[..., Shown]]:
    """Open a page; a message of the console, an error, or a request for another resource fails the test."""
    wrong: list[str] = []
    contexts: list[Any] = []

    def shown(path: Path, **device: Any) -> Shown:
        context = browser.new_context(**device)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: wrong.append(message.text))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda request: wrong.extend({request.url} - {path.as_uri()}))
        page.goto(path.as_uri())
        page.wait_for_selector("canvas, main svg", state="attached")
        return page

    yield shown
    for context in contexts:
        context.close()
    assert wrong == []


def check(page: Shown) -> None:
    """Nothing is wider than the screen, and every text is large and dark enough."""
    width = page.viewport_size["width"] if page.viewport_size else 0
    for details in page.locator("details").all():
        details.evaluate("(details) => { details.open = true; }")
    assert page.evaluate("document.documentElement.scrollWidth") == width
    for size, text in page.evaluate(SIZES):
        assert size >= 10.99, text
    for ink, paper, text in page.evaluate(TEXT_COLOURS):
        assert contrast(ink, paper) >= 4.5, text
    cut = "(rows) => rows.filter((row) => row.scrollWidth > row.clientWidth).map((row) => row.textContent)"
    assert page.locator(".cards tr").evaluate_all(cut) == []
    for box in (box for canvas in page.locator("figure canvas").all() if (box := canvas.bounding_box())):
        assert box["x"] >= 0.0
        assert box["x"] + box["width"] <= width


def test_a_phone_shows_every_kind_of_panel_and_a_row_as_a_card(shown, tmp_path):
    page = shown(every_panel(tmp_path), **PHONE)
    check(page)
    assert page.locator("figure canvas").count() == 5
    assert page.locator("table thead").is_hidden()
    box = page.locator("tbody tr").first.bounding_box()
    assert box
    assert box["width"] <= 390.0
    # A value that rounds to zero has no sign.
    told = page.evaluate("[-0.001, -0.01, 0, null, -1234.5].map(shown)")
    assert told == ["0.00", "\N{MINUS SIGN}0.01", "0.00", "\N{EN DASH}", "\N{MINUS SIGN}1235"]


def test_few_results_stay_in_a_row_on_a_phone(shown, tmp_path):
    table = Table("", ["Run", "Largest yaw rate", "Final heading"], [["a", "1.0", "2.0"]], kind="results", numbers=2)
    picture = Picture("", [Panel("x [m]", "y [m]", [Curve([0.0, 1.0], [0.0, 1.0])])])
    sections = [Section("Part", [], [table], pictures=[picture])]
    page = shown(write_page(Page("all", "Few", [], sections), tmp_path / "f.html"), **PHONE)
    cells = page.locator("tbody td").evaluate_all("(all) => all.map((one) => one.getBoundingClientRect().toJSON())")
    assert cells[0]["top"] == cells[1]["top"]
    assert cells[0]["right"] <= cells[1]["left"]


def test_many_plots_stand_four_in_a_row_unless_they_are_over_time(shown, tmp_path):
    curve = Curve([0.0, 1.0], [0.0, 1.0])
    pictures = [Picture("", [Panel(x, "toe [deg]", [curve]) for _ in range(6)]) for x in ("travel [mm]", "time [s]")]
    sections = [Section(f"Part {number}", pictures=[picture]) for number, picture in enumerate(pictures)]
    page = shown(write_page(Page("all", "Many", [], sections), tmp_path / "m.html"), **DESK)
    tops = page.locator("figure").evaluate_all("(all) => all.map((one) => one.getBoundingClientRect().top)")
    assert len(tops) == 12
    assert len(set(tops[:6])) == 2
    assert len(set(tops[6:])) == 3


def test_plots_in_a_row_stand_at_one_height_below_names_of_any_length(shown, tmp_path):
    names = ["toe", "a name so long that it takes more than one line above its plot, and " * 3]
    panels = [Panel("x [m]", "y [m]", [Curve([0.0, 1.0], [0.0, 1.0])], name) for name in names]
    sections = [Section("Part", pictures=[Picture("", panels)])]
    page = shown(write_page(Page("all", "Rows", [], sections), tmp_path / "r.html"), **DESK)
    heads = page.locator("figcaption").evaluate_all("(all) => all.map((one) => one.getBoundingClientRect().height)")
    tops = page.locator(".uplot").evaluate_all("(all) => all.map((one) => one.getBoundingClientRect().top)")
    assert heads[0] < heads[1]
    assert tops[0] == tops[1]
    page.set_viewport_size({"width": 688, "height": 900})
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    tops = page.locator(".uplot").evaluate_all("(all) => all.map((one) => one.getBoundingClientRect().top)")
    assert tops[0] == tops[1]


def test_many_plots_and_a_long_table_are_folded_on_a_phone_below_what_they_are(shown, tmp_path):
    picture = Picture("", [Panel("x [m]", "y [m]", [Curve([0.0, 1.0], [0.0, 1.0])])] * 6)
    table = Table("Modes", ["name", "value"], [["a", "1"]] * 9)
    path = write_page(Page("all", "Fold", [], [Section(tables=[table], pictures=[picture])]), tmp_path / "f.html")
    page = shown(path, **PHONE)
    assert page.locator("summary:visible").all_inner_texts()[:2] == ["Modes 9 rows", "6 plots"]
    assert page.locator("figure:visible, tbody:visible").count() == 0
    assert shown(path, **DESK).locator("figure:visible, tbody:visible").count() == 7


# Texts of the fields of a chart: ordinate and baseline, middle of the field [px], and colours of both.
FIELDS = """() => {
  const chart = drawn.find((each) => each.panel.areas.some((area) => area.shade != null) && each.panel.notes.length);
  const texts = [], { ctx } = chart.plot, told = ctx.fillText;
  ctx.fillText = (text, x, y) => texts.push([text, y, ctx.textBaseline]);
  chart.draw(chart.plot);
  ctx.fillText = told;
  return chart.panel.areas.map(({ low, high, shade }, i) => {
    const [text, , value, colour] = chart.panel.notes[i], [, y, baseline] = texts.find(([each]) => each === value);
    const middle = chart.plot.valToPos((low[0] + high[0]) / 2, "y", true);
    return { y, baseline, middle, colours: [scaleColour(shade), colour] };
  });
}"""


@pytest.mark.slow
def test_a_choice_with_a_long_name_is_no_wider_than_a_phone(shown, tmp_path):
    page = shown(of_study(tmp_path), **PHONE)
    for select in page.locator("select").all():
        select.evaluate("(select) => { select.options[0].textContent = 'a long name '.repeat(9); }")
        box = select.bounding_box()
        assert box
        assert 300.0 < box["x"] + box["width"] <= 390.0
    assert page.evaluate("document.documentElement.scrollWidth") == 390


@pytest.mark.slow
def test_the_values_of_a_map_stand_in_the_middle_of_their_fields(shown, tmp_path):
    page = shown(of_study(tmp_path), **PHONE)
    fields = page.evaluate(FIELDS)
    assert len(fields) == 6
    for field in fields:
        assert field["baseline"] == "middle"
        assert abs(field["y"] - field["middle"]) <= 3.0
        assert contrast(*field["colours"]) >= 4.5


@pytest.mark.slow
@pytest.mark.parametrize(("value", "told"), [("of", True), ("0 * of", False)])
def test_a_map_names_a_third_factor_that_differs_between_its_fields(shown, tmp_path, value, told):
    page = shown(of_study(tmp_path), **DESK)
    page.evaluate(f"""() => {{
      const [{{ key }}] = DATA.factors, values = DATA.rows.factors[key].map((of) => {value});
      DATA.factors.push({{ key: "third", label: "mass factor", unit: "-", numeric: true, levels: null }});
      DATA.rows.factors.third = values;
      for (const found of Object.values(DATA.by_group[0])) found.heat = null;
      drawAll();
    }}""")
    assert ("The fields also differ in mass factor." in page.inner_text("#study")) == told


@pytest.mark.slow
def test_links_and_sliders_of_a_phone_are_as_large_as_a_finger(shown, tmp_path):
    time_s = np.linspace(0.0, 1.0, 5)
    picture = Picture("", [Panel("time [s]", "y [m]", [Curve(time_s, time_s)])])
    sections = [Section(name, pictures=[picture]) for name in ("A", "B", "C")]
    page = shown(write_page(Page("all", "Touch", [], sections), tmp_path / "t.html"), **PHONE)
    boxes = page.locator(".jump a").evaluate_all("(all) => all.map((one) => one.getBoundingClientRect().toJSON())")
    assert len(boxes) == 4
    assert boxes[0]["width"] >= 40.0  # Top
    assert min(box["height"] for box in boxes) >= 40.0
    slider = page.locator("input.time").bounding_box()
    assert slider
    assert slider["height"] >= 40.0


@pytest.mark.slow
def test_the_extreme_runs_of_a_study_are_listed_with_their_factors(shown, tmp_path):
    page = shown(of_study(tmp_path), **DESK)
    table = page.locator("section.part", has_text="Largest and smallest magnitudes").locator("table").last
    heads = table.locator("th").evaluate_all("(all) => all.map((one) => one.textContent)")
    place = heads.index("speed [km/h]")
    values = table.locator(f"tbody tr td:nth-child({place + 1})").evaluate_all(
        "(all) => all.map((one) => one.textContent)"
    )
    assert set(values) == {"70", "80"}
    assert page.locator("details:has(table) > summary", has_text="runs, with factors and commands").count() == 1
    page.evaluate("begin('Commands'); tableOf(['run', 'command'], [['1', replayLine('activesteer run slalom')]])")
    assert page.locator(".controls:visible").count() == 2
    page.emulate_media(media="print")  # a button is of no use on paper
    assert page.locator(".controls:visible").count() == 0


@pytest.mark.slow
def test_the_chosen_metric_of_a_study_is_not_among_the_other_metrics(shown, tmp_path):
    page = shown(of_study(tmp_path), **DESK)
    others = page.locator("section.part", has_text="Other metrics").locator("figcaption b").all_inner_texts()
    assert others
    chosen = page.locator(".choices select").last
    assert chosen.evaluate("(list) => list.selectedOptions[0].textContent") not in others
    chosen.select_option(label=others[0])
    assert (
        others[0]
        not in page.locator("section.part", has_text="Other metrics").locator("figcaption b").all_inner_texts()
    )


@pytest.mark.slow
def test_points_of_controllers_stand_side_by_side_where_a_factor_has_few_values(shown, tmp_path):
    page = shown(of_study(tmp_path), **DESK)
    places = page.evaluate("""() => drawn.filter(({ panel }) => panel.x === "speed [km/h]" && panel.curves.length === 2)
      .map(({ panel }) => panel.curves.map(({ x }) => Math.min(...x)))""")
    assert places
    assert all(left < 70.0 < right for left, right in places)


@pytest.mark.slow
def test_a_legend_shows_a_filled_area_as_an_area(shown, tmp_path):
    x = np.linspace(0.0, 1.0, 5)
    panel = Panel(
        "x [m]", "y [m]", [Curve(x, x, "measured", "#777777")], areas=[Area(x, -1.0, 1.0, "tolerance", "#777777")]
    )
    page = shown(
        write_page(Page("all", "Area", [], [Section(pictures=[Picture("", [panel])])]), tmp_path / "a.html"), **DESK
    )
    heights = page.locator(".swatch path").evaluate_all("(paths) => paths.map((path) => path.getBBox().height)")
    assert heights == [0, 5]


@pytest.mark.slow
def test_pointing_at_a_chart_tells_values_and_a_name_hides_its_curve(shown, tmp_path):
    page = shown(every_panel(tmp_path), **DESK)
    figure = page.locator("figure").first
    figure.scroll_into_view_if_needed()
    box = figure.locator(".u-over").bounding_box()
    assert box
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 20.0)
    assert figure.locator(".values span").count() == 2
    button = page.locator(".legend button", has_text="a wave")
    button.click()
    assert button.get_attribute("aria-pressed") == "false"
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 20.0)
    assert figure.locator(".values span").count() == 1


@pytest.mark.slow
def test_legends_show_points_for_curves_of_points(shown, tmp_path):
    x = np.linspace(0.0, 1.0, 20)
    markers = {"line": "", "o": "o", "D": "D", "x": "x", "s": "s"}
    curves = [Curve(x, x, name, "#d55e00", "" if marker else "-", marker=marker) for name, marker in markers.items()]
    sections = [Section(pictures=[Picture("", [Panel("x [m]", "y [m]", curves)])])]
    page = shown(write_page(Page("all", "Legends", [], sections), tmp_path / "l.html"), **DESK)
    widths = page.locator(".swatch path").evaluate_all("(paths) => paths.map((path) => path.getBBox().width)")
    assert widths[0] == 28
    assert len(widths) == len(markers)
    assert all(0 < width <= 6 for width in widths[1:])


@pytest.mark.slow
def test_pictures_of_a_section_with_the_same_names_share_one_legend(shown, tmp_path):
    x = np.linspace(0.0, 1.0, 20)

    def pictures(*names: str) -> list[Picture]:
        return [Picture("", [Panel("x [m]", "y [m]", [Curve(x, x, name, "#d55e00")])]) for name in names]

    sections = [Section("one", pictures=pictures("a", "a", "b")), Section("two", pictures=pictures("a"))]
    page = shown(write_page(Page("all", "Legends", [], sections), tmp_path / "l.html"), **DESK)
    assert page.locator(".legend").all_inner_texts() == ["a", "b", "a"]
    first = page.locator(".legend button").first
    first.click()
    drawn = [pixels(figure, "#d55e00") > 20 for figure in page.locator("figure").all()]
    assert drawn == [False, False, True, True]


@pytest.mark.slow
@pytest.mark.parametrize("device", ["desk light", "phone light"])
def test_one_player_moves_the_curves_of_all_pictures_and_stays_in_sight(shown, tmp_path, device):
    time_s = np.linspace(2.0, 4.0, 50)
    pictures = [Picture(f"picture {i}", [Panel("time [s]", "angle [deg]", [Curve(time_s, time_s)])]) for i in range(4)]
    sections = [Section(str(i), ["Text."], pictures=[picture]) for i, picture in enumerate(pictures)]
    page = shown(write_page(Page("all", "Time", [], sections), tmp_path / "t.html"), **DEVICES[device])
    slider, height = page.locator("input.time"), page.evaluate("document.body.scrollHeight")
    slider.evaluate("(slider) => { slider.value = slider.max / 2; slider.dispatchEvent(new Event('input')); }")
    assert page.evaluate("document.body.scrollHeight") == height  # nothing jumps when values appear
    assert page.locator(".player output").inner_text() == "3.00 s"
    for figure in page.locator("figure").all():
        figure.scroll_into_view_if_needed()
        assert float(figure.locator(".values").inner_text().split()[0]) == pytest.approx(3.0, abs=0.05)
        box = slider.bounding_box()
        assert box
        assert 0.0 <= box["y"] < page.evaluate("innerHeight")


@pytest.mark.slow
@pytest.mark.parametrize("kind", PAGES)
def test_every_page_has_one_structure_on_every_screen(shown, tmp_path, folder, kind):
    path = PAGES[kind](tmp_path)
    structures = {}
    for name, device in DEVICES.items():
        page = shown(path, **device)
        structures[name] = page.evaluate(STRUCTURE)
        page.screenshot(path=folder / f"page-{kind}-{name.replace(' ', '-')}.png", full_page=True)
        check(page)
    first = structures["desk light"]
    assert first["h1"] == 1
    assert first["figure"] == first["canvas"]
    assert all(found == first for found in structures.values())
