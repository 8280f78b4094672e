"""Relaxation lengths of both versions of the formula, against a second implementation of their equations."""

from __future__ import annotations

import math

import pytest

from activesteer.tyre.kernels.slip import (
    carcass_stiffnesses,
    cornering_stiffness,
    longitudinal_stiffness,
    relaxation_lengths,
)
from tests.unit.tyre.tyres import tyre

PRESSURE_PA = 240e3
MF52 = {
    "PTX1": 2.3, "PTX2": 1.1, "PTX3": -0.2, "PTY1": 2.1, "PTY2": 1.9, "LFZO": 1.1, "LSGKP": 1.2, "LSGAL": 0.9,
}  # fmt: skip


@pytest.mark.parametrize("load", [0.5, 1.0, 1.3])
@pytest.mark.parametrize("gamma_rad", [0.0, 0.05])
def test_mf52_lengths_follow_their_own_coefficients(load, gamma_rad) -> None:
    """PAC2002: sigma_kappa with PTX, sigma_alpha with PTY."""
    p = tyre("synthetic_all_terms").with_values(FITTYP=52, **MF52)
    fz = load * p["FNOMIN"]
    dfz = fz / (p["LFZO"] * p["FNOMIN"]) - 1.0
    sigma_x = fz / p["FNOMIN"] * (2.3 + 1.1 * dfz) * math.exp(0.2 * dfz) * p["UNLOADED_RADIUS"] * 1.2
    sigma_y = 2.1 * math.sin(2.0 * math.atan(load / (1.9 * 1.1))) * (1.0 - p["PKY3"] * gamma_rad)
    sigma_y *= 1.1 * p["UNLOADED_RADIUS"] * 0.9
    assert relaxation_lengths(p.record, fz, gamma_rad, PRESSURE_PA) == pytest.approx((sigma_x, sigma_y))


@pytest.mark.parametrize("load", [0.5, 1.0, 1.3])
def test_mf61_lengths_are_slip_stiffness_over_carcass_stiffness(load) -> None:
    p = tyre("synthetic_all_terms")
    fz, fz0, dpi = load * p["FNOMIN"], p["LFZO"] * p["FNOMIN"], PRESSURE_PA / p["NOMPRES"] - 1.0
    dfz = fz / fz0 - 1.0
    across = p["LATERAL_STIFFNESS"] * (1.0 + p["PCFY1"] * dfz + p["PCFY2"] * dfz**2) * (1.0 + p["PCFY3"] * dpi)
    along = p["LONGITUDINAL_STIFFNESS"] * (1.0 + p["PCFX1"] * dfz + p["PCFX2"] * dfz**2) * (1.0 + p["PCFX3"] * dpi)
    assert carcass_stiffnesses(p.record, fz, PRESSURE_PA) == pytest.approx((along, across))
    expected = (
        abs(longitudinal_stiffness(p.record, fz, dfz, dpi) / along),
        abs(cornering_stiffness(p.record, fz, 0.0, dpi) / across),
    )
    assert relaxation_lengths(p.record, fz, 0.0, PRESSURE_PA) == pytest.approx(expected)
