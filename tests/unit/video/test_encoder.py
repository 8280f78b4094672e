from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from activesteer.errors import ParameterError, PlaybackError
from activesteer.video import film as module
from activesteer.video.film import check, encoder
from tests.raising import raises
from tests.unit.video.films import decode, need_ffmpeg

SIZE = (64, 48)
COLOURS = ((200, 30, 30), (30, 200, 30), (30, 30, 200))


def picture(colour: tuple[int, int, int]) -> np.ndarray:
    return np.full((SIZE[1], SIZE[0], 3), colour, np.uint8)


def write(path: Path, rate_hz: float = 20.0) -> Path:
    pictures = [picture(colour) for colour in COLOURS]
    with encoder(path, SIZE, rate_hz) as append:
        for pixels in pictures:
            append(pixels)
    return path


def test_mp4_holds_the_pictures(tmp_path):
    need_ffmpeg()
    film = decode(write(tmp_path / "a.mp4"))
    for text in ("h264", "yuv420p", "64x48", "20 fps"):
        assert text in film.about
    assert len(film.pictures) == 3
    for pixels, colour in zip(film.pictures, COLOURS, strict=True):
        assert pixels[20, 20] == pytest.approx(colour, abs=12)
    assert [path.name for path in tmp_path.iterdir()] == ["a.mp4"]


def test_failure_on_the_way_leaves_the_file_of_before(tmp_path):
    need_ffmpeg()
    path = tmp_path / "a.mp4"
    path.write_text("before")

    def fail() -> None:
        with encoder(path, SIZE, 20.0) as append:
            append(picture(COLOURS[0]))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert path.read_text() == "before"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.mp4"]


def test_folder_in_the_way_is_an_error(tmp_path):
    need_ffmpeg()
    path = tmp_path / "a.mp4"
    path.mkdir()
    with raises(PlaybackError, cause=IsADirectoryError, value=path):
        write(path)
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_cannot_be_written_is_one_error_before_anything_is_drawn():
    path = Path("/proc/self/a.mp4")  # also for root
    begun = False
    with raises(PlaybackError, cause=OSError, value=path), encoder(path, SIZE, 20.0):
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


@pytest.mark.parametrize(
    ("name", "size", "fields"),
    [
        ("a.avi", SIZE, {"allowed": (".mp4",)}),
        ("a", SIZE, {"allowed": (".mp4",)}),
        ("a.mp4", (8, 48), {"value": (8, 48), "allowed": (16, 8192)}),
        ("a.mp4", (64, 10000), {"value": (64, 10000), "allowed": (16, 8192)}),
        ("a.mp4", (65, 48), {"value": (65, 48)}),
    ],
)
def test_name_or_size_that_no_video_can_have_is_refused_first(tmp_path, name, size, fields):
    with raises(ParameterError, **fields):
        check(tmp_path / name, size)


def test_a_gif_is_refused_with_what_makes_one(tmp_path):
    with raises(ParameterError, allowed=(".mp4",)) as told:
        check(tmp_path / "a.gif", SIZE)
    assert "ffmpeg -i FILM.mp4 FILM.gif" in str(told.value)


def test_missing_folder_is_named_first(tmp_path):
    with raises(PlaybackError, value=tmp_path / "no"):
        check(tmp_path / "no" / "a.mp4", SIZE)
