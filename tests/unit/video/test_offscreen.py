"""Messages if nothing can be drawn; tests with the marker `render` draw."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from activesteer.errors import PlaybackError
from activesteer.video import offscreen
from tests.raising import raises


@pytest.fixture(autouse=True)
def asked_anew(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    offscreen.backend.cache_clear()
    yield
    offscreen.backend.cache_clear()


def test_missing_libraries_are_named_with_their_packages(monkeypatch):
    monkeypatch.setattr(offscreen, "_TRY", "raise AttributeError('NoneType')")
    monkeypatch.setattr(offscreen, "find_library", lambda _name: None)
    with pytest.raises(PlaybackError) as told:
        offscreen.backend()
    for text in ("libEGL.so is missing", "libOSMesa.so is missing", "apt-get install libegl1", "libosmesa6"):
        assert text in str(told.value)


def test_what_a_driver_says_is_told(monkeypatch):
    monkeypatch.setattr(offscreen, "_TRY", "raise RuntimeError('no such device.')")
    monkeypatch.setattr(offscreen, "find_library", lambda name: name)
    monkeypatch.setenv("MUJOCO_GL", "egl")
    with raises(PlaybackError, value={"egl": "RuntimeError: no such device"}) as told:
        offscreen.backend()
    assert "osmesa" not in str(told.value)


def test_driver_that_crashes_is_no_crash_here(monkeypatch):
    monkeypatch.setattr(offscreen, "_TRY", "import os; os.abort()")
    with raises(PlaybackError, value=dict.fromkeys(("egl", "osmesa"), "ended by signal 6")):
        offscreen.backend()


def test_first_that_works_is_taken(monkeypatch):
    monkeypatch.setattr(offscreen, "_TRY", "import sys; sys.exit(sys.argv[1] == 'egl')")
    assert offscreen.backend() == "osmesa"
