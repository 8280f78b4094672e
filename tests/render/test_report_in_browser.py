"""The report in a browser: on a desktop, on a phone, on paper. Skipped if there is no browser."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from activesteer import simulate
from activesteer.analysis.report import write_report
from activesteer.core.conventions import RUN_COLOURS
from tests.conftest import PHONE
from tests.contrast import contrast
from tests.unit.analysis.synthetic_files import lane_changes, step_steers

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

pytestmark = pytest.mark.render

DESK = {"viewport": {"width": 1280, "height": 800}}
DARK = DESK | {"color_scheme": "dark"}
DURATION_S = 7.0
LOST = {"stays_in_lanes": 0.0, "lane_overstep_m": 1.2, "cones_hit": 2.0, "sideslip_peak_abs_rad": 0.8}

# How many pixels of a canvas have about a colour; blending with white makes others of it.
COUNT = """(canvas, [r, g, b, tolerance]) => {
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const context = copy.getContext("2d", { willReadFrequently: true });
  context.drawImage(canvas, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height);
  const near = (i) => Math.abs(data[i] - r) + Math.abs(data[i + 1] - g) + Math.abs(data[i + 2] - b) < tolerance;
  let found = 0;
  for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 200 && near(i)) found++;
  return found;
}"""
# Colour of each text and of what lies behind it, once for each pair.
TEXT_COLOURS = """() => {
  const two = (part) => (+part).toString(16).padStart(2, "0");
  const hex = (colour) => "#" + colour.match(/[\\d.]+/g).slice(0, 3).map(two).join("");
  const behind = (part) => {
    for (; part; part = part.parentElement) {
      const colour = getComputedStyle(part).backgroundColor;
      if (!/, 0\\)$/.test(colour)) return colour;
    }
    return "rgb(255, 255, 255)";
  };
  const found = new Map();
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const part = walker.currentNode.parentElement, text = walker.currentNode.textContent.trim();
    if (!text || !part.checkVisibility()) continue;
    const pair = [hex(getComputedStyle(part).color), hex(behind(part))];
    found.set(pair.join(), [...pair, text]);
  }
  return [...found.values()];
}"""
TELL_WIDTHS = """() => {
  const widths = () => [...document.querySelectorAll(".uplot")].map((plot) => plot.clientWidth);
  addEventListener("beforeprint", () => { window.printed = widths(); });
}"""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    lanes = lane_changes()
    lanes["lanes-none.mcap"].metrics.update(LOST)
    lanes["lanes-ars.mcap"].metrics.update({"stays_in_lanes": 1.0, "cones_hit": 0.0, "sideslip_peak_abs_rad": 0.1})
    return write_report({**step_steers(), **lanes}, path)


@pytest.fixture
def open_page(browser: Browser, report: Path) -> Iterator[Callable[..., Page]]:
    """Open the report; a console message, an error, or a request for another resource fails the test."""
    wrong: list[str] = []
    contexts: list[Any] = []

    def open_page(*, opened: bool = True, **device: Any) -> Page:
        context = browser.new_context(**device)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: wrong.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("request", lambda request: wrong.extend({request.url} - {report.as_uri()}))
        page.goto(report.as_uri())
        page.wait_for_selector(".uplot canvas", state="attached")
        if opened:
            for summary in page.locator("details.narrow > summary:visible").all():
                summary.click()
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert wrong == []


def plot(page: Page, title: str, group: int = 1) -> Locator:
    return page.locator(f"#group-{group} figure", has=page.locator("b", has_text=re.compile(f"^{title}$")))


def pixels(figure: Locator, colour: str, tolerance: int = 24) -> int:
    rgb = [int(colour[start : start + 2], 16) for start in (1, 3, 5)]
    return figure.locator("canvas").evaluate(COUNT, [*rgb, tolerance])


def hover(page: Page, figure: Locator, share: float) -> None:
    figure.scroll_into_view_if_needed()
    box = figure.locator(".u-over").bounding_box()
    assert box
    page.mouse.move(box["x"] + share * box["width"], box["y"] + 0.5 * box["height"])


def told(figure: Locator) -> list[str]:
    """Return the instant and the values of a plot's read-out."""
    return re.findall(r"[\N{MINUS SIGN}\d.]+", figure.locator(".values").inner_text())


