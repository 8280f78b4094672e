"""A drive at the pace of a clock, with a substitute for the viewer."""

from __future__ import annotations

import dataclasses
import math
from contextlib import nullcontext
from typing import Any

import mujoco
import numpy as np
import pytest

from activesteer.scenario import resolve
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.live_view import FRAME_S, FramePacer, Keys, drive, scene_for


class Clock:
    """Time that advances by sleep and work."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.slept_s = 0.0

    def __call__(self) -> float:
        return self.now_s

    def sleep(self, time_s: float) -> None:
        assert time_s >= 0.0
        self.now_s += time_s
        self.slept_s += time_s


class Viewer:
    """A view that takes `work_s` to draw and is closed after some pictures."""

    def __init__(
        self,
        stage,
        clock: Clock,
        work_s: float = 0.002,
        pictures: int = 10**9,
        pressed: dict[int, str] | None = None,
    ) -> None:
        self.keys, self._pressed = Keys(), pressed or {}
        self.cam = mujoco.MjvCamera()
        self._stage, self._clock, self._work_s, self._left = stage, clock, work_s, pictures
        self.shown: list[tuple[float, float, str]] = []
        self.azimuths: list[float] = []
        self._text = ""

    def is_running(self) -> bool:
        return self._left > 0

    def lock(self) -> Any:
        return nullcontext()

    def set_texts(self, texts: Any) -> None:
        self._text = texts[3]

    def sync(self) -> None:
        self._clock.now_s += self._work_s
        self._left -= 1
        x_m = float(self._stage.data.body("0/chassis").xpos[0])
        self.shown.append((self._clock.now_s, x_m, self._text))
        self.azimuths.append(self.cam.azimuth)
        for key in self._pressed.get(len(self.shown), ""):
            self.keys(ord(key))


def watched(duration_s: float = 0.5, speed: float = 1.0, **look: Any):
    scenario = resolve("step_steer", "compact", {"duration_s": duration_s, "settle_s": 0.2, "steer.start_s": 0.1})
    assert scenario.maneuver.search is not None
    scenario = dataclasses.replace(
        scenario, maneuver=scenario.maneuver.search.accept(0.8)
    )  # instead of searching for it
    simulation, clock = ClosedLoop(scenario), Clock()
    stage = scene_for(simulation, scenario.maneuver)
    viewer, pacer = Viewer(stage, clock, **look), FramePacer(speed, clock, clock.sleep)
    return drive(simulation, stage, viewer, pacer, viewer.keys), viewer, clock, pacer, simulation


def test_pictures_come_when_they_are_due():
    (simulated_s, finished), viewer, clock, pacer, simulation = watched()
    assert finished
    assert simulated_s == pytest.approx(0.5)
    assert clock.now_s - 100.0 == pytest.approx(0.5, abs=2 * FRAME_S)
    assert len(viewer.shown) == pytest.approx(0.5 / FRAME_S, abs=2)
    assert pacer.lost_s == 0.0
    times, places, _ = zip(*viewer.shown, strict=True)
    speed = np.diff(places) / np.diff(times)
    assert speed[1:-1] == pytest.approx(simulation.maneuver.speed_mps, rel=0.08)


@pytest.mark.parametrize("speed", [0.25, 4.0])
def test_slow_motion_and_fast(speed):
    (_, finished), _, clock, *_ = watched(speed=speed)
    assert finished
    assert clock.now_s - 100.0 == pytest.approx(0.5 / speed, abs=2 * FRAME_S)


def test_slow_viewer_gets_fewer_pictures_of_the_same_drive():
    (_, finished), viewer, clock, pacer, _ = watched(work_s=0.05)
    assert finished
    assert len(viewer.shown) == pytest.approx(11, abs=1)
    # Half a second, but for the first picture and the last.
    assert clock.now_s - 100.0 == pytest.approx(0.5, abs=0.12)
    assert clock.slept_s <= FRAME_S
    assert pacer.lost_s == 0.0


def test_viewer_that_is_far_too_slow_makes_the_drive_slower():
    (_, finished), viewer, _, pacer, _ = watched(work_s=0.4)
    assert finished
    assert len(viewer.shown) >= 5
    # The first picture starts the clock; from the second on each takes 0.4 s and shows 0.1 s of the drive.
    assert pacer.lost_s == pytest.approx((len(viewer.shown) - 2) * 0.3)


def test_pause_is_not_caught_up_with():
    clock = Clock()
    pacer = FramePacer(1.0, clock, clock.sleep)
    shown = pacer.next(0.0)
    clock.now_s += 30.0
    shown = pacer.next(shown)
    assert shown == pytest.approx(FRAME_S + 0.1)
    assert pacer.next(shown) == pytest.approx(shown + FRAME_S)
    assert pacer.lost_s == pytest.approx(29.9)


def test_closing_the_window_ends_the_drive():
    (simulated_s, finished), viewer, *_ = watched(pictures=5)
    assert not finished
    assert len(viewer.shown) == 5
    assert simulated_s < 0.1


def test_camera_follows_and_turns_with_the_car():
    _, viewer, _, _, simulation = watched(duration_s=2.5)
    motion = simulation.vehicle.motion()
    assert motion.yaw_rad > 0.3
    assert viewer.cam.lookat[:2] == pytest.approx([motion.x_m, motion.y_m])
    turned = math.radians(viewer.azimuths[-1] - viewer.azimuths[0])
    assert 0.5 * motion.yaw_rad < turned < motion.yaw_rad
    assert max(np.abs(np.diff(viewer.azimuths))) < 1.0


def test_space_pauses_and_goes_on():
    (_, finished), viewer, clock, _, _ = watched(pressed={5: " ", 25: " "})
    assert finished
    places = [place for _, place, _ in viewer.shown]
    assert len(set(places[5:25])) == 1
    assert places[30] > places[25]
    assert "paused" in viewer.shown[10][2]
    assert clock.now_s - 100.0 == pytest.approx(0.5 + 20 * (FRAME_S + 0.002), abs=4 * FRAME_S)


@pytest.mark.parametrize(("key", "factor"), [("-", 0.5), ("=", 2.0)])
def test_keys_make_the_drive_slower_and_faster(key, factor):
    (_, finished), viewer, clock, _, _ = watched(pressed={1: key})
    assert finished
    assert clock.now_s - 100.0 == pytest.approx(0.5 / factor, abs=4 * FRAME_S)
    assert f"{factor:g} x real time" in viewer.shown[-1][2]


def test_restart_ends_the_drive_and_other_keys_do_nothing():
    (_, finished), viewer, *_ = watched(pressed={3: "X", 6: "R"})
    assert not finished
    assert len(viewer.shown) == 6
    assert viewer.keys.restart
