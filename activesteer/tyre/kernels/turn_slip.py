"""The turn slip factors zeta, compiled, on plain floats: effect of a curved path, or of steering at rest.

Turn slip is the yaw rate over the speed [1/m]: the curvature of the path, positive to the left. Defined for MF 6.x.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.75 to 4.106 (section 4.3.3).
"""

from __future__ import annotations

import math

from activesteer.compilation import compiled
from activesteer.tyre.kernels.pure_slip import EPSILON, cornering_stiffness, guarded
from activesteer.tyre.kernels.vertical import effective_rolling_radius

_MAX_TURN_SLIP = 1e6
"""Turn slip times radius beyond which the factors have long reached their limits."""


@compiled
def rolling_speed(p, fz: float, kappa: float, pressure: float, vx: float):
    """Return rotational speed [rad/s] and effective radius [m] of a wheel at a given slip, solved together."""
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
    """Return the factors zeta 0 to 8."""
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
