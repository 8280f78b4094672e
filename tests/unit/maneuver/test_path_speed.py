"""A path with speeds and widths, which may cross itself."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import activesteer
from activesteer.analysis.path_following import path_following_metrics
from activesteer.core.conventions import CORNERS
from activesteer.errors import ManeuverError
from activesteer.maneuver.follow_path import FollowPath
from activesteer.road.course import Course
from activesteer.scenario import resolve
from tests.raising import raises
from tests.unit.analysis.synthetic import SyntheticRun

RADIUS_M = 30.0
LENGTH_M = 4.0 * math.pi * RADIUS_M


def eight(count: int = 120) -> np.ndarray:
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    left = np.column_stack([RADIUS_M * np.sin(turn), RADIUS_M * (1.0 - np.cos(turn))])
    return np.vstack([left, left * (1.0, -1.0), [[0.0, 0.0]]])


def manoeuvre(folder: Path, columns: str = "x_m,y_m,speed_kmh,width_m", extra: str = "") -> FollowPath:
    points = eight()
    speed_kmh = 36.0 + 18.0 * np.linspace(0.0, 1.0, len(points))
    table = np.column_stack([points, speed_kmh, np.full(len(points), 6.0)])
    np.savetxt(folder / "eight.csv", table, delimiter=",", header=columns, comments="", fmt="%.5f")
    text = f'kind = "follow_path"\nspeed_kmh = 36\nduration_s = 30\n[path]\ncsv = "eight.csv"\n{extra}'
    (folder / "eight.toml").write_text(text)
    found = resolve(folder / "eight.toml").maneuver
    assert isinstance(found, FollowPath)
    return found


def test_the_speed_follows_the_place_on_a_path_that_crosses_itself(tmp_path: Path) -> None:
    maneuver = manoeuvre(tmp_path)
    sequence = maneuver.sequence()
    assert sequence is not None
    path = maneuver.course.path
    demands = []
    for x_m, y_m in zip(path.x_m, path.y_m, strict=True):
        demands.append(sequence.setpoint(0.0, (0.0, 0.0, 0.0, 10.0, x_m, y_m)).speed_demand_mps)
    # The crossing is passed three times, at three speeds.
    assert np.allclose(demands, 10.0 + 5.0 * path.s_m / path.length_m, atol=0.02)
    assert path.length_m == pytest.approx(LENGTH_M, rel=1e-3)


def test_where_the_speed_falls_the_brake_is_pressed(tmp_path: Path) -> None:
    sequence = manoeuvre(tmp_path).sequence()
    assert sequence is not None
    fast = sequence.setpoint(0.0, (0.0, 0.0, 0.0, 14.0, 0.0, 0.0))
    slow = sequence.setpoint(0.0, (0.0, 0.0, 0.0, 9.0, 0.0, 0.0))
    assert fast.brake_pedal > 0.2
    assert not fast.hold_speed
    assert (slow.brake_pedal, slow.hold_speed) == (0.0, True)


@pytest.mark.parametrize("deceleration_mps2", [2.0, 5.0])
def test_the_car_brakes_as_the_speed_of_the_path_falls(deceleration_mps2: float) -> None:
    x = np.arange(0.0, 161.0, 4.0)
    # 90 km/h for 40 m, then a constant deceleration to 36 km/h.
    wanted = np.sqrt(np.maximum(25.0**2 - 2.0 * deceleration_mps2 * np.maximum(x - 40.0, 0.0), 10.0**2))
    path = {"x_m": x.tolist(), "y_m": np.zeros_like(x).tolist(), "speed_kmh": (3.6 * wanted).tolist()}
    table = {"kind": "follow_path", "speed_kmh": 90.0, "duration_s": 5.0, "settle_s": 0.5, "path": path}
    run = activesteer.simulate(table)
    behind = run["speed_mps"] - np.interp(run["x_m"], x, wanted)
    assert np.abs(behind[run["x_m"] < 155.0]).max() < 1.0
    even = (run["x_m"] > 60.0) & (run["speed_mps"] > 14.0)
    assert run["ax_mps2"][even].mean() == pytest.approx(-deceleration_mps2, rel=0.05)


def test_lap_time_and_overstep_of_a_car_beside_the_path(tmp_path: Path) -> None:
    course = manoeuvre(tmp_path).course
    again = Course.from_table(course.to_table())
    assert again.width_m == pytest.approx(course.width_m)
    time_s = np.arange(0.0, 45.0, 0.001)
    # One metre to the left of the path, at 10 m/s along it.
    s = 10.0 * time_s
    path = course.path
    x, y, heading = (np.interp(s, path.s_m, line) for line in (path.x_m, path.y_m, path.heading_rad))
    beyond = np.maximum(s - path.length_m, 0.0)
    x, y = x + beyond * np.cos(heading) - np.sin(heading), y + beyond * np.sin(heading) + np.cos(heading)
    zero = np.zeros_like(time_s)
    channels = {name: zero for name in ("yaw_rate_radps", "sideslip_rad", "ay_mps2", "roll_rad", "steering_wheel_rad")}
    channels |= {
        "x_m": x,
        "y_m": y,
        "front_axle_x_m": x,
        "front_axle_y_m": y,
        "yaw_rad": heading,
        "speed_mps": zero + 10.0,
    }
    channels |= {f"{corner}_friction_utilisation": zero for corner in CORNERS}
    for corner in CORNERS:
        channels |= {f"{corner}_contact_x_m": x, f"{corner}_contact_y_m": y}
    run = SyntheticRun(time_s, channels, "follow_path")
    car = {"width_m": 1.8, "wheelbase_m": 2.6, "front_track_m": 1.5, "rear_track_m": 1.5, "tyre_width_m": [0.2, 0.2]}
    run.metadata |= {"course": course.to_table(), "car": car}
    values = path_following_metrics(run)
    assert values["lap_time_s"] == pytest.approx(path.length_m / 10.0, abs=0.02)
    assert values["road_overstep_m"] == pytest.approx(1.0 + 0.9 - 3.0, abs=0.02)


def test_columns_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    with raises(ManeuverError, key="path.csv"):
        manoeuvre(tmp_path, extra="speed_mps = [10.0, 11.0]\n")
    points = {"x_m": [0.0, 10.0, 20.0, 30.0], "y_m": [0.0] * 4, "width_m": [3.0]}
    with raises(ManeuverError, key="path.width_m"):
        resolve({"kind": "follow_path", "speed_kmh": 50, "duration_s": 3.0, "path": points})
