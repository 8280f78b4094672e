"""The Magic Formula against MFeval 4.3.1, an independent implementation (Marco Furlan, BSD-3).

Tolerance: 1e-9 of each column's peak. Two implementations of the same equations in double precision agree to some
1e-16; a wrong term shows from 1e-4 on. Radii: 1e-6, because MFeval finds them by an iteration that it stops earlier.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer.tyre import MagicFormula, TyreForces, TyreParameters, load_tir
from tests.reference.tyre_tables import INPUTS, read_coefficients, read_table

TYRES = Path(__file__).parents[2] / "models" / "tyres"
SETS = {
    "mfeval_mf61_205_60R15.csv": lambda: load_tir(TYRES / "pacejka2012_205_60R15.tir"),
    "mfeval_mf61_synthetic.csv": lambda: load_tir(TYRES / "synthetic_all_terms.tir"),
    "mfeval_mf61_synthetic_tangent.csv": lambda: load_tir(TYRES / "synthetic_all_terms.tir", slip_tangent=True),
    "mfeval_mf52_235_85R16.csv": lambda: TyreParameters(read_coefficients("mf52_235_85R16_coefficients.csv")),
    "mfeval_pac2002_235_60R16.csv": lambda: TyreParameters(read_coefficients("pac2002_235_60R16_coefficients.csv")),
}
FORCES = {"fx_N": "Fx_N", "fy_N": "Fy_N", "mx_Nm": "Mx_Nm", "my_Nm": "My_Nm", "mz_Nm": "Mz_Nm"}
INTERMEDIATE = {
    "friction_x": "mux_1",
    "friction_y": "muy_1",
    "trail_m": "trail_m",
    "slip_stiffness_N": "Kxk_N",
    "cornering_stiffness_Nprad": "Kya_Nprad",
}
ROLLING = {
    "effective_radius_m": "Re_m",
    "loaded_radius_m": "Rl_m",
    "deflection_m": "rho_m",
    "spin_radps": "omega_radps",
    "contact_length_m": "contact_length_2a_m",
    "contact_width_m": "contact_width_2b_m",
    "relaxation_length_x_m": "sigmax_m",
    "relaxation_length_y_m": "sigmay_m",
}


@pytest.fixture(scope="module", params=SETS)
def case(request: pytest.FixtureRequest) -> tuple[TyreForces, dict[str, np.ndarray]]:
    table = read_table(request.param)
    arguments: Any = [table[name] for name in INPUTS]
    return MagicFormula(SETS[request.param]()).evaluate(*arguments), table


def _error(forces: TyreForces, table: dict[str, np.ndarray], ours: str, theirs: str) -> float:
    """Return the largest difference over the peak of the column."""
    return float(np.abs(getattr(forces, ours) - table[theirs]).max() / np.abs(table[theirs]).max())


@pytest.mark.parametrize("name", FORCES)
def test_forces_and_moments_agree(case: tuple[TyreForces, dict[str, np.ndarray]], name: str) -> None:
    assert _error(*case, name, FORCES[name]) < 1e-9


@pytest.mark.parametrize("name", INTERMEDIATE)
def test_what_the_forces_come_from_agrees(case: tuple[TyreForces, dict[str, np.ndarray]], name: str) -> None:
    assert _error(*case, name, INTERMEDIATE[name]) < 1e-9


@pytest.mark.parametrize("name", ROLLING)
def test_radii_and_relaxation_lengths_agree(case: tuple[TyreForces, dict[str, np.ndarray]], name: str) -> None:
    assert _error(*case, name, ROLLING[name]) < 1e-6


def test_the_tables_reach_every_quadrant_of_combined_slip() -> None:
    for name in SETS:
        table = read_table(name)
        quadrants = {
            (np.sign(kappa), np.sign(alpha)) for kappa, alpha in zip(table["kappa_1"], table["alpha_rad"], strict=True)
        }
        assert {(-1, -1), (-1, 1), (1, -1), (1, 1)} <= quadrants