def test_plots_show_the_curves_of_all_runs(open_page):
    page = open_page(**DESK)
    yaw_rate = plot(page, "Yaw rate")
    assert all(pixels(yaw_rate, colour) > 200 for colour in RUN_COLOURS[:3])
    assert pixels(yaw_rate, RUN_COLOURS[3]) == 0
    for figure in page.locator("figure").all():
        # A level line lies between two rows of pixels and is paler in both.
        drawn = [pixels(figure, colour, 130) for colour in RUN_COLOURS[:3]]
        assert max(drawn) > 100, figure.locator("b").inner_text()
    track = plot(page, "Track of the front axle centre", 2)
    assert pixels(track, "#f3ead0") > 5000  # lanes
    assert pixels(track, "#d98200") > 50  # cones
    assert "stretched" in track.inner_text()


@pytest.mark.slow
def test_a_course_with_a_turn_is_not_squeezed(browser: Browser, tmp_path: Path):
    run = simulate("mu_jump", "none")
    page = browser.new_page(**DESK)
    page.goto(write_report({"a.mcap": run}, tmp_path / "turn.html").as_uri())
    page.wait_for_selector(".uplot canvas", state="attached")
    track = plot(page, "Track of the front axle centre")
    assert not re.search("stretched|squeezed", track.inner_text())
    page.close()


@pytest.mark.slow
def test_first_screen_says_what_came_out(open_page):
    page = open_page(**DESK)
    # Inner text is what is shown; the first paragraphs say what was run.
    for words in (
        "vehicle synthetic",
        "lost with a sideslip angle of 46 deg, leaves the lane by 1.20 m, hits 2 cones",
        "stays in the lanes",
    ):
        box = page.get_by_text(words).first.bounding_box()
        assert box
        assert box["y"] + box["height"] < 800.0, words
    red, green = (page.locator(f".contents .chip.{kind}").first for kind in ("failed", "passed"))
    assert (red.inner_text()[0], green.inner_text()[0]) == ("\N{BALLOT X}", "\N{CHECK MARK}")


@pytest.mark.slow
@pytest.mark.parametrize("device", [DESK, DARK], ids=["light", "dark"])
def test_every_text_can_be_read(open_page, device):
    page = open_page(**device)
    for details in page.locator("details").all():
        details.evaluate("(details) => { details.open = true; }")
    found = page.evaluate(TEXT_COLOURS)
    assert len(found) >= 6
    for ink, paper, text in found:
        assert contrast(ink, paper) >= 4.5, text


@pytest.mark.slow
def test_pointing_at_a_run_makes_the_others_pale(open_page):
    page = open_page(**DESK)
    yaw_rate = plot(page, "Yaw rate")
    before = [pixels(yaw_rate, colour) for colour in RUN_COLOURS[:3]]
    page.locator("#group-1 button", has_text="ars: active rear steering").hover()
    none, ars, afs = (pixels(yaw_rate, colour) for colour in RUN_COLOURS[:3])
    assert (none, afs) == (0, 0)
    assert ars >= before[1]
    page.mouse.move(0, 0)
    assert [pixels(yaw_rate, colour) for colour in RUN_COLOURS[:3]] == before


@pytest.mark.slow
def test_nothing_lies_over_anything_else(open_page):
    for device in (DESK, PHONE):
        page = open_page(**device)
        boxes = [
            box for part in page.locator("figure, .results, .metrics, h1, h2, h3").all() if (box := part.bounding_box())
        ]
        boxes.sort(key=lambda box: box["y"])
        for place, box in enumerate(boxes):
            for other in boxes[place + 1 :]:
                below = other["y"] >= box["y"] + box["height"] - 0.5
                beside = other["x"] >= box["x"] + box["width"] - 0.5 or box["x"] >= other["x"] + other["width"] - 0.5
                assert below or beside, (box, other)


