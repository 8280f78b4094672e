"""A drive by hand: signs, limits of the hands, cones, laps, and the recording that is left."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer.analysis.report.groups import verdict
from activesteer.analysis.report.run_page import report_page
from activesteer.errors import ActiveSteerError, ParameterError
from activesteer.explore.choice import Folder
from activesteer.explore.drive import COURSES, DriveSession
from activesteer.explore.messages import Act, Start
from activesteer.simulation.live_view import FramePacer


class Clock:
    """A clock that goes on by 0.1 s, the longest time between two pictures, at each look."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        self.now_s += 0.1
        return self.now_s


def drive(course: str, folder: Path, **more: Any) -> DriveSession:
    pacer = FramePacer(clock=Clock(), sleep=lambda _: None)
    car = DriveSession(Start(maneuver=course, **more), Folder(folder), pacer)
    car.go()
    return car


def go(car: DriveSession, until_s: float) -> dict[str, Any]:
    while True:
        header = car.frame().header
        if header["time_s"] >= until_s:
            return header


def result_of(car: DriveSession) -> str:
    """Return the last event of a finished drive."""
    assert car.path is not None
    return activesteer.Recording.open(car.path).metadata["events"][-1]["what"]


def test_steering_to_the_left_turns_left_and_the_recording_holds_the_drive(tmp_path: Path) -> None:
    car = drive("plane", tmp_path)
    assert next(car.start()).header["cones"] == []
    car.act(Act(steer=0.5, direct=True, number=7))
    frame = go(car, 1.5)
    assert frame["yaw_rate_degps"] > 5.0
    assert frame["seen"] == 7
    assert frame["speed_kmh"] == pytest.approx(60.0, abs=3.0)  # held
    car.act(Act(controller="ars"))
    assert abs(go(car, 2.0)["rear_deg"]) > 0.05
    end = car.end().header
    recording = activesteer.Recording.open(tmp_path / "drive_plane.mcap")
    assert recording.time_s[-1] == pytest.approx(end["time_s"], abs=2e-3)
    assert recording["yaw_rate_radps"][-1] > 0.0
    assert recording.metadata["complete"]  # a drive is as long as its driver wants
    assert recording.metadata["maneuver"]["title"] == "Free plane, dry, driven by hand"
    assert recording.metadata["driver"]["name"] == "by hand"
    assert recording.metadata["overrides"].keys() == {"speed_kmh", "road.mu"}
    (change,) = recording.metadata["events"]
    assert (change["time_s"], change["what"]) == (pytest.approx(1.5, abs=0.1), "controller = ars")
    assert recording.metrics["speed_end_mps"] == pytest.approx(recording["vx_mps"][-1], rel=0.01)


def test_the_gauges_of_a_car_that_spins_are_those_of_its_recording(tmp_path: Path) -> None:
    car = drive("slippery", tmp_path, vehicle="bmw_m8", speed_kmh=40.0)
    car.act(Act(steer=1.0, throttle=1.0))
    frames = [car.frame().header for _ in range(60)]
    assert max(abs(frame["sideslip_deg"]) for frame in frames) > 90.0
    car.end()
    recording = activesteer.Recording.open(tmp_path / "drive_slippery.mcap")
    for frame in frames:
        row = int(np.argmin(np.abs(recording.time_s - frame["time_s"])))
        speed_kmh = 3.6 * math.hypot(recording["vx_mps"][row], recording["vy_mps"][row])
        assert frame["speed_kmh"] == pytest.approx(speed_kmh, abs=0.5)  # no sign: it slides
        angle_rad = math.atan2(recording["vy_mps"][row], recording["vx_mps"][row])
        if speed_kmh > 10.0:
            assert math.cos(angle_rad - math.radians(frame["sideslip_deg"])) > 0.99


@pytest.mark.parametrize(("controller", "low_deg", "high_deg"), [
    ("none", 30.0, math.inf), pytest.param("lqr", 0.0, 15.0, marks=pytest.mark.slow),
    pytest.param("esc", 0.0, 15.0, marks=pytest.mark.slow), ("integrated", 0.0, 15.0),
])  # fmt: skip
def test_a_key_to_the_left_and_then_to_the_right_on_snow_spins_only_the_car_without_control(
    controller: str, low_deg: float, high_deg: float, tmp_path: Path
) -> None:
    car = drive("slippery", tmp_path, vehicle=COURSES["slippery"].vehicle, controllers=(controller,))
    sideslip_deg = 0.0
    for steer, until_s in ((0.0, 0.5), (1.0, 1.5), (-1.0, 3.0), (0.0, 5.0)):
        car.act(Act(steer=steer))
        while (header := car.frame().header)["time_s"] < until_s:
            sideslip_deg = max(sideslip_deg, abs(header["sideslip_deg"]))
    car.end()
    assert low_deg < sideslip_deg < high_deg


