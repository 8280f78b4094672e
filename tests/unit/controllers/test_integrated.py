"""Steering and brakes together: the allocation, and its behaviour after failures."""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import numpy as np
import pytest

from activesteer.controllers import load_controller
from activesteer.controllers.axle_slopes import LEAST, AxleSlopes, slopes
from activesteer.controllers.integrated import Integrated, SupervisedActuator, solver
from activesteer.core.signals import Estimate
from activesteer.errors import ControllerError, ParameterError
from activesteer.scenario import resolve
from tests.raising import raises
from tests.unit.controllers.cars import held, measured, steering

pytest.importorskip("daqp")
INTERVAL_S, SPEED_MPS = 0.005, 25.0


@pytest.fixture(scope="module")
def known():
    return resolve("straight_line").controller_setup(INTERVAL_S)


def moving(sideslip_rad: float = 0.0, friction: float = 0.9) -> Estimate:
    return Estimate(SPEED_MPS, SPEED_MPS * sideslip_rad, sideslip_rad, 0.0, friction, *[0.0] * 5)


def test_small_errors_are_left_to_the_steering_which_does_what_the_state_feedback_wants(known):
    driver, yaw_rate = steering(0.002), measured(0.01, SPEED_MPS)
    alone, together = (load_controller(name, known).step(driver, yaw_rate) for name in ("lqr", "integrated"))
    assert together.rear_steer_demand_rad == pytest.approx(alone.rear_steer_demand_rad, abs=math.radians(0.02))
    assert together.superposition_demand_rad == pytest.approx(alone.superposition_demand_rad, abs=math.radians(0.02))
    assert not any(torque > 1.0 for torque in together.brake_torque_demand_Nm)


def spinning(side: float, yaw_rate_radps: float = 0.6):
    """A car that keeps turning with its wheels at their limits."""
    most_rad = math.radians(3.0)
    return measured(side * yaw_rate_radps, SPEED_MPS)._replace(
        rear_steer_rad=side * most_rad, superposition_rad=-side * most_rad
    )


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_spinning_car_gets_the_outer_front_brake_where_the_steering_has_given_all(known, side):
    answer = load_controller("integrated", known).step(steering(0.0), spinning(side))
    fl, fr, rl, rr = answer.brake_torque_demand_Nm
    outer, others = (fr, (fl, rl, rr)) if side > 0.0 else (fl, (fr, rl, rr))
    assert outer > 100.0
    # The outer rear wheel would lose side force that holds the car.
    assert max(others) < outer
    assert answer.rear_steer_demand_rad * side > 0.0 > answer.superposition_demand_rad * side
    assert answer.saturated


def test_steering_that_suffices_within_its_rates_is_left_alone_and_beyond_it_the_brakes_help(known):
    # In 0.1 s both axles make some 9 kNm. 0.3 rad/s need 2200 * 0.25 / 0.1 = 5.5 kNm, 0.6 rad/s need 12 kNm.
    torques_Nm = [
        max(load_controller("integrated", known).step(steering(0.0), measured(rate, SPEED_MPS)).brake_torque_demand_Nm)
        for rate in (0.3, 0.6)
    ]
    assert torques_Nm[0] == 0.0 < torques_Nm[1]


def test_slow_rear_steering_leaves_more_to_the_brakes(known):
    def braked_Nm(rear_rate_degps: float) -> float:
        servos = replace(known.gains.servos, rear_rate_radps=math.radians(rear_rate_degps))
        setup = replace(known, gains=replace(known.gains, servos=servos))
        return max(load_controller("integrated", setup).step(steering(0.0), measured(0.5, SPEED_MPS))
                   .brake_torque_demand_Nm)  # fmt: skip

    assert braked_Nm(28.0) < braked_Nm(12.0) < braked_Nm(4.0)


def test_moment_for_the_brakes_grows_from_zero_without_a_jump_whatever_the_feedback_wants(known):
    """The wanted moment may point against that of the feedback, which mostly acts on the sideslip."""
    controller = Integrated(known)
    band = known.gains.esc.yaw_rate_band_radps
    rates = band + np.linspace(-0.02, 0.2, 100)
    for steered_Nm in (-5000.0, 0.0, 5000.0):
        missing = [
            controller._missing_moment(moving()._replace(yaw_rate_radps=rate), 0.0, 0.0, steered_Nm) for rate in rates
        ]
        assert missing[0] == 0.0
        assert np.all(np.diff(missing) <= 0.0)
        assert np.abs(np.diff(missing)).max() < 300.0
        assert missing[-1] == pytest.approx(min(-0.2 / 0.1 * 2200.0 - steered_Nm, 0.0), abs=1.0)


def test_brakes_use_no_more_than_the_limit_of_the_stability_control(known):
    answer = load_controller("integrated", known).step(steering(0.0), spinning(1.0, 5.0))
    assert max(answer.brake_torque_demand_Nm) == pytest.approx(known.gains.esc.torque_limit_Nm)


