"""The reduction factors of turn slip, against the equations of the book, written down a second time.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.76 and 4.E77 to 4.E109.
"""

from __future__ import annotations

import math
from math import atan, cos, sin

import numpy as np
import pytest

from activesteer.tyre.kernels.slip import cornering_stiffness, rolling_speed, turn_slip_factors
from tests.unit.tyre.tyres import tyre

EVERY_TERM = {
    "PDXP2": 0.3, "PDXP3": 1.5, "PDYP2": -0.2, "PDYP3": 3.0, "PDYP4": 0.1, "PKYP1": 0.8, "PHYP3": 0.05, "PECP2": 0.2,
    "QDRP1": 0.9, "QDRP2": -1.5, "QCRP1": 0.25, "QCRP2": 0.15, "QDZ10": 0.3, "QDZ11": -0.2, "PKY7": 0.1, "PPY5": -0.2,
}  # fmt: skip
PRESSURE_PA = 240e3


def by_the_book(p, record, fz, kappa, tan_alpha, gamma, vx, lmuy, g_y, turn_slip):
    """Zeta 0 to 8."""
    r0, fz0 = p["UNLOADED_RADIUS"], p["LFZO"] * p["FNOMIN"]
    dfz, dpi = fz / fz0 - 1.0, PRESSURE_PA / p["NOMPRES"] - 1.0
    epsilon = p["PECP1"] * (1.0 + p["PECP2"] * dfz)
    _, rolling_radius_m = rolling_speed(record, fz, kappa, PRESSURE_PA, vx)
    phi = turn_slip + (1.0 - epsilon) * (1.0 + kappa) * sin(gamma) / rolling_radius_m
    b_x = p["PDXP1"] * (1.0 + p["PDXP2"] * dfz) * cos(atan(p["PDXP3"] * kappa))
    b_y = p["PDYP1"] * (1.0 + p["PDYP2"] * dfz) * cos(atan(p["PDYP3"] * tan_alpha))
    zeta1 = cos(atan(b_x * r0 * phi))
    zeta2 = cos(atan(b_y * (r0 * abs(phi) + p["PDYP4"] * math.sqrt(r0 * abs(phi)))))
    zeta3 = cos(atan(p["PKYP1"] * r0**2 * phi**2))
    camber_N = fz * (p["PKY6"] + p["PKY7"] * dfz) * (1.0 + p["PPY5"] * dpi) * p["LKYC"]
    shift_N = fz * (p["PVY3"] + p["PVY4"] * dfz) * gamma * p["LKYC"] * lmuy * zeta2
    stiffness_N, upright_N = (cornering_stiffness(record, fz, angle, dpi) * zeta3 for angle in (gamma, 0.0))
    d_h = p["PHYP2"] + p["PHYP3"] * dfz
    x = camber_N / (1.0 - epsilon) / (p["PHYP1"] * d_h * upright_N) * r0 * phi
    shift = d_h * sin(p["PHYP1"] * atan(x - p["PHYP4"] * (x - atan(x))))
    friction = (p["PDY1"] + p["PDY2"] * dfz) * (1.0 + p["PPY3"] * dpi + p["PPY4"] * dpi**2)
    friction *= (1.0 - p["PDY3"] * gamma**2) * lmuy
    most_Nm = p["QCRP1"] * abs(friction) * r0 * fz * math.sqrt(fz / fz0) * p["LMP"]
    d_dr = most_Nm / sin(0.5 * math.pi * p["QDRP1"])
    residual_Nm = fz * r0 * (p["QDZ8"] + p["QDZ9"] * dfz + (p["QDZ10"] + p["QDZ11"] * dfz) * abs(gamma)) * p["LKZC"]
    x = residual_Nm / (p["QDRP1"] * d_dr * (1.0 - epsilon)) * r0 * phi
    d_r = d_dr * sin(p["QDRP1"] * atan(x - p["QDRP2"] * (x - atan(x))))
    right_angle_Nm = most_Nm * 2.0 / math.pi * atan(p["QCRP2"] * r0 * abs(turn_slip)) * g_y
    zeta7 = 2.0 / math.pi * math.acos(min(right_angle_Nm / abs(d_r), 1.0))
    zeta5, zeta6 = cos(atan(p["QDTP1"] * r0 * phi)), cos(atan(p["QBRP1"] * r0 * phi))
    return 0.0, zeta1, zeta2, zeta3, 1.0 + shift - shift_N / stiffness_N, zeta5, zeta6, zeta7, 1.0 + d_r


@pytest.mark.parametrize("changes", [{}, EVERY_TERM], ids=["file", "every_term"])
def test_factors_are_those_of_the_book(changes, rng: np.random.Generator) -> None:
    p = tyre("synthetic_all_terms").with_values(**changes)
    fz0 = p["LFZO"] * p["FNOMIN"]
    for load, kappa, tan_alpha, gamma, slip, lmuy, g_y in rng.uniform(
        [0.4, -0.1, -0.1, -0.08, -2.0, 0.3, 0.5], [1.6, 0.1, 0.1, 0.08, 2.0, 1.0, 1.0], (40, 7)
    ):
        fz, dpi = load * fz0, PRESSURE_PA / p["NOMPRES"] - 1.0
        found = turn_slip_factors(
            p.record, fz, load - 1.0, dpi, kappa, tan_alpha, gamma, gamma, PRESSURE_PA, 1.5, lmuy, g_y, slip
        )
        expected = by_the_book(p, p.record, fz, kappa, tan_alpha, gamma, 1.5, lmuy, g_y, slip)
        # The kernel guards its denominators by a small number.
        assert tuple(found) == pytest.approx(expected, rel=1e-6)
