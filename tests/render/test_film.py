"""Films of drives: their pictures, and the files. Skipped if nothing can be drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from activesteer.errors import PlaybackError
from activesteer.recording import Recording
from activesteer.video import Film, Settings, make_film
from activesteer.video.offscreen import backend
from tests.unit.video.films import decode, need_ffmpeg

pytestmark = pytest.mark.render

SIZE = (320, 240)


@pytest.fixture(scope="module", autouse=True)
def canvas() -> None:
    try:
        backend()
    except PlaybackError as error:
        pytest.skip(str(error))


@pytest.fixture
def picture(drives: Mapping[str, Recording], folder: Path) -> Callable[..., np.ndarray]:
    """Return the picture of an instant, and save it for inspection."""

    def shoot(time_s: float, *names: str, **settings) -> np.ndarray:
        chosen = {name: drives[name] for name in names or ("afs",)}
        with Film(chosen, Settings(size=SIZE, **settings)) as film:
            pixels = film.picture(time_s)
        Image.fromarray(pixels).save(
            folder / f"film-{'-'.join(chosen)}-{'-'.join(map(str, settings.values()))}-{time_s}.png"
        )
        return pixels[20:180].astype(int)  # without the gauges

    return shoot


def share(pixels: np.ndarray, is_so: Callable[..., np.ndarray]) -> float:
    return float(is_so(*np.moveaxis(pixels, 2, 0)).mean())


def blue(r, g, b):
    return (b > r + 50) & (b > g + 20) & (r < 90)


def orange(r, g, b):
    return (r > 150) & (r > b + 80) & (r > g + 40)


def white(r, g, b):
    return (r > 200) & (g > 200) & (b > 185)


def test_chase_camera_shows_car_road_cones_and_sky(picture):
    pixels = picture(1.7)
    assert 0.02 < share(pixels, blue) < 0.4
    middle = pixels[:, 110:210]
    assert share(middle, blue) > 2 * share(pixels[:, :100], blue)
    assert share(pixels, orange) > 0.0005
    assert share(pixels, white) > 0.005
    assert pixels[0, 5, 2] > pixels[120, 5, 2]  # sky is brighter and bluer than the road
    assert pixels[-1].std() > 1.0  # the surface has a pattern
    road = np.s_[100:160, :80]
    assert np.abs(pixels[road] - picture(1.74)[road]).mean() > 0.5  # and it moves


@pytest.mark.slow
def test_top_camera_shows_the_car_in_the_middle(picture):
    pixels = picture(2.0, camera="top")
    where = np.argwhere(blue(*np.moveaxis(pixels, 2, 0)))
    assert 0.004 < len(where) / pixels[..., 0].size < 0.15
    assert where.mean(axis=0) == pytest.approx([100.0, 160.0], abs=15)
    wide, long = np.subtract(*np.percentile(where, [99, 1], axis=0))  # without the edges of wedges
    assert 1.5 < long / wide < 3.2  # seen from above, nose to the right


@pytest.mark.slow
def test_body_has_the_colour_of_the_system_and_a_ghost_in_its_place_is_not_drawn(drives, picture):
    assert share(picture(2.0), blue) > 0.02 > share(picture(2.0, "ars"), blue)
    run = drives["ars"]
    shown = []
    for runs in ({"ars": run}, {"ars": run, "twin": run}):
        with Film(runs, Settings(size=SIZE)) as film:
            shown.append(film.picture(4.0)[20:180].astype(int))
    # The second car's share of the gauges covers the lower part; its shadow is drawn below the car.
    assert np.abs(shown[0] - shown[1])[:70].max() < 4


@pytest.mark.slow
def test_cutaway_shows_springs_that_the_body_hides(picture):
    def springs(pixels):
        return share(pixels, lambda r, g, b: (r > b + 50) & (g > b + 20) & (g < r))

    whole, cut = (picture(4.0, cutaway=cutaway) for cutaway in (False, True))
    assert share(whole, blue) > 3 * share(cut, blue)
    assert springs(cut[60:]) > springs(whole[60:])


@pytest.mark.slow
def test_wheel_camera_shows_tyre_and_spring(picture):
    for corner in ("fl", "rr"):
        pixels = picture(2.0, camera="wheel", corner=corner)
        # Black of the tyre, and the yellow of springs.
        assert share(pixels, lambda r, g, b: (r < 60) & (g < 60) & (b < 75)) > 0.05
        assert share(pixels, lambda r, g, b: (r > b + 50) & (g > b + 20) & (g < r)) > 0.002


@pytest.mark.slow
def test_other_car_is_a_ghost_where_it_is(drives, folder):
    run = drives["afs"]
    left = run.poses._replace(positions_m=run.poses.positions_m + np.array([0.0, 3.0, 0.0]))
    other = Recording(run.channels, run.time_s, run.values, poses=left, scene=run.scene)
    shown = []
    for name, runs in (("alone", {"afs": run}), ("both", {"afs": run, "beside": other})):
        with Film(runs, Settings(size=SIZE, camera="top")) as film:
            shown.append(film.picture(8.0)[20:180].astype(int))
        Image.fromarray(shown[-1].astype(np.uint8)).save(folder / f"film-ghost-{name}.png")
    alone, both = shown
    assert 0.004 < share(alone, blue) == pytest.approx(share(both, blue), rel=0.2)  # the colour of its system in both
    # 240 pixels are 12.4 m, and left is up.
    ghost = np.s_[100 - 68 : 100 - 48, 150:190]
    assert np.abs(alone[ghost] - both[ghost]).mean() > 10
    assert (both[ghost].max(axis=2) - both[ghost].min(axis=2)).mean() > 10  # tinted, the road is grey
    elsewhere = np.s_[130:155, :200]
    assert np.abs(alone[elsewhere] - both[elsewhere]).max() < 4


def steered(run: Recording, rear_deg: float) -> Recording:
    """Return the same run with other rear wheel angles."""
    values = run.values.copy()
    for number, channel in enumerate(run.channels):
        if channel.name in {"rl_steer_rad", "rr_steer_rad"}:
            values[:, number] = np.radians(rear_deg)
    return Recording(run.channels, run.time_s, values, poses=run.poses, scene=run.scene, metadata=run.metadata)


@pytest.mark.slow
def test_rear_steering_of_2_deg_is_seen_beside_the_car_and_so_is_its_side(drives, folder):
    shown = []
    for angle_deg in (1.7, -1.7):
        with Film({"ars": steered(drives["ars"], angle_deg)}, Settings(size=(640, 480), camera="top")) as film:
            shown.append(film.picture(0.2)[:360].astype(int))  # straight ahead, to the right in the picture
        Image.fromarray(shown[-1].astype(np.uint8)).save(folder / f"film-rear-{angle_deg}.png")
    left, right = (np.argwhere(orange(*np.moveaxis(pixels, 2, 0))) for pixels in shown)
    seen = [{tuple(pixel) for pixel in pixels} for pixels in (left, right)]
    only_left, only_right = (np.array(sorted(own - other)) for own, other in (seen, seen[::-1]))
    # Two wedges of 17 deg and 1.2 m, 38.6 pixels to a metre.
    area = 2 * 0.5 * 1.2**2 * np.radians(17.0) * 38.6**2
    assert area * 0.6 < len(only_left) < area * 1.4
    assert area * 0.6 < len(only_right) < area * 1.4
    assert only_left[:, 0].mean() < only_right[:, 0].mean() - 5.0  # left is up
    assert only_left[:, 1].max() < 320  # the rear end
    assert set(np.unique(np.sign(only_left[:, 0] - 240))) == {-1, 1}  # a wedge on each side of the car


@pytest.mark.slow
def test_arrows_of_tyre_forces_are_seen_on_the_slippery_road(picture):
    def magenta(r, g, b):
        return (r > 150) & (g < 80) & (b > 60) & (b < r)

    assert share(picture(3.4, "ars", camera="top"), magenta) > 0.001


@pytest.mark.slow
def test_side_by_side_every_car_has_a_picture_of_its_own(drives, folder):
    runs = {name: drives[name] for name in ("ars", "afs")}
    with Film(runs, Settings(size=(640, 240), layout="side-by-side")) as film:
        pixels = film.picture(2.0)
    Image.fromarray(pixels).save(folder / "film-side-by-side.png")
    left, right = (part[20:180].astype(int) for part in np.split(pixels, 2, axis=1))
    assert share(left, orange) > 0.02 > share(right, orange)
    assert share(right, blue) > 0.02 > share(left, blue)


@pytest.mark.slow
def test_file_is_as_long_as_the_drive(drives, folder):
    need_ffmpeg()
    shares: list[float] = []
    path = folder / "film.mp4"
    frames = make_film({"ars": drives["ars"]}, path, Settings(size=SIZE, rate_hz=10, speed=4.0), shares.append)
    duration_s = drives["ars"].poses.time_s[-1] / 4.0
    assert frames / 10.0 == pytest.approx(duration_s, abs=0.15)
    assert shares[-1] == 1.0
    assert len(shares) == frames
    film = decode(path)
    assert "10 fps" in film.about
    assert film.pictures.shape[1:] == (SIZE[1], SIZE[0], 3)
    assert len(film.pictures) == frames
    with Film({"ars": drives["ars"]}, Settings(size=SIZE, speed=2.0)) as same:
        drawn = same.picture(2.0).astype(int)
    assert np.abs(film.pictures[5].astype(int) - drawn).mean() < 6.0
