"""Longitudinal and lateral force at pure slip, compiled, on plain floats.

Symbols are those of the source: p (parameter array), z0 ... z4 (turn slip factors zeta), lmu (friction scale with the
road's), `_s` for the starred angles, K stiffness, S_H and S_V shifts.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.E9 to 4.E30;
for MF 5.2: 2nd ed. 2006, section 4.3.2.
"""

from __future__ import annotations

import math

from activesteer.compilation import compiled
from activesteer.tyre.kernels import parameter_index as c

EPSILON = 1e-6
"""Guard of the denominators; it carries the sign of its neighbour, so that it never cancels it."""

MF52 = 52.0


@compiled
def guarded(x: float) -> float:
    """Move a denominator away from zero, in the direction of its own sign."""
    return x + EPSILON if x >= 0.0 else x - EPSILON


@compiled
def sine_formula(b: float, c_: float, d: float, e: float, x: float) -> float:
    """D sin(C atan(Bx - E(Bx - atan Bx))) with E not above 1 (equation 4.E9)."""
    e = min(e, 1.0)
    bx = b * x
    return d * math.sin(c_ * math.atan(bx - e * (bx - math.atan(bx))))


@compiled
def sign(x: float) -> float:
    """-1, 0 or 1."""
    return 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)


@compiled
def longitudinal_stiffness(p, fz: float, dfz: float, dpi: float) -> float:
    """Slip stiffness K_xkappa [N] (4.E15)."""
    pressure = 1.0 + p[c.PPX1] * dpi + p[c.PPX2] * dpi * dpi
    return fz * (p[c.PKX1] + p[c.PKX2] * dfz) * math.exp(p[c.PKX3] * dfz) * pressure * p[c.LKX]


@compiled
def cornering_stiffness(p, fz: float, gamma_s: float, dpi: float) -> float:
    """Cornering stiffness K_yalpha [N/rad] without turn slip, negative for a tyre in ISO-W axes (4.E25)."""
    fz0 = p[c.LFZO] * p[c.FNOMIN]
    load = (p[c.PKY2] + p[c.PKY5] * gamma_s * gamma_s) * (1.0 + p[c.PPY2] * dpi) * fz0
    peak = p[c.PKY1] * fz0 * (1.0 + p[c.PPY1] * dpi) * (1.0 - p[c.PKY3] * abs(gamma_s)) * p[c.LKY]
    return peak * math.sin(p[c.PKY4] * math.atan(fz / load))


@compiled
def longitudinal_force(
    p, fz: float, dfz: float, dpi: float, kappa: float, gamma: float, lmu: float, d: float, z1: float
):
    """Longitudinal force at pure slip (4.E9 to 4.E18).

    Args:
        p: Parameter array.
        fz: Load [N], > 0.
        dfz: Load relative to the nominal one, less 1.
        dpi: Pressure relative to the nominal one, less 1.
        kappa: Longitudinal slip.
        gamma: Camber [rad].
        lmu: Longitudinal friction scale.
        d: Rolling direction, 1 forward, -1 backward, between them below walking speed.
        z1: Turn slip factor.

    Returns:
        Force [N], peak friction, slip stiffness [N].
    """
    mu = (p[c.PDX1] + p[c.PDX2] * dfz) * (1.0 + p[c.PPX3] * dpi + p[c.PPX4] * dpi * dpi)
    mu *= (1.0 - p[c.PDX3] * gamma * gamma) * lmu
    c_x = p[c.PCX1] * p[c.LCX]
    d_x = mu * fz * z1
    k_x = longitudinal_stiffness(p, fz, dfz, dpi)
    kappa_x = kappa + (p[c.PHX1] + p[c.PHX2] * dfz) * p[c.LHX] * d
    shifted = p[c.LMUX] if p[c.SCALE_PEAKS_ONLY] != 0.0 else lmu
    s_v = fz * (p[c.PVX1] + p[c.PVX2] * dfz) * p[c.LVX] * shifted * z1 * d
    e_x = (p[c.PEX1] + p[c.PEX2] * dfz + p[c.PEX3] * dfz * dfz) * (1.0 - p[c.PEX4] * d * sign(kappa_x)) * p[c.LEX]
    b_x = k_x / guarded(c_x * d_x)
    return sine_formula(b_x, c_x, d_x, e_x, kappa_x) + s_v, mu, k_x


@compiled
def lateral_force(
    p, fz: float, dfz: float, dpi: float, alpha_s: float, gamma_s: float, lmu: float, d: float,
    z0: float, z2: float, z3: float, z4: float,
):  # fmt: skip
    """Lateral force at pure side slip (4.E19 to 4.E30).

    Args:
        p: Parameter array.
        fz: Load [N], > 0.
        dfz: Load relative to the nominal one, less 1.
        dpi: Pressure relative to the nominal one, less 1.
        alpha_s: Slip angle alpha*.
        gamma_s: Camber gamma*.
        lmu: Lateral friction scale.
        d: Rolling direction, 1 forward, -1 backward, between them below walking speed.
        z0: Turn slip factor.
        z2: Turn slip factor.
        z3: Turn slip factor.
        z4: Turn slip factor.

    Returns:
        Force [N], peak friction, cornering stiffness K_yalpha [N/rad], B_y, C_y, S_Hy, S_Vy [N].
    """
    k_y = cornering_stiffness(p, fz, gamma_s, dpi) * z3
    shift = (p[c.PHY1] + p[c.PHY2] * dfz) * p[c.LHY] * d
    shifted = p[c.LMUY] if p[c.SCALE_PEAKS_ONLY] != 0.0 else lmu
    s_vg = fz * (p[c.PVY3] + p[c.PVY4] * dfz) * gamma_s * p[c.LKYC] * shifted * z2
    if p[c.MF_VERSION] == MF52:
        s_h = shift + p[c.PHY3] * gamma_s * p[c.LKYC]
    else:
        k_yg = fz * (p[c.PKY6] + p[c.PKY7] * dfz) * (1.0 + p[c.PPY5] * dpi) * p[c.LKYC]
        s_h = shift + (k_yg * gamma_s - s_vg) * z0 / guarded(k_y) + z4 - 1.0
    s_v = fz * (p[c.PVY1] + p[c.PVY2] * dfz) * p[c.LVY] * shifted * z2 * d + s_vg
    mu = (p[c.PDY1] + p[c.PDY2] * dfz) * (1.0 + p[c.PPY3] * dpi + p[c.PPY4] * dpi * dpi)
    mu *= (1.0 - p[c.PDY3] * gamma_s * gamma_s) * lmu
    c_y = p[c.PCY1] * p[c.LCY]
    d_y = mu * fz * z2
    b_y = k_y / guarded(c_y * d_y)
    alpha_y = alpha_s + s_h
    side = (p[c.PEY3] + p[c.PEY4] * gamma_s) * sign(alpha_y)
    e_y = (p[c.PEY1] + p[c.PEY2] * dfz) * (1.0 + p[c.PEY5] * gamma_s * gamma_s - side) * p[c.LEY]
    return sine_formula(b_y, c_y, d_y, e_y, alpha_y) + s_v, mu, k_y, b_y, c_y, s_h, s_v
