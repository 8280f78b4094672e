"""The metrics depend on the kind of the manoeuvre."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.analysis import step_response
from activesteer.analysis.metrics import (
    EVALUATIONS,
    KEY_METRICS,
    SEAT_ASIDE_M,
    energy_metrics,
    general_metrics,
    label_of,
    metrics,
    ride_metrics,
    seat_acceleration_mps2,
    speed_note,
    weighted,
    weighting,
)
from activesteer.core.conventions import CORNERS
from activesteer.errors import ParameterError, RecordingError
from activesteer.maneuver import KINDS
from tests.raising import raises
from tests.unit.analysis.synthetic import SyntheticRun, step_steer

TIME_S = np.arange(2001) * 0.001


def wave(kind: str = "open_loop") -> SyntheticRun:
    channels = {
        "yaw_rate_radps": 0.3 * np.sin(2.0 * np.pi * TIME_S),
        "ay_mps2": -5.0 * np.sin(2.0 * np.pi * TIME_S),
        "sideslip_rad": np.zeros_like(TIME_S),
        "roll_rad": np.full_like(TIME_S, -0.02),
        "steering_wheel_rad": -0.7 * np.sin(2.0 * np.pi * TIME_S),
        "speed_mps": np.linspace(20.0, 19.0, TIME_S.size),
    }
    for corner in CORNERS:
        channels |= {f"{corner}_tyre_f{axis}_N": np.zeros_like(TIME_S) for axis in "xy"}
        channels[f"{corner}_tyre_fz_N"] = np.full_like(TIME_S, 4000.0)
        channels[f"{corner}_friction_utilisation"] = np.full_like(TIME_S, 0.5)
    return SyntheticRun(TIME_S, channels, kind)


def test_step_steer_gets_the_metrics_of_iso_7401():
    run = step_steer()
    assert metrics(run) == pytest.approx(step_response.step_response_metrics(run), nan_ok=True)


@pytest.mark.parametrize("kind", ["step_steer", "sine_sweep", "random_steer"])
def test_a_response_at_another_speed_than_demanded_is_noted(kind):
    run = wave(kind)
    run.metadata["maneuver"]["speed_mps"] = 20.0
    for share, said in ((0.0, False), (0.019, False), (-0.019, False), (0.021, True), (-0.021, True)):
        run.channels["speed_mps"] = np.where(TIME_S > 1.0, 20.0 * (1.0 + share), 20.0)
        assert bool(speed_note(run)) is said
    run.metadata["maneuver"]["kind"] = "open_loop"
    assert speed_note(run) == ""


@pytest.mark.parametrize("kind", ["open_loop", "random_steer"])
def test_kinds_without_metrics_of_their_own_get_the_general_ones(kind):
    assert metrics(wave(kind)) == general_metrics(wave(kind))


def test_a_kind_without_an_evaluation_is_an_error():
    with raises(RecordingError, key="maneuver.kind", value="step_stear") as caught:
        metrics(wave("step_stear"))
    assert "'step_steer'" in str(caught.value)


def test_every_kind_of_manoeuvre_has_an_evaluation():
    assert set(EVALUATIONS) == {*KINDS, "measured"}


@pytest.mark.parametrize("kind", EVALUATIONS)
def test_a_kind_has_ten_different_key_metrics(kind):
    # A car that stands has one more, which a car that drives does not have.
    assert len(set(KEY_METRICS[kind])) == len(KEY_METRICS[kind])
    assert len(set(KEY_METRICS[kind]) - {"displacement_at_rest_m"}) == 10


def test_a_car_that_stands_tells_how_far_it_moves():
    run = wave()
    assert "displacement_at_rest_m" not in metrics(run)
    run.channels["speed_mps"] = np.full_like(TIME_S, 0.1)
    # It moves 3 mm back and 4 mm to the side, and half of this back again.
    way = np.interp(TIME_S, [0.0, 1.0, 2.0], [0.0, 1.0, 0.5])
    run.channels |= {"x_m": 7.0 - 0.003 * way, "y_m": -2.0 + 0.004 * way}
    assert metrics(run)["displacement_at_rest_m"] == pytest.approx(0.005)


def test_peaks_and_root_mean_squares_of_a_sine():
    values = metrics(wave())
    assert values["yaw_rate_peak_abs_radps"] == pytest.approx(0.3, rel=1e-6)
    assert values["yaw_rate_rms_radps"] == pytest.approx(0.3 / math.sqrt(2.0), rel=1e-3)
    assert values["ay_peak_abs_mps2"] == pytest.approx(5.0, rel=1e-6)
    assert values["roll_peak_abs_rad"] == pytest.approx(0.02)
    assert values["steering_wheel_peak_abs_rad"] == pytest.approx(0.7, rel=1e-6)
    assert values["speed_end_mps"] == pytest.approx(19.0)


def test_friction_utilisation_is_the_largest_fraction_of_its_friction_that_a_tyre_uses():
    run = wave()
    run.channels["rl_friction_utilisation"] = np.where(TIME_S > 1.0, 0.7, 0.0)
    assert metrics(run)["friction_utilisation_max"] == 0.7


def test_wheels_of_a_side_that_are_lifted_together_count_as_two_wheel_lift():
    run = wave("phases")
    run.channels["fl_tyre_fz_N"] = np.where(TIME_S > 1.0, 0.0, 4000.0)
    run.channels["rl_tyre_fz_N"] = np.where((TIME_S > 0.5) & (TIME_S < 1.2005), 0.0, 4000.0)
    run.channels["rr_tyre_fz_N"] = np.where(TIME_S < 0.3, 0.0, 4000.0)
    values = metrics(run)
    assert values["two_wheel_lift_time_s"] == pytest.approx(0.2, abs=1e-3)
    assert values["wheel_load_min_N"] == 0.0


def test_a_metric_has_the_words_of_its_key_figure_and_others_on_a_path():
    assert label_of("heading_end_rad", ["heading_end_rad"]) != label_of("heading_end_rad", ["track_deviation_max_m"])
    for name in ("heading_end_rad", "track_deviation_max_m", "yaw_rate_peak_abs_radps"):
        label = label_of(name, ["track_deviation_max_m", name])
        assert label[:2].islower(), label


def test_a_recording_without_kind_is_refused():
    run = wave()
    run.metadata["maneuver"] = "step_steer"
    with raises(RecordingError, file="the metadata", key="maneuver"):
        metrics(run)


def test_an_evaluation_that_returns_an_undeclared_metric_is_an_error(monkeypatch):
    monkeypatch.setitem(EVALUATIONS, "open_loop", lambda recording: {"new_idea_s": 1.0})
    with raises(ParameterError, value="new_idea_s"):
        metrics(wave())


def test_the_weighting_has_the_factors_of_iso_2631() -> None:
    # ISO 2631-1:1997, table 3, W_k in thousandths.
    table = {0.5: 418, 1.0: 482, 2.0: 531, 4.0: 967, 6.3: 1054, 8.0: 1036, 16.0: 768, 31.5: 405, 63.0: 186}
    found = np.abs(weighting(np.array(list(table))))
    assert 1000.0 * found == pytest.approx(list(table.values()), abs=1.0)


def test_a_sine_keeps_its_shape_and_its_mean_does_not_count() -> None:
    time = np.arange(0.0, 10.0, 1e-3)
    wave = 3.0 + 2.0 * np.sin(2.0 * math.pi * 4.0 * time)
    assert np.sqrt(np.mean(weighted(wave, 1e-3) ** 2)) == pytest.approx(0.967 * math.sqrt(2.0), rel=1e-3)


SINE_RADPS = 2.0 * math.pi * 4.0
"""A frequency that the weighting leaves nearly as it is."""
LEFT_AHEAD_M = 1.1


def shaken(**channels: np.ndarray) -> SyntheticRun:
    """Return a car of 2.6 m wheelbase, its front axle 1.1 m ahead of its centre of gravity, with some channels."""
    time_s = np.arange(0.0, 10.0, 1e-3)
    zero = np.zeros_like(time_s)
    names = ("az_mps2", "pitch_rate_radps", "roll_rate_radps", "x_m", "y_m", "front_axle_y_m")
    known = dict.fromkeys(names, zero) | {"front_axle_x_m": zero + LEFT_AHEAD_M}
    for corner in CORNERS:
        known |= {f"{corner}_tyre_fz_N": zero + 4000.0, f"{corner}_travel_m": zero}
        known |= {f"{corner}_contact_{axis}_m": zero for axis in "xy"}
    run = SyntheticRun(time_s, known | channels)
    run.metadata["car"] = {"wheelbase_m": 2.6}
    return run


def test_the_seat_is_in_the_middle_of_the_wheelbase_on_the_side_that_is_worse() -> None:
    sine, cosine = (function(SINE_RADPS * np.arange(0.0, 10.0, 1e-3)) for function in (np.sin, np.cos))
    gain = 0.967 * math.sqrt(0.5)
    heave = seat_acceleration_mps2(shaken(az_mps2=2.0 * sine))
    assert heave == pytest.approx(2.0 * gain, rel=2e-3)
    # The middle of the wheelbase is 0.2 m behind the centre of gravity: it rises as the nose falls.
    pitch = 0.1 * SINE_RADPS
    assert seat_acceleration_mps2(shaken(pitch_rate_radps=0.1 * cosine)) == pytest.approx(0.2 * pitch * gain, rel=5e-3)
    together = shaken(az_mps2=2.0 * sine, pitch_rate_radps=-0.1 * cosine)
    assert seat_acceleration_mps2(together) == pytest.approx((2.0 + 0.2 * pitch) * gain, rel=5e-3)
    for side in (1.0, -1.0):
        rolling = shaken(az_mps2=2.0 * sine, roll_rate_radps=-side * 0.1 * cosine)
        expected = (2.0 + SEAT_ASIDE_M * 0.1 * SINE_RADPS) * gain
        assert seat_acceleration_mps2(rolling) == pytest.approx(expected, rel=5e-3)


def test_the_wheel_that_is_worst_counts_on_an_uneven_road() -> None:
    time_s = np.arange(0.0, 10.0, 1e-3)
    run = shaken(
        rl_tyre_fz_N=4000.0 + 1000.0 * np.sin(SINE_RADPS * time_s),
        fr_tyre_fz_N=np.where(time_s < 1.0, 0.0, 4000.0),
        rr_travel_m=0.03 * np.sin(SINE_RADPS * time_s) - 0.05,
    )
    values = ride_metrics(run)
    assert values["suspension_travel_max_m"] == pytest.approx(0.06, rel=1e-3)
    assert values["wheel_lift_share"] == pytest.approx(0.1)
    # A load of 4 kN that is away for a tenth of the time: deviation 0.3 of it, mean 0.9 of it.
    assert values["wheel_load_coefficient_max"] == pytest.approx(0.3 / 0.9, rel=1e-3)
    run.channels["fr_tyre_fz_N"] = np.full_like(time_s, 4000.0)
    assert ride_metrics(run)["wheel_load_coefficient_max"] == pytest.approx(0.25 * math.sqrt(0.5), rel=1e-3)


@pytest.mark.parametrize(
    ("rear", "superposition", "steering_W"),
    [
        # Both hinges of 10 Nm at 0.1 rad/s; the superposition turns the steering wheel 16 times as far as the wheels.
        ({"preset": "hinge"}, {"preset": "servo"}, 2.0 * 10.0 * 0.1 + 2.0 * 16.0 * 0.01),
        ({"preset": "screw_3deg"}, {"preset": "servo"}, 2.0 * 0.5 * 40.0 + 2.0 * 16.0 * 0.01),
        ({"preset": "screw_3deg", "arrangement": "central"}, {"preset": "harmonic"}, 0.7 * 30.0 + 0.2 * 50.0),
        ({"preset": "screw_10deg"}, {"preset": "harmonic"}, 0.7 * 30.0 + 0.2 * 50.0),
    ],
)
def test_energies_are_those_of_battery_brakes_and_steering_actuators(rear, superposition, steering_W) -> None:
    time_s = np.arange(0.0, 4.0005, 0.001)
    # Actuators move for two seconds, and are driven back in the next two: that energy is not regained.
    back = np.where(time_s < 2.0, 1.0, -1.0)
    ones = np.ones_like(time_s)
    channels = {
        "battery_energy_J": 5e4 + 100.0 * time_s, "rear_steer_rad": 0.1 * time_s, "superposition_rad": 0.01 * time_s,
        "superposition_torque_Nm": 2.0 * back,
        "rear_motor_torque_Nm": 0.7 * back, "rear_motor_speed_radps": 30.0 * ones,
        "superposition_motor_torque_Nm": 0.2 * back, "superposition_motor_speed_radps": 50.0 * ones,
    }  # fmt: skip
    for corner in CORNERS:
        channels |= {f"{corner}_brake_torque_Nm": -200.0 * ones, f"{corner}_wheel_speed_radps": 50.0 * ones}
        channels |= {f"{corner}_steer_torque_Nm": 10.0 * back, f"{corner}_motor_torque_Nm": 0.5 * back}
        channels |= {f"{corner}_motor_speed_radps": 40.0 * ones}
    run = SyntheticRun(time_s, channels)
    assert energy_metrics(run) == {}
    run.metadata["vehicle"] = {
        "motors": {"rl": {}}, "steering": {"ratio": 16.0}, "rear_actuator": rear,
        "superposition_actuator": superposition,
    }  # fmt: skip
    values = energy_metrics(run)
    assert values["battery_energy_J"] == pytest.approx(400.0)
    assert values["brake_energy_J"] == pytest.approx(4.0 * 200.0 * 50.0 * 4.0, rel=1e-6)
    assert values["steering_energy_J"] == pytest.approx(2.0 * steering_W, rel=2e-3)
