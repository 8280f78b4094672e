"""Faults in the circles of UN R79: symmetry, limits, and the effects of faults."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import activesteer
from activesteer.scenario import resolve
from activesteer.standards.r79_circle import AY_MPS2, YAW_RATE_RADPS, circle, fault_circle
from activesteer.standards.standard import SIDES

FAULTS = ("rear:runaway=left", "rear:runaway=right", "rear:stuck")
BEGIN_S = 4.5


@pytest.fixture(scope="module")
def made() -> dict[tuple[str, str], dict[str, Any]]:
    rows = [row for direction in SIDES for row in fault_circle("ars", "typical", "compact", {}, FAULTS, direction)]
    return {(row["fault"], row["direction"]): row for row in rows}


def test_the_circles_mirror_and_a_stuck_actuator_does_nothing_in_a_steady_circle(made) -> None:
    outwards, inwards = made["rear:runaway=left", "left"], made["rear:runaway=right", "left"]
    for fault, row in (("rear:runaway=right", outwards), ("rear:runaway=left", inwards)):
        mirrored = made[fault, "right"]
        for key in ("lateral_offset_1s_m", "lateral_offset_1s_driver_m"):
            assert mirrored[key] == pytest.approx(-row[key], abs=1e-6)
        for key in ("yaw_rate_change_radps", "ay_change_mps2", "fault_tolerant_time_s"):
            assert mirrored[key] == pytest.approx(row[key], abs=1e-6)
    # Rear wheels to the left turn the car to the right.
    assert outwards["lateral_offset_1s_m"] < -0.5 < 0.5 < inwards["lateral_offset_1s_m"]
    # He sees it and acts 0.2 s later; a second is short.
    assert abs(outwards["lateral_offset_1s_driver_m"]) < 0.8 * abs(outwards["lateral_offset_1s_m"])
    assert outwards["steering_correction_rad"] > math.radians(10.0)
    stuck = made["rear:stuck", "left"]
    assert stuck["fault_tolerant_time_s"] is None
    assert stuck["yaw_rate_change_radps"] < math.radians(0.5)


def test_the_tolerated_time_keeps_the_limits_and_a_little_more_breaks_them(made) -> None:
    """The runs with and without the fault are driven through the public interface."""
    tolerant_s = made["rear:runaway=left", "left"]["fault_tolerant_time_s"]
    assert 0.0 < tolerant_s < 0.1
    good = activesteer.simulate(circle("left"), "ars")

    def broken(until: str = "") -> activesteer.Recording:
        return activesteer.simulate(circle("left"), "ars", overrides={"fault": f"rear:runaway=left@{BEGIN_S}{until}"})

    run, then = broken(), round((BEGIN_S + 1.0) * 1000.0) - 1
    x, y = (run[name][then] - good[name][then] for name in ("x_m", "y_m"))
    yaw = good["yaw_rad"][then]
    aside = math.cos(yaw) * y - math.sin(yaw) * x
    assert made["rear:runaway=left", "left"]["lateral_offset_1s_driver_m"] == pytest.approx(aside, abs=1e-9)

    def used(length_s: float) -> float:
        """Return the largest proportion of a limit."""
        run = broken(f"-{BEGIN_S + length_s}")
        # The driver, who answers here, has done nothing yet when the peak comes.
        yaw_rate, ay = (np.abs(run[name] - good[name]).max() for name in ("yaw_rate_radps", "ay_mps2"))
        return max(yaw_rate / YAW_RATE_RADPS, ay / AY_MPS2)

    assert used(tolerant_s) <= 1.0 < used(tolerant_s + 0.006)


@pytest.mark.parametrize("direction", SIDES)
def test_the_path_is_a_circle_of_100_m_when_the_fault_begins(direction: str) -> None:
    maneuver: Any = resolve(circle(direction)).maneuver
    x, y = np.array(maneuver.path.x_m), np.array(maneuver.path.y_m)
    curvature = SIDES[direction] * np.diff(np.unwrap(np.arctan2(np.diff(y), np.diff(x))))
    assert curvature.max() == pytest.approx(0.01, rel=0.01)
    assert curvature[round(BEGIN_S * 80.0 / 3.6) - 1] == pytest.approx(0.01, rel=0.02)
