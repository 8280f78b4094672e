"""Stability control by single brakes: wheels, torques and limits."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from activesteer.controllers import load_controller
from activesteer.controllers.esc import Esc, brake_levers, wheel_torques
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.core.signals import DriverCommand, Estimate
from activesteer.scenario import resolve
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


@pytest.mark.parametrize(("axle", "wheel", "yaw_rate_radps"), [("front", 0, -0.3), ("rear", 2, 0.3)])
def test_brake_makes_the_demanded_moment_at_either_axle(known, axle, wheel, yaw_rate_radps):
    car = known.estimation
    tyres = tuple(replace(tyre, rolling_radius_m=radius) for tyre, radius in zip(car.tyres, (0.30, 0.34), strict=True))
    tracks = replace(car.two_track, front_track_m=1.4, rear_track_m=1.7)
    uneven = replace(known, estimation=replace(car, two_track=tracks, tyres=tyres))
    force_N = wheel_torques(1000.0, yaw_rate_radps, brake_levers(uneven), 2000.0)[wheel]
    force_N /= {"front": 0.30, "rear": 0.34}[axle]
    assert force_N * {"front": 0.7, "rear": 0.85}[axle] == pytest.approx(1000.0)


@pytest.mark.parametrize("sideslip_time_s", [0.1, 0.2, 0.4])
def test_brake_turns_a_sliding_car_back_in_a_time_proportional_to_the_sideslip_time(known, sideslip_time_s):
    car, beyond_rad = known.estimation, 0.003
    p = replace(known.gains.esc, sideslip_time_s=sideslip_time_s)
    setup = replace(known, gains=replace(known.gains, esc=p))
    sideslip_rad = p.sideslip_limit_rad + beyond_rad

    class Sliding:
        def step(self, _measurement):
            return Estimate(SPEED_MPS, SPEED_MPS * sideslip_rad, sideslip_rad, 0.0, 0.9, *[0.0] * 5)

    inertia_kgm2 = known.single_track.yaw_inertia_kgm2
    esc = Esc(setup)
    esc._estimator = Sliding()  # pyright: ignore[reportAttributeAccessIssue]
    torque_Nm = esc.step(steering(0.0), measured(0.0)).brake_torque_demand_Nm[0]
    moment_Nm = torque_Nm / car.rolling_radius_m[0] * 0.5 * car.two_track.front_track_m
    # A constant moment M turns an inertia J from rest by an angle a in the time sqrt(2 a J / M).
    assert math.sqrt(2.0 * beyond_rad * inertia_kgm2 / moment_Nm) == pytest.approx(math.sqrt(2.0) * sideslip_time_s)


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
    full = DriverCommand(drive_torque_demand_Nm=1e5, front_steer_demand_rad=0.0)
    found = held(esc, full, measured(0.4, SPEED_MPS), 5)
    assert found.drive_torque_change_Nm == -sum(found.brake_torque_demand_Nm) < -500.0
    coasting = held(esc, steering(0.0), measured(0.4, SPEED_MPS), 5)
    assert coasting.drive_torque_change_Nm == 0.0


def test_below_20_kmh_it_rests_and_still_tells_the_desired_yaw_rate(known):
    assert not any(answer(known, 0.0, 0.4, 5.0))
    rests = held(Esc(known), steering(0.05), measured(0.4, 5.0), 500)
    turn_radps = SingleTrack(known.single_track).yaw_rate_gain(rests.estimate.speed_mps) * 0.05
    assert rests.yaw_rate_desired_radps == pytest.approx(turn_radps, rel=0.01)


def knowing(known, now):
    """Return a controller whose estimator knows this."""

    class Known:
        def step(self, _measurement):
            return now

    esc = Esc(known)
    esc._estimator = Known()  # pyright: ignore[reportAttributeAccessIssue]
    return esc


@pytest.mark.parametrize(("sideslip_deg", "std_deg", "braked"), [(4.0, 0.4, True), (4.0, 1.4, False), (9.0, 1.4, True)])
def test_only_a_sideslip_angle_that_is_certain_is_braked(known, sideslip_deg, std_deg, braked):
    """4 deg, beyond the limit of 3 deg, are no slide if the estimate may be wrong by six times 1.4 deg."""
    for side, wheel in ((1.0, 0), (-1.0, 1)):
        sideslip_rad, std_rad = side * math.radians(sideslip_deg), math.radians(std_deg)
        now = Estimate(SPEED_MPS, SPEED_MPS * sideslip_rad, sideslip_rad, 0.0, 0.9, 0.0, 0.0, std_rad, 0.0, 0.0)
        torques = knowing(known, now).step(steering(0.0), measured(0.0)).brake_torque_demand_Nm
        assert [torque > 0.0 for torque in torques] == [braked and index == wheel for index in range(4)]


def test_the_desired_yaw_rate_is_limited_by_a_friction_only_as_far_as_it_is_certain(known):
    desired = []
    for std in (0.0, 0.2):
        esc = knowing(known, Estimate(SPEED_MPS, 0.0, 0.0, 0.0, 0.4, *[0.0] * 4, std))
        desired.append(held(esc, steering(0.1), measured(3.5 / SPEED_MPS, SPEED_MPS), 500).yaw_rate_desired_radps)
    assert desired[0] == pytest.approx(0.9 * 0.4 * GRAVITY_MPS2 / SPEED_MPS)
    assert desired[1] > 1.1 * desired[0]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_turn_at_the_measured_acceleration_is_left_alone_although_the_estimate_still_says_snow(known, side):
    """With a constant sideslip angle, a car turns at a_y / v. A faster rotation by 6 deg/s is braked."""
    turn_radps, wheel = side * 6.0 / SPEED_MPS, 1 if side > 0.0 else 0
    for beyond_radps in (0.0, side * math.radians(6.0)):
        yaw_rate_radps = turn_radps + beyond_radps
        snow = Estimate(SPEED_MPS, 0.0, 0.0, yaw_rate_radps, 0.2, *[0.0] * 5)
        shown = measured(yaw_rate_radps, SPEED_MPS)._replace(ay_mps2=side * 6.0)
        command = held(knowing(known, snow), steering(side * 0.1), shown, 500)
        assert command.yaw_rate_desired_radps == pytest.approx(turn_radps)
        braked = [torque > 0.0 for torque in command.brake_torque_demand_Nm]
        assert braked == [bool(beyond_radps) and index == wheel for index in range(4)]
