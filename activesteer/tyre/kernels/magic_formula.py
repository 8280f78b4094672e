"""The Magic Formula: forces and moments of a tyre in steady state, one compiled kernel for every caller.

Inputs and outputs are in ISO-W axes at the contact point, SI and radians: alpha > 0 gives F_y < 0, kappa > 0 drives,
gamma > 0 inclines the wheel about +x, M_y < 0 rolls forward. Slip refers to the absolute value of the speed.

`p` is the record of the tyre (`record.TYRE_RECORD`). Inputs outside the ranges of the file are evaluated at the limit
(see `limits.limit_flags`). Below the smallest valid load, the forces of that load are scaled down to zero.

Below the speed VXLOW everything that depends on the rolling direction (shifts, trail, rolling resistance) fades with
a sine through zero at rest, so that the forces are continuous through standstill. The forces due to slip do not fade,
because there slip is the deflection of the contact patch (see `relaxation`).

A division by zero gives inf or nan, as in numpy, and no exception. The kernels run inside the engine's callbacks, where
nothing could catch an exception; the check of the state finds values that are not finite.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from activesteer.compilation import compiled
from activesteer.tyre.kernels.combined_slip import (
    friction_ellipse,
    lateral_weight,
    longitudinal_weight,
    slip_induced_side_force,
)
from activesteer.tyre.kernels.moments import (
    SMALLEST_FRICTION,
    aligning_moment,
    overturning_moment,
    rolling_resistance_moment,
)
from activesteer.tyre.kernels.pure_slip import (
    MF52,
    cornering_stiffness,
    lateral_force,
    longitudinal_force,
    longitudinal_stiffness,
)
from activesteer.tyre.kernels.turn_slip import turn_slip_factors


class SteadyState(NamedTuple):
    """Results of one evaluation, ISO-W axes at the contact point.

    Attributes:
        fx_N: Longitudinal force [N].
        fy_N: Lateral force [N].
        mx_Nm: Overturning moment [Nm].
        my_Nm: Rolling resistance moment [Nm].
        mz_Nm: Aligning moment [Nm].
        friction_x: Peak longitudinal friction mu_x.
        friction_y: Peak lateral friction mu_y.
        trail_m: Pneumatic trail [m].
        residual_moment_Nm: Residual part of the aligning moment [Nm].
        slip_stiffness_N: K_xkappa [N].
        cornering_stiffness_Nprad: K_yalpha [N/rad].
    """

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
    """Return 1 rolling forward, -1 backward, and a sine between them below VXLOW."""
    low = p.VXLOW
    if vx_mps >= low:
        return 1.0
    if vx_mps <= -low:
        return -1.0
    return math.sin(0.5 * math.pi * vx_mps / low)


@compiled
def clamp(x: float, low: float, high: float) -> float:
    """Return the value, or the limit that it exceeds."""
    return min(max(x, low), high)


@compiled
def relative_pressure(p, pressure_Pa: float) -> float:
    """Return the pressure over the nominal one, less 1."""
    return clamp(pressure_Pa, p.PRESMIN, p.PRESMAX) / p.NOMPRES - 1.0


@compiled
def steady_state(
    p, fz: float, kappa: float, alpha: float, gamma: float, pressure: float, vx: float, mu: float, turn_slip: float
):
    """Evaluate the formula once; return a `SteadyState`."""
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
    """Return forces and moments of the tyre at the contact point in steady state.

    Args:
        p: Record of the tyre, a `TYRE_RECORD`.
        fz_N: Load [N]; zero or less gives no forces.
        kappa: Longitudinal slip -V_sx/|V_x|, positive drives; -1 is a locked wheel.
        alpha_rad: Slip angle atan(V_sy/|V_x|) [rad].
        gamma_rad: Camber [rad], positive about +x.
        pressure_Pa: Inflation pressure [Pa].
        vx_mps: Speed of the contact point along the wheel's heading [m/s].
        mu: Friction of the road relative to that of the file; multiplies LMUX and LMUY, and narrows the curves of
            combined slip accordingly.

    Returns:
        F_x [N], F_y [N], M_x [Nm], M_y [Nm], M_z [Nm] in ISO-W axes.

    Validity: the ranges of the file; outside them the value at the limit.
    Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, section 4.3.2.
    """
    r = steady_state(p, fz_N, kappa, alpha_rad, gamma_rad, pressure_Pa, vx_mps, mu, 0.0)
    return r.fx_N, r.fy_N, r.mx_Nm, r.my_Nm, r.mz_Nm


@compiled
def slip_stiffnesses(p, fz_N: float, gamma_rad: float, pressure_Pa: float):
    """Return the slopes of the forces at zero slip; the friction of the road does not affect them.

    Args:
        p: Record of the tyre.
        fz_N: Load [N].
        gamma_rad: Camber [rad].
        pressure_Pa: Inflation pressure [Pa].

    Returns:
        Slip stiffness K_xkappa [N], > 0, and cornering stiffness K_yalpha [N/rad], < 0 in ISO-W axes.

    Source: Pacejka 2012, 4.E15 and 4.E25.
    """
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
