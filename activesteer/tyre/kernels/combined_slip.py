"""Weighting of the pure forces at combined slip, compiled, on plain floats.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.E50 to 4.E67.
"""

from __future__ import annotations

import math

from activesteer.compilation import compiled


@compiled
def _cosine_formula(b: float, c: float, e: float, x: float) -> float:
    """cos(C atan(Bx - E(Bx - atan Bx))) with E not above 1."""
    e = min(e, 1.0)
    bx = b * x
    return math.cos(c * math.atan(bx - e * (bx - math.atan(bx))))


@compiled
def longitudinal_weight(p, dfz: float, kappa: float, alpha_s: float, gamma_s: float) -> float:
    """G_xalpha: factor of the longitudinal force due to the slip angle (4.E50 to 4.E57)."""
    b = (p.RBX1 + p.RBX3 * gamma_s * gamma_s) * math.cos(math.atan(p.RBX2 * kappa)) * p.LXAL
    e = p.REX1 + p.REX2 * dfz
    s_h = p.RHX1
    return _cosine_formula(b, p.RCX1, e, alpha_s + s_h) / _cosine_formula(b, p.RCX1, e, s_h)


@compiled
def lateral_weight(p, dfz: float, kappa: float, alpha_s: float, gamma_s: float) -> float:
    """G_ykappa: factor of the lateral force due to the longitudinal slip (4.E58 to 4.E65)."""
    slope = p.RBY1 + p.RBY4 * gamma_s * gamma_s
    b = slope * math.cos(math.atan(p.RBY2 * (alpha_s - p.RBY3))) * p.LYKA
    e = p.REY1 + p.REY2 * dfz
    s_h = p.RHY1 + p.RHY2 * dfz
    return _cosine_formula(b, p.RCY1, e, kappa + s_h) / _cosine_formula(b, p.RCY1, e, s_h)


@compiled
def slip_induced_side_force(
    p, dfz: float, kappa: float, alpha_s: float, gamma_s: float, mu_fz: float, z2: float
) -> float:
    """S_Vykappa: the lateral force [N] that longitudinal slip induces (4.E66, 4.E67); mu_fz is mu_y F_z [N]."""
    d = mu_fz * (p.RVY1 + p.RVY2 * dfz + p.RVY3 * gamma_s) * math.cos(math.atan(p.RVY4 * alpha_s)) * z2
    return d * math.sin(p.RVY5 * math.atan(p.RVY6 * kappa)) * p.LVYKA


@compiled
def friction_ellipse(
    p, fz: float, dfz: float, d: float, kappa: float, alpha_s: float, fx0: float, fy0: float, dx: float, dy: float,
    k_x: float, k_y: float, s_hy: float, s_vy: float, lmux: float,
):  # fmt: skip
    """Return the factors of both pure forces at combined slip: an ellipse, divided by the ratio of the shifted slips.

    Returns:
        Factors of the longitudinal and of the lateral force, 0 to 1.

    Source: the friction ellipse of MSC's PAC2002 (without its weights), as in Project Chrono's ChPac02Tire:
    F_x = F_x0 / sqrt(1 + (mu_x t / mu_ymax)^2), F_y = F_y0 / sqrt(1 + (mu_y / (t mu_xmax))^2) with the ratio of the
    shifted slips t = |alpha_c| / |kappa_c|.
    """
    s_hx = (p.PHX1 + p.PHX2 * dfz) * p.LHX * d
    shifted = p.LMUX if p.SCALE_PEAKS_ONLY != 0.0 else lmux
    s_vx = fz * (p.PVX1 + p.PVX2 * dfz) * p.LVX * shifted * d
    along = abs(kappa + s_hx + s_vx / k_x)
    across = abs(math.sin(alpha_s + s_hy + s_vy / k_y))
    # Multiplied out: either slip may vanish.
    x, used_x = along * dy, across * abs(fx0 - s_vx)
    y, used_y = across * dx, along * abs(fy0 - s_vy)
    g_x = x / math.sqrt(x * x + used_x * used_x) if used_x > 0.0 else 1.0
    g_y = y / math.sqrt(y * y + used_y * used_y) if used_y > 0.0 else 1.0
    return g_x, g_y
