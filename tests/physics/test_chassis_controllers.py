"""Controllers beyond the paper's in the car, with production sensors."""

from __future__ import annotations

import math

import numpy as np
import pytest

import activesteer
from activesteer.controllers.lqr import Lqr

PRODUCTION = {"sensors.preset": "production", "sensors.seed": 1}


@pytest.fixture(scope="module")
def steps():
    return {
        name: activesteer.simulate("step_steer", name, overrides={**PRODUCTION}).metrics
        for name in ("none", "lqr", "integrated")
    }


@pytest.mark.parametrize("name", ["lqr", "esc", "integrated"])
def test_car_is_kept_in_the_sine_with_dwell_in_which_it_is_lost_without_control(name):
    found = activesteer.simulate("sine_with_dwell", name, overrides=PRODUCTION).metrics
    # FMVSS 126: 35 % after 1.00 s, 20 % after 1.75 s, 1.83 m to the side.
    assert abs(found["yaw_rate_after_1000ms_share"]) < 0.35
    assert abs(found["yaw_rate_after_1750ms_share"]) < 0.2
    assert found["lateral_displacement_m"] > 1.83
    # Beyond what both systems of the paper reach, 5.3 and 10 deg; without control 50 deg.
    assert found["sideslip_peak_abs_rad"] < math.radians(5.0)


@pytest.mark.parametrize("name", ["lqr", "integrated"])
def test_step_is_answered_no_later_than_without_control_and_without_overshoot(steps, name):
    free, found = steps["none"], steps[name]
    for answer in ("yaw_rate", "ay"):
        assert found[f"{answer}_response_time_s"] <= free[f"{answer}_response_time_s"]
    assert found["yaw_rate_overshoot"] <= 0.03
    assert abs(found["sideslip_peak_rad"]) < abs(free["sideslip_peak_rad"])


@pytest.mark.parametrize("speed_kmh", [30, 40])
def test_step_at_low_speed_is_answered_no_later_than_without_control(speed_kmh):
    keys = {"speed_kmh": speed_kmh, "steer.lateral_acceleration_mps2": 1.5}
    free_s, found_s = (
        activesteer.simulate("step_steer", name, overrides=keys).metrics["yaw_rate_response_time_s"]
        for name in ("none", "lqr")
    )
    # Within one call of the controller. Without the limit of the lag, the answer is 40 and 13 ms later.
    assert found_s <= free_s + Lqr.interval_s


def test_rear_wheels_that_stick_in_mid_manoeuvre_leave_no_yaw_rate():
    fault = {"fault": [{"part": "rear", "kind": "stuck", "start_s": 1.45}]}
    left = {
        name: activesteer.simulate("sine_with_dwell", name, overrides={**PRODUCTION, **fault}).metrics
        for name in ("lqr", "integrated")
    }
    assert abs(left["integrated"]["yaw_rate_after_1750ms_share"]) < 0.02
    # `lqr` does not notice the fault; the front wheels carry what its rear wheels do not.
    assert abs(left["lqr"]["yaw_rate_after_1750ms_share"]) < 0.05


def test_braking_in_a_turn_does_not_make_the_estimator_steer_the_car_in():
    run = activesteer.simulate("brake_in_turn", "lqr", overrides=PRODUCTION)
    fast = run["speed_mps"] > 5.0
    error_rad = (run["estimated_sideslip_rad"] - run["sideslip_rad"])[fast]
    # A car that slides by a degree is what the controller must not answer to.
    assert abs(error_rad).max() < math.radians(1.0)


@pytest.mark.parametrize("seeds", [(2,), pytest.param((1, 2, 3, 4), marks=pytest.mark.slow)])
def test_steering_against_the_brakes_on_split_friction_shortens_the_way_without_leaving_the_line(seeds):
    """Mean over some seeds: with anti-lock brakes the stopping distance varies by 0.5 m with the sensor noise."""
    ways_m = np.empty((len(seeds), 2))
    for seed, way_m in zip(seeds, ways_m, strict=True):
        esc, integrated = (
            activesteer.simulate(
                "split_mu_braking", name, overrides=PRODUCTION | {"sensors.seed": seed, "duration_s": 7.0}
            )
            for name in ("esc", "integrated")
        )
        way_m[:] = esc.metrics["stopping_distance_m"], integrated.metrics["stopping_distance_m"]
        assert integrated.metrics["lateral_deviation_max_m"] <= esc.metrics["lateral_deviation_max_m"]
        later = (integrated.time_s > 1.0) & (integrated["speed_mps"] > 5.0)
        assert integrated["rl_brake_pressure_Pa"][later].mean() > 1.3 * integrated["rr_brake_pressure_Pa"][later].mean()
        assert not esc["side_difference_Pa"].any()
    without_m, with_m = ways_m.mean(0)
    # As cars with such systems do against those with an anti-lock system alone: 6 % and more.
    assert with_m < 0.94 * without_m
