"""A found steering wheel angle is stored under all inputs that determine it, and a damaged store does no harm."""

from __future__ import annotations

import os
import threading
from typing import Any

import pytest

from activesteer.scenario import resolve
from activesteer.simulation import preparation
from activesteer.simulation.preparation import with_amplitude_found

KEY, ANGLE_RAD = "0123456789abcdef" * 4, 0.1 + 0.2


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path):
    """Return an empty store; the process has stored nothing."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(preparation, "_in_process", {})
    return tmp_path / "activesteer" / "amplitudes"


@pytest.fixture
def searches(monkeypatch):
    """Angles found by searches, which do not drive."""
    made = []
    monkeypatch.setattr(preparation, "_steady_turn", lambda *_: made.append(ANGLE_RAD + len(made)) or made[-1])
    return made


def angle(overrides: dict[str, Any] | None = None, vehicle: Any = "compact") -> float:
    maneuver: Any = with_amplitude_found(resolve("step_steer", vehicle, overrides or {})).maneuver
    return maneuver.steer.steering_wheel_rad


def test_changed_car_gain_processor_or_version_gives_a_new_amplitude(searches, monkeypatch):
    first = angle()
    assert angle({"controllers.ars.limit_deg": 1.0}) == first  # the search drives the car without control
    changes = {"factors.mass": 1.01, "single_track.mass_kg": 1501.0, "driver.speed_gain_1ps": 1.0, "road.mu": 0.8}
    found = {first, angle(vehicle="sedan"), *(angle({key: value}) for key, value in changes.items())}
    for name, other in (("__version__", "x"), ("processor", lambda *_: "x"), ("content_key", lambda *_: "x")):
        monkeypatch.setattr(preparation, name, other)
        found.add(angle())
    assert len(found) == len(searches) == 9


def test_stored_amplitude_is_found_by_another_process_and_a_damaged_one_is_searched_for(searches, folder):
    first = angle()
    preparation._in_process.clear()
    assert angle() == first  # bit for bit, from the disk
    [file] = folder.iterdir()
    whole = file.read_bytes()
    for wrong in (b"", whole[:-9], whole.replace(b"0", b"1"), whole + b"0", b"nan \n", b"\xff" * 40, b"0" * 10**6):
        preparation._in_process.clear()
        file.write_bytes(wrong)
        assert angle() == searches[-1] != first
    assert len(searches) == 8


def test_concurrent_writers_leave_whole_files_and_only_so_many(folder, monkeypatch):
    keys = [f"{number:064x}" for number in range(4)]

    def write(key: str) -> None:
        for _ in range(50):
            preparation.keep(key, ANGLE_RAD)

    threads = [threading.Thread(target=write, args=(key,)) for key in (*keys, *keys)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        preparation._in_process.clear()
        assert preparation.recall(keys[0]) in (None, ANGLE_RAD)
    assert [file.stem for file in sorted(folder.iterdir())] == keys
    monkeypatch.setattr(preparation, "MAX_KEPT", 5)
    for number in range(9):
        preparation.keep(f"{number + 9:064x}", ANGLE_RAD)
    assert len(list(folder.iterdir())) == 5


def test_the_angle_just_found_is_kept_after_the_clock_was_set_back(folder, monkeypatch):
    monkeypatch.setattr(preparation, "MAX_KEPT", 2)
    for number in range(2):
        preparation.keep(f"{number:064x}", ANGLE_RAD)
    for file in folder.iterdir():
        os.utime(file, (2e9, 2e9))
    preparation.keep(KEY, ANGLE_RAD)
    assert len(list(folder.iterdir())) == 2
    assert (folder / f"{KEY}.amplitude").is_file()
