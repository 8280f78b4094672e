"""Test methods: metrics of signals with known results; a method without limits never passes a car."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from activesteer.analysis.frequency_response import FrequencyResponse
from activesteer.analysis.handling import CarGeometry, evaluate
from activesteer.config import Range
from activesteer.core.files import json_text
from activesteer.errors import ManeuverError, ParameterError, RecordingError
from activesteer.standards import braking, examination, iso7401, iso13674
from activesteer.standards.braking import after_one_second, corrected_distance
from activesteer.standards.catalogue import STANDARDS, standard_of
from activesteer.standards.examination import Examination, examine
from activesteer.standards.standard import Findings, StandardRun, StandardRunner, metrics_table, steering_wheel_at
from tests.raising import raises
from tests.unit.standards.signals import run_of, times


def no_verdict(result: Examination) -> Findings:
    [found] = result.findings.values()
    assert found.passed is None
    assert "pass" not in found.values
    assert "nan" not in found.summary
    assert not result.failed
    json.loads(json_text(result.to_json()))
    assert found.tables
    assert found.pictures
    return found


def test_what_the_standard_says_is_not_changed():
    with raises(ParameterError, key="speed_kmh", allowed=["vehicle", "driver", "road"]):
        examine("iso4138", overrides={"speed_kmh": 50.0})


def test_settings_of_a_controller_are_for_the_controllers_that_read_them(monkeypatch):
    changes = {"controllers.ars.limit_deg": 2.0, "factors.mass": 1.1}
    given = {}

    def look(runner: StandardRunner) -> Findings:
        given[runner.controller] = dict(runner.overrides)
        [run] = runner.drive("short", "straight_line", [{"speed_kmh": 50.0}], {"duration_s": 0.2})
        return Findings({}, run.error)

    monkeypatch.setitem(examination.EXAMINED_BY, "iso4138", look)
    result = examine("iso4138", ["none", "ars"], overrides=changes, jobs=1)
    assert given == {"none": {"factors.mass": 1.1}, "ars": changes}
    assert [found.summary for found in result.findings.values()] == ["", ""]
    with raises(ParameterError, key="controllers.ars.limit_deg"):
        examine("iso4138", ["none", "afs"], overrides=changes, jobs=1)


def test_every_standard_says_what_it_is():
    assert set(STANDARDS) == set(examination.EXAMINED_BY)
    for name, standard in STANDARDS.items():
        assert standard_of(name) is standard
        for text in (standard.title, standard.edition, *standard.implemented, *standard.left_out):
            assert text
    for name in ("iso740", ""):
        with raises(ParameterError, value=name, allowed=tuple(STANDARDS)):
            standard_of(name)


class RampGround:
    """A car whose lateral acceleration follows the steering wheel without lag."""

    def __init__(self, gain_mps2prad: float) -> None:
        self._gain = gain_mps2prad

    def drive(self, *_: object, **__: object) -> list[StandardRun]:
        steering = np.radians(5.0) * times(30.0)
        return [run_of({"steering_wheel_rad": steering, "ay_mps2": self._gain * steering})]

    scenario = drive


def test_steering_wheel_angle_of_a_linear_car():
    assert steering_wheel_at(RampGround(4.0 / math.radians(37.5)), 80.0, 4.0) == 37.5  # pyright: ignore[reportArgumentType]
    with raises(ManeuverError, value=pytest.approx(2.62, abs=0.01), allowed=Range(4.0)):
        steering_wheel_at(RampGround(1.0), 80.0, 4.0)  # pyright: ignore[reportArgumentType]


def test_stopping_distance_goes_with_the_square_of_the_speed():
    assert corrected_distance(40.0, 28.0, 27.0) == pytest.approx(40.0 * (27.0 / 28.0) ** 2)


def test_one_second_after_the_brake_of_a_constant_yaw_acceleration():
    time_s = np.maximum(times(3.0) - 0.5, 0.0)
    run = run_of({"yaw_rate_radps": 0.2 * time_s, "yaw_rad": 0.3 + 0.1 * time_s**2, "y_m": 0.5 * time_s})
    found = after_one_second(run, 0.5)
    assert found["yaw_rate_after_1000ms_radps"] == pytest.approx(0.2)
    assert found["yaw_angle_after_1000ms_rad"] == pytest.approx(0.1)
    assert found["lateral_deviation_after_1000ms_m"] == pytest.approx(0.5)


def test_a_run_that_ends_early_or_failed_has_no_value():
    run = run_of({"y_m": times(1.0)})
    assert math.isnan(run.at("y_m", 1.5))
    failed = StandardRun({}, {}, {}, "it diverged")
    assert math.isnan(failed.at("y_m", 0.5))
    assert failed.values == {"error": "it diverged"}
    with raises(RecordingError, problem="it diverged", value="y_m"):
        failed["y_m"]


def test_frequencies_with_weak_coherence_are_said():
    frequency_Hz = np.array([0.5, 1.0, 1.5, 2.0, 2.5])
    found = FrequencyResponse(frequency_Hz, np.ones(5, complex), np.array([0.9, 0.99, 0.94, 0.93, 1.0]))
    assert iso7401.weak_ranges(found) == "0.50 Hz, 1.50 to 2.00 Hz"
    assert iso7401.weak_ranges(found._replace(coherence=np.ones(5))) == ""
    assert iso7401.weak_ranges(found._replace(coherence=np.zeros(5))) == "0.50 to 2.50 Hz"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_understeer_of_a_held_steering_wheel(side):
    """Constant angle: the curvature decreases as the speed rises, l k = delta - EG ay."""
    car, gradient, speed = CarGeometry(1.0, 1.6, 16.0), 0.004, 4.0 + 0.4 * times(40.0)
    steer = 2.6 / 40.0
    curvature = steer / (car.wheelbase_m + gradient * speed**2)
    ay = side * curvature * speed**2
    zero = np.zeros_like(ay)
    run = run_of({
        "steering_wheel_rad": side * np.full_like(ay, 16.0 * steer), "ay_mps2": ay, "vx_mps": speed,
        "yaw_rate_radps": side * curvature * speed, "sideslip_rad": zero, "roll_rad": 0.01 * ay,
    })  # fmt: skip
    found = evaluate(run, car)
    assert found["understeer_gradient_radpmps2"] == pytest.approx(gradient, rel=1e-6)
    assert found["steer_gradient_radpmps2"] == pytest.approx(0.0, abs=1e-9)
    assert found["roll_gradient_radpmps2"] == pytest.approx(0.01, rel=1e-6)


def test_weave_of_sines_with_a_known_lag():
    phase = 2.0 * math.pi * 0.2 * times(20.0)
    signals = {
        "steering_wheel_rad": math.radians(15.0) * np.sin(phase),
        "ay_mps2": 2.0 * np.sin(phase - 0.1),
        "yaw_rate_radps": math.radians(4.0) * np.sin(phase),
        "hand_torque_Nm": np.full_like(phase, 3.0),
    }
    ay, yaw, torque, _ = iso13674.weave_loops(signals)
    assert ay["gradient"] == pytest.approx(2.0 / 15.0 * math.cos(0.1), rel=1e-3)
    assert ay["ordinate_dead_band"] == pytest.approx(4.0 * math.sin(0.1), rel=1e-2)
    assert ay["abscissa_dead_band"] == pytest.approx(30.0 * math.sin(0.1), rel=1e-2)
    assert yaw["abscissa_dead_band"] == pytest.approx(0.0, abs=0.05)
    assert torque["gradient"] is None


def test_transition_through_friction():
    ay = np.linspace(-2.0, 2.0, 401)
    signals = {
        "steering_wheel_rad": np.radians(8.0 * ay), "ay_mps2": ay, "yaw_rate_radps": np.radians(2.0 * ay),
        "hand_torque_Nm": np.sign(ay) * (3.0 + 1.5 * np.abs(ay)),
    }  # fmt: skip
    gain, yaw, over_angle, over_ay = iso13674.transition_lines(signals)
    assert gain["slope"] == pytest.approx(1.0 / 8.0)
    assert yaw["slope"] == pytest.approx(2.0 / 8.0)
    assert (over_angle["slope"], over_angle["intercept"]) == (pytest.approx(1.5 / 8.0), pytest.approx(3.0))
    assert (over_ay["slope"], over_ay["intercept"]) == (pytest.approx(1.5), pytest.approx(3.0))


def test_a_table_of_metrics_has_an_empty_cell_where_there_is_none():
    table = metrics_table("t", {"a": {"yaw_rate_peak_radps": math.radians(2.0)}, "b": {"track_amplitude_m": 1.0}})
    assert table.rows == [["peak yaw rate", "deg/s", "2.000", "-"], ["track amplitude", "m", "-", "1.000"]]


def test_the_compact_stops_from_100_kmh():
    found = no_verdict(examine("iso21994", jobs=1))
    # At the most what a peak friction of 0.9 allows, and with nine tenths of it as anti-lock systems do.
    least_m = (100.0 / 3.6) ** 2 / (2.0 * 0.9 * 9.81)
    assert least_m < found.values["stopping_distance_corrected_m"] < 1.25 * least_m


def test_split_friction_turns_the_car_to_the_side_that_holds():
    found = no_verdict(examine("iso14512", jobs=1))
    left, right = found.values["runs"]
    assert left["yaw_rate_after_1000ms_radps"] > 0.02
    assert right["yaw_rate_after_1000ms_radps"] == pytest.approx(-left["yaw_rate_after_1000ms_radps"], rel=1e-3)


@pytest.mark.slow
def test_braking_in_a_turn_begins_on_the_circle(monkeypatch):
    monkeypatch.setattr(braking, "PEDALS", (0.2, 0.4))
    found = no_verdict(examine("iso7975", jobs=1))
    for run in found.values["runs"]:
        assert abs(run["ay_begin_mps2"]) == pytest.approx(5.0, rel=0.03)
        assert run["radius_begin_m"] == pytest.approx(100.0, rel=0.04)


@pytest.mark.slow
def test_responses_of_the_compact_are_coherent_and_follow_its_step(monkeypatch):
    monkeypatch.setattr(iso7401, "SEQUENCES", 2)
    found = no_verdict(examine("iso7401", jobs=1))
    left, right = found.values["steps"]
    assert left["ay_steady_state_mps2"] == pytest.approx(iso7401.STEP_MPS2, rel=0.03)
    assert right["yaw_rate_response_time_s"] == pytest.approx(left["yaw_rate_response_time_s"], abs=1e-3)
    sweep, random = (found.values["responses"][kind]["yaw_rate_radps"] for kind in ("sweep", "random"))
    assert min(*sweep["coherence"], *random["coherence"]) > 0.99
    static = left["yaw_rate_steady_state_radps"] / math.radians(found.values["steering_wheel_deg"])
    assert sweep["gain"][0] == pytest.approx(static, rel=0.05)
    # Both steer by some 0.1 g; dry friction in the steering makes a larger amplitude a little more effective.
    at_sweep = np.interp(random["frequency_Hz"], sweep["frequency_Hz"], sweep["gain"])
    assert np.array(random["gain"]) / at_sweep == pytest.approx(1.0, abs=0.04)
    assert "coherence" not in found.summary


@pytest.mark.slow
def test_three_methods_find_one_understeer_gradient():
    found = no_verdict(examine("iso4138", jobs=1))
    gradients = [side["understeer_gradient_radpmps2"] for method in found.values["methods"].values() for side in method]
    assert len(gradients) == 6
    assert gradients == pytest.approx([gradients[0]] * 6, rel=0.1)


@pytest.mark.slow
def test_on_centre_gain_is_that_of_the_ramp():
    found = no_verdict(examine("iso13674", jobs=1))
    gain = iso13674.AY_MPS2 / found.values["steering_wheel_deg"]
    assert found.values["weave"][0]["gradient"] == pytest.approx(gain, rel=0.1)
    assert found.values["weave"][0]["abscissa_dead_band"] > 0.0