def test_the_hands_turn_no_faster_than_hands_and_no_further_than_a_full_turn(tmp_path: Path) -> None:
    car = drive("plane", tmp_path)
    car.act(Act(steer=1.0))
    angles = [go(car, 0.1 * count)["steering_wheel_deg"] for count in range(1, 12)]
    rates = [(b - a) / 0.1 for a, b in itertools.pairwise(angles)]
    assert max(rates) < 600.0
    speed, car_ = 60.0 / 3.6, car._driver._setup.single_track
    assert car_.characteristic_speed_mps is not None
    wheelbase, slow = car_.cg_to_front_m + car_.cg_to_rear_m, car_.characteristic_speed_mps
    full = car._driver._setup.steering_ratio * 11.0 * wheelbase / speed**2 * (1.0 + (speed / slow) ** 2)
    assert angles[-1] == pytest.approx(math.degrees(full), rel=0.15)  # the column twists, the speed falls
    car.end()


def test_a_car_waits_at_the_start_on_the_road_and_leaves_no_file(tmp_path: Path) -> None:
    car = DriveSession(Start(maneuver="slalom", speed_kmh=45.0, mu=0.5), Folder(tmp_path))
    course, picture = car.start()
    assert (course.header["speed_kmh"], course.header["mu"]) == (45.0, 0.5)
    assert picture.header["time_s"] == 0.0
    assert picture.header["speed_kmh"] == pytest.approx(45.0, abs=0.5)
    assert picture.arrays[0][1:, 2] == pytest.approx(0.3, abs=0.03)  # the wheels stand on the road
    assert car.path is None
    assert list(tmp_path.iterdir()) == []


def test_speed_and_friction_change_while_the_car_drives(tmp_path: Path) -> None:
    car = drive("plane", tmp_path, speed_kmh=60.0)
    car.act(Act(speed_kmh=50.0))
    assert go(car, 6.0)["speed_kmh"] == pytest.approx(50.0, abs=2.0)
    car.act(Act(steer=1.0))
    on_dry = abs(go(car, 7.5)["ay_mps2"])
    car.act(Act(mu=0.2))
    assert on_dry > 6.0
    assert abs(go(car, 9.0)["ay_mps2"]) < 0.25 * 9.81
    car.end()
    assert car.path is not None
    (event,) = activesteer.Recording.open(car.path).metadata["events"]
    assert (event["kind"], event["what"]) == ("set", "road.mu = 0.2")


def test_a_foot_on_the_brake_stops_the_car(tmp_path: Path) -> None:
    car = drive("slippery", tmp_path, speed_kmh=40.0)
    car.act(Act(brake=1.0, steer=0.0))
    assert go(car, 5.0)["speed_kmh"] < 4.0
    car.end()


def test_a_car_that_drives_straight_on_hits_cones_once_and_each_adds_two_seconds_to_the_time(tmp_path: Path) -> None:
    car = drive("slalom", tmp_path)
    cones = next(car.start()).header["cones"]
    fallen: list[int] = []
    before = car.frame().header
    while (header := car.frame().header)["time_s"] < 9.0:
        fallen += header["cones"]
        assert header["penalty_s"] == 2.0 * len(fallen)
        if before["lap_s"] > before["penalty_s"]:  # behind the first gate
            added_s = header["lap_s"] - before["lap_s"] - (header["time_s"] - before["time_s"])
            assert added_s == pytest.approx(2.0 * len(header["cones"]), abs=2e-3)
        before = header
    assert 0 < len(fallen) == len(set(fallen)) <= len(cones)
    assert header["lap_s"] > 1.0
    car.end()


