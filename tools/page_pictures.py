"""Make the pictures of HTML pages in the documentation: `python tools/renew.py pages`.

The tool drives short runs, writes a report, a comparison and a standard's page, and draws the top of each in Chromium.
It also draws the page of `activesteer explore` and the rerun viewer.
Run it again after a change of the look of these pages. It takes five minutes.
"""

from __future__ import annotations

import io
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from PIL import Image
from playwright.sync_api import Browser, sync_playwright

from activesteer.commands.cli import main as activesteer

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tests.render.headless import Headless

PICTURES: Final = Path(__file__).resolve().parents[1] / "docs" / "pictures"
SIZE: Final = (1000, 760)
"""Width and height of the browser's window [px]."""
TITLE_BAR: Final = 37
"""Height of the viewer's title bar, which warns of a machine without a graphics card and of a container [px]."""
COLOURS: Final = 64
FROM: Final = {"measured_lane_change": ": check window"}
"""Picture -> end of the last heading with it, at the top of the picture. By default it shows the top of the page."""


def write_pages(folder: Path) -> dict[str, Path]:
    """Write the pages.

    Args:
        folder: An empty folder.

    Returns:
        Name of the picture -> page.
    """
    names = {controller: str(folder / f"step_steer-{controller}.mcap") for controller in ("none", "ars")}
    for controller, file in names.items():
        activesteer(["run", "step_steer", "-c", controller, "-o", file])
    report, comparison = folder / "report.html", folder / "compared.html"
    activesteer(["report", *names.values(), "-o", str(report)])
    # A car with softer tyres stands for the measured one.
    track = str(folder / "track.mcap")
    activesteer(["run", "step_steer", "--set", "factors.tyre_cornering_stiffness=0.9", "-o", track])
    activesteer(["compare", track, names["none"], "-o", str(comparison)])
    activesteer(["test", "iso21994", "-o", str(folder)])
    activesteer(["fit", "bmw_m8", "-o", str(folder)])
    return {
        "page_report": report, "page_comparison": comparison, "page_standard": folder / "iso21994.html",
        "measured_lane_change": folder / "page.html",
    }  # fmt: skip


def draw_explore(browser: Browser, folder: Path) -> Image.Image:
    """Return a picture of `activesteer explore` in the middle of a sine with dwell."""
    program = "from activesteer.commands.cli import main; main()"
    command = [sys.executable, "-c", program, "explore", "--json", "-o", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        shown = browser.new_page(viewport={"width": 1200, "height": 1000})
        shown.goto(json.loads(server.stdout.readline())["url"])
        shown.wait_for_selector("#state:has-text('driven in')", timeout=60_000)
        shown.locator("#time").fill("2.6")
        shown.locator("#time").blur()
        shown.wait_for_timeout(3000)
        # The latencies are those of the machine that draws the pictures.
        shown.locator("#state").evaluate("(state) => { state.textContent = ''; }")
        picture = Image.open(io.BytesIO(shown.screenshot())).convert("RGB")
        server.terminate()
    return picture


def draw_viewer(folder: Path) -> Image.Image:
    """Return a picture of the rerun viewer in the middle of a sine with dwell, drawn without a window."""
    files = [str(folder / f"sine_with_dwell-{name}.mcap") for name in ("none", "ars")]
    for file in files:
        activesteer(["run", "sine_with_dwell", "-c", file.rpartition("-")[2].removesuffix(".mcap"), "-o", file])
    activesteer(["replay", *files, "--compare", "-o", str(folder / "runs.rrd")])
    with Headless(folder) as viewer:
        viewer.open(folder / "runs.rrd")
        window = viewer.window(2.6)
    return window.crop((0, TITLE_BAR, *window.size))


def draw_pages() -> None:
    """Draw the top of each page."""
    width, height = SIZE
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        pictures = {"page_explore": draw_explore(browser, Path(folder)), "page_viewer": draw_viewer(Path(folder))}
        for name, page in write_pages(Path(folder)).items():
            shown = browser.new_page(viewport={"width": width, "height": height})
            shown.goto(page.as_uri())
            if name in FROM:
                heading = shown.locator(f"h3:has-text('{FROM[name]}')").last
                heading.evaluate("heading => heading.scrollIntoView({ behavior: 'instant' })")
            shown.wait_for_timeout(500)
            pictures[name] = Image.open(io.BytesIO(shown.screenshot())).convert("RGB")
        for name, picture in pictures.items():
            file = PICTURES / f"{name}.png"
            picture.quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)
            print(f"{file.name}: {file.stat().st_size / 1000:.0f} kB")
        browser.close()
