"""Claims D1 to D5 pass if they hold and fail if they do not."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.analysis.claims.judge import SCENARIOS, Claim
from tests.unit.analysis.good_runs import check, failing, good, runs_of
from tests.unit.analysis.synthetic import COMPLETION_S, REVERSAL_S

SCENARIO = "sine_with_dwell"


@pytest.mark.parametrize(
    ("broken", "system", "change"),
    [
        (["D1"], "none", {"after_1000ms": 0.3, "after_1750ms": 0.15}),  # the ratios are kept
        (["D1"], "none", {"sideslip_rad": np.radians(19.0)}),  # sideslip is below 20 deg
        (["D2", "D5"], "ars", {"after_1000ms": 0.38}),
        (["D2", "D5"], "ars", {"after_1750ms": 0.22}),
        (["D2", "D5"], "ars", {"after_1750ms": -0.22}),  # swings back: the standard would let it pass
        (["D3"], "afs", {"after_1000ms": 0.38}),
        (["D3"], "afs", {"after_1750ms": 0.22}),
        (["D4"], "ars", {"rear_rad": -0.02}),
        (["D4"], "afs", {"superposition_rad": 0.03}),
        (["D4"], "ars", {"rear_rad": 0.0015}),  # never above 0.1 deg
        (["D5"], "ars", {"sideslip_rad": 0.0585}),  # 0.09 deg below afs
        (["D2", "D5"], "ars", {"sideslip_rad": np.radians(13.0)}),
        (["D1", "D2", "D5"], "ars", {"sideslip_rad": np.radians(16.0)}),  # none has less than twice as much
        (["D3"], "afs", {"sideslip_rad": np.radians(13.0)}),
        (["D5"], "ars", {"sideslip_rad": 0.07}),
        (["D5"], "ars", {"after_1000ms": 0.25}),
        (["D5"], "ars", {"after_1000ms": -0.25}),
    ],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_only_the_broken_one_fails(broken, system, change, side):
    arguments = good(SCENARIO)
    arguments[system] |= change
    assert failing(SCENARIO, arguments, side=side) == broken


def test_one_ratio_above_its_limit_is_enough_to_fail_the_standard():
    arguments = good(SCENARIO)
    arguments["none"] |= {"after_1000ms": 0.3, "after_1750ms": 0.25}
    assert check(SCENARIO, arguments)["D1"].passed


def test_angles_that_are_opposite_for_less_than_nine_tenths_of_the_time_do_not_pass():
    runs = runs_of(SCENARIO, good(SCENARIO))
    claims = {claim.id: claim for claim in SCENARIOS[SCENARIO](runs)}
    assert claims["D4"].values["added_angles_opposite_share"] == 1.0
    rear = runs["ars"]["rear_steer_demand_rad"].copy()
    # For the last 0.2 s of some 1.2 s both turn the same way.
    last = (runs["ars"].time_s > COMPLETION_S - 0.3) & (runs["ars"].time_s < COMPLETION_S - 0.1)
    rear[last] *= -1.0
    runs["ars"].channels["rear_steer_demand_rad"] = rear
    claim = {claim.id: claim for claim in SCENARIOS[SCENARIO](runs)}["D4"]
    assert claim.values["added_angles_correlation"] < 0.0
    assert 0.7 < claim.values["added_angles_opposite_share"] < 0.9
    assert not claim.passed


def demands(rear, front) -> Claim:
    """Return D4 for runs with these demanded angles, functions of the time since the reversal."""
    runs = runs_of(SCENARIO, good(SCENARIO))
    since_s = runs["ars"].time_s - REVERSAL_S
    runs["ars"].channels["rear_steer_demand_rad"] = rear(since_s)
    runs["afs"].channels["superposition_demand_rad"] = front(since_s)
    return {claim.id: claim for claim in SCENARIOS[SCENARIO](runs)}["D4"]


@pytest.mark.parametrize(("length_s", "passed"), [(0.05, False), (0.15, True)])
def test_angles_that_are_large_together_only_for_a_moment_prove_nothing(length_s, passed):
    claim = demands(
        lambda t: np.where((t > 0.3) & (t < 0.3 + length_s), 0.02, 1e-4),
        lambda t: np.where(t > 0.2, -0.02, 0.0),
    )
    assert claim.values["added_angles_correlation"] < 0.0
    assert claim.values["added_angles_common_s"] == pytest.approx(length_s, abs=0.002)
    assert claim.passed is passed


def test_small_opposite_angles_do_not_outweigh_large_ones_of_one_sign():
    claim = demands(
        lambda t: np.where((t > 0.3) & (t < 0.35), 0.1, 0.002),
        lambda t: np.where((t > 0.3) & (t < 0.35), 0.1, -0.002),
    )
    assert claim.values["added_angles_opposite_share"] > 0.95
    assert claim.values["added_angles_correlation"] > 0.0
    assert not claim.passed


def test_what_happens_before_the_reversal_does_not_count():
    runs = runs_of(SCENARIO, good(SCENARIO))
    ars = runs["ars"]
    ars.channels["rear_steer_demand_rad"] = np.where(ars.time_s < 1.2, -5.0, 1.0) * ars["rear_steer_demand_rad"]
    assert {claim.id: claim for claim in SCENARIOS[SCENARIO](runs)}["D4"].passed


@pytest.mark.parametrize(("system", "number"), [("ars", "D2"), ("afs", "D3")])
def test_a_value_that_does_not_exist_fails_its_claim(system, number):
    arguments = good(SCENARIO)
    arguments[system]["duration_s"] = COMPLETION_S + 1.5
    assert number in failing(SCENARIO, arguments)
