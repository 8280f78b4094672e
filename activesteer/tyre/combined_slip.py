"""Weighting of the pure forces at combined slip, compiled, on plain floats.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.E50 to 4.E67.
"""

from __future__ import annotations

import math

from numba import njit

from activesteer.tyre import parameters as c


@njit(cache=True, error_model="numpy")
def _cosine_formula(b: float, c_: float, e: float, x: float) -> float:
    """cos(C atan(Bx - E(Bx - atan Bx))) with E not above 1."""
    e = min(e, 1.0)
    bx = b * x
    return math.cos(c_ * math.atan(bx - e * (bx - math.atan(bx))))


@njit(cache=True, error_model="numpy")
def longitudinal_weight(p, dfz: float, kappa: float, alpha_s: float, gamma_s: float) -> float:
    """G_xalpha: what the slip angle leaves of the longitudinal force (4.E50 to 4.E57)."""
    b = (p[c.RBX1] + p[c.RBX3] * gamma_s * gamma_s) * math.cos(math.atan(p[c.RBX2] * kappa)) * p[c.LXAL]
    e = p[c.REX1] + p[c.REX2] * dfz
    s_h = p[c.RHX1]
    return _cosine_formula(b, p[c.RCX1], e, alpha_s + s_h) / _cosine_formula(b, p[c.RCX1], e, s_h)


@njit(cache=True, error_model="numpy")
def lateral_weight(p, dfz: float, kappa: float, alpha_s: float, gamma_s: float) -> float:
    """G_ykappa: what the longitudinal slip leaves of the lateral force (4.E58 to 4.E65)."""
    slope = p[c.RBY1] + p[c.RBY4] * gamma_s * gamma_s
    b = slope * math.cos(math.atan(p[c.RBY2] * (alpha_s - p[c.RBY3]))) * p[c.LYKA]
    e = p[c.REY1] + p[c.REY2] * dfz
    s_h = p[c.RHY1] + p[c.RHY2] * dfz
    return _cosine_formula(b, p[c.RCY1], e, kappa + s_h) / _cosine_formula(b, p[c.RCY1], e, s_h)


@njit(cache=True, error_model="numpy")
def slip_induced_side_force(
    p, dfz: float, kappa: float, alpha_s: float, gamma_s: float, mu_fz: float, z2: float
) -> float:
    """S_Vykappa: the lateral force [N] that longitudinal slip induces (4.E66, 4.E67); mu_fz is mu_y F_z [N]."""
    d = mu_fz * (p[c.RVY1] + p[c.RVY2] * dfz + p[c.RVY3] * gamma_s) * math.cos(math.atan(p[c.RVY4] * alpha_s)) * z2
    return d * math.sin(p[c.RVY5] * math.atan(p[c.RVY6] * kappa)) * p[c.LVYKA]
