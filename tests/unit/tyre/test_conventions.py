"""Conventions that a tyre file leaves to the reading program: the effect of each."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from activesteer.config import Source, build
from activesteer.errors import ParameterError
from activesteer.tyre import MagicFormula, load_tir
from activesteer.tyre.tyre_parameters import TyreConventions, TyreParameters
from tests.raising import raises
from tests.unit.tyre.tyres import TYRES, differing

LOAD_N, ALPHA_RAD, KAPPA = 4000.0, np.radians(2.0), 0.03


@pytest.fixture(scope="module")
def tyre() -> TyreParameters:
    return load_tir(TYRES / "sedan_pac02.tir")


def forces(tyre: TyreParameters, kappa: float = 0.0, alpha: float = ALPHA_RAD, gamma: float = 0.0, mu: float = 1.0,
           **conventions: object):  # fmt: skip
    chosen = replace(tyre, conventions=TyreConventions(**conventions))  # type: ignore[arg-type]
    return MagicFormula(chosen).evaluate(LOAD_N, kappa, alpha, gamma, vx_mps=20.0, road_friction=mu)


def test_the_defaults_stand_as_zero_and_one(tyre: TyreParameters) -> None:
    numbers = TyreConventions().numbers()
    assert list(numbers.values()) == [0.0] * 8 + [1.0]
    assert {name: tyre.record[name] for name in numbers} == numbers


def test_each_convention_has_its_own_place(tyre: TyreParameters) -> None:
    changes = {
        "camber": False, "relaxation": False, "combined_slip": "friction_ellipse", "friction_scales": "peaks",
        "slip_velocity": "wheel_centre", "rolling_radius": "third_of_deflection", "trail_load": "scaled",
        "speed_offset_mps": 0.1, "reference_friction": 0.8,
    }  # fmt: skip
    default = tyre.record
    for place, (key, value) in zip(TyreConventions().numbers(), changes.items(), strict=True):
        changed = replace(tyre, conventions=TyreConventions(**{key: value})).record  # type: ignore[arg-type]
        assert differing(changed, default) == [place], key


def test_they_travel_between_processes_and_to_the_other_side(tyre: TyreParameters) -> None:
    chosen = replace(tyre, conventions=TyreConventions(camber=False))
    assert pickle.loads(pickle.dumps(chosen)).conventions == chosen.conventions
    assert chosen.mounted_on("LEFT").conventions == chosen.conventions


def test_without_camber_an_inclined_wheel_has_the_forces_of_an_upright_one(tyre: TyreParameters) -> None:
    upright, leaning = forces(tyre, camber=False), forces(tyre, gamma=0.05, camber=False)
    assert leaning.fy_N == upright.fy_N
    assert abs(forces(tyre, gamma=0.05).fy_N - upright.fy_N) > 50.0


def test_the_ellipse_leaves_pure_slip_alone_and_keeps_the_resultant_within_friction(tyre: TyreParameters) -> None:
    shift = -0.00113  # where F_x vanishes, nearly: the file's horizontal shift
    assert forces(tyre, kappa=shift, combined_slip="friction_ellipse").fy_N == pytest.approx(
        forces(tyre, kappa=shift).fy_N, rel=1e-4
    )
    both = forces(tyre, kappa=0.12, alpha=0.12, combined_slip="friction_ellipse")
    square = forces(tyre, kappa=0.12, alpha=0.12)
    ellipse = np.hypot(both.fx_N / both.friction_x, both.fy_N / both.friction_y) / LOAD_N
    assert ellipse < 1.06
    assert np.hypot(square.fx_N / both.friction_x, square.fy_N / both.friction_y) / LOAD_N > 1.3


def test_friction_of_the_road_scales_peaks_only_or_all(tyre: TyreParameters) -> None:
    # Where slip is large the peak counts, where it is none the shifts do.
    for alpha in (0.0, 0.2):
        all_, peaks = (forces(tyre, alpha=alpha, mu=0.5, friction_scales=word) for word in ("formula", "peaks"))
        assert all_.friction_y == peaks.friction_y
        assert all_.fy_N != peaks.fy_N
    assert forces(tyre, mu=0.4, reference_friction=0.8).fy_N == forces(tyre, mu=0.5).fy_N


def test_rolling_radius_by_deflection(tyre: TyreParameters) -> None:
    by_hand = 0.344 - LOAD_N / 280835.2941 / 3.0
    assert forces(tyre, rolling_radius="third_of_deflection").effective_radius_m == pytest.approx(by_hand, abs=1e-9)


def test_the_trail_is_related_to_the_scaled_load(tyre: TyreParameters) -> None:
    scaled, nominal = forces(tyre, trail_load="scaled"), forces(tyre)
    assert scaled.trail_m / nominal.trail_m == pytest.approx(1.0 / 0.81, rel=1e-12)


@pytest.mark.parametrize(
    ("key", "value"),
    [("combined_slip", "ellipse"), ("speed_offset_mps", -0.1), ("reference_friction", 0.0)],
)
def test_what_does_not_exist_is_refused(key: str, value: object) -> None:
    with raises(ParameterError, key=f"tyres.conventions.{key}", value=value):
        build(TyreConventions, {key: value}, Source("car.toml"), ("tyres", "conventions"))


def test_without_relaxation_the_evaluation_has_the_length_that_the_contact_has(tyre: TyreParameters) -> None:
    """An estimator that reads the evaluation would expect a lag of 0.9 m which this tyre does not have."""
    with_it, without = forces(tyre), forces(tyre, relaxation=False)
    assert with_it.relaxation_length_y_m > 0.3
    assert without.relaxation_length_y_m == without.relaxation_length_x_m == pytest.approx(0.02)
    assert without.fy_N == with_it.fy_N
