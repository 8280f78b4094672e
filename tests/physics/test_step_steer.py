"""The step steer agrees with the paper."""

from __future__ import annotations

import pytest

from activesteer.core.conventions import GRAVITY_MPS2
from tests.physics.runs import last, run


def test_the_manoeuvre_is_the_paper_s() -> None:
    """80 km/h, 0.4 g in the steady state of the car without control, steering wheel faster than 200 deg/s."""
    recording = run("step_steer")
    end = last(recording, 0.5)
    assert recording["ay_mps2"][end].mean() == pytest.approx(0.4 * GRAVITY_MPS2, rel=1e-3)
    assert recording["speed_mps"][end].mean() * 3.6 == pytest.approx(80.0, rel=0.01)
    assert recording.metrics["steering_wheel_max_rate_radps"] > 3.49
