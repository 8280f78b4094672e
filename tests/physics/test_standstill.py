"""Standstill, stopping and driving off: no creep, no chatter, no jump of a force."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.core.conventions import CORNERS, GRAVITY_MPS2
from activesteer.recording import Recording
from tests.physics.runs import car, corners, last, mass_kg, run

FORCES = ("tyre_fx_N", "tyre_fy_N", "tyre_fz_N")


def largest_change_N(recording: Recording, rows: np.ndarray | slice = slice(None)) -> float:
    """Return the largest change of a tyre force from one step to the next."""
    return max(float(np.abs(np.diff(corners(recording, force)[rows], axis=0)).max()) for force in FORCES)


def distance_m(recording: Recording) -> float:
    """Return the largest distance of the centre of gravity from its first position."""
    x, y = recording["x_m"], recording["y_m"]
    return float(np.hypot(x - x[0], y - y[0]).max())


def test_at_rest_the_car_does_not_creep() -> None:
    recording = run("standstill")
    assert recording.time_s[-1] == pytest.approx(10.0, abs=0.002)
    assert distance_m(recording) < 1e-3


def test_at_rest_nothing_chatters() -> None:
    """A force with stick-slip would change by several per cent of the load from step to step."""
    recording = run("standstill")
    assert largest_change_N(recording) < 0.01
    assert np.abs(corners(recording, "wheel_speed_radps")).max() < 1e-4
    assert np.abs(corners(recording, "wheel_speed_radps")[last(recording, 1.0)]).max() < 1e-8


def test_brakes_hold_the_car_on_a_slope() -> None:
    recording = run("hill_hold")
    assert recording.time_s[-1] == pytest.approx(10.0, abs=0.002)
    assert recording.metadata["maneuver"]["road"]["grade"] == 0.15
    assert distance_m(recording) < 5e-3
    assert largest_change_N(recording) < 1.0


def test_on_the_slope_the_tyres_carry_the_downhill_force() -> None:
    recording = run("hill_hold")
    weight_N = mass_kg(car()) * GRAVITY_MPS2
    slope_rad = np.arctan(0.15)
    assert corners(recording, "tyre_fx_N")[-1].sum() == pytest.approx(weight_N * np.sin(slope_rad), rel=1e-3)
    assert corners(recording, "tyre_fz_N")[-1].sum() == pytest.approx(weight_N * np.cos(slope_rad), rel=1e-3)


def test_without_brakes_the_car_rolls_down_the_slope() -> None:
    """The opposite of holding: without brakes nothing may stop the car."""
    recording = run("hill_hold", brake__pedal=(0.0,), duration_s=1.0)
    drag_N = 4 * 1.5 / 0.3 + 0.02 * 1430 * GRAVITY_MPS2
    least_mps2 = GRAVITY_MPS2 * np.sin(np.arctan(0.15)) - drag_N / 1430
    assert recording["ax_mps2"][-200:].mean() < -0.9 * least_mps2


def test_drives_off_and_reaches_its_speed() -> None:
    recording = run("drive_off_and_stop")
    assert recording["speed_mps"][recording.time_s < 1.0].max() < 1e-3
    rolling = (recording.time_s > 6.5) & (recording.time_s < 7.0)
    np.testing.assert_allclose(recording["speed_mps"][rolling], 30.0 / 3.6, rtol=0.05)


@pytest.mark.parametrize("timestep_s", [1e-3, 5e-4])
def test_no_jump_of_a_tyre_force_between_rest_and_rest(timestep_s: float) -> None:
    """A force that builds up takes a bounded time, so what it changes by in a step goes with the step.

    The steepest that the physics offers is the rebound when the car comes to rest with its wheels locked: 0.15 m/s
    between the rim and a carcass of 2e5 N/m are 30 kN/s, 30 N a millisecond. A switched force would be hundreds of
    newtons at any step.
    """
    assert largest_change_N(run("drive_off_and_stop", timestep_s=timestep_s)) < 5e4 * timestep_s


def test_wheels_stop_and_stay_stopped() -> None:
    """The body continues to oscillate on springs and carcasses for a while; the brakes hold the wheels."""
    recording = run("drive_off_and_stop")
    stopped = int(np.flatnonzero(recording["vx_mps"][9000:] <= 0.0)[0]) + 9000
    turned_rad = np.cumsum(corners(recording, "wheel_speed_radps")[stopped + 500 :], axis=0) * 1e-3
    assert np.abs(turned_rad).max() < 5e-3
    end = last(recording, 1.0)
    assert np.abs(corners(recording, "wheel_speed_radps")[end]).max() < 1e-3
    assert np.abs(recording["vx_mps"][end]).max() < 1e-3
    assert np.ptp(recording["x_m"][end]) < 1e-4
    assert largest_change_N(recording, end) < 0.1


def test_braking_wheels_do_not_turn_backwards() -> None:
    recording = run("drive_off_and_stop")
    braking = recording["brake_pedal"] > 0.0
    # What winds up in carcass and pads while braking turns the wheel back by some mrad when the car stands.
    assert corners(recording, "wheel_speed_radps")[braking].min() > -1.0
    for corner in CORNERS:
        angle_rad = np.cumsum(recording[f"{corner}_wheel_speed_radps"][braking]) * 1e-3
        assert angle_rad.max() - angle_rad[-1] < 0.1


def test_turning_the_steering_wheel_at_rest_leaves_the_car_where_it_is() -> None:
    recording = run(
        "standstill",
        steering__time_s=(0.5, 1.5, 3.0),
        steering__steering_wheel_deg=(0.0, 180.0, 180.0),
        hold_last=True,
        duration_s=5.0,
    )
    assert distance_m(recording) < 0.05
    end = last(recording, 1.0)
    assert np.ptp(recording["x_m"][end]) < 1e-4
    assert largest_change_N(recording) < 30.0
    assert largest_change_N(recording, end) < 0.1
