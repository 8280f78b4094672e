from __future__ import annotations

import numpy as np
import pytest

from activesteer.tyre import MagicFormula
from activesteer.tyre.kernels.slip import relaxation_lengths
from activesteer.tyre.kernels.vertical import (
    deflection_under_load,
    effective_rolling_radius,
    free_radius,
    vertical_force,
    vertical_force_loaded,
)
from tests.unit.tyre.tyres import tyre


def _mf62():
    return tyre("synthetic_all_terms").with_values(
        FITTYP=62,
        Q_FCX=0.1,
        Q_FCY=0.15,
        Q_FCY2=0.4,
        Q_CAM1=0.5,
        Q_CAM2=0.3,
        Q_CAM3=0.2,
        Q_FYS1=0.1,
        Q_FYS2=0.2,
        Q_FYS3=0.1,
    )


def test_the_stiffness_at_the_nominal_load_is_that_of_the_file() -> None:
    parameters = tyre()
    p, load = parameters.record, parameters["FNOMIN"]
    deflection = deflection_under_load(p, load, 0.0, 230e3, 0.0, 0.0, 0.0)
    step = 1e-6
    slope = vertical_force(p, deflection + step, 0.0, 230e3) - vertical_force(p, deflection - step, 0.0, 230e3)
    assert slope / (2 * step) == pytest.approx(parameters["VERTICAL_STIFFNESS"], rel=1e-6)


@pytest.mark.parametrize("parameters", [tyre(), tyre("synthetic_all_terms"), _mf62()], ids=["61", "synthetic", "62"])
def test_deflection_and_force_are_inverse(parameters, rng: np.random.Generator) -> None:
    p = parameters.record
    for load, fx, fy, gamma in rng.uniform([200, -3000, -3000, -0.08], [9000, 3000, 3000, 0.08], (50, 4)):
        deflection = deflection_under_load(p, load, 40.0, 220e3, fx, fy, gamma)
        assert vertical_force_loaded(p, deflection, 40.0, 220e3, fx, fy, gamma) == pytest.approx(load, rel=1e-9)


@pytest.mark.parametrize("version", [61, 62])
def test_the_force_of_an_upright_tyre_is_that_of_the_equation_of_its_file(version: int) -> None:
    """Besselink 2010, equation 2, and MF 6.2 manual: both formulas are the same without camber and lateral force."""
    t = _mf62().with_values(FITTYP=version)
    for deflection, spin, fx in ((0.02, 0.0, 0.0), (0.03, 60.0, 0.0), (0.025, 30.0, -2500.0)):
        rho, fz0 = deflection / t["UNLOADED_RADIUS"], t["FNOMIN"]
        soft = 1.0 + t["Q_V2"] * spin * t["UNLOADED_RADIUS"] / t["LONGVL"] - (t["Q_FCX"] * fx / fz0) ** 2
        expected = soft * (t["Q_FZ1"] * rho + t["Q_FZ2"] * rho**2) * fz0
        found = vertical_force_loaded(t.record, deflection, spin, t["NOMPRES"], fx, 0.0, 0.0)
        assert found == pytest.approx(expected, rel=1e-9)


def test_no_deflection_gives_no_force() -> None:
    assert vertical_force(tyre().record, 0.0, 50.0, 230e3) == 0.0
    assert vertical_force(tyre().record, -0.01, 50.0, 230e3) == 0.0


def test_a_cambered_mf62_tyre_touches_with_its_shoulder_and_lifts_off() -> None:
    p = _mf62().record
    first = vertical_force_loaded(p, 0.0, 0.0, 230e3, 0.0, 0.0, 0.05)
    assert 0.0 < first < 1000.0
    assert vertical_force_loaded(p, -0.05, 0.0, 230e3, 0.0, 0.0, 0.05) == 0.0


def test_pressure_and_speed_stiffen_the_tyre() -> None:
    p = tyre().record
    assert vertical_force(p, 0.02, 0.0, 280e3) > vertical_force(p, 0.02, 0.0, 230e3)
    assert vertical_force(p, 0.02, 100.0, 230e3) > vertical_force(p, 0.02, 0.0, 230e3)


def test_the_rim_stops_a_tyre_that_bottoms() -> None:
    parameters = tyre()
    p = parameters.record
    room = free_radius(p, 0.0) - parameters["RIM_RADIUS"] - parameters["BOTTOM_OFFST"]
    before = vertical_force(p, room, 0.0, 230e3)
    elastic = vertical_force_loaded(p, room + 0.005, 0.0, 230e3, 0.0, 0.0, 0.0)
    assert vertical_force(p, room + 0.005, 0.0, 230e3) == pytest.approx(elastic + 0.005 * parameters["BOTTOM_STIFF"])
    assert before == pytest.approx(vertical_force_loaded(p, room, 0.0, 230e3, 0.0, 0.0, 0.0))


def test_the_rolling_radius_lies_between_the_loaded_and_the_free_one() -> None:
    forces = MagicFormula(tyre()).evaluate(np.linspace(2000, 8000, 7), 0.0, 0.0)
    assert (forces.effective_radius_m > forces.loaded_radius_m).all()
    assert (forces.effective_radius_m < tyre()["UNLOADED_RADIUS"]).all()
    assert (np.diff(forces.effective_radius_m) < 0).all()
    assert effective_rolling_radius(tyre().record, 0.0, 0.0, 230e3) == free_radius(tyre().record, 0.0)


def test_the_spin_of_a_rolling_wheel_gives_its_slip_back() -> None:
    forces = MagicFormula(tyre()).evaluate(4000.0, 0.1, 0.0, vx_mps=20.0)
    assert float(forces.spin_radps * forces.effective_radius_m / 20.0 - 1.0) == pytest.approx(0.1, abs=1e-9)


def test_relaxation_lengths_vanish_with_the_load() -> None:
    p = tyre().record
    assert relaxation_lengths(p, 0.0, 0.0, 230e3) == (0.0, 0.0)
    short, long = relaxation_lengths(p, 10.0, 0.0, 230e3), relaxation_lengths(p, 1000.0, 0.0, 230e3)
    assert all(0.0 < a < b for a, b in zip(short, long, strict=True))
