"""What each standard has driven, and its evaluation of a car whose properties are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.standards import braking, iso4138, iso7401, iso13674
from tests.unit.standards.linear_car import EG, LIMIT_MPS2, REAR, ROLL, FRICTION_Nm, LinearCarRunner, TORQUE_NmPMPS2
from tests.unit.standards.signals import run_of, times


def wheel_deg(maneuver, time_s) -> np.ndarray:
    return np.degrees([maneuver.setpoint(float(time)).steering_wheel_demand_rad for time in time_s])


def test_iso_4138_drives_three_methods_to_both_sides_and_each_finds_the_understeer_of_the_car():
    runner = LinearCarRunner()
    methods = iso4138.examine(runner).values["methods"]
    assert len(methods) == 3
    for method in methods.values():
        assert [run["direction"] for run in method] == ["left", "right"]
        for run in method:
            assert run["understeer_gradient_radpmps2"] == pytest.approx(EG, rel=1e-3)
            assert run["roll_gradient_radpmps2"] == pytest.approx(ROLL, rel=1e-3)
            assert run["rear_slip_gradient_radpmps2"] == pytest.approx(REAR, rel=1e-3)
            assert run["limit_acceleration_mps2"] == pytest.approx(LIMIT_MPS2, rel=0.01)
    radii = [1.0 / (each.setpoint(60.0).curvature_demand_1pm or 0.0) for each in runner.maneuvers["constant_radius"]]
    assert radii == pytest.approx([100.0, -100.0], rel=1e-3)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        [held] = runner.maneuvers[f"constant_angle_{side}"]
        # The wheel is turned while the car is slow, to the Ackermann angle of 40 m, and stays.
        ackermann_deg = math.degrees(runner.ratio * runner.wheelbase_m / 40.0)
        assert wheel_deg(held, [0.0, 1.5, 3.0, 80.0]) == pytest.approx(
            [0.0, 0.5 * sign * ackermann_deg, sign * ackermann_deg, sign * ackermann_deg]
        )
        speeds = [held.setpoint(time).speed_demand_mps for time in (0.0, 6.0, 16.0)]
        assert speeds == pytest.approx([15.0 / 3.6, 15.0 / 3.6, 15.0 / 3.6 + 4.0])
    assert [each.speed_mps for each in runner.maneuvers["constant_speed"]] == pytest.approx([80.0 / 3.6] * 2)


def test_iso_13674_weaves_at_0_2_hz_to_2_mps2_and_passes_the_centre_at_5_deg_per_second():
    runner = LinearCarRunner()
    found = iso13674.examine(runner)
    speed_mps = 100.0 / 3.6
    angle_deg = math.degrees(runner.steering_wheel_rad(2.0, speed_mps))
    assert found.values["steering_wheel_deg"] == pytest.approx(angle_deg, abs=0.06)
    [weave] = runner.maneuvers["weave"]
    assert weave.speed_mps == pytest.approx(speed_mps)
    angle_deg = found.values["steering_wheel_deg"]
    quarters = [1.0, 2.25, 3.5, 4.75, 6.0, 29.75]
    assert wheel_deg(weave, quarters) == pytest.approx([0.0, angle_deg, 0.0, -angle_deg, 0.0, -angle_deg], abs=0.01)
    assert weave.duration_s == pytest.approx(31.0)  # six periods
    gain = math.radians(1.0) / runner.steering_wheel_rad(1.0, speed_mps)
    over_angle, _, torque, over_ay = found.values["weave"]
    assert over_angle["gradient"] == pytest.approx(gain, rel=1e-3)
    assert over_angle["abscissa_dead_band"] == pytest.approx(0.0, abs=1e-6)
    # Friction is ahead of the angle, so that the loop of the torque is passed the other way round.
    assert torque["ordinate_dead_band"] == pytest.approx(-2.0 * FRICTION_Nm, rel=1e-3)
    assert over_ay["gradient"] == pytest.approx(TORQUE_NmPMPS2, rel=0.01)
    left, right = runner.maneuvers["transition"]
    ramp = times(6.0)[50:]
    assert np.diff(wheel_deg(left, ramp)) / np.diff(ramp) == pytest.approx(5.0)
    assert wheel_deg(right, ramp) == pytest.approx(-wheel_deg(left, ramp))
    on_centre, yaw, over_angle, over_ay = found.values["transition"]
    assert on_centre["slope"] == pytest.approx(gain, rel=1e-3)
    assert yaw["slope"] == pytest.approx(math.degrees(gain / speed_mps), rel=1e-3)
    assert over_ay["slope"] == pytest.approx(TORQUE_NmPMPS2, rel=0.01)
    assert over_ay["intercept"] == pytest.approx(FRICTION_Nm, rel=0.01)
    joined = iso13674._through_centre([run_of(dict(runner.channels(each))) for each in (left, right)])
    assert (np.diff(joined["ay_mps2"]) >= 0.0).all()
    assert np.abs(joined["ay_mps2"][[0, -1]]) == pytest.approx(2.0, rel=0.02)


def test_iso_7975_brakes_on_a_circle_of_100_m_from_gentle_to_nearly_full():
    metrics = {"yaw_rate_deviation_after_1000ms_radps": math.radians(-3.0), "mean_deceleration_mps2": 6.5}
    runner = LinearCarRunner(metrics)
    found = braking.in_a_turn(runner)
    speed_mps = 80.0 / 3.6
    assert found.values["steering_wheel_deg"] == pytest.approx(
        math.degrees(runner.steering_wheel_rad(speed_mps**2 / 100.0, speed_mps)), rel=0.02
    )
    runs = runner.maneuvers["brake_in_turn"]
    assert [each.brake.pedal for each in runs[:7]] == [each.brake.pedal for each in runs[7:]]
    assert (runs[0].brake.pedal, runs[6].brake.pedal) == (0.12, 0.6)
    for number, each in enumerate(runs):
        sign = 1.0 if number < 7 else -1.0
        assert each.speed_mps == pytest.approx(speed_mps)
        assert wheel_deg(each, [each.brake.start_s]) == pytest.approx([sign * found.values["steering_wheel_deg"]])
        # The second after the start of braking is evaluated.
        assert each.duration_s >= each.brake.start_s + 1.0
    hardest = next(picture for picture in found.pictures if picture.title == "Hardest braking")
    speeds = next(panel for panel in hardest.panels if panel.y_label.startswith("speed"))
    assert [curve.label for curve in speeds.curves] == ["left, pedal 0.60", "right, pedal 0.60"]
    for curve in speeds.curves:
        one_second_later = float(np.interp(1.0, curve.x, curve.y))
        assert one_second_later / 3.6 == pytest.approx(speed_mps - 6.0, abs=0.7)
    assert "-3.0 deg/s" in found.summary
    assert "runs wide" in found.summary
    assert "6.5 m/s²" in found.summary
    assert "14 of 14" in found.summary


def test_iso_7401_steps_to_4_mps2_and_the_responses_of_a_car_without_lag_are_its_gain():
    runner = LinearCarRunner({"yaw_rate_response_time_s": 0.1})
    found = iso7401.examine(runner)
    speed_mps = 80.0 / 3.6
    assert found.values["steering_wheel_deg"] == pytest.approx(
        math.degrees(runner.steering_wheel_rad(4.0, speed_mps)), abs=0.06
    )
    steps = runner.maneuvers["step_steer"]
    assert [wheel_deg(each, [4.0])[0] for each in steps] == pytest.approx(
        [sign * found.values["steering_wheel_deg"] for sign in (1.0, -1.0)]
    )
    random = runner.maneuvers["random_steer"]
    # Twelve minutes, each with other angles.
    assert [each.duration_s for each in random] == pytest.approx([random[0].duration_s] * 12)
    assert random[0].duration_s >= 60.0
    angles = [wheel_deg(each, times(60.0)[100:]) for each in random]
    assert len({angle[100] for angle in angles}) == 12
    rms_deg = np.sqrt(np.mean(np.square(angles)))
    assert rms_deg == pytest.approx(0.2 * found.values["steering_wheel_deg"], rel=0.1)
    for maneuver in (*steps, *random, *runner.maneuvers["sine_sweep"]):
        assert maneuver.speed_mps == pytest.approx(speed_mps)
    gain = 1.0 / runner.steering_wheel_rad(1.0, speed_mps)
    for kind in ("sweep", "random"):
        for name, expected in (("ay_mps2", gain), ("yaw_rate_radps", gain / speed_mps), ("roll_rad", ROLL * gain)):
            response = found.values["responses"][kind][name]
            assert response["gain"] == pytest.approx([expected] * len(response["gain"]), rel=1e-3)
            assert response["phase_rad"] == pytest.approx([0.0] * len(response["gain"]), abs=1e-3)
            assert min(response["coherence"]) > 0.999
    assert "coherence" not in found.summary
    coherence = found.tables[-1]
    assert {row[-1] for row in coherence.rows} == {"nowhere"}
    assert coherence.outside == frozenset()


def test_iso_21994_stops_from_100_kmh_and_scales_the_distance_by_the_square_of_the_speed():
    runner = LinearCarRunner({"stopping_distance_m": 40.0, "speed_begin_mps": 28.0, "mean_deceleration_mps2": 9.5})
    found = braking.stop(runner)
    assert found.values["stopping_distance_corrected_m"] == pytest.approx(40.0 * (100.0 / 3.6 / 28.0) ** 2)
    assert found.summary.startswith("39.37 m from 100 km/h")
    [stop] = runner.maneuvers["stop"]
    assert stop.speed_mps == pytest.approx(100.0 / 3.6)
    assert stop.brake.pedal == 1.0


def test_iso_14512_brakes_with_low_friction_on_either_side_and_the_steering_wheel_held():
    runner = LinearCarRunner({})
    found = braking.on_split_friction(runner)
    assert len(found.values["runs"]) == 2
    left, right = runner.maneuvers["split_mu"]
    assert (left.road.mu_left, left.road.mu_right) == (0.9, 0.3)
    assert (right.road.mu_left, right.road.mu_right) == (0.3, 0.9)
    assert left.course is None
    assert left.brake.start_s == 0.5
