"""The Magic Formula: steady-state forces and moments of a tyre in one compiled kernel.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, equations 4.E31 to 4.E49 and 4.E68 to 4.E78, with the
corrections that the property files need: in the overturning moment the square stands on the arc tangent's argument, and
A_mu is 1. For MF 5.2: 2nd ed. 2006, section 4.3.2.

Inputs and outputs are in ISO-W axes at the contact point, SI and radians: alpha > 0 gives F_y < 0, kappa > 0 drives,
gamma > 0 inclines the wheel about +x, M_y < 0 rolls forward. Slip refers to the absolute value of the speed.

`p` is the record of the tyre (`record.TYRE_RECORD`). Inputs outside the ranges of the file are evaluated at the limit
(see `limit_flags`). Below the smallest valid load, the forces of that load are scaled down to zero.

Below the speed VXLOW everything that depends on the rolling direction (shifts, trail, rolling resistance) fades with
a sine through zero at rest, so that the forces are continuous through standstill. The forces due to slip do not fade,
because there slip is the deflection of the contact patch (see `slip`).

A division by zero gives inf or nan, as in numpy, and no exception. The kernels run inside the engine's callbacks, where
nothing could catch an exception; the check of the state finds values that are not finite.
"""

from __future__ import annotations

import math
from enum import IntFlag
from typing import NamedTuple

from activesteer.native.compilation import compiled
from activesteer.tyre.kernels.slip import (
    EPSILON,
    MF52,
    cornering_stiffness,
    friction_ellipse,
    lateral_force,
    lateral_weight,
    longitudinal_force,
    longitudinal_stiffness,
    longitudinal_weight,
    rolling_relaxation_lengths,
    rolling_speed,
    slip_induced_side_force,
    turn_slip_factors,
)
from activesteer.tyre.kernels.vertical import contact_patch, deflection_under_load, free_radius


class Limit(IntFlag):
    """Input outside the range of the file, evaluated at its limit."""

    NONE = 0
    LOAD_LOW = 1
    LOAD_HIGH = 2
    SLIP_RATIO = 4
    SLIP_ANGLE = 8
    CAMBER = 16
    PRESSURE = 32


@compiled
def limit_flags(p, fz_N: float, kappa: float, alpha_rad: float, gamma_rad: float, pressure_Pa: float) -> int:
    """Return the sum of the `Limit` values that apply. A load of zero is a lifted wheel and not a violation."""
    flags = 0
    if 0.0 < fz_N < p.FZMIN:
        flags += 1
    if fz_N > p.FZMAX:
        flags += 2
    if kappa < p.KPUMIN or kappa > p.KPUMAX:
        flags += 4
    if alpha_rad < p.ALPMIN or alpha_rad > p.ALPMAX:
        flags += 8
    if gamma_rad < p.CAMMIN or gamma_rad > p.CAMMAX:
        flags += 16
    if pressure_Pa < p.PRESMIN or pressure_Pa > p.PRESMAX:
        flags += 32
    return flags


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
    """Equivalent slip angle for combined slip, with the sign of alpha (4.E77, 4.E78)."""
    tangent = math.tan(alpha)
    size = math.atan(math.sqrt(tangent * tangent + stiffness_ratio_kappa * stiffness_ratio_kappa))
    return math.copysign(size, alpha)


@compiled
def aligning_moment(
    p, fz: float, dfz: float, dpi: float, kappa: float, alpha_s: float, gamma_s: float, gamma: float, vx: float,
    tan_alpha: float, lmu: float, d: float, k_x: float, k_y: float, b_y: float, c_y: float, s_hy: float, s_vy: float,
    fx: float, fy: float, fy_trail: float, z0: float, z2: float, z5: float, z6: float, z7: float, z8: float,
):  # fmt: skip
    """Aligning moment [Nm] (4.E31 to 4.E49, 4.E71 to 4.E78), pneumatic trail [m], residual moment [Nm]."""
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


class SteadyState(NamedTuple):
    """Results of one evaluation, in ISO-W axes at the contact point."""

    fx_N: float
    fy_N: float
    mx_Nm: float
    my_Nm: float
    mz_Nm: float
    friction_x: float
    friction_y: float
    trail_m: float
    residual_moment_Nm: float
    slip_stiffness_N: float
    cornering_stiffness_Nprad: float


@compiled
def rolling_direction(p, vx_mps: float) -> float:
    """Return the rolling direction: 1 forwards, -1 backwards, a sine between them below VXLOW."""
    low = p.VXLOW
    if vx_mps >= low:
        return 1.0
    if vx_mps <= -low:
        return -1.0
    return math.sin(0.5 * math.pi * vx_mps / low)


@compiled
def clamp(x: float, low: float, high: float) -> float:
    """Clamp a value to its limits."""
    return min(max(x, low), high)


