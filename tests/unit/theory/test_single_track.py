"""The single-track model against eqs. 1 to 5 of Dorsch 2012, calculated by hand and against each other."""

from __future__ import annotations

import math
from dataclasses import replace

import control
import numpy as np
import pytest

from activesteer.controllers import SingleTrack, SingleTrackParameters
from activesteer.errors import ParameterError
from tests.raising import raises
from tests.unit.controllers.cars import CAR, NO_PREDICTION_MPS

SPEEDS_MPS = (1.0, 5.0, 15.0, NO_PREDICTION_MPS, 22.22, 27.78, 50.0)


@pytest.fixture
def car() -> SingleTrack:
    return SingleTrack(CAR)


def test_matrices_are_those_of_equations_1_and_2(car):
    a, b = car.matrices(20.0)
    # C_V l_V^2 + C_H l_H^2 = 90000 + 270000 = 360000; C_H l_H - C_V l_V = 180000 - 90000 = 90000; C_V + C_H = 210000
    assert a[0, 0] == pytest.approx(-360_000.0 / (2100.0 * 20.0), rel=1e-15)
    assert a[0, 1] == pytest.approx(90_000.0 / 2100.0, rel=1e-15)
    assert a[1, 0] == pytest.approx(90_000.0 / (1400.0 * 400.0) - 1.0, rel=1e-15)
    assert a[1, 1] == pytest.approx(-210_000.0 / (1400.0 * 20.0), rel=1e-15)
    assert b == pytest.approx(
        np.array(
            [
                [90_000.0 * 1.0 / 2100.0, -120_000.0 * 1.5 / 2100.0],
                [90_000.0 / (1400.0 * 20.0), 120_000.0 / (1400.0 * 20.0)],
            ]
        ),
        rel=1e-15,
    )


def test_matrices_follow_from_newton_and_euler(car, rng):
    """Expected are the forces and moments of the two axles, summed without the paper's equations."""
    speed_mps = 30.0
    a, b = car.matrices(speed_mps)
    for yaw_rate, sideslip, front, rear in 0.1 * rng.standard_normal((20, 4)):
        front_force_N = CAR.front_stiffness_Nprad * (front - sideslip - CAR.cg_to_front_m * yaw_rate / speed_mps)
        rear_force_N = CAR.rear_stiffness_Nprad * (rear - sideslip + CAR.cg_to_rear_m * yaw_rate / speed_mps)
        moment_Nm = CAR.cg_to_front_m * front_force_N - CAR.cg_to_rear_m * rear_force_N
        expected = (
            moment_Nm / CAR.yaw_inertia_kgm2,
            (front_force_N + rear_force_N) / (CAR.mass_kg * speed_mps) - yaw_rate,
        )
        assert a @ (yaw_rate, sideslip) + b @ (front, rear) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_characteristic_speed_is_that_of_equation_4(car):
    # 90000 * 120000 * 2.5^2 / (1400 * 90000)
    assert car.characteristic_speed_mps**2 == pytest.approx(535.714285714, rel=1e-11)


@pytest.mark.parametrize("speed_mps", SPEEDS_MPS)
def test_steady_state_of_the_state_space_is_the_gain_of_equation_3(car, speed_mps):
    steady = control.dcgain(car.state_space(speed_mps))
    assert steady[0, 0] == pytest.approx(car.yaw_rate_gain(speed_mps), rel=1e-12)


def test_state_space_is_labelled(car):
    model = car.state_space(20.0)
    assert isinstance(model, control.StateSpace)
    assert model.input_labels == ["front_steer_rad", "rear_steer_rad"]
    assert model.output_labels == model.state_labels == ["yaw_rate_radps", "sideslip_rad"]


@pytest.mark.parametrize("speed_mps", [0.0, -1.0])
def test_state_space_needs_a_speed(car, speed_mps):
    with raises(ParameterError, key="speed_mps", value=speed_mps):
        car.state_space(speed_mps)


def test_slow_car_turns_on_the_ackermann_radius(car):
    speed_mps = 1e-3
    assert car.yaw_rate_gain(speed_mps) / speed_mps == pytest.approx(1.0 / 2.5, rel=1e-8)
    assert car.yaw_rate_gain(0.0) == 0.0


def test_yaw_rate_gain_is_largest_at_the_characteristic_speed(car):
    peak = car.characteristic_speed_mps
    assert car.yaw_rate_gain(peak) == pytest.approx(peak / (2.0 * 2.5), rel=1e-12)
    assert car.yaw_rate_gain(peak) > max(car.yaw_rate_gain(0.95 * peak), car.yaw_rate_gain(1.05 * peak))


def test_neutral_car_turns_on_the_ackermann_radius_at_every_speed():
    neutral = SingleTrack(replace(CAR, rear_stiffness_Nprad=60_000.0))
    assert neutral.characteristic_speed_mps == math.inf
    for speed_mps in SPEEDS_MPS:
        assert neutral.yaw_rate_gain(speed_mps) == pytest.approx(speed_mps / 2.5, rel=1e-15)
        assert control.dcgain(neutral.state_space(speed_mps))[0, 0] == pytest.approx(speed_mps / 2.5, rel=1e-9)


def test_oversteering_car_needs_a_characteristic_speed():
    oversteering = replace(CAR, rear_stiffness_Nprad=50_000.0)
    with raises(ParameterError, key="single_track"):
        SingleTrack(oversteering)
    given = SingleTrack(replace(oversteering, characteristic_speed_mps=25.0))
    assert given.yaw_rate_gain(25.0) == pytest.approx(25.0 / 5.0)


