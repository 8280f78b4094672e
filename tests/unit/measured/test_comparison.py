"""Measurement against simulation: shifts, corridors and verdicts of signals with known results."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.errors import RecordingError
from activesteer.measured.comparison import TOLERANCES, compare
from activesteer.recording import Recording
from activesteer.signals import Channel
from tests.raising import raises

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
    found = compare(
        [run(time_s, yaw_rate_radps=0.3 * signal(time_s - shift_s))], run(yaw_rate_radps=0.3 * signal(TIME_S))
    )
    assert found.shifts_s[0] == pytest.approx(shift_s, abs=2e-4)
    assert found.quantities[0].to_json()["rms"] < 1e-4
    assert found.inside


def test_clocks_are_compared_by_the_steering_so_that_a_lag_of_the_car_stays():
    measured = run(steering_wheel_rad=step(TIME_S - 0.05), yaw_rate_radps=0.3 * step(TIME_S - 0.25))
    found = compare([measured], run(steering_wheel_rad=step(TIME_S), yaw_rate_radps=0.3 * step(TIME_S)))
    assert found.shifts_s[0] == pytest.approx(0.05, abs=1e-4)
    steering, rate = found.quantities
    assert (steering.inside, rate.inside) == (True, False)
    assert not found.inside


def test_the_corridor_is_offset_and_gain_of_the_simulation():
    constant = 4.0 + 0.0 * TIME_S
    allowed = 0.1 + 0.06 * 4.0
    for size, inside in ((0.99, True), (1.01, False)):
        found = compare([run(ay_mps2=constant + size * allowed)], run(ay_mps2=constant))
        assert found.inside is inside
        assert found.quantities[0].to_json()["rms"] == pytest.approx(size * allowed)
        assert math.isnan(found.shifts_s[0])  # nothing moves


def test_the_share_is_that_of_the_samples():
    wrong = np.where(TIME_S < 1.0, 5.0, 0.0)
    found = compare([run(ay_mps2=wrong)], run(ay_mps2=0.0 * TIME_S))
    assert found.quantities[0].share_inside == pytest.approx(0.8, abs=1e-3)


def test_of_several_runs_the_mean_counts_and_its_interval_is_that_of_student(rng):
    truth = 0.3 * step(TIME_S)
    slow_s = TIME_S[::10]  # noise that does not depend on how samples are interpolated
    noise = [np.interp(TIME_S, slow_s, 0.01 * rng.standard_normal(len(slow_s))) for _ in range(4)]
    found = compare([run(yaw_rate_radps=truth + each) for each in noise], run(yaw_rate_radps=truth)).quantities[0]
    assert found.to_json()["rms"] == pytest.approx(0.005 * np.sqrt(2.0 / 3.0), rel=0.1)
    assert np.mean(np.abs(found.residual) < found.confidence) == pytest.approx(0.95, abs=0.03)


def test_cross_plots_know_no_time():
    ay = np.linspace(0.0, 8.0, len(TIME_S))
    slower = ay**3 / 64.0

    def angle(ay_mps2, gradient=0.02):
        return gradient * ay_mps2 + 0.002 * ay_mps2**2

    simulated = run(ay_mps2=ay, sideslip_rad=angle(ay))
    assert compare([run(ay_mps2=slower, sideslip_rad=angle(slower))], simulated, "iso19364").inside
    assert not compare([run(ay_mps2=slower, sideslip_rad=angle(slower))], simulated).inside
    # Off by 1.2 tolerances across, on a flat curve.
    flat = run(ay_mps2=ay, sideslip_rad=0.0 * ay)
    for size, inside in ((0.95, True), (1.2, False)):
        off = size * TOLERANCES["sideslip_rad"].offset
        assert compare([run(ay_mps2=ay, sideslip_rad=0.0 * ay + off)], flat, "iso19364").inside is inside


def test_runs_with_nothing_in_common_are_an_error():
    with raises(RecordingError, allowed=tuple(TOLERANCES)):
        compare([run(yaw_rate_radps=TIME_S)], run(ay_mps2=TIME_S))
    with raises(RecordingError, value="ay_mps2"):
        compare([run(yaw_rate_radps=TIME_S)], run(yaw_rate_radps=TIME_S), "iso19364")