@compiled
def relative_pressure(p, pressure_Pa: float) -> float:
    """Return the relative deviation of the inflation pressure from the nominal pressure."""
    return clamp(pressure_Pa, p.PRESMIN, p.PRESMAX) / p.NOMPRES - 1.0


@compiled
def steady_state(
    p, fz: float, kappa: float, alpha: float, gamma: float, pressure: float, vx: float, mu: float, turn_slip: float
):
    """Evaluate the Magic Formula once, in steady state."""
    if not fz > 0.0:
        return SteadyState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    load = clamp(fz, p.FZMIN, p.FZMAX)
    scale = min(fz / load, 1.0)
    fz = load
    side = p.SIDE
    kappa = clamp(kappa, p.KPUMIN, p.KPUMAX)
    alpha = side * clamp(alpha, p.ALPMIN, p.ALPMAX)
    gamma = side * clamp(gamma, p.CAMMIN, p.CAMMAX)
    if p.CAMBER_OFF != 0.0:
        gamma = 0.0
    mu = mu / p.REFERENCE_FRICTION
    pressure = clamp(pressure, p.PRESMIN, p.PRESMAX)
    fz0 = p.LFZO * p.FNOMIN
    dfz = (fz - fz0) / fz0
    dpi = relative_pressure(p, pressure)
    d = rolling_direction(p, vx)
    tan_alpha = math.tan(alpha)
    alpha_s, gamma_s = alpha, gamma
    if p.SLIP_TANGENT != 0.0:
        alpha_s, gamma_s = tan_alpha, math.sin(gamma)
    lmux, lmuy = p.LMUX * mu, p.LMUY * mu
    mf52 = p.MF_VERSION == MF52
    gamma_x, gamma_y, gamma_z = gamma, gamma_s, gamma_s
    if mf52:
        gamma_x, gamma_y, gamma_z = gamma * p.LGAX, gamma_s * p.LGAY, gamma_s * p.LGAZ

    # On a slippery road the pure forces reach their peaks at smaller slips. The weights must follow, or both peaks
    # occur together and the resultant exceeds the friction (similarity method, Pacejka 2012, section 4.2).
    similar = max(mu, SMALLEST_FRICTION)
    kappa_m, alpha_m = kappa / similar, alpha_s / similar
    g_y = lateral_weight(p, dfz, kappa_m, alpha_m, gamma_s)
    z0, z1, z2, z3, z4, z5, z6, z7, z8 = 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0
    if turn_slip != 0.0 and not mf52:
        z0, z1, z2, z3, z4, z5, z6, z7, z8 = turn_slip_factors(
            p, fz, dfz, dpi, kappa, tan_alpha, gamma, gamma_s, pressure, vx, lmuy, g_y, side * turn_slip
        )
    fx0, mu_x, k_x = longitudinal_force(p, fz, dfz, dpi, kappa, gamma_x, lmux, d, z1)
    fy0, mu_y, k_y, b_y, c_y, s_hy, s_vy = lateral_force(p, fz, dfz, dpi, alpha_s, gamma_y, lmuy, d, z0, z2, z3, z4)
    kappa_z, lmu_z = kappa, p.LMUY if p.SCALE_PEAKS_ONLY != 0.0 else lmuy
    if p.FRICTION_ELLIPSE != 0.0:
        g_x, g_y = friction_ellipse(
            p, fz, dfz, d, kappa, alpha_s, fx0, fy0, mu_x * fz, mu_y * fz, k_x, k_y, s_hy, s_vy, lmux
        )
        # Longitudinal slip affects the moment only through the remaining lateral force.
        kappa_z = 0.0
    else:
        g_x = longitudinal_weight(p, dfz, kappa_m, alpha_m, gamma_s)
    fx = g_x * fx0
    fy = g_y * fy0
    fy_trail = fy
    if not mf52:
        # The trail acts on the force without camber and turn slip, weighted with camber (4.E74).
        fy_trail = g_y * lateral_force(p, fz, dfz, dpi, alpha_s, 0.0, lmuy, d, 1.0, 1.0, 1.0, 1.0)[0]
    fy += slip_induced_side_force(p, dfz, kappa, alpha_s, gamma_s, mu_y * fz, z2)

    mx = overturning_moment(p, fz, fy, gamma, dpi)
    my = rolling_resistance_moment(p, fz, fx, gamma, pressure, vx, d)
    mz, trail, residual = aligning_moment(
        p, fz, dfz, dpi, kappa_z, alpha_s, gamma_z, gamma, vx, tan_alpha, lmu_z, d, k_x, k_y, b_y, c_y, s_hy, s_vy,
        fx, fy, fy_trail, z0, z2, z5, z6, z7, z8,
    )  # fmt: skip
    mirrored = side * scale
    return SteadyState(
        scale * fx, mirrored * fy, mirrored * mx, scale * my, mirrored * mz,
        mu_x, mu_y, trail, mirrored * residual, scale * k_x, scale * k_y,
    )  # fmt: skip


