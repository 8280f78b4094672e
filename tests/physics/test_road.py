"""Effects of varying friction: split braking, patches, and tyres at their limit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer.core.conventions import CORNERS
from activesteer.recording import Recording
from tests.physics.runs import COAST_OR_BRAKE, corners

BRAKE = {"time_s": [0.0, 0.5, 0.6], "pedal": [0.0, 0.0, 0.3]}
FULL_BRAKE = {"time_s": [0.0, 0.5, 0.6], "pedal": [0.0, 0.0, 1.0]}
MAX_USE = 1.08
"""Combined slip and camber let the formula exceed the ellipse of its own peaks by up to 7 % with the compact's tyre."""


def drive(road: dict[str, Any], **keys: Any) -> Recording:
    # Without the anti-lock system, which moves the forces about from one instant to the next.
    return activesteer.simulate({**COAST_OR_BRAKE, "road": road, **keys}, overrides={"brakes.abs": False})


@pytest.mark.parametrize(("slippery", "turn"), [("mu_right", 1.0), ("mu_left", -1.0)])
def test_braking_on_a_split_road_turns_the_car_to_the_grippy_side(slippery: str, turn: float) -> None:
    recording = drive({"mu": 0.9, slippery: 0.3}, brake=BRAKE)
    at = np.searchsorted(recording.time_s, 2.0)
    assert np.degrees(recording["yaw_rad"][at]) * turn > 0.5
    assert recording["y_m"][at] * turn > 0.05
    fx = corners(recording, "tyre_fx_N")[at]
    grippy, other = (fx[[0, 2]].sum(), fx[[1, 3]].sum())
    assert (grippy - other) * turn < -1000.0


def test_braking_on_an_even_road_does_not_turn_the_car() -> None:
    recording = drive({"mu": 0.9, "mu_left": 0.3, "mu_right": 0.3}, brake=BRAKE)
    assert np.abs(np.degrees(recording["yaw_rad"])).max() < 0.05


def test_each_wheel_feels_a_patch_exactly_from_its_start_to_its_end() -> None:
    recording = drive({"mu": 0.9, "patches": [{"start_m": 10.0, "end_m": 25.0, "mu": 0.3}]})
    for corner in CORNERS:
        x = recording[f"{corner}_contact_x_m"]
        expected = np.where((x >= 10.0) & (x < 25.0), 0.3, 0.9)
        np.testing.assert_allclose(recording[f"{corner}_mu"], expected, rtol=1e-6)
    entry = np.argmax(recording["fl_mu"] < 0.5)
    assert recording["rl_contact_x_m"][entry] == pytest.approx(10.0 - 2.637, abs=0.05)


def test_a_patch_takes_the_brake_force_at_once_and_gives_it_back() -> None:
    recording = drive({"mu": 0.9, "patches": [{"start_m": 25.0, "end_m": 35.0, "mu": 0.1}]}, brake=BRAKE)
    fx, mu = recording["fl_tyre_fx_N"], recording["fl_mu"]
    enters, leaves = np.argmax(mu < 0.5), len(mu) - np.argmax(mu[::-1] < 0.5)
    assert fx[enters - 1] < -1500.0
    assert fx[enters + 2] > -0.12 * recording["fl_tyre_fz_N"][enters + 2]
    assert fx[enters:leaves].max() < 0.0
    assert fx[leaves + 200] < -1500.0


def test_patches_of_the_road_s_own_friction_change_nothing() -> None:
    plain = drive({"mu": 0.9}, brake=BRAKE)
    patched = drive({"mu": 0.9, "mu_left": 0.9, "patches": [{"start_m": 1.0, "end_m": 30.0, "mu": 0.9}]}, brake=BRAKE)
    for name in ("x_m", "y_m", "yaw_rate_radps", "fl_tyre_fx_N", "rr_tyre_fy_N", "fr_mu"):
        np.testing.assert_array_equal(patched[name], plain[name])


@pytest.mark.parametrize("mu", [0.9, 0.4])
def test_a_wheel_that_locks_uses_all_its_friction_on_the_way(mu: float) -> None:
    recording = drive({"mu": mu}, brake=FULL_BRAKE)
    use = corners(recording, "friction_utilisation")
    assert np.all(recording["speed_mps"][:600] > 15.0)
    assert use[:500].max() < 0.15
    assert np.all((use.max(axis=0) > 0.98) & (use.max(axis=0) < 1.03))
    # Locked, the force is that of sliding, below the peak.
    sliding = use[1200:1500, :2]
    assert np.all((sliding > 0.6) & (sliding < 0.97))


@pytest.mark.parametrize("mu", [0.9, 0.4])
def test_cornering_beyond_the_limit_uses_the_front_tyres_up(mu: float) -> None:
    steer = {"time_s": [0.0, 0.5, 0.8], "steering_wheel_rad": [0.0, 0.0, 2.4]}
    recording = drive({"mu": mu}, steering=steer, hold_last=True, drive="hold_speed")
    use = corners(recording, "friction_utilisation")
    assert use[-1000:, 1].min() > 0.9
    assert use[:450].max() < 0.2
    assert use.max() < MAX_USE


def test_braking_at_the_limit_of_cornering_keeps_the_resultant_within_the_friction() -> None:
    steer = {"time_s": [0.0, 0.5, 0.8], "steering_wheel_rad": [0.0, 0.0, 2.0]}
    brake = {"time_s": [0.0, 1.0, 1.1], "pedal": [0.0, 0.0, 0.5]}
    recording = drive({"mu": 0.9}, steering=steer, hold_last=True, brake=brake)
    assert 0.98 < corners(recording, "friction_utilisation").max() < MAX_USE