def test_measured_characteristic_speed_replaces_equation_4():
    given = SingleTrack(replace(CAR, characteristic_speed_mps=20.0))
    assert given.yaw_rate_gain(20.0) == pytest.approx(20.0 / 2.5 / 2.0, rel=1e-15)


def test_coefficients_of_the_prediction_are_those_of_equation_5(car):
    gain, lead_s, lag_s = car.rear_prediction(20.0)
    # m v^2 = 560000; denominator 560000 * 1.5 + 90000 * 1.0 * 2.5 = 1065000
    assert gain == pytest.approx(0.75 * (560_000.0 * 1.0 - 120_000.0 * 1.5 * 2.5) / 1_065_000.0, rel=1e-14)
    assert lag_s == pytest.approx(2100.0 * 20.0 / 1_065_000.0, rel=1e-14)
    zero_s = 2100.0 * 20.0 / (120_000.0 * 1.5 * 2.5 - 560_000.0 * 1.0)
    assert lead_s == pytest.approx(gain * zero_s, rel=1e-13)


@pytest.mark.parametrize("speed_mps", SPEEDS_MPS)
def test_predicted_rear_angle_keeps_the_sideslip_at_zero_at_all_frequencies(car, speed_mps):
    frequency_radps = np.logspace(-3, 3, 61)
    from_front, from_rear = np.asarray(car.state_space(speed_mps)(1j * frequency_radps))[1]
    gain, lead_s, lag_s = car.rear_prediction(speed_mps)
    rear = (gain + lead_s * 1j * frequency_radps) / (1.0 + lag_s * 1j * frequency_radps)
    assert np.abs(from_front + from_rear * rear).max() < 1e-12 * np.abs(from_front).max()


@pytest.mark.parametrize("speed_mps", SPEEDS_MPS)
def test_predicted_rear_angle_keeps_the_sideslip_at_zero_in_steady_state(car, speed_mps):
    gain = car.rear_prediction(speed_mps)[0]
    steady = control.dcgain(car.state_space(speed_mps))
    assert abs(steady[1] @ (1.0, gain)) < 1e-12


def test_prediction_stays_finite_where_its_gain_is_zero(car):
    gain, lead_s, lag_s = car.rear_prediction(NO_PREDICTION_MPS)
    assert abs(gain) < 1e-15
    assert lead_s == pytest.approx(-0.75 * lag_s, rel=1e-15)
    assert lag_s > 0.0


def test_rear_wheels_turn_against_the_front_ones_when_slow_and_with_them_when_fast(car):
    gains = [car.rear_prediction(speed_mps)[0] for speed_mps in np.linspace(0.0, 60.0, 121)]
    assert np.all(np.diff(gains) > 0.0)
    assert car.rear_prediction(0.99 * NO_PREDICTION_MPS)[0] < 0.0 < car.rear_prediction(1.01 * NO_PREDICTION_MPS)[0]
    # Parking: the centre of gravity moves along the car where the turning centre is beside it.
    assert gains[0] == pytest.approx(-1.5 / 1.0, rel=1e-14)
    # Very fast: forces alone count, C_V delta_V l_V = C_H delta_H l_H.
    assert car.rear_prediction(1e6)[0] == pytest.approx(0.75 / 1.5, rel=1e-6)


def test_predicted_angle_is_first_against_the_front_one_at_every_speed(car):
    """Initial rear angle for a step of the front wheels: K_H T_z / T_1 = -C_V / C_H."""
    for speed_mps in SPEEDS_MPS:
        _, lead_s, lag_s = car.rear_prediction(speed_mps)
        assert lead_s / lag_s == pytest.approx(-0.75, rel=1e-14)


def test_prediction_of_many_speeds_is_that_of_each(car):
    one_by_one = np.array([car.rear_prediction(speed_mps) for speed_mps in SPEEDS_MPS])
    assert pytest.approx(one_by_one, rel=1e-15) == np.array(car.rear_prediction(np.array(SPEEDS_MPS))).T


def test_car_is_stable_at_all_speeds(car):
    for speed_mps in SPEEDS_MPS:
        assert car.state_space(speed_mps).poles().real.max() < 0.0


@pytest.mark.parametrize(
    "key", [field for field in SingleTrackParameters.__dataclass_fields__ if field != "source" and "speed" not in field]
)
def test_every_parameter_counts(key):
    changed = SingleTrack(replace(CAR, **{key: 1.1 * getattr(CAR, key)}))
    before, after = SingleTrack(CAR).matrices(20.0), changed.matrices(20.0)
    assert not np.allclose(np.hstack(before), np.hstack(after), rtol=1e-3)
    assert changed.rear_prediction(20.0) != SingleTrack(CAR).rear_prediction(20.0)


def test_longest_lag_is_that_of_a_slowly_growing_front_angle(car):
    """To first order in s, a transfer function is G(0) (1 - T s)."""

    def lag_s(speed_mps: float) -> float:
        a, b = car.matrices(speed_mps)
        below, at, above = (np.linalg.solve(s * np.eye(2) - a, b[:, 0])[0] for s in (-1e-4, 0.0, 1e-4))
        return (below - above) / (2e-4 * at)

    lags_s = [lag_s(speed_mps) for speed_mps in np.linspace(1.0, 60.0, 600)]
    assert car.longest_lag_s() == pytest.approx(max(lags_s), rel=1e-4)
    assert 1 < lags_s.index(max(lags_s)) < 598


def test_lag_of_a_neutral_car_has_no_limit():
    stiffness = CAR.rear_stiffness_Nprad * CAR.cg_to_rear_m / CAR.cg_to_front_m
    neutral = replace(CAR, front_stiffness_Nprad=stiffness, characteristic_speed_mps=None)
    assert math.isinf(SingleTrack(neutral).longest_lag_s())
