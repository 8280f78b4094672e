"""FMVSS 126: times of the steering, ratios from its completion, displacement from its beginning."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.metrics import metrics
from activesteer.analysis.sine_with_dwell import integrated_displacement, marks, steering
from activesteer.errors import RecordingError
from tests.raising import raises
from tests.unit.analysis.synthetic import COMPLETION_S, REVERSAL_S, SINE_BEGIN_S, SyntheticRun, sine_with_dwell

FILTER_S = 0.02
"""By how much the 10 Hz filter may move an instant at a corner of the steering [s]."""


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_times_of_the_steering_are_found(side):
    times = steering(sine_with_dwell(side=side))
    assert times.side == side
    assert times.begin_s == pytest.approx(SINE_BEGIN_S, abs=FILTER_S)
    # Between the halves there is no corner, so the filter moves nothing.
    assert times.reversal_s == pytest.approx(REVERSAL_S, abs=1e-4)
    assert times.completion_s == pytest.approx(COMPLETION_S, abs=FILTER_S)


@pytest.mark.parametrize("creep_s", [0.1, 0.3, 3.0])
def test_a_wheel_that_creeps_to_the_centre_does_not_put_the_completion_off(creep_s):
    assert steering(sine_with_dwell(creep_s=creep_s)).completion_s == pytest.approx(COMPLETION_S, abs=FILTER_S)


@pytest.mark.parametrize("creep_s", [0.0, 3.0])
def test_times_lie_between_the_samples(creep_s):
    fine = sine_with_dwell(creep_s=creep_s)
    coarse = SyntheticRun(fine.time_s[::10], {name: values[::10] for name, values in fine.channels.items()})
    found, expected = steering(coarse), steering(fine)
    assert found.begin_s == pytest.approx(expected.begin_s, abs=1e-3)
    assert found.reversal_s == pytest.approx(expected.reversal_s, abs=1e-4)
    assert found.completion_s == pytest.approx(expected.completion_s, abs=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_car_that_does_not_turn_back_has_no_peak_after_the_reversal(side):
    run = sine_with_dwell(side=side)
    run.channels["yaw_rate_radps"] = side * np.interp(run.time_s, [SINE_BEGIN_S, 1.0, 6.0], [0.0, 0.5, 0.2])
    values = metrics(run)
    for name in ("yaw_rate_reversal_peak_radps", "yaw_rate_reversal_peak_time_s", "yaw_rate_after_1000ms_share"):
        assert math.isnan(values[name])


def test_the_final_heading_counts_from_the_first_one_with_all_turns():
    run = sine_with_dwell()
    run.channels["yaw_rad"] = np.interp(run.time_s, [0.0, 6.0], [0.3, -8.0])
    assert metrics(run)["heading_end_rad"] == pytest.approx(-8.3)


def test_begin_is_where_the_wheel_passes_five_degrees():
    slow = sine_with_dwell(amplitude_rad=math.radians(20.0))
    # A sine of 20 deg and 0.7 Hz passes 5 deg after 57 ms.
    passed_s = SINE_BEGIN_S + math.asin(0.25) / (2.0 * math.pi * 0.7)
    assert steering(slow).begin_s == pytest.approx(passed_s, abs=0.002)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_ratios_count_from_the_completion_of_steer(side):
    values = metrics(sine_with_dwell(side=side, after_1000ms=0.30, after_1750ms=-0.10))
    assert values["yaw_rate_after_1000ms_share"] == pytest.approx(0.30, abs=0.015)
    assert values["yaw_rate_after_1750ms_share"] == pytest.approx(-0.10, abs=0.015)


def test_counting_from_the_beginning_would_give_another_ratio():
    """A common mistake: 1.00 s after the beginning of steer the car is still in the first half or the dwell."""
    run = sine_with_dwell(after_1000ms=0.30)
    mistaken = np.interp(SINE_BEGIN_S + 1.0, run.time_s, run["yaw_rate_radps"])
    peak = np.abs(run["yaw_rate_radps"]).max()
    assert abs(abs(mistaken) / peak - 0.30) > 0.1
    assert metrics(run)["yaw_rate_after_1000ms_share"] == pytest.approx(0.30, abs=0.015)


def test_peak_is_the_first_after_the_reversal_and_not_a_larger_later_one():
    run = sine_with_dwell(peak_radps=0.5)
    late = np.exp(-((run.time_s - 2.3) ** 2) / 0.005)
    run.channels["yaw_rate_radps"] = run["yaw_rate_radps"] - 0.4 * late
    values = metrics(run)
    assert values["yaw_rate_reversal_peak_radps"] == pytest.approx(-0.5, rel=0.02)
    assert values["yaw_rate_reversal_peak_time_s"] < 1.7
    assert values["yaw_rate_peak_abs_radps"] > 0.8


def test_the_peak_of_the_first_half_is_not_taken():
    run = sine_with_dwell(peak_radps=0.5)
    first = np.exp(-((run.time_s - 0.85) ** 2) / 0.01)
    run.channels["yaw_rate_radps"] = run["yaw_rate_radps"] + 2.0 * first
    assert metrics(run)["yaw_rate_reversal_peak_radps"] == pytest.approx(-0.5, rel=0.02)


def test_a_kick_before_the_reversal_is_not_taken():
    run = sine_with_dwell(peak_radps=0.5)
    kick = np.exp(-((run.time_s - 0.9) ** 2) / 0.01)
    run.channels["yaw_rate_radps"] = run["yaw_rate_radps"] - 0.5 * kick
    assert run["yaw_rate_radps"][900] < -0.1
    assert metrics(run)["yaw_rate_reversal_peak_radps"] == pytest.approx(-0.5, rel=0.02)


def test_a_car_that_spins_ever_faster_has_its_largest_yaw_rate_as_peak():
    run = sine_with_dwell()
    run.channels["yaw_rate_radps"] = -np.maximum(run.time_s - 1.0, 0.0)
    values = metrics(run)
    assert values["yaw_rate_reversal_peak_radps"] == pytest.approx(-5.0, rel=0.01)
    assert values["yaw_rate_after_1000ms_share"] == pytest.approx((COMPLETION_S + 0.016) / 5.0, rel=0.01)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_displacement_is_taken_after_the_beginning_across_the_heading(side):
    run = sine_with_dwell(side=side, ay_mps2=4.0)
    # Half of a t^2, between the beginning (5 deg, a few ms after the first movement) and 1.07 s later.
    begin_s = steering(run).begin_s - SINE_BEGIN_S
    expected = 2.0 * ((begin_s + 1.07) ** 2 - begin_s**2)
    assert metrics(run)["lateral_displacement_m"] == pytest.approx(expected, rel=1e-3)
    angle = 0.7
    x, y = run["x_m"], run["y_m"]
    run.channels |= {
        "x_m": math.cos(angle) * x - math.sin(angle) * y,
        "y_m": math.sin(angle) * x + math.cos(angle) * y,
        "yaw_rad": np.full_like(x, angle),
    }
    assert metrics(run)["lateral_displacement_m"] == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_integrated_displacement_is_that_of_a_constant_acceleration(side):
    run = sine_with_dwell(side=side, ay_mps2=4.0)
    # The filter spreads the step over 50 ms; what it moves before the beginning of steer is lost to both integrals.
    assert metrics(run)["lateral_displacement_by_ay_m"] == pytest.approx(0.5 * 4.0 * 1.07**2, abs=4.0 * 0.01 * 1.07)


def test_integral_of_a_sine_is_known():
    time_s, radps = np.arange(3000) * 1e-3, 2.0 * math.pi
    # s'' = sin(w t) from rest: s = t / w - sin(w t) / w^2.
    expected = 1.07 / radps - math.sin(radps * 1.07) / radps**2
    found = integrated_displacement(time_s, np.sin(radps * (time_s - 0.5)), 0.5)
    assert found == pytest.approx(expected, rel=1e-5)
    assert math.isnan(integrated_displacement(time_s, time_s, 2.0))


def test_offsets_of_the_sensors_are_taken_off():
    run, late = sine_with_dwell(), sine_with_dwell()
    late.channels["steering_wheel_rad"] = run["steering_wheel_rad"] + math.radians(3.0)
    late.channels["yaw_rate_radps"] = run["yaw_rate_radps"] + 0.05
    late.channels["ay_mps2"] = run["ay_mps2"] - 0.4
    found, true = metrics(late), metrics(run)
    for name in ("yaw_rate_after_1000ms_share", "lateral_displacement_by_ay_m", "steer_begin_time_s"):
        assert found[name] == pytest.approx(true[name], abs=1e-9)


def test_a_run_that_ends_early_has_no_ratio():
    values = metrics(sine_with_dwell(duration_s=COMPLETION_S + 1.4))
    assert values["yaw_rate_after_1000ms_share"] == pytest.approx(0.1, abs=0.015)
    assert math.isnan(values["yaw_rate_after_1750ms_share"])


def changed(steering_wheel) -> SyntheticRun:
    run = sine_with_dwell()
    run.channels["steering_wheel_rad"] = steering_wheel(run["steering_wheel_rad"])
    return run


@pytest.mark.parametrize(
    ("change", "angle_rad"),
    [
        (lambda angle: 0.01 * angle, 0.025),  # the largest
        (np.abs, 2.5),  # to one side only
        (lambda angle: angle + 1.0, 1.0),  # turned in the first sample
        (lambda angle: np.where(np.arange(len(angle)) > 1900, angle[1900], angle), 2.5),  # not completed
    ],
)
def test_what_is_no_sine_with_dwell_is_refused(change, angle_rad):
    with raises(RecordingError, value=pytest.approx(angle_rad, rel=0.02)):
        metrics(changed(change))


@pytest.mark.parametrize(("start_s", "marked"), [(2.0, [(2.0, "brake")]), (0.0, []), (9.0, [])])
def test_the_beginning_of_braking_is_marked_but_no_pedal_that_is_held_from_the_start(start_s, marked):
    time_s = np.arange(0.0, 5.0, 0.5)
    run = SyntheticRun(time_s, {"brake_pedal": np.where(time_s >= start_s, 0.4, 0.0)}, "brake_in_turn")
    run.metadata["maneuver"]["brake"] = {"pedal": 0.4}
    assert marks(run) == marked
