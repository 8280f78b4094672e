"""Each claim of the paper passes where it holds and fails where it does not."""

from __future__ import annotations

from typing import Any

import pytest

from activesteer.analysis.claims import Claim, step_steer_claims
from activesteer.errors import ParameterError
from tests.unit.analysis.synthetic import SyntheticRun, second_order, step_steer


def good() -> dict[str, dict[str, Any]]:
    """Arguments of three runs for which all five claims hold."""
    damped = {"yaw": lambda t: second_order(t, 10.0, 0.6)}
    return {
        "none": {"sideslip_rad": -0.01},
        "ars": {**damped, "sideslip_rad": -0.015, "rear_rad": -0.01},
        "afs": {**damped, "superposition_rad": 0.005},
    }


def check(arguments: dict[str, dict[str, Any]], side: float = 1.0) -> dict[str, Claim]:
    runs: dict[str, SyntheticRun] = {system: step_steer(side=side, **words) for system, words in arguments.items()}
    return {claim.id: claim for claim in step_steer_claims(runs)}


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_all_hold_where_they_hold(side):
    claims = check(good(), side)
    assert list(claims) == ["S1", "S2", "S3", "S4", "S5"]
    assert all(claim.passed for claim in claims.values())


@pytest.mark.parametrize(
    ("broken", "system", "change"),
    [
        ("S1", "ars", {"yaw_radps": 0.25}),
        ("S1", "afs", {"yaw_radps": 0.25}),
        ("S2", "ars", {"yaw": lambda t: second_order(t - 0.05, 10.0, 0.6)}),
        ("S2", "afs", {"yaw": lambda t: second_order(t - 0.05, 10.0, 0.6)}),
        ("S3", "ars", {"rear_rad": 0.01}),
        ("S3", "ars", {"rear_rad": 0.0}),
        ("S4", "afs", {"superposition_rad": -0.005}),
        ("S4", "afs", {"superposition_rad": 0.0}),
        ("S5", "ars", {"sideslip_rad": -0.005}),
    ],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_only_the_broken_one_fails(broken, system, change, side):
    arguments = good()
    arguments[system] |= change
    assert [name for name, claim in check(arguments, side).items() if not claim.passed] == [broken]


def test_a_response_within_the_tolerance_is_not_later():
    arguments = good()
    arguments["ars"]["yaw"] = lambda t: second_order(t - 0.004, 9.0, 0.51)
    arguments["none"]["yaw"] = lambda t: second_order(t, 9.0, 0.5)
    claim = check(arguments)["S2"]
    assert 0.004 < claim.values["ars_yaw_rate_response_time_s"] - claim.values["none_yaw_rate_response_time_s"] < 0.008
    arguments["ars"]["yaw"] = lambda t: second_order(t - 0.003, 9.0, 0.5)
    assert check(arguments)["S2"].passed


def test_values_name_system_and_metric():
    claim = check(good())["S1"]
    assert set(claim.values) == {f"{system}_yaw_rate_peak_radps" for system in ("none", "ars", "afs")}


def test_a_missing_run_is_named():
    with pytest.raises(ParameterError, match="missing: afs"):
        step_steer_claims({"none": step_steer(), "ars": step_steer()})


def test_the_give_of_a_hinge_is_no_added_rear_angle():
    runs = {system: step_steer(rear_rad=-0.001) for system in ("none", "ars", "afs")}
    assert not next(claim for claim in step_steer_claims(runs) if claim.id == "S3").passed
