"""Relaxation lengths: the distance over which slip builds up, compiled, on plain floats.

Source: Besselink, Schmeitz, Pacejka 2010, equations 17 to 19 (MF 6.x); Pacejka, Tyre and Vehicle Dynamics,
2nd ed. 2006, section 4.3.2 (PTX, PTY of MF 5.2).
"""

from __future__ import annotations

import math

from activesteer.compilation import compiled
from activesteer.tyre.kernels import parameter_index as c
from activesteer.tyre.kernels.pure_slip import cornering_stiffness, longitudinal_stiffness


@compiled
def carcass_stiffnesses(p, fz_N: float, pressure_Pa: float):
    """Longitudinal and lateral stiffness of the carcass [N/m] at a load [N] and a pressure [Pa] (equations 17, 18)."""
    dfz = fz_N / (p[c.LFZO] * p[c.FNOMIN]) - 1.0
    dpi = min(max(pressure_Pa, p[c.PRESMIN]), p[c.PRESMAX]) / p[c.NOMPRES] - 1.0
    along = (1.0 + p[c.PCFX1] * dfz + p[c.PCFX2] * dfz * dfz) * (1.0 + p[c.PCFX3] * dpi)
    across = (1.0 + p[c.PCFY1] * dfz + p[c.PCFY2] * dfz * dfz) * (1.0 + p[c.PCFY3] * dpi)
    return p[c.LONGITUDINAL_STIFFNESS] * along, p[c.LATERAL_STIFFNESS] * across


@compiled
def relaxation_lengths(p, fz_N: float, gamma_rad: float, pressure_Pa: float):
    """Relaxation lengths of longitudinal and lateral slip [m], >= 0.

    MF 6.x: slip stiffness over carcass stiffness. MF 5.2: the PTX and PTY coefficients where the file has them.

    Args:
        p: Parameter array.
        fz_N: Load [N]; zero or less gives zero lengths.
        gamma_rad: Camber [rad].
        pressure_Pa: Inflation pressure [Pa].
    """
    if not fz_N > 0.0:
        return 0.0, 0.0
    load = min(max(fz_N, p[c.FZMIN]), p[c.FZMAX])
    scale = min(fz_N / load, 1.0)
    gamma = min(max(gamma_rad, p[c.CAMMIN]), p[c.CAMMAX])
    r0, fz0 = p[c.UNLOADED_RADIUS], p[c.FNOMIN]
    dfz = load / (p[c.LFZO] * fz0) - 1.0
    dpi = min(max(pressure_Pa, p[c.PRESMIN]), p[c.PRESMAX]) / p[c.NOMPRES] - 1.0
    along, across = carcass_stiffnesses(p, load, pressure_Pa)
    if p[c.PTX_GIVEN] != 0.0:
        sigma_x = load * (p[c.PTX1] + p[c.PTX2] * dfz) * math.exp(-p[c.PTX3] * dfz) * r0 / fz0 * p[c.LSGKP]
    else:
        sigma_x = longitudinal_stiffness(p, load, dfz, dpi) / along
    if p[c.PTY_GIVEN] != 0.0:
        peak = p[c.PTY1] * r0 * p[c.LFZO] * p[c.LSGAL] * (1.0 - p[c.PKY3] * abs(gamma))
        sigma_y = peak * math.sin(2.0 * math.atan(load / (p[c.PTY2] * p[c.LFZO] * fz0)))
    else:
        gamma_s = math.sin(gamma) if p[c.SLIP_TANGENT] != 0.0 else gamma
        sigma_y = cornering_stiffness(p, load, gamma_s, dpi) / across
    return scale * abs(sigma_x), scale * abs(sigma_y)
