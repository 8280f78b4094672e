"""Steering servos as controllers know them: equal to those of the cars, and respected by the controllers."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from activesteer.controllers import load_controller
from activesteer.controllers.parameters import ServoParameters
from activesteer.resources import list_vehicles
from activesteer.scenario import resolve
from tests.unit.controllers.cars import measured, steering


@pytest.mark.parametrize("vehicle", list_vehicles())
def test_table_is_what_the_model_of_each_car_has(vehicle: str) -> None:
    car = resolve("straight_line", vehicle).car
    servos, model = car.config.controllers.servos, car.on().model
    rear = 1.0, servos.rear_limit_rad, servos.rear_rate_radps
    # The front servo turns a hinge in the steering column.
    front = car.config.steering.ratio, servos.superposition_limit_rad, servos.superposition_rate_radps
    for name, (ratio, limit_rad, rate_radps) in {"rl_steer": rear, "rr_steer": rear, "superposition": front}.items():
        actuator = model.actuator(name).id
        lag_s, hinge_radps = model.actuator_dynprm[actuator, :2]
        least_rad, most_rad = model.actuator_ctrlrange[actuator] / ratio
        assert lag_s == servos.lag_s
        # The table has tenths of a degree, and whole degrees per second that suit all cars.
        assert (-least_rad, most_rad) == pytest.approx((limit_rad, limit_rad), abs=math.radians(0.05))
        assert hinge_radps / ratio == pytest.approx(rate_radps, abs=math.radians(1.0))


@pytest.mark.parametrize(("name", "interval_s"), [("lqr", 0.005), ("integrated", 0.005)])
def test_controllers_keep_to_the_table(name: str, interval_s: float) -> None:
    if name != "lqr":
        pytest.importorskip("daqp")
    known = resolve("straight_line").controller_setup(interval_s)
    quick = ServoParameters(
        rear_limit_rad=0.02, superposition_limit_rad=0.01, rear_rate_radps=50.0, superposition_rate_radps=50.0
    )
    setup = replace(known, gains=replace(known.gains, servos=quick))
    answer = load_controller(name, setup).step(steering(0.0), measured(0.5))
    assert answer.rear_steer_demand_rad == pytest.approx(0.02)
    assert answer.superposition_demand_rad == pytest.approx(-0.01)
