"""Ranges of validity: which inputs of an evaluation lie outside those of the file, as a flag to record."""

from __future__ import annotations

from enum import IntFlag

from activesteer.compilation import compiled
from activesteer.tyre.kernels import parameter_index as c


class Limit(IntFlag):
    """What was evaluated at its limit, because the input lies outside the range of the file."""

    NONE = 0
    LOAD_LOW = 1
    LOAD_HIGH = 2
    SLIP_RATIO = 4
    SLIP_ANGLE = 8
    CAMBER = 16
    PRESSURE = 32


@compiled
def limit_flags(p, fz_N: float, kappa: float, alpha_rad: float, gamma_rad: float, pressure_Pa: float) -> int:
    """Sum of the `Limit` values that apply; a load of zero is a lifted wheel and no violation.

    Args:
        p: Parameter array.
        fz_N: Load [N].
        kappa: Longitudinal slip.
        alpha_rad: Slip angle [rad].
        gamma_rad: Camber [rad].
        pressure_Pa: Inflation pressure [Pa].
    """
    flags = 0
    if 0.0 < fz_N < p[c.FZMIN]:
        flags += 1
    if fz_N > p[c.FZMAX]:
        flags += 2
    if kappa < p[c.KPUMIN] or kappa > p[c.KPUMAX]:
        flags += 4
    if alpha_rad < p[c.ALPMIN] or alpha_rad > p[c.ALPMAX]:
        flags += 8
    if gamma_rad < p[c.CAMMIN] or gamma_rad > p[c.CAMMAX]:
        flags += 16
    if pressure_Pa < p[c.PRESMIN] or pressure_Pa > p[c.PRESMAX]:
        flags += 32
    return flags
