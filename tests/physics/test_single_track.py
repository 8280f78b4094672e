"""The multibody car against the linear single-track model of its controllers, where both must agree."""

from __future__ import annotations

import pytest

from activesteer.scenario import load_car
from activesteer.theory.single_track import SingleTrack
from tests.physics.runs import last, run

TENTH_G_MPS2 = 0.981


@pytest.mark.parametrize("speed_kmh", [50.0, 80.0, 120.0])
def test_steady_state_yaw_rate_agrees_at_a_tenth_of_g(speed_kmh: float) -> None:
    recording = run("step_steer", steer__lateral_acceleration_g=0.1, speed_kmh=speed_kmh)
    car = load_car().config
    end = last(recording, 0.5)
    assert recording["ay_mps2"][end].mean() == pytest.approx(TENTH_G_MPS2, rel=2e-3)
    demand_rad = recording["steering_wheel_demand_rad"][end].mean() / car.steering.ratio
    expected = SingleTrack(car.single_track).yaw_rate_gain(recording["speed_mps"][end].mean()) * demand_rad
    assert recording["yaw_rate_radps"][end].mean() == pytest.approx(expected, rel=0.1)
