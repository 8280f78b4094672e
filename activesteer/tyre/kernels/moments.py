"""Overturning, rolling resistance and aligning moment, compiled, on plain floats.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.E31 to 4.E49 and 4.E68 to 4.E78, with the
corrections that the property files need: in the overturning moment the square stands on the arc tangent's argument, and
A_mu is 1. For MF 5.2: 2nd ed. 2006, section 4.3.2.
"""

from __future__ import annotations

import math

from activesteer.compilation import compiled
from activesteer.tyre.kernels.pure_slip import EPSILON, MF52

SMALLEST_FRICTION = 1e-6
"""Friction scale below which slopes divided by it stay constant."""


@compiled
def overturning_moment(p, fz: float, fy: float, gamma: float, dpi: float) -> float:
    """Overturning moment M_x [Nm] (4.E69, corrected)."""
    r0, fz0 = p.UNLOADED_RADIUS, p.FNOMIN
    if p.MF_VERSION == MF52:
        return r0 * fz * (p.QSX1 * p.LVMX - p.QSX2 * gamma + p.QSX3 * fy / fz0) * p.LMX
    mixed = p.QSX4 * math.cos(p.QSX5 * math.atan((p.QSX6 * fz / fz0) ** 2))
    mixed *= math.sin(p.QSX7 * gamma + p.QSX8 * math.atan(p.QSX9 * fy / fz0))
    sum_ = p.QSX1 * p.LVMX - p.QSX2 * gamma * (1.0 + p.PPMX1 * dpi) + p.QSX3 * fy / fz0
    sum_ += mixed + p.QSX10 * math.atan(p.QSX11 * fz / fz0) * gamma
    added = fy * (p.QSX13 + p.QSX14 * abs(gamma)) - fz * p.QSX12 * gamma * abs(gamma)
    return r0 * p.LMX * (fz * sum_ + added)


@compiled
def rolling_resistance_moment(p, fz: float, fx: float, gamma: float, pressure: float, vx: float, d: float) -> float:
    """Rolling resistance moment M_y [Nm], negative when rolling forward (4.E70)."""
    r0, fz0 = p.UNLOADED_RADIUS, p.FNOMIN
    speed = abs(vx) / p.LONGVL
    sum_ = p.QSY1 + p.QSY2 * d * fx / fz0 + p.QSY3 * speed + p.QSY4 * speed**4
    if p.MF_VERSION == MF52:
        return -r0 * fz * sum_ * p.LMY * d
    sum_ += (p.QSY5 + p.QSY6 * fz / fz0) * gamma * gamma
    load = (fz / fz0) ** p.QSY7 * (pressure / p.NOMPRES) ** p.QSY8
    return -r0 * fz0 * sum_ * load * p.LMY * d


@compiled
def _equivalent_slip(alpha: float, stiffness_ratio_kappa: float) -> float:
    """Slip angle that stands for combined slip, with the sign of alpha (4.E77, 4.E78)."""
    tangent = math.tan(alpha)
    size = math.atan(math.sqrt(tangent * tangent + stiffness_ratio_kappa * stiffness_ratio_kappa))
    return math.copysign(size, alpha)


@compiled
def aligning_moment(
    p, fz: float, dfz: float, dpi: float, kappa: float, alpha_s: float, gamma_s: float, gamma: float, vx: float,
    tan_alpha: float, lmu: float, d: float, k_x: float, k_y: float, b_y: float, c_y: float, s_hy: float, s_vy: float,
    fx: float, fy: float, fy_trail: float, z0: float, z2: float, z5: float, z6: float, z7: float, z8: float,
):  # fmt: skip
    """Aligning moment at combined slip (4.E31 to 4.E49, 4.E71 to 4.E78).

    Returns:
        Aligning moment [Nm], pneumatic trail [m], residual moment [Nm].
    """
    r0, fz0 = p.UNLOADED_RADIUS, p.FNOMIN
    k_ya = k_y + math.copysign(EPSILON, k_y)
    speed = abs(vx)
    cos_alpha = speed / (speed * math.sqrt(1.0 + tan_alpha * tan_alpha) + EPSILON)
    stiffness = p.LKY / max(lmu, SMALLEST_FRICTION)
    size = abs(gamma_s)
    gamma_z = gamma * p.LGAZ if p.MF_VERSION == MF52 else gamma

    alpha_t = alpha_s + (p.QHZ1 + p.QHZ2 * dfz) * d + (p.QHZ3 + p.QHZ4 * dfz) * gamma_s
    alpha_r = alpha_s + s_hy + s_vy / k_ya
    slip = k_x / k_ya * kappa
    alpha_t_eq = _equivalent_slip(alpha_t, slip)
    alpha_r_eq = _equivalent_slip(alpha_r, slip)

    b_t = (p.QBZ1 + p.QBZ2 * dfz + p.QBZ3 * dfz * dfz) * stiffness
    b_t *= 1.0 + p.QBZ4 * gamma_z + p.QBZ5 * abs(gamma_z)
    c_t = p.QCZ1
    d_t = fz * r0 / (p.LFZO * fz0) * (p.QDZ1 + p.QDZ2 * dfz) * (1.0 - p.PPZ1 * dpi) * p.LTR * d
    d_t *= (1.0 + p.QDZ3 * gamma_z + p.QDZ4 * gamma_z * gamma_z) * z5
    curve = (p.QEZ4 + p.QEZ5 * gamma_s) * 2.0 / math.pi * math.atan(b_t * c_t * alpha_t)
    e_t = min((p.QEZ1 + p.QEZ2 * dfz + p.QEZ3 * dfz * dfz) * (1.0 + curve), 1.0)
    bt = b_t * alpha_t_eq
    trail = d_t * math.cos(c_t * math.atan(bt - e_t * (bt - math.atan(bt)))) * cos_alpha
    if p.TRAIL_BY_SCALED_LOAD == 0.0:
        trail *= p.LFZO

    b_r = (p.QBZ9 * stiffness + p.QBZ10 * b_y * c_y) * z6
    d_r = (p.QDZ6 + p.QDZ7 * dfz) * p.LRES * z2
    camber = (p.QDZ8 + p.QDZ9 * dfz) * (1.0 + p.PPZ2 * dpi) + (p.QDZ10 + p.QDZ11 * dfz) * size
    d_r += camber * gamma_s * p.LKZC * z0
    d_r = fz * r0 * d_r * lmu * d * math.cos(alpha_s) + z8 - 1.0
    residual = d_r * math.cos(z7 * math.atan(b_r * alpha_r_eq))

    arm = r0 * (p.SSZ1 + p.SSZ2 * fy / fz0 + (p.SSZ3 + p.SSZ4 * dfz) * gamma) * p.LS
    return -trail * fy_trail + residual + arm * fx, trail, residual
