"""The paper's rear steering with a sideslip term."""

from __future__ import annotations

from typing import Any

import pytest

from activesteer.controllers.rear_steer import RearSteer, SideslipRearSteer
from activesteer.core.signals import Estimate
from activesteer.scenario import resolve
from tests.unit.controllers.cars import measured, steering

SETUP = resolve("straight_line").controller_setup(0.001)
GAIN, LIMIT_RAD, SPEED_MPS = SETUP.gains.ars_sideslip.sideslip_gain, SETUP.gains.ars.limit_rad, 25.0


class Knows:
    """An estimator with a known sideslip angle."""

    def __init__(self, sideslip_rad: float) -> None:
        self.sideslip_rad = sideslip_rad

    def step(self, measurement):
        speed_mps = measurement.speed_mps
        lateral_mps = speed_mps * self.sideslip_rad
        return Estimate(speed_mps, lateral_mps, self.sideslip_rad, measurement.yaw_rate_radps, 0.9, *[0.0] * 5)


def answer(sideslip_rad: float, speed_mps: float = SPEED_MPS):
    knows: Any = Knows(sideslip_rad)
    made = SideslipRearSteer(SETUP)
    made._estimator = knows
    return made.step(steering(0.01), measured(0.05, speed_mps))


@pytest.mark.parametrize("sideslip_rad", [-0.02, 0.01])
def test_rear_wheels_turn_against_the_sideslip_beside_what_the_paper_asks(sideslip_rad):
    paper = RearSteer(SETUP).step(steering(0.01), measured(0.05, SPEED_MPS))
    found = answer(sideslip_rad)
    assert found.rear_steer_demand_rad - paper.rear_steer_demand_rad == pytest.approx(-GAIN * sideslip_rad)
    assert not found.saturated


def test_angle_ends_at_its_limit():
    assert answer(-0.5).rear_steer_demand_rad == LIMIT_RAD
    assert answer(-0.5).saturated


def test_at_walking_speed_it_rests():
    assert answer(-0.5, 1.0).rear_steer_demand_rad == 0.0
