"""Longitudinal and lateral force at pure slip, compiled, on plain floats.

Symbols are those of the source: p (record of the tyre), z0 ... z4 (turn slip factors zeta), lmu (friction scale with
the road's), `_s` for the starred angles, K stiffness, S_H and S_V shifts.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.E9 to 4.E30;
for MF 5.2: 2nd ed. 2006, section 4.3.2.
"""

from __future__ import annotations

import math

from activesteer.compilation import compiled

EPSILON = 1e-6
"""Guard of the denominators; it takes the sign of its neighbour, so that the two never cancel."""

MF52 = 52.0


@compiled
def guarded(x: float) -> float:
    """Move a denominator away from zero, in the direction of its own sign."""
    return x + EPSILON if x >= 0.0 else x - EPSILON


@compiled
def sine_formula(b: float, c: float, d: float, e: float, x: float) -> float:
    """D sin(C atan(Bx - E(Bx - atan Bx))) with E not above 1 (equation 4.E9)."""
    e = min(e, 1.0)
    bx = b * x
    return d * math.sin(c * math.atan(bx - e * (bx - math.atan(bx))))


@compiled
def sign(x: float) -> float:
    """-1, 0 or 1."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@compiled
def longitudinal_stiffness(p, fz: float, dfz: float, dpi: float) -> float:
    """Slip stiffness K_xkappa [N] (4.E15)."""
    pressure = 1.0 + p.PPX1 * dpi + p.PPX2 * dpi * dpi
    return fz * (p.PKX1 + p.PKX2 * dfz) * math.exp(p.PKX3 * dfz) * pressure * p.LKX


@compiled
def cornering_stiffness(p, fz: float, gamma_s: float, dpi: float) -> float:
    """Cornering stiffness K_yalpha [N/rad] without turn slip, negative for a tyre in ISO-W axes (4.E25)."""
    fz0 = p.LFZO * p.FNOMIN
    load = (p.PKY2 + p.PKY5 * gamma_s * gamma_s) * (1.0 + p.PPY2 * dpi) * fz0
    peak = p.PKY1 * fz0 * (1.0 + p.PPY1 * dpi) * (1.0 - p.PKY3 * abs(gamma_s)) * p.LKY
    return peak * math.sin(p.PKY4 * math.atan(fz / load))


@compiled
def longitudinal_force(
    p, fz: float, dfz: float, dpi: float, kappa: float, gamma: float, lmu: float, d: float, z1: float
):
    """Longitudinal force at pure slip (4.E9 to 4.E18).

    Returns:
        Force [N], peak friction, slip stiffness [N].
    """
    mu = (p.PDX1 + p.PDX2 * dfz) * (1.0 + p.PPX3 * dpi + p.PPX4 * dpi * dpi)
    mu *= (1.0 - p.PDX3 * gamma * gamma) * lmu
    c_x = p.PCX1 * p.LCX
    d_x = mu * fz * z1
    k_x = longitudinal_stiffness(p, fz, dfz, dpi)
    kappa_x = kappa + (p.PHX1 + p.PHX2 * dfz) * p.LHX * d
    shifted = p.LMUX if p.SCALE_PEAKS_ONLY != 0.0 else lmu
    s_v = fz * (p.PVX1 + p.PVX2 * dfz) * p.LVX * shifted * z1 * d
    e_x = (p.PEX1 + p.PEX2 * dfz + p.PEX3 * dfz * dfz) * (1.0 - p.PEX4 * d * sign(kappa_x)) * p.LEX
    b_x = k_x / guarded(c_x * d_x)
    return sine_formula(b_x, c_x, d_x, e_x, kappa_x) + s_v, mu, k_x


@compiled
def lateral_force(
    p, fz: float, dfz: float, dpi: float, alpha_s: float, gamma_s: float, lmu: float, d: float,
    z0: float, z2: float, z3: float, z4: float,
):  # fmt: skip
    """Lateral force at pure side slip (4.E19 to 4.E30).

    Returns:
        Force [N], peak friction, cornering stiffness K_yalpha [N/rad], B_y, C_y, S_Hy, S_Vy [N].
    """
    k_y = cornering_stiffness(p, fz, gamma_s, dpi) * z3
    shift = (p.PHY1 + p.PHY2 * dfz) * p.LHY * d
    shifted = p.LMUY if p.SCALE_PEAKS_ONLY != 0.0 else lmu
    s_vg = fz * (p.PVY3 + p.PVY4 * dfz) * gamma_s * p.LKYC * shifted * z2
    if p.MF_VERSION == MF52:
        s_h = shift + p.PHY3 * gamma_s * p.LKYC
    else:
        k_yg = fz * (p.PKY6 + p.PKY7 * dfz) * (1.0 + p.PPY5 * dpi) * p.LKYC
        s_h = shift + (k_yg * gamma_s - s_vg) * z0 / guarded(k_y) + z4 - 1.0
    s_v = fz * (p.PVY1 + p.PVY2 * dfz) * p.LVY * shifted * z2 * d + s_vg
    mu = (p.PDY1 + p.PDY2 * dfz) * (1.0 + p.PPY3 * dpi + p.PPY4 * dpi * dpi)
    mu *= (1.0 - p.PDY3 * gamma_s * gamma_s) * lmu
    c_y = p.PCY1 * p.LCY
    d_y = mu * fz * z2
    b_y = k_y / guarded(c_y * d_y)
    alpha_y = alpha_s + s_h
    side = (p.PEY3 + p.PEY4 * gamma_s) * sign(alpha_y)
    e_y = (p.PEY1 + p.PEY2 * dfz) * (1.0 + p.PEY5 * gamma_s * gamma_s - side) * p.LEY
    return sine_formula(b_y, c_y, d_y, e_y, alpha_y) + s_v, mu, k_y, b_y, c_y, s_h, s_v
