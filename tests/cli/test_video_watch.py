from __future__ import annotations

import argparse

import pytest

from activesteer.commands.recordings import _size
from tests.unit.playback.synthetic import circle


def refused(told, *texts: str) -> None:
    assert told.status == 1
    assert told.err.startswith("activesteer: ")
    assert "Traceback" not in told.err
    for text in texts:
        assert text in told.err


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "run.mcap"
    circle(0.3).save(path)
    return path


@pytest.mark.parametrize(
    ("words", "texts"),
    [
        (["-o", "a.avi"], ["a.avi: the name of a film must end in .mp4"]),
        (["-o", "nowhere/a.mp4"], ["cannot write nowhere/a.mp4: there is no folder nowhere"]),
        (["-o", "a.mp4", "--fps", "0"], ["pictures a second: is 0, must be 1 to 240"]),
        (["-o", "a.mp4", "--speed", "-1"], ["speed: is -1, must be 0.01 to 100"]),
        (["-o", "a.mp4", "--compare", "none.mcap"], ["cannot read none.mcap"]),
        (["-o", "a.mp4", "--size", "4x4"], ["4 x 4 pixels", "16 to 8192"]),
    ],
)
def test_video_that_cannot_be_made_is_refused_in_one_message(call, file, words, texts):
    refused(call("video", file, *words), *texts)


def test_video_compared_with_itself_is_refused(call, file):
    refused(call("video", file, "--compare", file, "-o", "a.mp4"), "is given twice")


def test_recording_without_a_car_is_no_film(call, file, tmp_path):
    run = circle(0.3)
    type(run)(run.channels, run.time_s, run.values).save(file)
    refused(call("video", file, "-o", tmp_path / "a.mp4"), "has no poses of a car")


def test_size_is_width_and_height():
    assert _size("1280x720") == (1280, 720)
    with pytest.raises(argparse.ArgumentTypeError):
        _size("big")


def test_watch_without_a_display_says_so_and_what_to_do(call, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    refused(call("run", "step_steer", "--watch"), "there is no display to open a window on", "`activesteer video`")


@pytest.mark.parametrize(
    ("words", "texts"),
    [
        (["step_ster"], ["no manoeuvre is named 'step_ster'", "did you mean 'step_steer'"]),
        (["step_steer", "--realtime", "1e-3"], ["--realtime: is 0.001, must be 0.01 to 100"]),
        (["step_steer", "--set", "road.mu"], ["KEY=VALUE is needed"]),
        (["step_steer", "-c", "none", "-c", "ars"], ["-c: give one controller with --watch"]),
    ],
)
def test_watch_says_what_is_wrong_before_it_looks_for_a_display(call, words, texts):
    refused(call("run", *words, "--watch"), *texts)
