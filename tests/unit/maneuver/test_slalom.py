"""The slalom: a path past the cones, and the messages for wrong ones."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from activesteer.errors import ManeuverError
from activesteer.maneuver.lane_changes import Slalom
from tests.raising import raises
from tests.unit.maneuver.made import made


def slalom(cones: dict[str, Any] | None = None, **keys: Any) -> Slalom:
    table = {"kind": "slalom", "speed_kmh": 100, "duration_s": 12.5, "vehicle_width_m": 1.8, "cones": cones or {}}
    return made(Slalom, table | keys)


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("count", [2, 5, 6])
def test_every_cone_is_passed_on_the_other_side_by_the_offset(side, count):
    course = slalom({"side": side, "count": count, "offset_m": 1.2, "spacing_m": 30.0, "entry_m": 40.0}).course
    assert course.cones_m.tolist() == [[40.0 + 30.0 * number, 0.0] for number in range(count)]
    assert course.last_gate_x_m == 40.0 + 30.0 * (count - 1)
    assert course.lanes == ()
    y = np.interp(course.cones_m[:, 0], course.path.x_m, course.path.y_m)
    first = 1.0 if side == "left" else -1.0
    assert y == pytest.approx([first * 1.2 * (-1.0) ** number for number in range(count)], abs=2e-3)


def test_path_between_cones_is_a_cosine_with_its_peak_curvature_at_them():
    path = slalom({"spacing_m": 36.0, "offset_m": 1.15, "entry_m": 50.0}).course.path
    between = (path.x_m >= 50.0) & (path.x_m <= 50.0 + 4 * 36.0)
    x = path.x_m[between]
    assert path.y_m[between] == pytest.approx(1.15 * np.cos(np.pi * (x - 50.0) / 36.0), abs=1e-4)
    peak = float(np.abs(path.curvature_1pm[between]).max())
    assert peak == pytest.approx(1.15 * (math.pi / 36.0) ** 2, rel=0.01)


def test_path_comes_from_the_row_and_leaves_straight_beside_it():
    course = slalom({"entry_m": 60.0}).course
    path = course.path
    crest = 1.15 * (math.pi / 36.0) ** 2
    assert (path.x_m[0], path.y_m[0]) == pytest.approx((0.0, 0.0), abs=1e-9)
    straight = path.x_m < 60.0 - 36.5
    assert np.abs(path.y_m[straight]).max() < 1e-3
    entry = (path.x_m > 24.0) & (path.x_m < 60.0)
    assert np.abs(path.curvature_1pm[entry]).max() < 1.01 * crest
    assert path.x_m[-1] == pytest.approx(course.last_gate_x_m)
    assert path.y_m[-1] == pytest.approx(-1.15)
    assert path.heading_rad[-1] == pytest.approx(0.0, abs=1e-3)
    assert path.curvature_1pm[-1] == pytest.approx(0.0, abs=0.02 * crest)
    assert np.abs(path.curvature_1pm).max() < 1.16 * crest
    # No jump: the whole curvature is built up over many points of the path.
    assert np.abs(np.diff(path.curvature_1pm)).max() < 0.15 * crest


def test_first_pass_on_the_right_is_the_mirror_image():
    left, right = (slalom({"side": side}).course.path for side in ("left", "right"))
    assert np.array_equal(right.y_m, -left.y_m)


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"cones": {"offset_m": 0.8}}, "cones.offset_m"),
        ({"cones": {"entry_m": 20.0}}, "cones.entry_m"),
        ({"cones": {"count": 1}}, "cones.count"),
        ({"cones": {"count": 5.5}}, "cones.count"),
        ({"cones": {"spacing_m": -36}}, "cones.spacing_m"),
        ({"cones": {"side": "l"}}, "cones.side"),
        ({"speed_kmh": -100}, "speed_kmh"),
        ({"speed_kmh": -50}, "speed_kmh"),
        ({"duration_s": 8.0}, "duration_s"),
    ],
)
def test_wrong_values_are_answered_with_what_is_allowed(keys, key):
    with raises(ManeuverError, file="mine.toml", key=key):
        slalom(**keys)


@pytest.mark.parametrize(
    ("keys", "minimum"),
    [({"cones": {"offset_m": 0.8}}, 0.9), ({"cones": {"entry_m": 20.0}}, 36.0), ({"duration_s": 8.0}, 11.8)],
)
def test_least_that_is_allowed_is_part_of_the_answer(keys, minimum):
    with raises(ManeuverError) as refused:
        slalom(**keys)
    assert refused.value.allowed.low == pytest.approx(minimum, abs=0.05)
