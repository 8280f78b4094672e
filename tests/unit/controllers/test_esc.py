"""Stability control by single brakes: which wheel, how much, and when not."""

from __future__ import annotations

import math

import pytest

from activesteer.controllers import load_controller
from activesteer.controllers.esc import brake_levers, wheel_torques
from activesteer.scenario import resolve
from activesteer.signals import DriverCommand
from activesteer.theory.single_track import SingleTrack
from tests.unit.controllers.cars import held, measured, steering

LEVERS, SPEED_MPS = (0.4, 0.4), 25.0


@pytest.fixture(scope="module")
def known():
    return resolve("straight_line").controller_setup(0.005)


def answer(known, front_rad, yaw_rate_radps, speed_mps=SPEED_MPS):
    return held(
        load_controller("esc", known), steering(front_rad), measured(yaw_rate_radps, speed_mps), 5
    ).brake_torque_demand_Nm


@pytest.mark.parametrize(
    ("moment_Nm", "yaw_rate_radps", "wheel"),
    [
        (-1000.0, 0.3, 1),  # oversteer in a left turn: the right front wheel
        (1000.0, 0.3, 2),  # understeer in a left turn: the left rear wheel
        (1000.0, -0.3, 0),  # mirrored
        (-1000.0, -0.3, 3),
    ],
)
def test_outer_front_wheel_works_against_oversteer_and_inner_rear_wheel_against_understeer(
    moment_Nm, yaw_rate_radps, wheel
):
    torques = wheel_torques(moment_Nm, yaw_rate_radps, LEVERS, 2000.0)
    assert [torque > 0.0 for torque in torques] == [index == wheel for index in range(4)]
    assert torques[wheel] == pytest.approx(abs(moment_Nm) * LEVERS[0])


def test_brake_makes_the_moment_that_is_asked_for(known):
    car = known.estimation
    lever = brake_levers(known)[0]
    torque = wheel_torques(1000.0, -0.3, (lever, lever), 2000.0)[0]
    force_N = torque / car.rolling_radius_m[0]
    assert force_N * car.two_track.front_track_m / 2.0 == pytest.approx(1000.0)


def test_torque_ends_at_its_limit():
    assert max(wheel_torques(1e5, 0.3, LEVERS, 2000.0)) == 2000.0


def test_car_that_does_what_is_asked_is_left_alone(known):
    gain = SingleTrack(known.single_track).yaw_rate_gain(SPEED_MPS)
    assert not any(answer(known, 0.0, math.radians(2.0)))
    # The desired yaw rate comes in by its lag, within five calls by less than the band.
    assert not any(answer(known, 0.002, 0.002 * gain))


def test_spinning_car_is_braked_at_the_outer_front_wheel(known):
    left, right = answer(known, 0.0, 0.4), answer(known, 0.0, -0.4)
    assert left[1] > 500.0
    assert not any((left[0], left[2], left[3]))
    assert right[0] == pytest.approx(left[1], rel=1e-6)


def test_drive_is_taken_back_by_what_the_brake_takes_and_no_further(known):
    esc = load_controller("esc", known)
    gas = DriverCommand(drive_torque_demand_Nm=100.0, front_steer_demand_rad=0.0)
    found = held(esc, gas, measured(0.4, SPEED_MPS), 5)
    assert found.drive_torque_change_Nm == -100.0 > -sum(found.brake_torque_demand_Nm)
    coasting = held(esc, steering(0.0), measured(0.4, SPEED_MPS), 5)
    assert coasting.drive_torque_change_Nm == 0.0


def test_below_20_kmh_it_rests(known):
    assert not any(answer(known, 0.0, 0.4, 5.0))