def test_solvers_last_digits_are_no_demand_on_the_brakes(known):
    """The anti-lock system lets a wheel slip more that a controller brakes."""
    controller = load_controller("integrated", known)
    for rate in (0.0, 0.01, -0.02):
        assert controller.step(steering(0.002), measured(rate, SPEED_MPS)).brake_torque_demand_Nm == (0.0,) * 4


@pytest.mark.parametrize("key", ["ahead_s", "yaw_rate_time_s", "angle_scale_deg", "brake_fraction"])
def test_former_keys_say_where_they_are_now(key):
    with pytest.raises(ParameterError, match=r"controllers\.(lqr|esc)"):
        resolve("straight_line", overrides={f"controllers.integrated.{key}": 0.1})


def test_stuck_rear_wheels_are_noticed_and_taken_as_they_are(known):
    controller = load_controller("integrated", known)
    stuck = measured(0.0, SPEED_MPS)._replace(rear_steer_rad=math.radians(1.0))
    answer = controller.step(steering(0.0), stuck)
    assert answer.rear_steer_demand_rad < math.radians(0.5)
    assert held(controller, steering(0.0), stuck, 40).rear_steer_demand_rad == pytest.approx(stuck.rear_steer_rad)


def test_actuator_that_lags_is_sound_and_one_that_stays_has_failed():
    sound, stuck = (SupervisedActuator(0.005, 0.06, INTERVAL_S) for _ in range(2))
    position_rad = 0.0
    for call in range(400):
        demand_rad = 0.04 * math.sin(2.0 * math.pi * 1.5 * call * INTERVAL_S)
        position_rad += (1.0 - math.exp(-INTERVAL_S / 0.06)) * (demand_rad - position_rad)
        assert not sound.step(demand_rad, position_rad)
        stuck.step(demand_rad, 0.01)
    assert stuck.failed


def test_actuator_that_follows_a_demand_which_turns_back_is_sound():
    """A screw of 12 deg/s behind a demand of 2 Hz is late, and moves away from what was demanded a window before."""
    actuator, position = SupervisedActuator(math.radians(0.3), 0.06, INTERVAL_S), 0.0
    for k in range(400):
        demand = math.radians(2.0) * math.sin(2.0 * math.pi * 2.0 * k * INTERVAL_S)
        step = math.radians(12.0) * INTERVAL_S
        assert not actuator.step(demand, position)
        position += min(max(demand - position, -step), step)


def test_failed_actuator_stays_so():
    actuator = SupervisedActuator(0.005, 0.06, INTERVAL_S)
    for _ in range(30):
        actuator.step(0.03, 0.0)
    assert actuator.failed
    assert actuator.step(0.03, 0.03)


def test_slope_of_an_axle_falls_with_its_slip_angle_and_earlier_on_a_slippery_road(known):
    curves = AxleSlopes(known)

    def sizes(now, front_rad):
        return [abs(slope) for slope in slopes(curves, now, front_rad, 0.0)]

    # The first interval of the curve is nearly straight.
    assert sizes(moving(), 0.0) == pytest.approx((1.0, 1.0))
    some = [sizes(moving(), math.radians(angle))[0] for angle in (1.0, 3.0, 6.0)]
    assert 1.0 > some[0] > some[1] > some[2] >= LEAST
    assert sizes(moving(friction=0.3), math.radians(1.0))[0] < some[0]
    # Sliding to the right at the rear, as in a left turn, the rear wheels turned left give no more.
    assert sizes(moving(-0.2), 0.0)[1] == pytest.approx(sizes(moving(0.2), 0.0)[1])


def test_missing_solver_is_told_with_how_to_get_it(known, monkeypatch):
    monkeypatch.setitem(sys.modules, "daqp", None)
    with raises(ControllerError, cause=ImportError, value="daqp", allowed="control"):
        solver()


def test_sides_may_differ_the_less_the_further_the_car_is_off_and_not_without_an_actuator(known):
    limits = known.gains.integrated
    off_radps = 0.25 * limits.side_yaw_rate_radps

    def allowed(yaw_rate_radps: float, **angles: float) -> float:
        seen = measured(yaw_rate_radps, SPEED_MPS)._replace(**angles)
        return load_controller("integrated", known).step(steering(0.0), seen).side_difference_Pa

    assert allowed(0.0) == pytest.approx(limits.side_difference_Pa)
    assert allowed(off_radps) == pytest.approx(allowed(-off_radps)) == pytest.approx(0.75 * allowed(0.0), rel=0.1)
    assert allowed(2.0 * limits.side_yaw_rate_radps) == 0.0
    assert allowed(0.0, rear_steer_rad=known.gains.servos.rear_limit_rad) == 0.0
