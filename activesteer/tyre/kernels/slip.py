"""Compiled formulas of slip forces, combined slip, turn slip and relaxation lengths.

The symbols follow the source: p (record of the tyre), z0 ... z4 (turn slip factors zeta), lmu (friction scale with the
road's), `_s` for the starred angles, K stiffness, S_H and S_V shifts.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.E9 to 4.E30;
for MF 5.2: 2nd ed. 2006, section 4.3.2.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.E50 to 4.E67.

Turn slip is the yaw rate over the speed [1/m]: the curvature of the path, positive to the left. Defined for MF 6.x.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.75 to 4.106 (section 4.3.3).

Source: Besselink, Schmeitz, Pacejka 2010, equations 17 to 19 (MF 6.x); Pacejka, Tyre and Vehicle Dynamics,
2nd ed. 2006, section 4.3.2 (PTX, PTY of MF 5.2).
"""

from __future__ import annotations

import math
from typing import Final

from activesteer.native.compilation import compiled
from activesteer.tyre.kernels.vertical import effective_rolling_radius

EPSILON = 1e-6
"""Guard of the denominators. It takes the sign of its neighbour, so that the two never cancel."""

MF52 = 52.0


@compiled
def guarded(x: float) -> float:
    """Shift a denominator away from zero, in the direction of its sign."""
    return x + EPSILON if x >= 0.0 else x - EPSILON


@compiled
def sine_formula(b: float, c: float, d: float, e: float, x: float) -> float:
    """Sine form of the Magic Formula: D sin(C atan(Bx - E(Bx - atan Bx))) with E not above 1 (equation 4.E9)."""
    e = min(e, 1.0)
    bx = b * x
    return d * math.sin(c * math.atan(bx - e * (bx - math.atan(bx))))


@compiled
def sign(x: float) -> float:
    """Sign of a number: -1, 0 or 1."""
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
    """Longitudinal force at pure slip [N] (4.E9 to 4.E18), peak friction, slip stiffness [N]."""
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
    """Lateral force at pure slip [N] (4.E19 to 4.E30), peak friction, K_yalpha [N/rad], B_y, C_y, S_Hy, S_Vy [N]."""
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


@compiled
def _cosine_formula(b: float, c: float, e: float, x: float) -> float:
    """Cosine form of the Magic Formula: cos(C atan(Bx - E(Bx - atan Bx))) with E not above 1."""
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
    """S_Vykappa: the lateral force [N] that longitudinal slip induces (4.E66, 4.E67), with mu_fz = mu_y F_z [N]."""
    d = mu_fz * (p.RVY1 + p.RVY2 * dfz + p.RVY3 * gamma_s) * math.cos(math.atan(p.RVY4 * alpha_s)) * z2
    return d * math.sin(p.RVY5 * math.atan(p.RVY6 * kappa)) * p.LVYKA


@compiled
def friction_ellipse(
    p, fz: float, dfz: float, d: float, kappa: float, alpha_s: float, fx0: float, fy0: float, dx: float, dy: float,
    k_x: float, k_y: float, s_hy: float, s_vy: float, lmux: float,
):  # fmt: skip
    """Return the factors, 0 to 1, of both pure forces at combined slip, by the friction ellipse of PAC2002.

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


_MAX_TURN_SLIP = 1e6
"""Turn slip times radius beyond which the factors have long reached their limits."""


@compiled
def rolling_speed(p, fz: float, kappa: float, pressure: float, vx: float):
    """Return rotational speed [rad/s] and effective radius [m] of a wheel at a given slip."""
    radius = p.UNLOADED_RADIUS
    omega = 0.0
    for _ in range(30):
        omega = (vx + kappa * abs(vx)) / radius
        after = max(effective_rolling_radius(p, fz, omega, pressure), 0.1 * p.UNLOADED_RADIUS)
        change = abs(after - radius)
        radius = after
        if change < 1e-13:
            break
    return omega, radius


@compiled
def turn_slip_factors(
    p, fz: float, dfz: float, dpi: float, kappa: float, tan_alpha: float, gamma: float, gamma_s: float,
    pressure: float, vx: float, lmuy: float, g_y: float, turn_slip: float,
):  # fmt: skip
    """Return the turn slip factors zeta 0 to 8."""
    r0 = p.UNLOADED_RADIUS
    fz0 = p.LFZO * p.FNOMIN
    epsilon_g = min(p.PECP1 * (1.0 + p.PECP2 * dfz), 0.99)
    _, rolling_radius = rolling_speed(p, fz, kappa, pressure, vx)
    spin_of_camber = (1.0 - epsilon_g) * (1.0 + kappa) * math.sin(gamma) / rolling_radius
    r_phi_t = min(max(r0 * turn_slip, -_MAX_TURN_SLIP), _MAX_TURN_SLIP)
    r_phi = r_phi_t + r0 * spin_of_camber
    size = abs(r_phi)

    b_xp = p.PDXP1 * (1.0 + p.PDXP2 * dfz) * math.cos(math.atan(p.PDXP3 * kappa))
    z1 = math.cos(math.atan(b_xp * r_phi))
    b_yp = p.PDYP1 * (1.0 + p.PDYP2 * dfz) * math.cos(math.atan(p.PDYP3 * tan_alpha))
    z2 = math.cos(math.atan(b_yp * (size + p.PDYP4 * math.sqrt(size))))
    z3 = math.cos(math.atan(p.PKYP1 * r_phi * r_phi))

    k_yg = fz * (p.PKY6 + p.PKY7 * dfz) * (1.0 + p.PPY5 * dpi) * p.LKYC
    s_vg = fz * (p.PVY3 + p.PVY4 * dfz) * gamma_s * p.LKYC * lmuy * z2
    k_ya = cornering_stiffness(p, fz, gamma_s, dpi) * z3
    k_ya0 = cornering_stiffness(p, fz, 0.0, dpi) * z3
    d_h = p.PHYP2 + p.PHYP3 * dfz
    b_h = k_yg / (1.0 - epsilon_g) / guarded(p.PHYP1 * d_h * k_ya0)
    e_h = min(p.PHYP4, 1.0)
    x = b_h * r_phi
    s_hp = d_h * math.sin(p.PHYP1 * math.atan(x - e_h * (x - math.atan(x))))
    z4 = 1.0 + s_hp - s_vg / guarded(k_ya)

    z5 = math.cos(math.atan(p.QDTP1 * r_phi))
    z6 = math.cos(math.atan(p.QBRP1 * r_phi))

    mu_y = abs((p.PDY1 + p.PDY2 * dfz) * (1.0 + p.PPY3 * dpi + p.PPY4 * dpi * dpi) * lmuy)
    mu_y *= abs(1.0 - p.PDY3 * gamma_s * gamma_s)
    m_inf = max(p.QCRP1 * mu_y * r0 * fz * math.sqrt(fz / fz0) * p.LMP, EPSILON)
    d_dr = m_inf / math.sin(0.5 * math.pi * p.QDRP1)
    camber = p.QDZ8 + p.QDZ9 * dfz + (p.QDZ10 + p.QDZ11 * dfz) * abs(gamma)
    b_dr = fz * r0 * camber * p.LKZC / guarded(p.QDRP1 * d_dr * (1.0 - epsilon_g))
    x = b_dr * r_phi
    d_r = d_dr * math.sin(p.QDRP1 * math.atan(x - min(p.QDRP2, 1.0) * (x - math.atan(x))))
    m_90 = m_inf * 2.0 / math.pi * math.atan(p.QCRP2 * abs(r_phi_t)) * g_y
    z7 = 2.0 / math.pi * math.acos(min(max(m_90 / (abs(d_r) + EPSILON), 0.0), 1.0))
    return 0.0, z1, z2, z3, z4, z5, z6, z7, 1.0 + d_r


MIN_RELAXATION_LENGTH_M: Final = 0.02
"""Smallest relaxation length [m], about a tread block's length. It keeps the slip defined when the load vanishes."""