def test_a_course_has_its_path_painted_on_the_road(tmp_path: Path) -> None:
    slalom, lane_change = drive("slalom", tmp_path), drive("lane_change", tmp_path)
    start, other = (next(car.start()).header for car in (slalom, lane_change))
    slalom.end()
    lane_change.end()
    x_m, y_m = np.array(start["line"]).T
    cones = np.array(start["cones"])
    assert x_m[0] == 0.0
    assert x_m[-1] > cones[-1, 0] - 2.0
    assert np.diff(x_m).max() < 2.5
    # It passes the cones of a slalom on one side and the other, in turn.
    beside_m = np.interp(cones[:, 0], x_m, y_m) - cones[:, 1]
    assert np.abs(beside_m).min() > 0.9
    assert (np.sign(beside_m[1:]) == -np.sign(beside_m[:-1])).sum() >= len(cones) // 2
    ends_m = {lane["start_x_m"]: lane for lane in other["lanes"]}
    x_m, y_m = np.array(other["line"]).T
    for start_m, lane in ends_m.items():  # through all its lanes
        assert lane["right_y_m"] < np.interp(start_m, x_m, y_m) < lane["left_y_m"]


def test_a_drive_whose_controller_fails_is_saved_as_incomplete_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "fails.py").write_text(
        "from activesteer import ActuatorCommand\n"
        "class Fails:\n"
        "    def step(self, command, measurement):\n"
        "        if measurement.time_s > 6.0:\n"
        "            raise ValueError('too late')\n"
        "        return ActuatorCommand()\n"
    )
    car = drive("slalom", tmp_path, controllers=("fails.py:Fails",))
    with pytest.raises(ActiveSteerError, match="too late"):
        go(car, 7.0)
    assert not car._standing.all()  # it has hit a cone, but a drive that failed has no result
    assert car.end().header["error"] == ""
    assert car.path is not None
    recording = activesteer.Recording.open(car.path)
    assert not recording.metadata["complete"]
    assert "too late" in recording.metadata["error"]
    assert recording.time_s[-1] == pytest.approx(6.0, abs=0.01)


def test_a_drive_past_a_gate_has_no_time(tmp_path: Path) -> None:
    car = drive("lane_change", tmp_path)  # straight on, beside the lane in the middle
    while (header := car.frame().header)["time_s"] < 8.0:
        pass
    assert header["lap_s"] > 5.0
    assert header["missed"]
    assert header["last_lap_s"] is None
    car.end()
    assert result_of(car).startswith("no time: a gate was missed")


def test_a_drive_that_ends_early_says_how_far_it_came_and_its_report_does_not_judge_the_rest(tmp_path: Path) -> None:
    car = drive("slalom", tmp_path)  # straight on, through the first cone
    go(car, 3.7)
    assert car.end().header["early"] == "ended after 1 of 6 cones"  # what the page says
    assert result_of(car) == "no time: ended after 1 of 6 cones, 1 cone hit (+2 s)"
    assert car.path is not None
    recording = activesteer.Recording.open(car.path)
    assert not any("misses" in words for words in verdict({"a": recording}))
    assert recording.metrics["cones_missed"] > 1.0  # a metric counts what is not reached
    page = report_page({"a.mcap": recording})
    assert "hits 1 cone" in page
    assert "final heading against the path" in page
    assert not any(words in page for words in ("misses", "cones missed", "mean cone distance", "passes all cones"))
    (group,) = json.loads(page.split('id="data">')[1].split("</script>")[0])["groups"]
    assert group["track"]["view"]["x"][0] < 5.0


def test_a_drive_through_all_gates_has_a_time(tmp_path: Path) -> None:
    car = drive("lane_change", tmp_path, speed_kmh=30.0)
    course = car._simulation.scenario.maneuver.course
    assert course is not None
    while (header := car.frame().header)["last_lap_s"] is None:
        assert not header["missed"]
        truth, motion = car._simulation.truth, car._simulation.motion
        ahead_m = 0.7 * motion.speed_mps
        wanted_m = np.interp(truth["front_axle_x_m"] + ahead_m, course.path.x_m, course.path.y_m)
        aside_rad = math.atan2(wanted_m - truth["front_axle_y_m"], ahead_m) - motion.yaw_rad
        car.act(Act(steer=max(-1.0, min(1.0, 1.5 * aside_rad))))
    assert header["last_lap_s"] > 10.0
    car.end()
    assert result_of(car).startswith(f"time {header['last_lap_s']:.2f} s")


def test_an_unknown_controller_or_one_of_another_folder_is_refused_and_the_drive_goes_on(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "elsewhere.py").write_text(f"open({str(tmp_path / 'executed')!r}, 'w').close()\nclass C: ...\n")
    car = drive("plane", tmp_path / "own")
    for name in ("arrs", f"{tmp_path}/elsewhere.py:C", "../elsewhere.py:C"):
        with pytest.raises(ParameterError):
            car.act(Act(controller=name))
    assert not (tmp_path / "executed").exists()
    assert go(car, 0.3)["time_s"] >= 0.3
    car.end()
