from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from activesteer.errors import ParameterError, PlaybackError
from activesteer.video import film as module
from activesteer.video.film import check, encoder, frame_rate
from tests.raising import raises
from tests.unit.video.films import decode, need_ffmpeg

SIZE = (64, 48)
COLOURS = ((200, 30, 30), (30, 200, 30), (30, 30, 200))


def picture(colour: tuple[int, int, int]) -> np.ndarray:
    return np.full((SIZE[1], SIZE[0], 3), colour, np.uint8)


def write(path: Path, rate_hz: float = 20.0) -> Path:
    pictures = [picture(colour) for colour in COLOURS]
    with encoder(path, SIZE, rate_hz, pictures) as append:
        for pixels in pictures:
            append(pixels)
    return path


def test_gif_holds_the_pictures_and_their_times(tmp_path):
    with Image.open(write(tmp_path / "a.gif")) as gif:
        assert gif.n_frames == 3  # type: ignore[attr-defined]
        for number, colour in enumerate(COLOURS):
            gif.seek(number)
            assert gif.info["duration"] == 50
            assert np.asarray(gif.convert("RGB"))[5, 5] == pytest.approx(colour, abs=3)
    assert [path.name for path in tmp_path.iterdir()] == ["a.gif"]


def test_mp4_holds_the_pictures(tmp_path):
    need_ffmpeg()
    film = decode(write(tmp_path / "a.mp4"))
    for text in ("h264", "yuv420p", "64x48", "20 fps"):
        assert text in film.about
    assert len(film.pictures) == 3
    for pixels, colour in zip(film.pictures, COLOURS, strict=True):
        assert pixels[20, 20] == pytest.approx(colour, abs=12)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_failure_on_the_way_leaves_the_file_of_before(tmp_path, name):
    if name.endswith(".mp4"):
        need_ffmpeg()
    path = tmp_path / name
    path.write_text("before")

    def fail() -> None:
        with encoder(path, SIZE, 20.0, [picture(COLOURS[0])]) as append:
            append(picture(COLOURS[0]))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert path.read_text() == "before"
    assert [entry.name for entry in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_folder_in_the_way_is_an_error(tmp_path, name):
    if name.endswith(".mp4"):
        need_ffmpeg()
    (tmp_path / name).mkdir()
    with raises(PlaybackError, cause=IsADirectoryError, value=tmp_path / name):
        write(tmp_path / name)
    assert [entry.name for entry in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_a_folder_that_cannot_be_written_is_one_error_before_anything_is_drawn(name):
    path = Path("/proc/self", name)  # also for root
    begun = False
    with raises(PlaybackError, cause=OSError, value=path), encoder(path, SIZE, 20.0, [picture(COLOURS[0])]):
        begun = True
    assert not begun


def test_what_ffmpeg_says_is_told(tmp_path, monkeypatch):
    tool = tmp_path / "ffmpeg"
    tool.write_text("#!/bin/sh\ncat >/dev/null\necho first >&2\necho Unknown encoder libx264 >&2\nexit 1\n")
    tool.chmod(0o755)
    monkeypatch.setattr(module, "ffmpeg", lambda: str(tool))
    with raises(PlaybackError, value="Unknown encoder libx264"):
        write(tmp_path / "a.mp4")


def test_missing_ffmpeg_names_what_to_install(tmp_path, monkeypatch):
    def missing(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(module.importlib, "import_module", missing)
    monkeypatch.setenv("PATH", str(tmp_path))
    with raises(PlaybackError, value="imageio-ffmpeg", allowed="video"):
        check(tmp_path / "a.mp4", SIZE)
    check(tmp_path / "a.gif", SIZE)


@pytest.mark.parametrize(
    ("name", "size", "fields"),
    [
        ("a.avi", SIZE, {"allowed": (".mp4", ".gif")}),
        ("a", SIZE, {"allowed": (".mp4", ".gif")}),
        ("a.gif", (8, 48), {"value": (8, 48), "allowed": (16, 8192)}),
        ("a.gif", (64, 10000), {"value": (64, 10000), "allowed": (16, 8192)}),
        ("a.mp4", (65, 48), {"value": (65, 48)}),
    ],
)
def test_name_or_size_that_no_video_can_have_is_refused_first(tmp_path, name, size, fields):
    with raises(ParameterError, **fields):
        check(tmp_path / name, size)


def test_missing_folder_is_named_first(tmp_path):
    with raises(PlaybackError, value=tmp_path / "no"):
        check(tmp_path / "no" / "a.gif", SIZE)


def test_rate_of_a_gif_is_one_that_it_can_have():
    gif, mp4 = Path("a.gif"), Path("a.mp4")
    assert frame_rate(mp4, 29.97) == 29.97
    assert frame_rate(gif, 20.0) == 20.0
    assert frame_rate(gif, 30.0) == pytest.approx(100.0 / 3.0)
    assert frame_rate(gif, 200.0) == 50.0
