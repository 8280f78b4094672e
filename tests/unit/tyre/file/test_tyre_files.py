from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from activesteer.tyre import MagicFormula, load_tir
from activesteer.tyre.file.syntax import COEFFICIENTS
from activesteer.tyre.file.tir import tir_from_text, tir_text
from activesteer.tyre.tyre_parameters import TyreConventions
from tests.unit.tyre.tyres import TYRES, tyre

FILES = sorted(TYRES.glob("*.tir"))


def test_every_coefficient_reaches_the_kernels_under_its_name() -> None:
    given = tyre()
    for coefficient in COEFFICIENTS:
        assert given.record[coefficient.name] == given[coefficient.name]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_written_and_read_again_it_is_the_same_tyre(path) -> None:
    first = load_tir(path)
    again = tir_from_text(tir_text(first, "a comment"), path)
    assert again.given == first.given
    assert again.side == first.side
    assert again.record == first.record


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_number_of_our_files_is_used(path) -> None:
    unused = {key for _, key in load_tir(path).unused}
    assert unused <= {"FILE_VERSION", "ROAD_INCREMENT", "ROAD_DIRECTION"}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_forces_are_finite_and_curvatures_valid_over_the_whole_range(path, rng: np.random.Generator) -> None:
    tyre = load_tir(path)
    if not tyre["RBX1"]:
        # A file without weights of combined slip: only an ellipse keeps the forces together.
        tyre = replace(tyre, conventions=TyreConventions(combined_slip="friction_ellipse"))
    formula = MagicFormula(tyre)
    rows = rng.uniform([100, -1, -1, -0.17, 1.5e5, -60], [10000, 1, 1, 0.17, 3.5e5, 60], (20000, 6))
    forces = formula.evaluate(*rows.T)
    for name in ("fx_N", "fy_N", "mx_Nm", "my_Nm", "mz_Nm", "effective_radius_m", "loaded_radius_m"):
        assert np.isfinite(getattr(forces, name)).all()
    assert (np.hypot(forces.fx_N, forces.fy_N) < 1.6 * rows[:, 0]).all()


def test_the_compact_tyre_is_what_its_file_says() -> None:
    formula = MagicFormula(tyre())
    alpha, kappa = np.radians(np.linspace(0, 25, 2501)), np.linspace(0, 0.5, 5001)
    side, drive, rolling = (
        formula.evaluate(4000.0, 0.0, alpha),
        formula.evaluate(4000.0, kappa, 0.0),
        formula.evaluate(4000.0, 0.0, 0.0),
    )
    assert -rolling.cornering_stiffness_Nprad * np.pi / 180 == pytest.approx(1430.0, rel=0.01)
    assert -side.fy_N.min() / 4000.0 == pytest.approx(1.0, abs=0.01)
    assert np.degrees(alpha[side.fy_N.argmin()]) == pytest.approx(9.1, abs=0.2)
    assert rolling.slip_stiffness_N == pytest.approx(100e3, rel=0.01)
    assert drive.fx_N.max() / 4000.0 == pytest.approx(1.03, abs=0.005)
    assert kappa[drive.fx_N.argmax()] == pytest.approx(0.12, abs=0.005)
    assert rolling.trail_m == pytest.approx(0.029, abs=0.001)
    assert rolling.relaxation_length_y_m == pytest.approx(0.51, abs=0.01)
    assert rolling.relaxation_length_x_m == pytest.approx(0.22, abs=0.01)
    assert -rolling.my_Nm / rolling.effective_radius_m / 4000.0 == pytest.approx(0.0104, abs=0.0005)
    loads = np.linspace(2000, 9000, 701)
    stiffness = -formula.evaluate(loads, 0.0, 0.0).cornering_stiffness_Nprad
    assert loads[stiffness.argmax()] == pytest.approx(6600.0, abs=50.0)


def test_the_winter_tyre_is_softer_than_the_summer_tyre() -> None:
    summer, winter = (
        MagicFormula(tyre(name)).evaluate(4000.0, 0.0, 0.0) for name in ("compact_205_55R16", "winter_205_55R16")
    )
    assert -winter.cornering_stiffness_Nprad < -0.85 * summer.cornering_stiffness_Nprad
    assert winter.friction_y < summer.friction_y
    assert winter.my_Nm < summer.my_Nm
