"""Left and right are equal: nothing drifts, and a mirrored input has a mirrored response."""

from __future__ import annotations

import numpy as np
import pytest

from tests.physics.runs import corners, run, step_steer

LEFT_TO_RIGHT = [1, 0, 3, 2]
MIRRORED = (
    "yaw_rate_radps", "ay_mps2", "roll_rad", "sideslip_rad", "y_m", "yaw_rad", "vy_mps", "front_axle_y_m",
    "steering_wheel_rad", "front_steer_rad", "rear_steer_rad", "superposition_rad", "yaw_rate_desired_radps",
)  # fmt: skip
"""Channels that change their sign."""
KEPT = ("x_m", "vx_mps", "ax_mps2", "pitch_rad", "z_m", "speed_mps", "drive_torque_demand_Nm")
"""Channels that stay."""


def test_straight_ahead_the_car_does_not_drift() -> None:
    recording = run("straight_line")
    assert recording.time_s[-1] == pytest.approx(10.0, abs=0.002)
    np.testing.assert_allclose(recording["speed_mps"], 80.0 / 3.6, rtol=0.01)
    assert np.abs(recording["y_m"]).max() < 1e-3
    assert np.abs(recording["yaw_rad"]).max() < 1e-6


@pytest.mark.parametrize("controller", ["none", "ars", "afs"])
def test_mirrored_steering_gives_the_mirrored_response(controller: str) -> None:
    left, right = step_steer(controller), step_steer(controller, side=-1.0)
    worst = {}
    for name in MIRRORED:
        worst[name] = np.abs(left[name] + right[name]).max() / max(np.abs(left[name]).max(), 1e-6)
    for name in KEPT:
        # The speed is held, so that longitudinal acceleration is small; its scale is that of acceleration as a whole.
        scale = left["ay_mps2"] if name == "ax_mps2" else left[name]
        worst[name] = np.abs(left[name] - right[name]).max() / np.abs(scale).max()
    for name, sign in (("tyre_fz_N", 1.0), ("tyre_fx_N", 1.0), ("tyre_fy_N", -1.0), ("travel_m", 1.0)):
        there, here = corners(left, name), corners(right, name)[:, LEFT_TO_RIGHT]
        worst[name] = np.abs(there - sign * here).max() / np.abs(there).max()
    too_large = {name: error for name, error in worst.items() if not error < 1e-9}
    assert not too_large
