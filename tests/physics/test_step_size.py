"""The step of 1 ms is short enough: a quarter of it gives the same result."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.core.conventions import DEFAULT_TIMESTEP_S
from tests.physics.runs import STEP_DEG, run

PEAKS = ("yaw_rate_radps", "ay_mps2", "roll_rad", "sideslip_rad")


@pytest.mark.parametrize("controller", ["none", "ars", pytest.param("afs", marks=pytest.mark.slow)])
@pytest.mark.parametrize("channel", PEAKS)
def test_peaks_agree_between_steps(channel: str, controller: str) -> None:
    coarse, fine = (
        run("step_steer", controller, timestep_s=each, steer__steering_wheel_deg=STEP_DEG, duration_s=2.5)
        for each in (DEFAULT_TIMESTEP_S, 0.25 * DEFAULT_TIMESTEP_S)
    )
    peak, reference = (float(np.abs(recording[channel]).max()) for recording in (coarse, fine))
    assert peak == pytest.approx(reference, rel=5e-3)
