"""What the metadata of a recording say of course and car."""

from __future__ import annotations

import pytest

from activesteer.analysis.course import read_car, read_course
from activesteer.errors import RecordingError
from tests.unit.analysis.made_up import LANES, SLALOM_CONES, along_path, slalom, step_steer


def test_course_and_car_are_read():
    course = read_course(along_path())
    assert [tuple(lane) for lane in course.lanes] == list(LANES)
    assert course.last_gate_x_m == 155.0
    assert course.first_gate_x_m == 30.0
    car = read_car(along_path())
    assert (car.width_m, car.wheelbase_m, car.tyre_width_m) == (1.8, 2.6, (0.2, 0.2))


def test_without_lanes_the_first_cone_is_the_first_gate():
    assert read_course(slalom()).first_gate_x_m == SLALOM_CONES[0][0]


def test_a_run_without_a_course_is_refused():
    with pytest.raises(RecordingError, match="no table 'course'"):
        read_course(step_steer())
    with pytest.raises(RecordingError, match="no table 'car'"):
        read_car(step_steer())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"path": None}, r"'course\.path' is None"),
        ({"path": {"x_m": [0.0, 1.0], "y_m": [0.0]}}, "2 x_m and 1 y_m"),
        ({"path": {"x_m": [0.0, float("nan")], "y_m": [0.0, 0.0]}}, r"'course\.path\.x_m'"),
        ({"lanes": [{"name": "a", "start_x_m": 0.0}]}, "KeyError: 'end_x_m'"),
        ({"cones": [[1.0, 2.0, 3.0]]}, "cannot be read"),
        ({"last_gate_x_m": "far"}, "cannot be read"),
    ],
)
def test_a_damaged_course_is_named(change, message):
    run = along_path()
    run.metadata["course"] |= change
    with pytest.raises(RecordingError, match=message):
        read_course(run)


@pytest.mark.parametrize("change", [{"tyre_width_m": [0.2]}, {"width_m": None}, {"wheelbase_m": "long"}])
def test_a_damaged_car_is_named(change):
    run = along_path()
    run.metadata["car"] |= change
    with pytest.raises(RecordingError, match=next(iter(change))):
        read_car(run)
