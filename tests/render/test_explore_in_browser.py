"""The local page in a browser: a slider changes the curve, and keys move the car. Skipped without a browser."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import activesteer
from tests.conftest import PHONE
from tests.contrast import contrast
from tests.render.test_pages_in_browser import DEVICES, SIZES
from tests.render.test_report_in_browser import TEXT_COLOURS

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytest.importorskip("uvicorn", reason="needs the extra `explore`")
pytestmark = pytest.mark.render

MAIN = "from activesteer.commands.cli import main; raise SystemExit(main())"
COMMAND = [sys.executable, "-c", MAIN, "explore", "--json"]
LAST_YAW_RATE = """() => [...activesteer.runs.values()].map((run) =>
  run.plots.panels.find((panel) => panel.title === "Yaw rate").series[0].values.at(-1))"""
SIZES_OF_SLIDERS = """() => Math.min(...[...document.querySelectorAll("#sliders input")]
  .filter((part) => part.checkVisibility()).map((part) => part.getBoundingClientRect().height))"""
DONE = "#state:has-text('driven in')"
LIMIT_MS = 60_000
EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    folder = tmp_path_factory.mktemp("explore")
    with subprocess.Popen([*COMMAND, "-o", str(folder)], stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        yield json.loads(server.stdout.readline())["url"], folder
        server.send_signal(signal.SIGINT)
        server.wait(20)


def opened(browser: Browser, url: str, **options: object) -> tuple[Page, list[str]]:
    page, problems = browser.new_page(**options), []  # type: ignore[arg-type]
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
    page.goto(url)
    return page, problems


@pytest.mark.slow
def test_a_slider_changes_the_curve_and_the_command_repeats_it(browser: Browser, served: tuple[str, Path]) -> None:
    address = served[0] + "#maneuver=step_steer&controllers=none,ars"
    page, problems = opened(browser, address, viewport={"width": 700, "height": 500})
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    before = page.evaluate(LAST_YAW_RATE)
    slider = page.locator('input[data-key="speed_kmh"]')
    slider.focus()
    slider.press("PageUp")
    page.wait_for_selector("#command:has-text('speed_kmh=90')", timeout=LIMIT_MS)
    after = page.evaluate(LAST_YAW_RATE)
    assert len(after) == 2
    assert after[0] < before[0] - 0.5  # the same 0.4 g at a higher speed is a lower yaw rate
    assert "\N{MINUS SIGN}" in page.inner_text("#figures")  # changes against the pale curves
    assert problems == []
    page.close()


def restarted(page: Page, asked: int) -> None:
    """Wait until the car that was asked for last drives. The page allows no function that polls in it."""
    for _ in range(LIMIT_MS // 100):
        if page.evaluate(f"activesteerDrive.asked === {asked} && activesteerDrive.running && !activesteerDrive.again"):
            return
        page.wait_for_timeout(100)
    pytest.fail("the car does not drive again")


def test_keys_drive_the_car_and_leave_a_recording(browser: Browser, served: tuple[str, Path]) -> None:
    page, problems = opened(browser, served[0], viewport={"width": 600, "height": 500})
    page.wait_for_selector("#maneuver option", state="attached", timeout=LIMIT_MS)
    page.click("#tab-drive")
    page.select_option("#course", "plane")
    page.click("#start", timeout=LIMIT_MS)  # once the car is ready
    page.wait_for_selector("#end:visible", timeout=LIMIT_MS)
    page.keyboard.down("ArrowLeft")
    page.wait_for_timeout(1500)
    page.keyboard.up("ArrowLeft")
    page.keyboard.press("r")  # restart: the drive is saved, and the car drives off at the start again
    restarted(page, asked=3)
    assert not page.locator("#start").is_visible()
    said = "(header) => { activesteerDrive.gauges(header); return document.getElementById('again').textContent; }"
    for seen, words in (({"missed": True}, "Gate missed: restart"), ({"last_lap_s": 9.0}, "Finished: restart")):
        assert page.evaluate(said, {"steering_wheel_deg": 0.0, **seen}) == words
    page.keyboard.press("Escape")
    page.wait_for_selector("#driven:has-text('drive_plane_2.mcap')", timeout=LIMIT_MS)
    with page.expect_popup() as popup:
        page.click("#drive-report")
    popup.value.wait_for_selector("h1", timeout=LIMIT_MS)
    assert "driven by hand" in popup.value.inner_text("body")
    recording = activesteer.Recording.open(served[1] / "drive_plane.mcap")
    assert recording["y_m"][-1] > 1.0
    assert recording["yaw_rate_radps"].max() > 0.1
    assert problems == []
    page.close()


@pytest.mark.slow
def test_numbers_at_the_curves_belong_to_the_time_that_stands(browser: Browser, served: tuple[str, Path]) -> None:
    page, problems = opened(browser, served[0] + "#maneuver=step_steer&controllers=none,ars")
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    page.click("#play")
    page.locator("#time").fill("1.85")
    page.click("#controllers input[value=afs]")
    page.wait_for_selector("#command:has-text('-c afs')", timeout=LIMIT_MS)
    page.wait_for_timeout(300)
    times = page.evaluate(
        "[...document.querySelectorAll('#curves p .quiet')].map((read) => read.textContent.slice(0, 6))"
    )
    assert set(times) == {"1.85 s"}
    places = page.evaluate("[...activesteer.runs.values()].map((run) => [run.name, run.place])")
    assert places == [["none", 0], ["ars", 1], ["afs", 2]]
    assert problems == []
    page.close()


@pytest.mark.slow
def test_without_webgl_the_page_shows_its_curves(browser: Browser, served: tuple[str, Path]) -> None:
    page = browser.new_page()
    page.add_init_script("""const of = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
        return kind.startsWith("webgl") ? null : of.call(this, kind, ...more); };""")
    page.goto(served[0] + "#maneuver=step_steer&controllers=none")
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    assert len(page.evaluate(LAST_YAW_RATE)) == 1
    assert "no WebGL" in page.inner_text("main")
    page.emulate_media(color_scheme="dark")  # the page follows the system until the reader chooses
    page.wait_for_selector("html.dark")
    page.emulate_media(color_scheme="light")
    page.wait_for_selector("html:not(.dark)")
    page.click("#theme")
    page.emulate_media(color_scheme="dark")
    page.emulate_media(color_scheme="light")
    page.wait_for_timeout(200)
    assert page.locator("html.dark").count() == 1
    page.close()


BOX = "(id) => document.getElementById(id).getBoundingClientRect().toJSON()"


def assert_readable(page: Page) -> None:
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    for size, text in page.evaluate(SIZES):
        assert size >= 10.99, text
    for ink, paper, text in page.evaluate(TEXT_COLOURS):
        assert contrast(ink, paper) >= 4.5, text


@pytest.mark.slow
@pytest.mark.parametrize("device", DEVICES)
def test_both_tabs_have_their_parts_in_sight(browser: Browser, served: tuple[str, Path], device: str) -> None:
    page, problems = opened(browser, served[0], **DEVICES[device])
    height, phone = page.evaluate("innerHeight"), device.startswith("phone")
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    assert_readable(page)
    gain = page.locator("[data-key='controllers.ars.prediction_gain']")
    assert gain.is_visible() != phone  # a phone shows one group of sliders at a time
    if phone:
        page.select_option("#group", "ARS")
        assert gain.is_visible()
        page.select_option("#group", "manoeuvre")
        assert page.evaluate(SIZES_OF_SLIDERS) >= 40.0
        assert page.evaluate(BOX, "theme")["width"] >= 40.0
    page.locator("#curves").scroll_into_view_if_needed()
    page.evaluate("scrollBy(0, 400)")
    sliders, curves = page.evaluate(BOX, "tuning"), page.evaluate(BOX, "curves")
    if phone:  # so do the colours of the curves, and the name of the car that turns round
        assert page.evaluate(BOX, "legend")["bottom"] < sliders["bottom"]
        assert page.inner_text("#legend").split() == ["none", "fails", "ars", "afs"]
    assert 0 <= sliders["top"] < 0.5 * height  # the sliders stay in sight beside or above the curves
    assert sliders["bottom"] < 0.4 * height if phone else sliders["right"] <= curves["left"]
    page.click("#tab-drive")
    page.wait_for_selector("#start:enabled", timeout=LIMIT_MS)
    assert_readable(page)
    assert page.inner_text("#start") == "Drive at 70 km/h"
    stage, gauges = page.evaluate(BOX, "stage"), page.evaluate(BOX, "gauges")
    assert stage["bottom"] <= height
    assert gauges["height"] < 0.12 * stage["height"]
    # Neither gauges nor pads cover the road: some browsers then leave the other end of the picture empty.
    view = page.evaluate(BOX, "drive-view")
    assert view["top"] == pytest.approx(gauges["bottom"], abs=1.0)
    end = page.evaluate(BOX, "touch")["top"] if phone else stage["bottom"]
    assert view["bottom"] == pytest.approx(end, abs=2.0)
    # The car and the gates are free.
    assert page.evaluate(BOX, "start")["bottom"] < view["top"] + 0.3 * view["height"]
    hint = page.locator(".thumbs" if phone else ".keys").bounding_box()
    assert hint
    if phone:
        assert hint["y"] > view["top"] + 0.75 * view["height"]
    else:
        assert hint["y"] + hint["height"] < view["top"] + 0.3 * view["height"]
    assert page.locator("#touch-throttle").is_visible() == page.locator(".thumbs").is_visible() == phone
    assert problems == []
    page.close()


@pytest.mark.slow
def test_a_hint_names_the_key_that_is_meant_and_leaves_the_road_free(
    browser: Browser, served: tuple[str, Path]
) -> None:
    page, problems = opened(browser, served[0] + "#maneuver=step_steer&controllers=none&mu=0.5", **PHONE)
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    assert "mu (there is road.mu)" in page.inner_text("#message")
    page.close()
    page, problems = opened(browser, served[0] + "#drive=slippery&sped=3", **PHONE)
    page.wait_for_selector("#start:enabled", timeout=LIMIT_MS)
    assert page.is_visible("#alert")
    page.tap("#start")
    page.wait_for_selector("#end:visible", timeout=LIMIT_MS)
    assert not page.is_visible("#alert")
    page.tap("#end")
    page.wait_for_selector("#drive-report:visible", timeout=LIMIT_MS)
    assert problems == []
    page.close()


@pytest.mark.slow
def test_a_telephone_on_its_side_has_room_for_thumbs(browser: Browser, served: tuple[str, Path]) -> None:
    page, problems = opened(browser, served[0], **PHONE | {"viewport": {"width": 844, "height": 390}})
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    assert_readable(page)
    heights = """() => [...document.querySelectorAll("button, select, summary, .check, fieldset label")]
      .filter((part) => part.checkVisibility()).map((part) => part.getBoundingClientRect().height)"""
    assert page.evaluate(f"Math.min(...({heights})())") >= 43.9
    page.tap("#fold")
    assert page.evaluate(BOX, "results")["left"] < 20  # without sliders, the results have the whole width
    assert page.evaluate(BOX, "results")["right"] > 820
    page.tap("#fold")
    page.evaluate("document.getElementById('curves').scrollIntoView()")
    assert page.evaluate(BOX, "play")["bottom"] <= 390
    assert 0 <= page.evaluate(BOX, "tuning")["top"] < 195
    page.tap("#tab-drive")
    page.wait_for_selector("#start:enabled", timeout=LIMIT_MS)
    assert page.evaluate(f"Math.min(...({heights})())") >= 43.9
    assert page.evaluate(BOX, "stage")["bottom"] <= 390
    page.tap("#drive-chosen")
    assert page.evaluate(f"Math.min(...({heights})())") >= 43.9
    assert_readable(page)
    assert problems == []
    page.close()


@pytest.mark.slow
def test_two_fingers_zoom_all_curves_and_a_double_tap_shows_the_whole_run(
    browser: Browser, served: tuple[str, Path]
) -> None:
    page, problems = opened(browser, served[0] + "#maneuver=step_steer&controllers=none,ars", **PHONE)
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    page.tap("#play")
    curve = page.locator(".u-over").nth(1)
    curve.evaluate("(curve) => curve.scrollIntoView({ block: 'center' })")
    box = curve.bounding_box()
    assert box
    fingers = page.context.new_cdp_session(page)

    def touch(kind: str, *xs: float) -> None:
        points = [{"x": box["x"] + x, "y": box["y"] + 60, "id": number} for number, x in enumerate(xs)]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    ends = "[...activesteer.curves.plots.values()].map(({ plot }) => `${plot.scales.x.min} to ${plot.scales.x.max}`)"
    whole = page.evaluate(ends)
    touch("touchStart", 80.0)
    touch("touchStart", 80.0, 140.0)
    for step in range(1, 11):
        touch("touchMove", 80.0 - 5.0 * step, 140.0 + 8.0 * step)
    touch("touchEnd")
    zoomed = page.evaluate(ends)
    assert len(set(zoomed)) == 1  # all curves show the same time
    assert set(zoomed) != set(whole)
    for _ in range(2):
        touch("touchStart", 100.0)
        touch("touchEnd")
    assert page.evaluate(ends) == whole
    assert problems == []
    page.close()


@pytest.mark.slow
def test_the_knob_stays_in_its_pad_and_a_finger_that_scrolls_leaves_the_friction(
    browser: Browser, served: tuple[str, Path]
) -> None:
    page, problems = opened(browser, served[0], **PHONE)
    page.wait_for_selector("#maneuver option", state="attached", timeout=LIMIT_MS)
    page.tap("#tab-drive")
    pad = page.evaluate(BOX, "touch-steer")
    for way in (1, -1):
        page.evaluate(f"activesteerDrive.steer({way})")
        knob = page.locator("#touch-steer i").bounding_box()
        assert knob
        assert pad["left"] <= knob["x"]
        assert knob["x"] + knob["width"] <= pad["right"]
    slider = page.locator("#drive-mu")
    before = slider.input_value()
    slider.evaluate("""(slider) => {
      slider.dispatchEvent(new Event("pointerdown"));
      slider.value = 0.15; slider.dispatchEvent(new Event("input"));
      slider.dispatchEvent(new Event("pointercancel"));
    }""")
    assert slider.input_value() == before
    assert float(page.inner_text("label:has(#drive-mu) output")) == float(before)
    assert problems == []
    page.close()


@pytest.mark.slow
def test_curves_of_a_row_stand_at_one_height_and_zero_ones_of_a_standing_car_are_named(
    browser: Browser, served: tuple[str, Path]
) -> None:
    tops = "(all) => all.map((one) => one.getBoundingClientRect().top)"
    page, problems = opened(
        browser, served[0] + "#maneuver=step_steer&controllers=none,lqr", viewport={"width": 1440, "height": 900}
    )
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    heights = page.locator("#curves [role=img]").evaluate_all(tops)
    # Of eight or more plots, one may stand next to the table and one alone in the last row.
    assert len(heights) >= 8
    assert len(set(heights)) <= len(heights) // 2 + 1
    page.goto("about:blank")
    page.goto(served[0] + "#maneuver=standstill&controllers=none")
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    assert page.locator("#curves [role=img]").count() == 1
    assert "Zero throughout, at rest: steering wheel angle, yaw rate" in page.inner_text("#curves")
    assert "sideslip" not in page.inner_text("#figures")
    assert problems == []
    page.close()


def test_two_thumbs_steer_and_accelerate_at_the_same_time(browser: Browser, served: tuple[str, Path]) -> None:
    page, problems = opened(browser, served[0], **PHONE)
    page.wait_for_selector("#maneuver option", state="attached", timeout=LIMIT_MS)
    page.tap("#tab-drive")
    page.select_option("#course", "plane")
    page.tap("#start", timeout=LIMIT_MS)
    page.wait_for_selector("#end:visible", timeout=LIMIT_MS)
    pad, throttle = page.evaluate(BOX, "touch-steer"), page.evaluate(BOX, "touch-throttle")
    left = {"x": pad["x"] + 0.3 * pad["width"], "y": pad["y"] + pad["height"] / 2, "id": 1}
    right = {"x": throttle["x"] + throttle["width"] / 2, "y": throttle["y"] + throttle["height"] / 2, "id": 2}
    thumbs = page.context.new_cdp_session(page)
    thumbs.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [left]})
    thumbs.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [left, right]})
    page.wait_for_timeout(1500)
    thumbs.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.tap("#switch button:has-text('afs')")
    page.wait_for_selector("#switch button[aria-pressed=true]:has-text('afs')", timeout=LIMIT_MS)
    page.tap("#end")
    page.wait_for_selector("#driven:has-text('Saved as')", timeout=LIMIT_MS)
    file = page.inner_text("#driven").partition("Saved as ")[2]
    recording = activesteer.Recording.open(served[1] / file)
    assert recording["y_m"][-1] > 1.0
    assert recording["speed_mps"].max() > 65.0 / 3.6
    assert problems == []
    page.close()


@pytest.mark.slow
def test_the_ghost_of_the_last_drive_drives_along(browser: Browser, served: tuple[str, Path]) -> None:
    page, problems = opened(browser, served[0], viewport={"width": 600, "height": 500})
    page.wait_for_selector("#maneuver option", state="attached", timeout=LIMIT_MS)
    page.click("#tab-drive")
    # A drive with another control cannot be compared.
    for control, cars in (("none", ["you"]), ("none", ["you", "ghost"]), ("ars", ["you"])):
        page.select_option("#drive-controller", control)
        page.click("#start", timeout=LIMIT_MS)
        page.wait_for_selector("#end:visible", timeout=LIMIT_MS)
        page.wait_for_timeout(1500)
        assert page.evaluate("[...activesteerDrive.scene.cars.keys()]") == cars
        page.click("#end")
        page.wait_for_selector("#start:enabled", timeout=LIMIT_MS)
    xs = page.evaluate("[...activesteerDrive.ghosts.values()][0].frames.map((frame) => frame.poses[0])")
    assert page.evaluate("activesteerDrive.ghosts.size") == 2
    assert xs[-1] - xs[0] > 10.0
    assert problems == []
    page.close()


@pytest.mark.slow
def test_an_address_names_files_of_the_folder(browser: Browser, served: tuple[str, Path]) -> None:
    for name in ("own_controller.py", "own_manoeuvre.toml"):
        shutil.copy(EXAMPLES / name, served[1])
    address = "#maneuver=own_manoeuvre.toml&controllers=none,own_controller.py:YawDamper&duration_s=4.5"
    page, problems = opened(browser, served[0] + address, viewport={"width": 1440, "height": 900})
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    assert len(page.evaluate(LAST_YAW_RATE)) == 2
    assert "--set duration_s=4.5" in page.inner_text("#command")
    assert page.locator("[data-key='controllers.YawDamper.gain_s']").is_visible()
    page.click("#tab-drive")
    page.select_option("#drive-controller", "own_controller.py:YawDamper")
    page.wait_for_selector("#start:enabled", timeout=LIMIT_MS)
    assert problems == []
    page.close()


@pytest.mark.slow
def test_an_address_names_a_drive_and_a_restart_keeps_the_friction_chosen_since(
    browser: Browser, served: tuple[str, Path]
) -> None:
    address = "#drive=plane&vehicle=sedan&controller=ars&speed_kmh=50&mu=0.5"
    page, problems = opened(browser, served[0] + address, viewport={"width": 1000, "height": 600})
    page.click("#start:has-text('Drive at 50 km/h')", timeout=LIMIT_MS)
    page.wait_for_selector("#end:visible", timeout=LIMIT_MS)
    assert page.input_value("#drive-vehicle") == "sedan"
    assert page.input_value("#drive-controller") == "ars"
    page.locator("#drive-mu").fill("0.8")  # during the drive
    page.keyboard.press("r")
    restarted(page, asked=2)
    assert page.input_value("#drive-mu") == "0.8"
    assert page.evaluate("activesteerDrive.ghosts.size") == 0  # a drive on another friction is nothing to beat
    assert page.url.endswith(address.replace("0.5", "0.8"))
    page.click("#tab-explore")
    page.wait_for_selector("#message:has-text('The drive has ended. It is saved as drive_plane')", timeout=LIMIT_MS)
    page.wait_for_selector(DONE, timeout=LIMIT_MS)
    assert "#maneuver=" in page.url
    assert problems == []
    page.close()
