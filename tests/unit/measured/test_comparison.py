"""Measurement against simulation: shifts, corridors and verdicts of signals with known results."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

from activesteer.core.signals import Channel
from activesteer.errors import RecordingError
from activesteer.measured.comparison import FILTERS, TOLERANCES, compare, smooth
from activesteer.measured.pages import comparison_page
from activesteer.recording import Recording
from tests.raising import raises

plain = partial(compare, filtered="none", noise=False)
TIME_S = np.arange(0.0, 5.0, 0.001)


def run(time_s=TIME_S, **channels) -> Recording:
    names = [Channel(name, "", "", "vehicle", single=False) for name in channels]
    return Recording(names, time_s, np.column_stack(list(channels.values())))


def step(time_s, at_s=2.0):
    return 1.0 / (1.0 + np.exp(-(time_s - at_s) / 0.05))


def sine(time_s):
    return np.sin(2.0 * np.pi * (time_s - 1.0)) * ((time_s > 1.0) & (time_s < 2.0))


@pytest.mark.parametrize("signal", [step, sine])
@pytest.mark.parametrize("shift_s", [-0.7, 0.0, 0.05, 0.0537, 1.2])
@pytest.mark.parametrize("interval_s", [0.001, 0.01])
def test_a_shift_is_found_between_the_samples_and_leaves_no_residual(signal, shift_s, interval_s):
    time_s = np.arange(1.0, 5.0, interval_s)
    found = plain(
        [run(time_s, yaw_rate_radps=0.3 * signal(time_s - shift_s))], run(yaw_rate_radps=0.3 * signal(TIME_S))
    )
    assert found.shifts_s[0] == pytest.approx(shift_s, abs=2e-4)
    assert found.quantities[0].to_json()["rms"] < 1e-4
    assert found.inside
    assert found.quantities[0].x[0] == pytest.approx(max(0.0, 1.0 - found.shifts_s[0]), abs=0.02)
    assert found.quantities[0].x[-1] == pytest.approx(min(5.0, 5.0 - found.shifts_s[0]), abs=0.02)


def test_clocks_are_compared_by_the_steering_so_that_a_lag_of_the_car_stays():
    measured = run(steering_wheel_rad=step(TIME_S - 0.05), yaw_rate_radps=0.3 * step(TIME_S - 0.25))
    found = plain([measured], run(steering_wheel_rad=step(TIME_S), yaw_rate_radps=0.3 * step(TIME_S)))
    assert found.shifts_s[0] == pytest.approx(0.05, abs=1e-4)
    steering, rate = found.quantities
    assert (steering.inside, rate.inside) == (True, False)
    assert not found.inside


def test_the_corridor_is_offset_and_gain_of_the_simulation():
    constant = 4.0 + 0.0 * TIME_S
    allowed = 0.1 + 0.06 * 4.0
    for size, inside in ((0.99, True), (1.01, False)):
        found = plain([run(ay_mps2=constant + size * allowed)], run(ay_mps2=constant))
        assert found.inside is inside
        assert found.quantities[0].to_json()["rms"] == pytest.approx(size * allowed)
        assert math.isnan(found.shifts_s[0])  # nothing moves


def test_the_share_is_that_of_the_samples():
    wrong = np.where(TIME_S < 1.0, 5.0, 0.0)
    found = plain([run(ay_mps2=wrong)], run(ay_mps2=0.0 * TIME_S))
    assert found.quantities[0].share_inside == pytest.approx(0.8, abs=1e-3)


def test_of_several_runs_the_mean_counts_and_its_interval_is_that_of_student(rng):
    truth = 0.3 * step(TIME_S)
    slow_s = TIME_S[::10]  # noise that does not depend on how samples are interpolated
    noise = [np.interp(TIME_S, slow_s, 0.01 * rng.standard_normal(len(slow_s))) for _ in range(4)]
    found = plain([run(yaw_rate_radps=truth + each) for each in noise], run(yaw_rate_radps=truth)).quantities[0]
    assert found.to_json()["rms"] == pytest.approx(0.005 * np.sqrt(2.0 / 3.0), rel=0.1)
    assert np.mean(np.abs(found.residual) < found.confidence) == pytest.approx(0.95, abs=0.03)


def test_the_interval_of_a_mean_is_two_sided():
    runs = [run(yaw_rate_radps=0.3 * step(TIME_S) + offset) for offset in (-0.01, 0.01)]
    found = plain(runs, run(yaw_rate_radps=0.3 * step(TIME_S)), aligned=False).quantities[0]
    # 12.706: Student's table of one degree of freedom at 95 %, two-sided; the standard error of the mean is 0.01.
    np.testing.assert_allclose(found.confidence, 12.706 * 0.01, rtol=1e-4)


def test_runs_that_are_not_aligned_are_compared_by_their_own_clocks():
    late = [run(ay_mps2=step(TIME_S, 2.5))]
    found = plain(late, run(ay_mps2=step(TIME_S)), aligned=False)
    assert found.shifts_s == (0.0,)
    assert found.quantities[0].share_inside == pytest.approx(1.0 - 0.5 / 5.0, abs=0.05)
    assert not found.inside


def test_cross_plots_know_no_time():
    ay = np.linspace(0.0, 8.0, len(TIME_S))
    slower = ay**3 / 64.0

    def angle(ay_mps2, gradient=0.02):
        return gradient * ay_mps2 + 0.002 * ay_mps2**2

    simulated = run(ay_mps2=ay, sideslip_rad=angle(ay))
    assert plain([run(ay_mps2=slower, sideslip_rad=angle(slower))], simulated, "iso19364").inside
    assert not plain([run(ay_mps2=slower, sideslip_rad=angle(slower))], simulated).inside
    # Off by 1.2 tolerances across, on a flat curve.
    flat = run(ay_mps2=ay, sideslip_rad=0.0 * ay)
    for size, inside in ((0.95, True), (1.2, False)):
        off = size * TOLERANCES["sideslip_rad"].offset
        found = plain([run(ay_mps2=ay, sideslip_rad=0.0 * ay + off)], flat, "iso19364")
        assert found.inside is inside
        assert (found.quantities[0].x[[0, -1]] == ay[[0, -1]]).all()  # both ends are judged


def test_runs_with_nothing_in_common_are_an_error():
    with raises(RecordingError, allowed=tuple(TOLERANCES)):
        plain([run(yaw_rate_radps=TIME_S)], run(ay_mps2=TIME_S))
    with raises(RecordingError, value="ay_mps2"):
        plain([run(yaw_rate_radps=TIME_S)], run(yaw_rate_radps=TIME_S), "iso19364")


@pytest.mark.parametrize("filtered", ["iso15037", "fmvss126", "none"])
def test_the_noise_that_remains_is_estimated_from_the_measurement(rng, filtered):
    time_s = np.arange(0.0, 20.0, 0.01)
    noise = 0.06 * rng.standard_normal(len(time_s))
    clean = 4.0 * np.sin(2.0 * np.pi * 0.5 * time_s)
    values, remaining = smooth(run(time_s, ay_mps2=clean + noise), "ay_mps2", FILTERS[filtered])
    inside = (time_s > 1.0) & (time_s < 19.0)
    expected = np.std((values - clean)[inside])
    assert remaining == pytest.approx(expected, rel=0.25)
    assert bool(expected < 0.04) is (filtered != "none")


def test_a_right_model_with_sensor_noise_is_inside_and_a_wrong_one_is_not(rng):
    time_s = np.arange(0.0, 20.0, 0.01)
    clean = 4.0 * np.sin(2.0 * np.pi * 0.5 * time_s)
    noise = 0.06 * rng.standard_normal(len(time_s))
    right = compare([run(time_s, ay_mps2=clean + noise)], run(time_s, ay_mps2=clean))
    wrong = compare([run(time_s, ay_mps2=1.12 * clean + noise)], run(time_s, ay_mps2=clean))
    assert right.inside
    assert right.quantities[0].noise == pytest.approx(1.96 * 0.06 * math.sqrt(10.1 / 50.0), rel=0.15)
    assert not wrong.inside
    assert right.to_json()["filter"]["poles"] == 8
    ramp = 0.05 * time_s
    bare, allowed = (each([run(time_s, ay_mps2=ramp + noise)], run(time_s, ay_mps2=ramp)) for each in (plain, compare))
    assert bare.quantities[0].noise == 0.0
    assert bare.quantities[0].share_inside < allowed.quantities[0].share_inside == 1.0


def test_a_slow_signal_is_compared_without_a_filter_and_the_reason_is_said():
    time_s = np.arange(0.0, 20.0, 0.1)
    values = 4.0 * np.sin(2.0 * np.pi * 0.2 * time_s)
    found = compare([run(time_s, ay_mps2=values)], run(time_s, ay_mps2=values))
    assert found.inside
    assert "10.1 Hz" in found.unfiltered[0]


def test_the_filters_of_the_law_cut_off_the_steering_wheel_and_the_motion_at_their_frequencies():
    law = FILTERS["fmvss126"]
    assert law is not None
    assert law.poles == 12
    assert [law.of(name) for name in ("steering_wheel_rad", "yaw_rate_radps", "ay_mps2")] == [10.0, 6.0, 6.0]


@pytest.mark.parametrize(("share", "inside"), [(0.99, True), (1.01, False)])
def test_the_corridor_of_the_speed_is_1_kmh_and_1_percent(share, inside):
    constant_mps = 20.0 + 0.0 * TIME_S
    found = plain([run(speed_mps=constant_mps + share * (1.0 / 3.6 + 0.2))], run(speed_mps=constant_mps))
    assert found.inside is inside


def test_the_filter_of_iso_15037_has_the_width_that_the_standard_requires():
    for frequency_Hz, low, high in ((5.0, 0.995, 1.0), (9.0, 0.707, 0.75), (20.0, 0.0, 0.01)):
        time_s = np.arange(0.0, 10.0, 0.001)
        wave = np.sin(2.0 * np.pi * frequency_Hz * time_s)
        found = smooth(run(time_s, ay_mps2=wave), "ay_mps2", FILTERS["iso15037"])[0]
        assert low <= np.abs(found[4000:6000]).max() <= high


@pytest.mark.parametrize(
    ("shift_s", "said"),
    [
        (-0.1, "Measured 100.0 ms earlier than simulated"),
        (0.05, "Measured 50.0 ms later than simulated"),
        (0.0, "no time shift"),
    ],
)
def test_the_page_says_whether_the_measured_run_is_earlier_or_later(shift_s, said):
    pytest.importorskip("matplotlib")
    found = plain([run(yaw_rate_radps=0.3 * step(TIME_S - shift_s))], run(yaw_rate_radps=0.3 * step(TIME_S)))
    assert said in comparison_page(found, ["car"], "model").lead[1]
