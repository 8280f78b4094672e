"""The preview driver with a linear single-track car."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from activesteer.core.path import Path
from activesteer.core.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.driver import DriverParameters, OpenLoopDriver, PathPreviewDriver, SpeedHold
from activesteer.driver.path_preview import PREVIEW_INTERVAL_S, steering_gains
from tests.unit.driver.drives import DRIVE
from tests.unit.driver.drives import parameters as somebody

RATIO, LOCK_RAD, TIMESTEP_S = 16.0, 8.0, 0.001
STRAIGHT = Path.through([0.0, 300.0], [0.0, 0.0])


def matrices(speed_mps: float) -> tuple[np.ndarray, np.ndarray]:
    """A mildly understeering car; states yaw rate and sideslip angle."""
    m, jz, cv, ch, lv, lh = 1430.0, 2200.0, 98e3, 149e3, 1.08, 1.56
    d = ch * lh - cv * lv
    a = [[-(cv * lv**2 + ch * lh**2) / (jz * speed_mps), d / jz],
         [d / (m * speed_mps**2) - 1.0, -(cv + ch) / (m * speed_mps)]]  # fmt: skip
    return np.array(a), np.array([[cv * lv / jz], [cv / (m * speed_mps)]])


def driver(parameters: DriverParameters | None = None) -> PathPreviewDriver:
    known = parameters or somebody()
    robot = OpenLoopDriver(SpeedHold(known, DRIVE, 1430.0, 0.31, TIMESTEP_S), RATIO, LOCK_RAD)
    return PathPreviewDriver(robot, matrices, known, TIMESTEP_S)


def seen(y_m: float = 0.0, yaw_rad: float = 0.0, speed_mps: float = 22.0, x_m: float = 0.0) -> Motion:
    return Motion(x_m, y_m, yaw_rad, speed_mps, 0.0, 0.0)


def command_of(block: PathPreviewDriver, motion: Motion, path: Path = STRAIGHT) -> DriverCommand:
    speed_mps = motion.speed_mps
    sensed = Measurement(0.0, speed_mps, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0))
    return block.step(Setpoint(0.0, speed_mps, 0.0, hold_speed=True, path=path), sensed, motion)


def answer_to(block: PathPreviewDriver, motion: Motion, seconds: float) -> list[float]:
    """Steering wheel angles for a constant view of the road."""
    return [command_of(block, motion).steering_wheel_demand_rad for _ in range(round(seconds / TIMESTEP_S))]


def drive(path: Path, speed_mps: float, seconds: float, parameters: DriverParameters | None = None) -> np.ndarray:
    """Driver and car in a loop; rows of x, y, steering wheel angle."""
    block = driver(parameters)
    a, b = matrices(speed_mps)
    state, x, y, yaw, rows = np.zeros(2), 0.0, 0.0, 0.0, []
    for _ in range(round(seconds / TIMESTEP_S)):
        lateral = speed_mps * math.tan(state[1])
        wheel = command_of(block, Motion(x, y, yaw, speed_mps, lateral, state[0]), path).steering_wheel_demand_rad
        x += TIMESTEP_S * (speed_mps * math.cos(yaw) - lateral * math.sin(yaw))
        y += TIMESTEP_S * (speed_mps * math.sin(yaw) + lateral * math.cos(yaw))
        yaw += TIMESTEP_S * state[0]
        state = state + TIMESTEP_S * (a @ state + b[:, 0] * wheel / RATIO)
        rows.append((x, y, wheel))
    return np.array(rows)


def test_on_the_path_he_does_not_steer() -> None:
    assert answer_to(driver(), seen(), 1.0)[-1] == pytest.approx(0.0, abs=1e-12)


def test_he_steers_back_to_the_path() -> None:
    assert answer_to(driver(), seen(y_m=1.0), 1.0)[-1] < -0.01
    assert answer_to(driver(), seen(yaw_rad=0.05), 1.0)[-1] < -0.01


def test_he_is_the_same_to_both_sides() -> None:
    left, right = answer_to(driver(), seen(y_m=-1.0), 0.5), answer_to(driver(), seen(y_m=1.0), 0.5)
    assert np.array(left) == pytest.approx(-np.array(right), abs=1e-12)


def test_nothing_happens_within_the_reaction_delay() -> None:
    known = somebody(reaction_delay_s=0.2, neuromuscular_lag_s=0.1)
    angles = np.array(answer_to(driver(parameters=known), seen(y_m=1.0), 0.6))
    assert not angles[:200].any()
    assert angles[200] != 0.0
    # Behind the delay, a first-order lag: of the first decision, which is that of the next 10 ms.
    assert angles[209] / angles[200] == pytest.approx(math.expm1(-0.1) / math.expm1(-0.01), rel=1e-6)


def test_the_rate_limit_is_kept_and_told() -> None:
    known = somebody(steering_rate_limit_radps=2.0)
    block = driver(parameters=known)
    angles = answer_to(block, seen(y_m=5.0), 0.5)
    assert np.abs(np.diff(angles)).max() == pytest.approx(2.0 * TIMESTEP_S)
    assert command_of(block, seen(y_m=5.0)).saturated


def test_the_lock_is_kept() -> None:
    assert answer_to(driver(), seen(y_m=500.0), 3.0)[-1] == pytest.approx(-LOCK_RAD)


@pytest.mark.parametrize("speed_mps", [8.0, 22.0, 33.0])
def test_an_offset_is_steered_away_without_end_oscillation(speed_mps: float) -> None:
    x = np.arange(0.0, 500.0, 5.0)
    beside = Path.through(x, 3.0 * np.clip((x - 20.0) / 40.0, 0.0, 1.0))
    rows = drive(beside, speed_mps, 200.0 / speed_mps)
    assert rows[-1, 1] == pytest.approx(3.0, abs=0.05)
    assert np.abs(rows[-1000:, 2]).max() < 0.02


def test_a_circle_is_followed() -> None:
    angle = np.linspace(0.0, 2.0, 100)
    circle = Path.through(100.0 * np.sin(angle), 100.0 * (1.0 - np.cos(angle)))
    x, y, _ = drive(circle, 15.0, 10.0)[-1]
    assert math.hypot(x, y - 100.0) == pytest.approx(100.0, abs=0.3)


def test_almost_at_rest_he_holds_the_wheel() -> None:
    block = driver()
    answer_to(block, seen(y_m=1.0), 1.0)
    # What he has decided before still comes.
    held = answer_to(block, seen(y_m=-3.0, speed_mps=1.0), 1.2)
    assert held[-1] == pytest.approx(held[-500], rel=1e-2)
    assert held[-1] < 0.0


def test_a_lane_change_of_a_tenth_of_g_is_followed_without_cutting_corners() -> None:
    x = np.arange(0.0, 300.0, 2.0)
    s = np.clip((x - 60.0) / 60.0, 0.0, 1.0)
    lane_change = Path.through(x, 3.5 * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5))
    for preview_s in (1.2, 2.5):
        rows = drive(lane_change, 13.0, 16.0, somebody(preview_s=preview_s))
        off = np.interp(rows[:, 0], lane_change.x_m, lane_change.y_m) - rows[:, 1]
        assert np.abs(off).max() < 0.1


def test_gains_of_the_state_are_those_of_the_problem_with_the_waiting_decisions_as_states() -> None:
    known = somebody(reaction_delay_s=0.03)
    found = steering_gains(22.0, matrices, known, RATIO)
    car, steered = matrices(22.0)
    system = np.zeros((6, 6))
    system[:2, :2], system[:2, 4] = car, steered[:, 0] / RATIO
    system[2, 0], system[3, 1:3] = 1.0, 22.0
    system[4, 4], system[4, 5] = -1.0 / known.neuromuscular_lag_s, 1.0 / known.neuromuscular_lag_s
    period = expm(system * PREVIEW_INTERVAL_S)
    a, b = np.zeros((8, 8)), np.zeros((8, 1))
    a[:5, :5], a[:5, 7] = period[:5, :5], period[:5, 5]
    a[6, 5] = a[7, 6] = b[5, 0] = 1.0
    share = period[4, 5] / PREVIEW_INTERVAL_S
    errors = np.zeros((3, 8))
    errors[0, 3] = 1.0
    errors[1, 1:3] = known.return_time_s * 22.0
    errors[2, 4], errors[2, 7] = (value * share / known.steering_rate_per_metre_radps for value in (-1.0, 1.0))
    cost, gain = np.eye(8), np.zeros((1, 8))
    for _ in range(3000):
        gain = np.linalg.solve(b.T @ cost @ b, b.T @ cost @ a)
        cost = errors.T @ errors + a.T @ cost @ (a - b @ gain)
    wanted = found.per_yaw_rate_s, found.per_sideslip, found.per_angle, *found.per_waiting
    assert -gain[0, [0, 1, 4, 5, 6, 7]] == pytest.approx(np.array(wanted), rel=1e-4)
    # A path that is moved aside or turned together with the car.
    assert gain[0, 3] == pytest.approx(found.per_path_radpm.sum(), rel=1e-4)
    looks = np.arange(len(found.per_path_radpm))
    assert gain[0, 2] == pytest.approx(22.0 * PREVIEW_INTERVAL_S * (found.per_path_radpm @ looks), rel=1e-4)


def test_gains_of_the_path_fade_with_the_distance_and_leave_nothing_to_the_road_behind() -> None:
    gains = np.abs(steering_gains(22.0, matrices, somebody(preview_s=6.0), RATIO).per_path_radpm)
    # What is decided now moves the car after the delay of 20 looks.
    assert not gains[:21].any()
    assert gains[21] > 0.0
    assert gains[300:].max() < 0.01 * gains.max()


def test_a_driver_of_one_point_has_all_gain_there_and_corrects_an_offset_as_strongly() -> None:
    many, one = (
        steering_gains(22.0, matrices, replace(somebody(), preview_points=points), RATIO) for points in ("all", "one")
    )
    assert np.count_nonzero(one.per_path_radpm) == 1
    assert one.per_path_radpm[-1] == pytest.approx(many.per_path_radpm.sum())
    assert one.per_yaw_rate_s == many.per_yaw_rate_s
