"""Metrics of runs along a path, from signals with known answers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis.metrics import metrics
from activesteer.analysis.path_following import as_far_as_driven, path_following_metrics
from activesteer.errors import RecordingError
from tests.raising import raises
from tests.unit.analysis.synthetic import SLALOM_CONES, SPEED_MPS, along_path, offset_track, slalom

SINE_RMS = 1.0 / math.sqrt(2.0)


@pytest.mark.parametrize("kind", ["lane_change", "slalom", "follow_path"])
def test_each_kind_along_a_path_gets_these_metrics(kind):
    run = along_path(kind=kind)
    assert metrics(run) == pytest.approx(path_following_metrics(run), nan_ok=True)


def test_gates_and_the_three_seconds_after_them_are_apart():
    values = metrics(along_path(yaw_rate=0.2, sideslip=0.05, after=0.1))
    assert values["yaw_rate_gates_rms_radps"] == pytest.approx(0.2 * SINE_RMS, rel=0.02)
    assert values["yaw_rate_after_gates_rms_radps"] == pytest.approx(0.02 * SINE_RMS, rel=1e-3)
    assert values["sideslip_after_gates_rms_rad"] == pytest.approx(0.005 * SINE_RMS, rel=1e-3)
    assert values["yaw_rate_peak_abs_radps"] == pytest.approx(0.2, rel=1e-3)


def test_what_comes_later_than_three_seconds_after_the_gates_does_not_count():
    gate_s = 155.0 / SPEED_MPS

    def yaw_rate(time_s):
        return np.select([time_s < gate_s + 2.0, time_s < gate_s + 3.0], [0.1, 0.4], 5.0)

    values = metrics(along_path(yaw_rate=yaw_rate))
    assert values["yaw_rate_after_gates_rms_radps"] == pytest.approx(math.sqrt(0.02 / 3.0 + 0.16 / 3.0), rel=1e-3)


def test_the_window_begins_with_the_front_axle_at_the_last_gate():
    begin_s = 155.0 / SPEED_MPS

    def yaw_rate(time_s):
        return np.where(time_s < begin_s - 1e-6, 5.0, 0.1)

    assert metrics(along_path(yaw_rate=yaw_rate))["yaw_rate_after_gates_rms_radps"] == pytest.approx(0.1)


def test_a_car_that_never_gets_to_the_last_gate_has_no_such_values():
    values = path_following_metrics(along_path(stops_m=120.0))
    for name in ("yaw_rate_gates_rms_radps", "yaw_rate_after_gates_rms_radps", "yaw_rate_lag_s"):
        assert math.isnan(values[name])


def test_a_recording_that_ends_too_early_has_no_time_after_the_gates():
    values = path_following_metrics(along_path(duration_s=10.0))
    assert math.isnan(values["yaw_rate_after_gates_rms_radps"])
    assert not math.isnan(values["yaw_rate_gates_rms_radps"])


def test_a_path_without_gates_has_no_values_of_gates():
    values = metrics(along_path(last_gate_m=None, lanes=(), kind="follow_path"))
    assert not [name for name in values if "gates" in name or "lane" in name or "cone" in name]
    assert values["yaw_rate_lag_s"] == pytest.approx(0.1, abs=1e-3)


@pytest.mark.parametrize("lead_s", [0.05, 0.123, 0.3])
def test_lags_are_those_behind_the_steering_wheel(lead_s):
    values = metrics(along_path(steering_lead_s=lead_s))
    assert values["yaw_rate_lag_s"] == pytest.approx(lead_s, abs=2e-3)
    assert values["ay_lag_s"] == pytest.approx(lead_s + 0.05, abs=2e-3)


def test_a_yaw_rate_ahead_of_the_wheel_has_no_lag():
    assert math.isnan(metrics(along_path(steering_lead_s=-0.1))["yaw_rate_lag_s"])


def test_steering_effort_of_a_sine():
    values = metrics(along_path(steering_rad=2.0))
    assert values["steering_wheel_peak_abs_rad"] == pytest.approx(2.0, rel=1e-3)
    assert values["steering_wheel_rms_rad"] == pytest.approx(2.0 * SINE_RMS, rel=1e-3)
    assert values["steering_wheel_rate_peak_radps"] == pytest.approx(4.0 * math.pi, rel=1e-3)
    assert values["steering_wheel_rate_rms_radps"] == pytest.approx(4.0 * math.pi * SINE_RMS, rel=1e-3)


def test_deviation_is_that_of_the_front_axle_from_the_path():
    values = metrics(along_path(lambda x: np.full_like(x, -0.4), path=np.zeros_like))
    assert values["track_deviation_max_m"] == pytest.approx(0.4)
    assert values["track_deviation_rms_m"] == pytest.approx(0.4)


def test_friction_utilisation_and_speed_loss():
    values = metrics(along_path(friction_utilisation=0.8))
    assert values["friction_utilisation_max"] == pytest.approx(0.8)
    assert values["friction_utilisation_mean"] == pytest.approx(0.25 * (0.8 + 3.0 * 0.4))
    assert values["speed_loss_mps"] == pytest.approx(1.0)


@pytest.mark.parametrize(("share", "inside"), [(1.0, 1.0), (1.5, 0.0)])
def test_lanes_are_kept_or_not(share, inside):
    values = metrics(along_path(lambda x: share * offset_track(x), path=offset_track))
    assert values["stays_in_lanes"] == inside
    assert (values["lane_overstep_m"] > 0.0) is (inside == 0.0)


def test_cones_that_are_hit_are_counted():
    cones = ((60.0, 1.75), (110.0, 2.1), (60.0, 8.0))
    assert metrics(along_path(cones=cones))["cones_hit"] == 2.0


def test_slalom_amplitude_is_that_of_the_track_between_first_and_last_cone():
    values = metrics(slalom(1.3))
    assert values["track_amplitude_m"] == pytest.approx(1.3, rel=1e-3)
    assert values["cones_hit"] == 0.0
    assert values["cones_missed"] == 0.0


def test_swinging_out_after_the_last_cone_is_no_amplitude():
    run = slalom(1.3)
    x = run["front_axle_x_m"]
    run.channels["front_axle_y_m"] = np.where(x > SLALOM_CONES[-1][0] + 1.0, 9.0, run["front_axle_y_m"])
    assert metrics(run)["track_amplitude_m"] == pytest.approx(1.3, rel=1e-3)


def test_cones_on_the_wrong_side_or_not_reached_are_missed():
    run = slalom(1.3)
    run.channels["front_axle_y_m"] = -run["front_axle_y_m"]
    assert metrics(run)["cones_missed"] == 5.0
    assert metrics(slalom(1.3, stops_m=90.0))["cones_missed"] == 3.0


def test_of_a_drive_that_ended_early_only_the_cones_that_were_reached_are_judged():
    run = slalom(1.3, stops_m=90.0)
    values = metrics(run)
    assert as_far_as_driven(run, values).keys() == values.keys() - {"cones_missed", "cone_distance_mean_m"}
    run.channels["front_axle_y_m"] = -run["front_axle_y_m"]
    assert as_far_as_driven(run, metrics(run))["cones_missed"] == 2.0
    whole = metrics(slalom(1.3))
    assert as_far_as_driven(slalom(1.3), whole) == whole


def test_a_small_amplitude_hits_the_cones():
    values = metrics(slalom(0.5))
    assert values["cones_hit"] == 5.0
    assert values["cone_distance_mean_m"] < 0.0


def test_a_missing_channel_is_an_error():
    run = along_path()
    del run.channels["fl_friction_utilisation"]
    with raises(RecordingError, value="fl_friction_utilisation"):
        metrics(run)
