"""The comparison with a measured circle: its measures by hand, and the angle against what geometry asks for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from activesteer.config import read_toml
from activesteer.errors import ParameterError
from activesteer.resources import find_vehicle
from activesteer.validation.measured_circle import CircleResult, is_measured, steering_wheel_deg, validate_circle
from tests.raising import raises


def result(ours: np.ndarray, measured: np.ndarray) -> CircleResult:
    return CircleResult("car", measured, float(ours.mean()), ours, ())


def test_the_area_between_shifted_distributions_is_the_shift(rng: np.random.Generator) -> None:
    values = rng.normal(94.0, 1.3, 200)
    assert result(values + 5.0, values).area_metric_deg == pytest.approx(5.0, abs=1e-9)
    assert result(values, values).area_metric_deg == pytest.approx(0.0, abs=1e-9)


def test_distributions_apart_do_not_overlap_and_alike_ones_do(rng: np.random.Generator) -> None:
    values = rng.normal(94.0, 1.3, 200)
    assert result(values + 30.0, values).overlap < 1e-3
    assert result(values, values).overlap == pytest.approx(1.0, abs=0.01)


def test_the_tolerance_is_that_of_iso_19364() -> None:
    measured = np.array([99.0, 101.0])
    assert result(measured + 7.9, measured).inside
    assert not result(measured + 8.1, measured).inside


def test_too_few_samples_are_an_error() -> None:
    assert is_measured("tesla_model_s")
    assert not is_measured("sedan")
    with raises(ParameterError, key="samples"):
        validate_circle("tesla_model_s", 5)


@pytest.mark.slow
def test_at_little_lateral_acceleration_the_angle_is_that_of_ackermann() -> None:
    """On 30 m the wheels ask for 5.64 deg, the ratio is 15.5; toe-in at the rear and slip leave some degrees."""
    table, _ = read_toml(find_vehicle("tesla_model_s"))
    angle = steering_wheel_deg({**table, "name": "tesla_model_s"}, 30.0, 1.0, 1.0, 1.0)
    assert angle == pytest.approx(15.48 * math.degrees(math.atan(2.96 / 30.0)), rel=0.05)
