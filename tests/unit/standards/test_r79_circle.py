"""UN R79: steering effort of a known spiral, its limits, and the circle with faults."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from activesteer.core.files import json_text
from activesteer.plotting import Panel
from activesteer.standards import r79_circle
from activesteer.standards.examination import examine
from activesteer.standards.r79_circle import EFFORTS, FIGURES, RIM_RADIUS_M
from activesteer.standards.standard import SIDES, StandardRun
from tests.unit.standards.runners import PrescribedRunner
from tests.unit.standards.signals import run_of, times

SPEED_MPS = 10.0 / 3.6


def spiral(tightest_m: float, force_N: float, side: float = 1.0) -> StandardRun:
    """Return a spiral: the curvature and the force at the rim rise steadily for 4 s to their final values."""
    rising = np.clip(times(5.0) - 0.5, 0.0, 4.0) / 4.0
    return run_of({
        "yaw_rate_radps": side * SPEED_MPS / tightest_m * rising, "speed_mps": np.full_like(rising, SPEED_MPS),
        "hand_torque_Nm": side * RIM_RADIUS_M * force_N * rising, "steering_wheel_rad": side * rising,
    })  # fmt: skip


class SpiralRunner(PrescribedRunner):
    """A car with prescribed steering effort and faults."""

    def __init__(self, tightest_m: float = 9.0, force_N: float = 100.0) -> None:
        super().__init__(lambda _, case: spiral(tightest_m, force_N, math.copysign(1.0, case["steer.rate_degps"])))


@pytest.fixture
def two_faults(monkeypatch) -> None:
    """Prescribe the circles with faults."""

    def fault_circles(_: object) -> list[dict[str, Any]]:
        one = dict.fromkeys(FIGURES, 0.1) | {"fault": "rear:stuck", "fault_tolerant_time_s": None}
        lost = dict.fromkeys(FIGURES, math.nan) | {"fault": "rear:float", "error": "the car tips over"}
        return [row | {"direction": direction} for row in (one, lost) for direction in SIDES]

    monkeypatch.setattr(r79_circle, "fault_circles", fault_circles)


def test_force_until_the_radius_of_a_known_spiral():
    """1/12 m of 1/9 m is reached after 3 of 4 s, with 75 of 100 N."""
    time_s, effort_N = r79_circle.reached(spiral(9.0, 100.0, -1.0), 12.0)
    assert time_s == pytest.approx(3.0, abs=0.02)
    assert effort_N == pytest.approx(75.0, abs=0.5)
    assert math.isnan(r79_circle.reached(spiral(13.0, 100.0), 12.0)[1])


@pytest.mark.usefixtures("two_faults")
def test_intact_and_without_power_assist_to_both_sides():
    runner = SpiralRunner()
    found = r79_circle.examine(runner)
    assert found.passed is True
    assert [row["direction"] for row in found.values["efforts"]] == ["left", "right"] * 2
    intact, failed = runner.asked.values()
    assert [case.get("steering.assist_fraction") for case in (*intact, *failed)] == [None, None, 0.0, 0.0]
    # To 12 m the wheel is turned further than to 20 m, by as much as the circle is tighter.
    assert intact[0]["steer.rate_degps"] == pytest.approx(20.0 / 12.0 * failed[0]["steer.rate_degps"])


@pytest.mark.usefixtures("two_faults")
@pytest.mark.parametrize(
    ("force_N", "steering"), [(200.1, ["intact"] * 2), (700.0, ["intact"] * 2 + ["power_assist_failed"] * 2)]
)
def test_more_than_the_effort_that_is_allowed_fails(force_N, steering):
    """A radius of 12 m needs three quarters of the force at 9 m, 20 m needs 9 / 20 of it."""
    found = r79_circle.examine(SpiralRunner(force_N=force_N))
    assert found.passed is False
    assert [row["steering"] for row in found.values["efforts"] if not row["pass"]] == steering
    assert r79_circle.examine(SpiralRunner(force_N=195.0)).passed is True


@pytest.mark.usefixtures("two_faults")
def test_a_radius_that_is_not_reached_fails():
    found = r79_circle.examine(SpiralRunner(tightest_m=15.0))
    assert found.passed is False
    assert "a radius of 12 m is not reached within 4 s" in found.summary


@pytest.mark.usefixtures("two_faults")
def test_a_fault_that_ends_the_run_is_a_row_and_no_verdict():
    found = r79_circle.examine(SpiralRunner())
    rows = {(row["fault"], row["direction"]): row for row in found.values["faults"]}
    assert rows["rear:float", "right"]["error"] == "the car tips over"
    assert "2 of 4 faults did not finish" in found.summary
    assert found.tables[1].outside == {2, 3}
    json.loads(json_text(found.values))


def test_the_compact_is_steered_alike_to_both_sides_and_corrected_in_both_circles(monkeypatch):
    monkeypatch.setattr("activesteer.standards.r79_circle.usual_faults", lambda _: ["rear:offset=1deg"])
    found = examine("r79-circle", ["ars"], jobs=1).findings["ars"]
    efforts = {(row["steering"], row["direction"]): row["effort_N"] for row in found.values["efforts"]}
    for name in EFFORTS:
        assert efforts[name, "left"] == pytest.approx(efforts[name, "right"], rel=1e-3)
    left, right = found.values["faults"]
    assert [left["direction"], right["direction"]] == ["left", "right"]
    # Rear wheels to the left turn the car to the right: out of a left-hand circle, into a right-hand one.
    for row in (left, right):
        assert row["lateral_offset_1s_m"] < -0.1
        assert math.radians(3.0) < row["steering_correction_rad"] < math.radians(20.0)


def test_every_plot_of_the_faults_names_its_rows_and_no_dot_covers_another():
    """Faults without effect have no row in the plots and share the last one of the table; the summary counts them."""
    sizes = {"rear:offset=1deg": 0.1, "rear:stuck": 0.0, "yaw_rate_sensor:offset=2degps": -0.1}
    both = [(*item, side) for item in sizes.items() for side in ("left", "right")]
    faults = [dict.fromkeys(FIGURES, size) | {"fault": name, "direction": side} for name, size, side in both]
    table = r79_circle._fault_table(faults)
    assert [row[0] for row in table.rows[::2]] == [
        "rear: offset 1 deg",
        "yaw rate sensor: offset 2 deg/s",
        "without effect: rear: stuck",
    ]
    assert ". 1 of 3 faults have no effect" in r79_circle._fault_words(faults)
    assert "have no effect" not in r79_circle._fault_words(faults[:2])
    for panel in r79_circle._dots(faults).panels:
        assert isinstance(panel, Panel)
        assert panel.names == ["rear: offset 1 deg", "yaw rate sensor: offset 2 deg/s"]
        places = np.concatenate([curve.y for curve in panel.curves])
        assert len(set(places)) == len(faults) - 2
        assert (np.floor(places).tolist(), [curve.label for curve in panel.curves]) == ([0, 1, 0, 1], ["left", "right"])
