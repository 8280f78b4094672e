"""The desired turn, and how much of it the measured lateral acceleration shows the road to bear."""

from __future__ import annotations

import pytest

from activesteer.controllers.turn_reference import BorneTurnReference, desired_turn
from tests.unit.controllers.cars import CAR, setup

SPEED_MPS = 25.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("name", ["esc", "tv"])
def test_a_turn_that_the_road_does_not_bear_is_not_desired(name, side):
    def desired(ay_mps2):
        reference = BorneTurnReference(CAR, getattr(setup().gains, name), 0.005)
        return side * [reference.borne(side * 0.03, SPEED_MPS, 0.9, side * ay_mps2) for _ in range(1000)][-1]

    wanted = desired(10.0)
    assert wanted * SPEED_MPS > 3.0
    # Up to 0.5 m/s2 may be missing; what is missing beyond that lowers the yaw rate.
    assert desired(wanted * SPEED_MPS - 0.45) == pytest.approx(wanted)
    assert desired(wanted * SPEED_MPS - 1.5) == pytest.approx(wanted - 1.0 / SPEED_MPS)
    assert desired(-10.0) == 0.0


def test_a_driver_who_reverses_is_followed_at_once_although_the_acceleration_still_has_the_old_sign():
    reference = BorneTurnReference(CAR, setup().gains.esc, 0.005)
    for _ in range(1000):
        reference.borne(0.03, SPEED_MPS, 0.9, 8.0)
    assert [reference.borne(-0.03, SPEED_MPS, 0.9, 8.0) for _ in range(10)][-1] < 0.0


@pytest.mark.parametrize("friction", [0.9, 0.3])
def test_a_desired_turn_that_has_fallen_meanwhile_does_not_fall_twice(friction):
    """The friction becomes known, or the driver turns back; the road bears the turn that is desired now."""
    parameters = setup().gains.esc
    reference, steered = (BorneTurnReference(CAR, parameters, 0.005) for _ in range(2))
    for _ in range(1000):
        reference.borne(0.03, SPEED_MPS, 0.9, 8.0)
        desired_turn(steered, 0.03, SPEED_MPS, 0.9)
    angle_rad = 0.03 if friction < 0.9 else 0.005
    for _ in range(20):
        wanted = desired_turn(steered, angle_rad, SPEED_MPS, friction)
        assert reference.borne(angle_rad, SPEED_MPS, friction, wanted * SPEED_MPS - 0.4) == pytest.approx(wanted)
