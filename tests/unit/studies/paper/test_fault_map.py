"""The fault map: symmetry, limits, and the effects of faults."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer.errors import ParameterError
from activesteer.plotting import Heat
from activesteer.scenario import resolve
from activesteer.studies.paper.fault_map import FaultMap, Limits, fault_map
from activesteer.studies.paper.fault_map_figure import _PICTURES, _picture, draw_fault_map
from activesteer.studies.paper.fault_situations import SITUATIONS, TURN_MPS2, path_of
from tests.raising import raises

FAULTS = ("rear:runaway=left", "rear:runaway=right", "rear:stuck")


@pytest.fixture(scope="module")
def made() -> FaultMap:
    return fault_map("ars", faults=FAULTS, speeds_kmh=[100.0], situations=["straight"], jobs=1)


def test_straight_ahead_left_and_right_mirror_and_a_stuck_actuator_does_nothing(made: FaultMap) -> None:
    left, right, stuck = made.rows
    assert [row["fault"] for row in made.rows] == list(FAULTS)
    for key in ("lateral_offset_1s_m", "lateral_offset_1s_driver_m"):
        assert left[key] == pytest.approx(-right[key], abs=1e-6)
    for key in ("yaw_rate_change_radps", "ay_change_mps2", "fault_tolerant_time_s"):
        assert left[key] == pytest.approx(right[key], abs=1e-6)
    # Rear wheels to the left turn the car to the right.
    assert left["lateral_offset_1s_m"] < -1.0
    # He sees it and acts 0.2 s later; a second is short.
    assert abs(left["lateral_offset_1s_driver_m"]) < 0.8 * abs(left["lateral_offset_1s_m"])
    assert left["steering_correction_rad"] > math.radians(10.0)
    assert stuck["steering_correction_rad"] < math.radians(0.1)
    assert stuck["fault_tolerant_time_s"] is None
    assert stuck["yaw_rate_change_radps"] < 1e-3


def test_the_tolerated_time_keeps_the_limits_and_a_little_more_breaks_them(made: FaultMap) -> None:
    """The run with a fault of that length is driven through the public interface."""
    import activesteer  # noqa: PLC0415

    tolerant_s = made.rows[0]["fault_tolerant_time_s"]
    assert 0.0 < tolerant_s < 0.1
    table = path_of("straight", 100.0 / 3.6, 3.0)

    def used(length_s: float) -> float:
        """Return the largest proportion of a limit."""
        fault = {"part": "rear", "kind": "runaway", "side": "left", "start_s": 1.0, "end_s": 1.0 + length_s}
        run = activesteer.simulate(table, "ars", overrides={"fault": [fault]})
        yaw_rate, ay = (np.abs(run[name]).max() for name in ("yaw_rate_radps", "ay_mps2"))
        return max(yaw_rate / made.limits.yaw_rate_radps, ay / made.limits.ay_mps2)

    # Straight ahead the driver, who answers here, has done nothing yet when the peak comes.
    assert used(tolerant_s) <= 1.0 < used(tolerant_s + 0.006)


def test_wider_limits_tolerate_longer() -> None:
    wide = Limits(yaw_rate_radps=math.radians(8.0), ay_mps2=4.0)
    (row,) = fault_map(
        "ars", faults=FAULTS[:1], speeds_kmh=[100.0], situations=["straight"], limits=wide, jobs=1
    ).rows  # fmt: skip
    assert row["fault_tolerant_time_s"] > 0.04


@pytest.mark.parametrize("name", ["turn", "lane_change", "circle_100m", "circle_100m_right"])
def test_the_paths_have_the_curvature_that_they_shall_have(name: str) -> None:
    speed = 80.0 / 3.6
    maneuver: Any = resolve(path_of(name, speed, 6.0)).maneuver
    x, y = np.array(maneuver.path.x_m), np.array(maneuver.path.y_m)
    heading = np.unwrap(np.arctan2(np.diff(y), np.diff(x)))
    curvature = (-1.0 if name.endswith("_right") else 1.0) * np.diff(heading)
    expected = 0.01 if "circle" in name else TURN_MPS2 / speed**2
    assert curvature.max() == pytest.approx(expected, rel=0.01)
    at_fault = round(SITUATIONS[name].fault_s(speed) * speed)
    assert curvature[at_fault - 1] == pytest.approx(expected, rel=0.02)
    if name == "lane_change":
        assert y[-1] == pytest.approx(3.5, abs=0.05)


@pytest.mark.parametrize(
    ("wrong", "key", "value"),
    [
        ({"situations": ["trun"]}, "situation", "trun"),
        ({"speeds_kmh": [5.0]}, "speed_kmh", 5.0),
        ({"faults": ["rear:stuck@2.0"]}, "--fault", "rear:stuck@2.0"),
        ({"faults": ["rear:offset"]}, "size_rad", None),
    ],
)
def test_wrong_inputs_are_named(wrong: dict[str, Any], key: str, value: Any) -> None:
    with raises(ParameterError, key=key, value=value):
        fault_map("ars", jobs=1, **wrong)


def test_a_limit_that_is_not_written_as_a_pair_is_named() -> None:
    from activesteer.commands.arguments import pairs  # noqa: PLC0415

    assert pairs(["ay_mps2=2"], "--limit", "ay_mps2=2") == {"ay_mps2": 2}
    with raises(ParameterError, value="ay"):
        pairs(["ay"], "--limit", "ay_mps2=2")


def test_every_figure_is_drawn(made: FaultMap, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    files = draw_fault_map(made, tmp_path)
    assert [file.name for file in files if file.suffix == ".html"] == ["fault_map.html"]
    page = files[-1].read_text(encoding="utf-8")
    assert page.count("<svg") == 3
    assert "The limits are 3 deg/s of yaw rate" in page
    assert {file.stem for file in files[:-1]} == {"fault_tolerant_time", "yaw_rate_change", "lateral_offset"}
    assert all(file.stat().st_size > 5000 for file in files)


def test_a_blank_field_has_no_colour(made: FaultMap) -> None:
    for name, shown in _PICTURES.items():
        for panel in _picture(made, shown).panels:
            assert isinstance(panel, Heat)
            blank = np.isnan(np.asarray(panel.values))
            assert (blank == np.array([[text in ("", "failed") for text in row] for row in panel.texts])).all()
            if name == "fault_tolerant_time":
                assert blank.any()
