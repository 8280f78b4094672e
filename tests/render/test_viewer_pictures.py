"""Pictures of every view of the viewer, drawn in software and checked by colour and place."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
from numpy.typing import NDArray

from activesteer.core.conventions import CORNERS, RUN_COLOURS_ON_DARK
from activesteer.drawing.panels import WHEELS, panels_in
from activesteer.playback import Showing, runs_of, save
from activesteer.playback.layout import blueprint
from activesteer.playback.plots import links
from activesteer.playback.viewer import fill
from activesteer.playback.wheel_angles import plan_view
from activesteer.recording import Recording
from tests.render.headless import Headless, Picture, save_pictures

pytestmark = pytest.mark.render

Pictures = dict[str, Picture]
Drives = Mapping[str, Recording]

SKY, ASPHALT, CONE, LANE = (176, 196, 214), (58, 60, 64), (255, 120, 20), (0, 158, 115)
NONE, ARS, AFS = "#8d939c", *RUN_COLOURS_ON_DARK[1:3]
AT_S = 3.8
"""Between the gates."""

CARS = ("1 no control", "2 active rear steering", "3 active front steering")
PLOTS = (
    "Yaw rate, desired one thin [deg/s]",
    "Sideslip angle [deg]",
    "Added steer angles, rear thick, front thin [deg]",
)
ALONE = "Curves: ars/Motion"
BESIDE = ("Course [m]", "Summary", *PLOTS)
"""What stands beside the cars on the first page."""


@pytest.fixture(scope="module")
def alone(viewer: Headless, drives: Drives, folder: Path) -> dict[float, Pictures]:
    """Pictures of the page of a single run, at two instants."""
    save(runs_of({"ars": drives["ars"]}), folder / "alone.rrd")
    return _looked_at(
        viewer,
        folder / "alone.rrd",
        (CARS[1], "From above", _plan({"ars": drives["ars"]}), ALONE, *BESIDE),
        (0.5, AT_S),
    )


@pytest.fixture(scope="module")
def together(viewer: Headless, drives: Drives, folder: Path) -> Pictures:
    """Pictures of the comparison page."""
    save(runs_of(drives), folder / "together.rrd", Showing(compare=True))
    return _looked_at(viewer, folder / "together.rrd", (*CARS, _plan(drives), "Curves: runs", *BESIDE), (AT_S,))[AT_S]


def _plan(drives: Drives) -> str:
    """Return the name of the view of the wheel angles, which contains their magnification."""
    return str(plan_view(runs_of(drives)).name)


def _looked_at(
    viewer: Headless, file: Path, names: tuple[str, ...], times_s: tuple[float, ...]
) -> dict[float, Pictures]:
    viewer.open(file)
    found = {}
    for time_s in times_s:
        found[time_s] = viewer.pictures(time_s, names)
        place = file.with_suffix("") / f"{time_s} s"
        place.mkdir(parents=True, exist_ok=True)
        save_pictures(found[time_s], place)
    return found


def like(pixels: NDArray[np.int16], colour: str | tuple[int, int, int], within: int = 40) -> NDArray[np.bool_]:
    """Return True for the pixels of about that colour."""
    if isinstance(colour, str):
        colour = (int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:], 16))
    return np.abs(pixels - np.array(colour)).max(axis=-1) <= within


def spread(mask: NDArray[np.bool_]) -> float:
    """Return the proportion of the picture's columns in which the colour occurs."""
    return float(mask.any(axis=0).mean())


def _shell(pixels: NDArray[np.int16]) -> NDArray[np.bool_]:
    """Return the pixels of the body in the colour of its system, lit or in shade."""
    red, green, blue = np.moveaxis(pixels, -1, 0)
    return (red > 60) & (red > 1.5 * green) & (green > 2 * blue - 10)


def view(pictures: Pictures, start: str) -> NDArray[np.int16]:
    """Return the picture of the view whose name begins like this."""
    (name,) = [name for name in pictures if name.startswith(start)]
    return pictures[name].pixels


@pytest.mark.slow
def test_no_view_reports_anything(alone: dict[float, Pictures], together: Pictures) -> None:
    for pictures in (*alone.values(), together):
        assert {name: picture.reports for name, picture in pictures.items() if picture.reports} == {}


