"""Ranges of validity: a flag for the inputs of an evaluation that lie outside those of the file."""

from __future__ import annotations

from enum import IntFlag

from activesteer.compilation import compiled


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
    """Return the sum of the `Limit` values that apply; a load of zero is a lifted wheel and not a violation.

    Args:
        p: Record of the tyre.
        fz_N: Load [N].
        kappa: Longitudinal slip.
        alpha_rad: Slip angle [rad].
        gamma_rad: Camber [rad].
        pressure_Pa: Inflation pressure [Pa].
    """
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