@compiled
def magic_formula(
    p, fz_N: float, kappa: float, alpha_rad: float, gamma_rad: float, pressure_Pa: float, vx_mps: float, mu: float
):
    """Return F_x, F_y [N], M_x, M_y, M_z [Nm] in steady state, in ISO-W axes at the contact point.

    Slip is kappa = -V_sx/|V_x| (positive drives, -1 is a locked wheel) and alpha = atan(V_sy/|V_x|), with the speed V_x
    of the contact point along the wheel's heading. Camber is positive about +x. A load of zero or less gives no forces.
    The friction of the road, relative to the file, multiplies LMUX and LMUY, and narrows the curves of combined slip
    accordingly.

    Validity: the ranges of the file; outside them the value at the limit.
    Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, section 4.3.2.
    """
    r = steady_state(p, fz_N, kappa, alpha_rad, gamma_rad, pressure_Pa, vx_mps, mu, 0.0)
    return r.fx_N, r.fy_N, r.mx_Nm, r.my_Nm, r.mz_Nm


@compiled
def slip_stiffnesses(p, fz_N: float, gamma_rad: float, pressure_Pa: float):
    """Return K_xkappa [N], > 0, and K_yalpha [N/rad], < 0 in ISO-W axes, without the road's friction (4.E15, 4.E25)."""
    if not fz_N > 0.0:
        return 0.0, 0.0
    load = clamp(fz_N, p.FZMIN, p.FZMAX)
    scale = min(fz_N / load, 1.0)
    dfz = load / (p.LFZO * p.FNOMIN) - 1.0
    dpi = relative_pressure(p, pressure_Pa)
    gamma = clamp(gamma_rad, p.CAMMIN, p.CAMMAX)
    if p.MF_VERSION == MF52:
        gamma *= p.LGAY
    if p.SLIP_TANGENT != 0.0:
        gamma = math.sin(gamma)
    k_x = longitudinal_stiffness(p, load, dfz, dpi)
    return scale * k_x, scale * cornering_stiffness(p, load, gamma, dpi)


INPUT_COLUMNS = ("fz_N", "kappa", "alpha_rad", "gamma_rad", "pressure_Pa", "vx_mps", "mu", "turn_slip_1pm")
FORCE_COLUMNS = SteadyState._fields
ROLLING_COLUMNS = (
    "relaxation_length_x_m", "relaxation_length_y_m", "effective_radius_m", "loaded_radius_m", "deflection_m",
    "spin_radps", "contact_length_m", "contact_width_m",
)  # fmt: skip


@compiled
def evaluate_rows(tyre, inputs, forces, flags) -> None:
    """Evaluate `steady_state` and `limit_flags` for the rows of INPUT_COLUMNS; fill FORCE_COLUMNS and int64 flags."""
    p = tyre[0]  # a call with an array of shape (1,) costs less than one with a record
    for i in range(inputs.shape[0]):
        fz, kappa, alpha, gamma = inputs[i, 0], inputs[i, 1], inputs[i, 2], inputs[i, 3]
        pressure = inputs[i, 4]
        result = steady_state(p, fz, kappa, alpha, gamma, pressure, inputs[i, 5], inputs[i, 6], inputs[i, 7])
        for k in range(len(result)):
            forces[i, k] = result[k]
        flags[i] = limit_flags(p, fz, kappa, alpha, gamma, pressure)


@compiled
def rolling_rows(tyre, inputs, forces, rolling) -> None:
    """Fill ROLLING_COLUMNS, relaxation lengths, radii and contact patch, from INPUT_COLUMNS and FORCE_COLUMNS."""
    p = tyre[0]
    for i in range(inputs.shape[0]):
        fz, kappa, gamma, pressure = inputs[i, 0], inputs[i, 1], inputs[i, 3], inputs[i, 4]
        omega, radius = rolling_speed(p, fz, kappa, pressure, inputs[i, 5])
        deflection = deflection_under_load(p, fz, omega, pressure, forces[i, 0], forces[i, 1], gamma)
        rolling[i, 0], rolling[i, 1] = rolling_relaxation_lengths(p, fz, gamma, pressure)
        rolling[i, 2] = radius
        rolling[i, 3] = max(free_radius(p, omega) - deflection, 0.0)
        rolling[i, 4] = deflection
        rolling[i, 5] = omega
        rolling[i, 6], rolling[i, 7] = contact_patch(p, fz, pressure)
        if fz <= 0.0:
            rolling[i, 3] = free_radius(p, omega)
