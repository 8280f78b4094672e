"""Claims D1 to D5 pass where they hold and fail where they do not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from activesteer.analysis.claims import SCENARIOS, Claim
from activesteer.errors import ParameterError
from tests.unit.analysis.synthetic import COMPLETION_S, REVERSAL_S, sine_with_dwell


def good() -> dict[str, dict[str, Any]]:
    """Arguments of three runs for which all five claims hold."""
    return {
        "none": {"after_1000ms": 0.7, "after_1750ms": 0.6, "sideslip_rad": np.radians(30.0)},
        "ars": {"after_1000ms": 0.10, "after_1750ms": 0.02, "sideslip_rad": 0.05, "rear_rad": 0.02},
        "afs": {"after_1000ms": 0.20, "after_1750ms": 0.05, "sideslip_rad": 0.06, "superposition_rad": -0.03},
    }


def check(arguments: dict[str, dict[str, Any]], side: float = 1.0) -> dict[str, Claim]:
    runs = {system: sine_with_dwell(side=side, **words) for system, words in arguments.items()}
    return {claim.id: claim for claim in SCENARIOS["sine_with_dwell"](runs)}


def failing(claims: dict[str, Claim]) -> list[str]:
    return [name for name, claim in claims.items() if not claim.passed]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_all_hold_where_they_hold(side):
    claims = check(good(), side)
    assert list(claims) == ["D1", "D2", "D3", "D4", "D5"]
    assert failing(claims) == []


@pytest.mark.parametrize(
    ("broken", "system", "change"),
    [
        (["D1"], "none", {"after_1000ms": 0.3, "after_1750ms": 0.15}),  # the ratios are kept
        (["D1"], "none", {"sideslip_rad": np.radians(19.0)}),  # sideslip is below 20 deg
        (["D2", "D5"], "ars", {"after_1000ms": 0.38}),
        (["D2"], "ars", {"after_1750ms": 0.22}),
        (["D2"], "ars", {"after_1750ms": -0.22}),  # swings back: the standard would let it pass
        (["D3"], "afs", {"after_1000ms": 0.38}),
        (["D3"], "afs", {"after_1750ms": 0.22}),
        (["D4"], "ars", {"rear_rad": -0.02}),
        (["D4"], "afs", {"superposition_rad": 0.03}),
        (["D4"], "ars", {"rear_rad": 0.0}),  # nothing is added: no sign
        (["D4"], "ars", {"rear_rad": 0.001}),  # never above 0.1 deg
        (["D5"], "ars", {"sideslip_rad": 0.07}),
        (["D5"], "ars", {"after_1000ms": 0.25}),
        (["D5"], "ars", {"after_1000ms": -0.25}),
    ],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_only_the_broken_one_fails(broken, system, change, side):
    arguments = good()
    arguments[system] |= change
    assert failing(check(arguments, side)) == broken


def test_one_ratio_above_its_limit_is_enough_to_fail_the_standard():
    arguments = good()
    arguments["none"] |= {"after_1000ms": 0.3, "after_1750ms": 0.25}
    assert check(arguments)["D1"].passed


def test_angles_that_are_opposite_for_less_than_nine_tenths_of_the_time_do_not_pass():
    runs = {system: sine_with_dwell(**words) for system, words in good().items()}
    claims = {claim.id: claim for claim in SCENARIOS["sine_with_dwell"](runs)}
    assert claims["D4"].values["added_angles_opposite_share"] == 1.0
    rear = runs["ars"]["rear_steer_demand_rad"].copy()
    # For the last 0.2 s of some 1.2 s both turn the same way.
    last = (runs["ars"].time_s > COMPLETION_S - 0.3) & (runs["ars"].time_s < COMPLETION_S - 0.1)
    rear[last] *= -1.0
    runs["ars"].channels["rear_steer_demand_rad"] = rear
    claim = {claim.id: claim for claim in SCENARIOS["sine_with_dwell"](runs)}["D4"]
    assert claim.values["added_angles_correlation"] < 0.0
    assert 0.7 < claim.values["added_angles_opposite_share"] < 0.9
    assert not claim.passed


def demands(rear, front) -> Claim:
    """D4 of runs with these demanded angles, functions of the time since the reversal."""
    runs = {system: sine_with_dwell(**words) for system, words in good().items()}
    since_s = runs["ars"].time_s - REVERSAL_S
    runs["ars"].channels["rear_steer_demand_rad"] = rear(since_s)
    runs["afs"].channels["superposition_demand_rad"] = front(since_s)
    return {claim.id: claim for claim in SCENARIOS["sine_with_dwell"](runs)}["D4"]


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
    runs = {system: sine_with_dwell(**words) for system, words in good().items()}
    ars = runs["ars"]
    ars.channels["rear_steer_demand_rad"] = np.where(ars.time_s < 1.2, -5.0, 1.0) * ars["rear_steer_demand_rad"]
    assert {claim.id: claim for claim in SCENARIOS["sine_with_dwell"](runs)}["D4"].passed


@pytest.mark.parametrize(("system", "number"), [("ars", "D2"), ("afs", "D3")])
def test_a_value_that_does_not_exist_fails_its_claim(system, number):
    arguments = good()
    arguments[system]["duration_s"] = COMPLETION_S + 1.5
    assert number in failing(check(arguments))


def test_a_missing_run_is_named():
    with pytest.raises(ParameterError, match="sine with dwell need the runs none, ars, afs; missing: afs"):
        SCENARIOS["sine_with_dwell"]({"none": sine_with_dwell(), "ars": sine_with_dwell()})
