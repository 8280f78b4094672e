"""Relaxation lengths: the distance over which slip builds up, compiled, on plain floats.

Source: Besselink, Schmeitz, Pacejka 2010, equations 17 to 19 (MF 6.x); Pacejka, Tyre and Vehicle Dynamics,
2nd ed. 2006, section 4.3.2 (PTX, PTY of MF 5.2).
"""

from __future__ import annotations

import math
from typing import Final

from activesteer.compilation import compiled
from activesteer.tyre.kernels.pure_slip import cornering_stiffness, longitudinal_stiffness

MIN_RELAXATION_LENGTH_M: Final = 0.02
"""About the length of a tread block; it keeps the slip defined when the load vanishes."""


@compiled
def rolling_relaxation_lengths(p, fz_N: float, gamma_rad: float, pressure_Pa: float):
    """Return the relaxation lengths of a rolling tyre as the contact uses them [m]; arguments as `relaxation_lengths`.

    A tyre whose file or vehicle says that slip builds up at once has those of a tread block.
    """
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
    """Return the relaxation lengths of longitudinal and lateral slip [m], >= 0.

    MF 6.x: slip stiffness over carcass stiffness. MF 5.2: the PTX and PTY coefficients if the file has them.

    Args:
        p: Record of the tyre.
        fz_N: Load [N]; zero or less gives zero lengths.
        gamma_rad: Camber [rad].
        pressure_Pa: Inflation pressure [Pa].
    """
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