@pytest.mark.slow
def test_cursor_is_in_all_plots_at_once_and_tells_the_values(open_page):
    page = open_page(**DESK)
    hover(page, plot(page, "Yaw rate"), 6.0 / DURATION_S)
    time_s, *values = told(plot(page, "Yaw rate"))
    assert float(time_s) == pytest.approx(6.0, abs=0.02)
    # 0.2, 0.17, 0.14 rad/s, and what each desires
    assert [float(value) for value in values] == pytest.approx([11.5, 11.5, 9.74, 9.74, 8.02, 8.02], abs=0.06)
    other = plot(page, "Lateral acceleration")
    assert told(other)[0] == time_s
    assert float(told(other)[1]) == pytest.approx(4.0, abs=0.01)
    assert len(told(plot(page, "Added angle at the wheels"))) == 3  # of the two systems that add one
    assert told(plot(page, "Yaw rate", 2)) == []  # other runs, other time


@pytest.mark.slow
def test_place_of_the_cars_at_the_cursor_is_on_the_track_and_back(open_page):
    page = open_page(**DESK)
    track, yaw_rate = plot(page, "Track of the front axle centre", 2), plot(page, "Yaw rate", 2)
    assert track.locator(".car:not([hidden])").count() == 0
    hover(page, yaw_rate, 0.4)
    assert track.locator(".car:not([hidden])").count() == 2
    # At 80 m, after 4 s at 20 m/s, of 10 m to 205 m that are shown.
    hover(page, track, 70.0 / 195.0)
    assert float(told(yaw_rate)[0]) == pytest.approx(4.0, abs=0.05)


@pytest.mark.slow
def test_slider_and_play_button_move_the_cars_and_the_cursor(open_page):
    page = open_page(**DESK)
    yaw_rate, track = plot(page, "Yaw rate", 2), plot(page, "Track of the front axle centre", 2)
    slider, button = page.locator("#group-2 input.time"), page.locator("#group-2 button.play")
    body = track.locator(".car").first
    slider.evaluate("(slider) => { slider.value = slider.max / 2; slider.dispatchEvent(new Event('input')); }")
    halfway = float(told(yaw_rate)[0])
    assert body.is_visible()
    before = body.get_attribute("d")
    button.click()
    assert "Pause" in button.inner_text()
    page.wait_for_timeout(800)
    button.click()
    after = float(told(yaw_rate)[0])
    # Real time, with room for a slow machine.
    assert halfway + 0.1 < after < halfway + 8.0
    assert body.get_attribute("d") != before
    assert slider.input_value() != "0"
    page.wait_for_timeout(200)
    assert float(told(yaw_rate)[0]) == after


@pytest.mark.slow
def test_a_phone_keeps_the_player_in_sight_and_shortens_no_title(open_page):
    page = open_page(**PHONE)
    page.locator("#group-1 .plots figure").last.scroll_into_view_if_needed()
    box = page.locator("#group-1 .player").bounding_box()
    assert box
    assert 0.0 <= box["y"] < 100.0
    cut = "(part) => part.scrollWidth > part.clientWidth + 1"
    assert not any(part.evaluate(cut) for part in page.locator("figcaption .quiet").all())


@pytest.mark.slow
def test_zoom_holds_for_all_plots_of_a_group_and_can_be_undone(open_page):
    page = open_page(**DESK)
    yaw_rate, other = plot(page, "Yaw rate"), plot(page, "Lateral acceleration")
    whole = page.locator("#group-1 input.time").get_attribute("max") or ""
    hover(page, yaw_rate, 0.2)
    page.mouse.down()
    hover(page, yaw_rate, 0.4)
    page.mouse.up()
    hover(page, other, 0.5)
    assert float(told(other)[0]) == pytest.approx(0.3 * DURATION_S, abs=0.03)
    # The player plays what is seen.
    slider = page.locator("#group-1 input.time")
    ends = [float(slider.get_attribute(end) or 0) / float(whole) * DURATION_S for end in ("min", "max")]
    assert ends == pytest.approx([0.2 * DURATION_S, 0.4 * DURATION_S], abs=0.05)
    page.locator("#group-1 button.play").click()
    page.wait_for_timeout(300)
    assert 0.2 * DURATION_S < float(page.locator("#group-1 output").inner_text().split()[0]) < 0.4 * DURATION_S
    page.locator("#group-1 button.play").click()
    page.locator("#group-1 button.reset").click()
    assert slider.get_attribute("max") == whole
    hover(page, other, 0.5)
    assert float(told(other)[0]) == pytest.approx(0.5 * DURATION_S, abs=0.03)