@compiled
def rolling_relaxation_lengths(p, fz_N: float, gamma_rad: float, pressure_Pa: float):
    """Return the relaxation lengths of a rolling tyre [m], or of a tread block if relaxation is off."""
    if p.RELAXATION_OFF != 0.0:
        return MIN_RELAXATION_LENGTH_M, MIN_RELAXATION_LENGTH_M
    return relaxation_lengths(p, fz_N, gamma_rad, pressure_Pa)


@compiled
def carcass_stiffnesses(p, fz_N: float, pressure_Pa: float):
    """Return longitudinal and lateral carcass stiffness [N/m] at a load [N] and a pressure [Pa] (equations 17, 18)."""
    dfz = fz_N / (p.LFZO * p.FNOMIN) - 1.0
    dpi = min(max(pressure_Pa, p.PRESMIN), p.PRESMAX) / p.NOMPRES - 1.0
    along = (1.0 + p.PCFX1 * dfz + p.PCFX2 * dfz * dfz) * (1.0 + p.PCFX3 * dpi)
    across = (1.0 + p.PCFY1 * dfz + p.PCFY2 * dfz * dfz) * (1.0 + p.PCFY3 * dpi)
    return p.LONGITUDINAL_STIFFNESS * along, p.LATERAL_STIFFNESS * across


@compiled
def relaxation_lengths(p, fz_N: float, gamma_rad: float, pressure_Pa: float):
    """Return the longitudinal and lateral relaxation length [m], >= 0; zero or less load gives zero lengths."""
    # MF 6.x: slip stiffness over carcass stiffness. MF 5.2: the PTX and PTY coefficients if the file has them.
    if not fz_N > 0.0:
        return 0.0, 0.0
    load = min(max(fz_N, p.FZMIN), p.FZMAX)
    scale = min(fz_N / load, 1.0)
    gamma = min(max(gamma_rad, p.CAMMIN), p.CAMMAX)
    r0, fz0 = p.UNLOADED_RADIUS, p.FNOMIN
    dfz = load / (p.LFZO * fz0) - 1.0
    dpi = min(max(pressure_Pa, p.PRESMIN), p.PRESMAX) / p.NOMPRES - 1.0
    along, across = carcass_stiffnesses(p, load, pressure_Pa)
    if p.PTX_GIVEN != 0.0:
        sigma_x = load * (p.PTX1 + p.PTX2 * dfz) * math.exp(-p.PTX3 * dfz) * r0 / fz0 * p.LSGKP
    else:
        sigma_x = longitudinal_stiffness(p, load, dfz, dpi) / along
    if p.PTY_GIVEN != 0.0:
        peak = p.PTY1 * r0 * p.LFZO * p.LSGAL * (1.0 - p.PKY3 * abs(gamma))
        sigma_y = peak * math.sin(2.0 * math.atan(load / (p.PTY2 * p.LFZO * fz0)))
    else:
        gamma_s = math.sin(gamma) if p.SLIP_TANGENT != 0.0 else gamma
        sigma_y = cornering_stiffness(p, load, gamma_s, dpi) / across
    return scale * abs(sigma_x), scale * abs(sigma_y)
