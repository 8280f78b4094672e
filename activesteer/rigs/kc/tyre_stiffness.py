"""Model of a standing tyre on the rig: a vertical and a lateral spring, and a moment against turning."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from activesteer.tyre.kernels.slip import carcass_stiffnesses
from activesteer.tyre.kernels.vertical import deflection_under_load, vertical_force
from activesteer.tyre.tyre_parameters import TyreParameters

PARKING_FRICTION: Final = 0.9
"""Coefficient of friction under tyres that are turned at rest."""


@dataclass(frozen=True)
class TyreStiffness:
    """A tyre under its static load."""

    vertical_Npm: float
    lateral_Npm: float
    width_m: float
    pressure_Pa: float


def tyre_stiffness(tyre: TyreParameters, pressure_Pa: float | None, load_N: float) -> TyreStiffness:
    """Return the stiffnesses of an upright standing tyre.

    Args:
        tyre: Parameters of the tyre.
        pressure_Pa: Inflation pressure [Pa]; None for the pressure of the tyre file.
        load_N: Vertical load [N].
    """
    record = tyre.record
    pressure = tyre["INFLPRES"] if pressure_Pa is None else pressure_Pa
    deflection = deflection_under_load(record, load_N, 0.0, pressure, 0.0, 0.0, 0.0)
    step = 1e-4
    more, less = (vertical_force(record, deflection + sign * step, 0.0, pressure) for sign in (1.0, -1.0))
    lateral = carcass_stiffnesses(record, load_N, pressure)[1]
    return TyreStiffness((more - less) / (2.0 * step), float(lateral), tyre["WIDTH"], pressure)


def parking_moment_Nm(load_N: float, tyre: TyreStiffness) -> float:
    """Return the moment of a standing tyre against turning about the vertical on a dry road [N m].

    Source: V. E. Gough, Practical Tire Research, SAE Transactions 64 (1956): mu / 3 sqrt(load^3 / pressure).
    """
    return PARKING_FRICTION / 3.0 * math.sqrt(load_N**3 / tyre.pressure_Pa)