def test_phone_shows_everything_within_its_width(open_page):
    page = open_page(**PHONE)
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    boxes = [box for figure in page.locator("figure .uplot").all() if (box := figure.bounding_box())]
    assert len(boxes) == page.locator("figure").count()
    for box in boxes:
        assert box["x"] >= 0.0
        assert 300.0 < box["width"] <= 390.0 - box["x"]


@pytest.mark.slow
def test_a_phone_shows_the_results_of_all_manoeuvres_before_anything_is_opened(open_page):
    page = open_page(opened=False, **PHONE)
    assert page.locator(".contents .chip.failed").first.is_visible()
    assert not page.locator("figure").first.is_visible()
    assert page.evaluate("document.body.scrollHeight") < 5000
    page.locator("#group-1 summary", has_text="plots").click()
    box = plot(page, "Yaw rate").locator("canvas").bounding_box()
    assert box
    assert box["width"] > 300.0


@pytest.mark.slow
def test_fingers_read_values_and_zoom(open_page):
    page = open_page(**PHONE)
    yaw_rate, other = plot(page, "Yaw rate"), plot(page, "Sideslip angle")
    yaw_rate.scroll_into_view_if_needed()
    box = yaw_rate.locator(".u-over").bounding_box()
    assert box
    session = page.context.new_cdp_session(page)

    def touch(kind: str, *shares: float) -> None:
        points = [
            {"x": box["x"] + share * box["width"], "y": box["y"] + 50.0, "id": number}
            for number, share in enumerate(shares)
        ]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 0.3)
    touch("touchMove", 0.5)
    assert float(told(other)[0]) == pytest.approx(0.5 * DURATION_S, abs=0.05)
    touch("touchEnd")
    # What was between 0.4 and 0.6 is pulled to 0.2 and 0.8: a third of the run remains.
    touch("touchStart", 0.4)
    touch("touchStart", 0.4, 0.6)
    touch("touchMove", 0.2, 0.8)
    touch("touchEnd")
    page.wait_for_timeout(400)  # or it would be a double tap
    touch("touchStart", 0.7)
    touch("touchMove", 0.8)
    assert float(told(other)[0]) == pytest.approx(0.6 * DURATION_S, abs=0.1)
    touch("touchEnd")


@pytest.mark.slow
def test_printed_plots_fit_the_paper(open_page):
    page = open_page(**DESK)
    page.evaluate(TELL_WIDTHS)
    pdf = page.pdf(format="A4")
    # Two manoeuvres, five runs.
    assert 2 <= len(re.findall(rb"/Type\s*/Page\b(?!s)", pdf)) <= 6
    # A4 less its margins is 182 mm, 688 px of CSS.
    assert set(page.evaluate("window.printed")) == {660, 322}
    box = plot(page, "Yaw rate").locator(".uplot").bounding_box()
    assert box
    assert box["width"] > 400.0  # as before


def test_labels_of_a_signal_at_rest_stay_clear_of_the_corner(open_page):
    page = open_page(**DESK)
    ends = page.evaluate("padded(0, 0, 2)")
    # A label at the very end of the axis would meet the first label of the abscissa.
    assert ends[0] < -1.0
    assert ends[1] > 1.0
    assert page.evaluate("padded(0, 10, 2)") == pytest.approx([-0.5, 10.5])
