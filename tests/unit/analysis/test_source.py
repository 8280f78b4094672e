"""Metadata of a recording that the analysis uses."""

from __future__ import annotations

from activesteer.analysis.source import read_course, read_footprint
from activesteer.errors import RecordingError
from tests.raising import raises
from tests.unit.analysis.synthetic import LANES, SLALOM_CONES, along_path, slalom, step_steer


def test_course_and_car_are_read():
    course = read_course(along_path())
    assert [tuple(lane) for lane in course.lanes] == list(LANES)
    assert course.last_gate_x_m == 155.0
    assert course.first_gate_x_m == 30.0
    car = read_footprint(along_path())
    assert (car.width_m, car.wheelbase_m, car.tyre_width_m) == (1.8, 2.6, (0.2, 0.2))
    assert read_course(slalom()).first_gate_x_m == SLALOM_CONES[0][0]


def test_a_run_without_a_course_is_refused():
    with raises(RecordingError, file="the metadata", key="course"):
        read_course(step_steer())
    with raises(RecordingError, file="the metadata", key="car"):
        read_footprint(step_steer())