def test_the_car_is_seen_from_behind_on_its_road(viewer: Headless, drives: Drives, folder: Path) -> None:
    save(runs_of({"ars": drives["ars"]}), folder / "behind.rrd")
    pixels = _looked_at(viewer, folder / "behind.rrd", (CARS[1],), (AT_S,))[AT_S][CARS[1]].pixels
    height, width = pixels.shape[:2]
    assert like(pixels[: height // 40], SKY, 6).mean() > 0.95
    assert like(pixels[-height // 5 :], ASPHALT, 12).mean() > 0.5
    middle = pixels[height // 4 :, width // 4 : -width // 4]
    assert like(middle, (0, 0, 0), 25).mean() > 0.002  # tyres
    assert _shell(middle).mean() > 0.02
    assert (middle[..., 1] - middle[..., 2] > 50).mean() > 0.002  # friction use: green or yellow discs
    assert like(pixels, CONE, 60).mean() > 0.0005
    assert like(pixels, LANE, 30).mean() > 0.0005


@pytest.mark.slow
def test_the_camera_follows_the_car(alone: dict[float, Pictures]) -> None:
    """After 120 m the car is at the same place in the picture, and the road is not."""
    early, late = (alone[time_s][CARS[1]].pixels for time_s in (0.5, AT_S))
    tyres = [np.argwhere(like(pixels, (0, 0, 0), 25)) for pixels in (early, late)]
    assert np.abs(tyres[0].mean(axis=0) - tyres[1].mean(axis=0)).max() < 0.05 * early.shape[1]
    assert (np.abs(early - late).max(axis=-1) > 20).mean() > 0.02


@pytest.mark.slow
def test_car_and_tyre_forces_are_seen_from_above_left_is_up(alone: dict[float, Pictures], drives: Drives) -> None:
    pixels = alone[AT_S]["From above"].pixels
    shell = _shell(pixels)
    # The car, without cones and the driven line, which are of its colour.
    shell &= (shell.mean(axis=1) > 0.2)[:, None] & (shell.mean(axis=0) > 0.15)
    rows, columns = np.nonzero(shell)
    assert np.ptp(columns) > 1.5 * np.ptp(rows)
    assert np.abs(np.mean([columns.min(), columns.max()]) / pixels.shape[1] - 0.5) < 0.1
    red, green, blue = np.moveaxis(pixels, -1, 0)
    arrows = np.argwhere((red > 130) & (green < 90) & (blue > 70))
    beside = arrows[(arrows[:, 0] < rows.min()) | (arrows[:, 0] > rows.max())]
    assert len(beside) > 10
    run = drives["ars"]
    force = sum(run[f"{corner}_tyre_fy_N"][round(AT_S * 1000)] for corner in CORNERS)
    assert np.sign(rows.mean() - beside[:, 0].mean()) == np.sign(force)


@pytest.mark.slow
def test_the_whole_course_is_on_the_map(alone: dict[float, Pictures]) -> None:
    pixels = alone[AT_S]["Course [m]"].pixels
    for colour, minimum in ((CONE, 0.02), (LANE, 0.12), (ARS, 0.7)):
        assert spread(like(pixels, colour, 50)) > minimum
    track = like(pixels, ARS, 50)
    assert 0.02 < np.flatnonzero(track.any(axis=0)).min() / pixels.shape[1] < 0.2


@pytest.mark.slow
def test_the_car_moves_on_the_map(alone: dict[float, Pictures]) -> None:
    early, late = (alone[time_s]["Course [m]"].pixels for time_s in (0.5, AT_S))
    changed = np.flatnonzero((np.abs(early - late).max(axis=-1) > 60).any(axis=0))
    assert np.ptp(changed) > 0.2 * early.shape[1]


@pytest.mark.slow
def test_signals_are_plotted_over_the_whole_time(alone: dict[float, Pictures]) -> None:
    for name in PLOTS:
        pixels = alone[AT_S][name].pixels
        line = like(pixels, ARS, 70)
        assert spread(line) > 0.6, name  # the desired yaw rate covers some of it
        assert np.ptp(np.nonzero(line)[0]) > 0.25 * pixels.shape[0], name


@pytest.mark.slow
def test_each_car_is_compared_with_the_ghosts_of_the_others(together: Pictures) -> None:
    for own, others in zip(CARS, ((ARS, AFS), (NONE, AFS), (NONE, ARS)), strict=True):
        pixels = together[own].pixels
        assert like(pixels[: len(pixels) // 40], SKY, 6).mean() > 0.9
        for colour in others:
            assert like(pixels, colour, 45).mean() > 0.001, (own, colour)


@pytest.mark.slow
def test_the_plots_hold_all_runs_in_their_colours(together: Pictures) -> None:
    for start in ("Yaw rate", "Sideslip"):
        pixels = view(together, start)
        seen = [spread(like(pixels, colour, 35)) for colour in (NONE, ARS, AFS)]
        assert min(seen) > 0.1, (start, seen)


@pytest.mark.slow
def test_plan_and_names_of_the_curves_show_every_run_in_its_colour_from_left_to_right(together: Pictures) -> None:
    for start in ("Wheels", "Curves"):
        middles = [np.argwhere(like(view(together, start), colour, 30))[:, 1].mean() for colour in (NONE, ARS, AFS)]
        assert middles == sorted(middles), start
        assert np.diff(middles).min() > 0.1 * view(together, start).shape[1], start


@pytest.mark.slow
def test_the_plots_of_wheels_and_links_are_drawn(viewer: Headless, drives: Drives, folder: Path) -> None:
    """These views are on pages behind the first one."""
    runs = runs_of({"ars": drives["ars"]})
    for page, plots in ((3, panels_in(WHEELS)), (4, links(runs[0]))):
        file = folder / f"page {page}.rrd"
        stream = rr.RecordingStream(f"page {page}")
        stream.save(file)
        fill(stream, runs, blueprint(runs, compare=False, page=page), Showing())
        stream.disconnect()
        # Nobody brakes in these drives, and what is zero throughout has no plot.
        titles = tuple(plot.title_with_unit for plot in plots if not plot.title.startswith("Brake pressure"))
        assert len(titles) == 4
        for name, picture in _looked_at(viewer, file, titles, (AT_S,))[AT_S].items():
            assert picture.reports == []
            bright = np.ptp(picture.pixels, axis=-1) > 60
            assert spread(bright) > 0.85, name
            hues = {tuple(pixel) for pixel in (picture.pixels[bright] // 64).tolist()}
            assert len(hues) >= 3, name
