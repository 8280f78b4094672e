"""The loop of driver and car: convergence to a path, and human-like driving.

The criteria of `typical` are those of docs/driver.md, which stood before his numbers.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer import simulate
from activesteer.analysis.metrics import metrics
from activesteer.scenario import resolve
from activesteer.studies.linear.driver_loop import LoopAtSpeed, damping_of, driver_loops, small_step

ALWAYS_ACTIVE = {
    "none": {},
    "ars": {
        "controllers.ars.corrector.deadband_start_degps": 0.0,
        "controllers.ars.corrector.deadband_end_degps": 0.001,
    },
}
"""Controller -> its corrector without a tolerance band."""
FRICTIONLESS = {"vehicle.friction.rack_N": 0.0}


@pytest.fixture(scope="module", params=[100.0, pytest.param(80.0, marks=pytest.mark.slow)])
def loops(request: pytest.FixtureRequest) -> list[LoopAtSpeed]:
    return driver_loops(speeds_kmh=[request.param])


def test_typical_driver_and_car_are_damped_by_a_quarter(loops):
    for loop in loops:
        assert loop.loop.damping()[0] >= 0.25
        assert loop.damping_in_run >= 0.25
        assert loop.step_difference_m < 0.03  # of 0.5 m: the friction of the rack leaves 1 or 2 cm
    assert len(loops) == 3


def test_typical_driver_crosses_over_where_humans_do_and_with_their_margin(loops):
    for loop in loops:
        if loop.controller == "none":
            crossover_radps, margin_rad = loop.loop.crossover()
            assert 2.0 <= crossover_radps <= 4.0
            assert margin_rad >= math.radians(30.0)


def test_typical_driver_takes_the_lane_change_as_a_human_does():
    run = simulate("double_lane_change")
    found = metrics(run)
    assert found["stays_in_lanes"] == 1.0
    assert found["cones_hit"] == 0.0
    fastest_radps = np.abs(np.diff(run["steering_wheel_rad"])).max() / np.diff(run.time_s).mean()
    assert fastest_radps < resolve("double_lane_change").driver.parameters.steering_rate_limit_radps


def test_typical_driver_follows_a_path_at_a_tenth_of_g():
    run = simulate("double_lane_change", overrides={"speed_kmh": 40.0, "duration_s": 14.5})
    assert metrics(run)["track_deviation_max_m"] <= 0.15


@pytest.mark.slow
def test_who_drives_better_gets_through_the_lane_change_faster():
    """Number of speeds from 60 to 110 km/h at which the car stays in the lanes."""
    novice, typical, expert = (
        sum(
            simulate(
                "double_lane_change", driver=driver, overrides={"speed_kmh": speed_kmh, "duration_s": 13.3}
            ).metrics["stays_in_lanes"]
            for speed_kmh in np.arange(60.0, 111.0, 5.0)
        )
        for driver in ("novice", "typical", "expert")
    )
    assert expert >= typical >= novice >= 1.0


@pytest.mark.parametrize("controller", ["none", pytest.param("ars", marks=pytest.mark.slow)])
def test_linear_loop_is_damped_as_the_car_is_in_a_run(controller):
    # Without the friction of the rack, which no linear car can have, and without a tolerance band. A driver whom
    # nothing troubles but the offset itself swings; the typical one comes to the path without crossing it.
    swinging = {"driver.return_time_s": 0.0, "driver.steering_rate_per_metre_radps": 20.0}
    (loop,) = driver_loops(
        controllers=[controller], speeds_kmh=[100.0], overrides=FRICTIONLESS | ALWAYS_ACTIVE[controller] | swinging
    )
    linear, natural_radps = loop.loop.damping()
    assert loop.damping_in_run == pytest.approx(linear, abs=0.05)
    assert loop.step_difference_m < 0.01
    assert 0.3 < linear < 0.5
    assert 3.0 < natural_radps < 6.0


def test_drivers_differ_as_their_names_say():
    novice, typical, expert = (
        damping_of(run.time_s, run["y_m"])[0]
        for run in (small_step(100.0 / 3.6, driver=driver) for driver in ("novice", "typical", "expert"))
    )
    assert 0.0 < novice < typical <= expert
