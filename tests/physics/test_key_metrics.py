"""Key metrics of each kind of manoeuvre are metrics of its runs; the bench covers the kinds of the paper."""

from __future__ import annotations

import pytest

import activesteer
from activesteer.analysis.metrics import EVALUATIONS

SHIPPED = ("brake_in_turn", "constant_radius", "mu_jump", "random_steer", "sine_sweep", "slowly_increasing_steer")


@pytest.mark.parametrize("maneuver", [*SHIPPED, "straight_braking", "straight_line"])
def test_key_metrics_are_metrics_of_a_run(maneuver: str) -> None:
    recording = activesteer.simulate(maneuver)
    kind = recording.metadata["maneuver"]["kind"]
    assert {metric.name for metric in EVALUATIONS[kind].key_metrics} <= recording.metrics.keys()
