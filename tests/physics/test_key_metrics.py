"""Key metrics of each kind of manoeuvre are metrics of its runs; the bench covers the kinds of the paper."""

from __future__ import annotations

from typing import Any

import pytest

from tests.physics.runs import assert_has_key_metrics, run


@pytest.mark.parametrize(
    ("maneuver", "overrides"),
    [
        ("brake_in_turn", {"duration_s": 7.5}),
        ("mu_jump", {}),
        ("random_steer", {"duration_s": 14.0}),
        ("straight_braking", {}),
        ("straight_line", {"duration_s": 2.0}),
        ("hill_hold", {"duration_s": 3.0}),
    ],
)
def test_key_metrics_are_metrics_of_a_run(maneuver: str, overrides: dict[str, Any]) -> None:
    """The tests of linearisation and identification see to the sine sweep, circle and slowly increasing steer."""
    assert_has_key_metrics(run(maneuver, **overrides))
