"""The driver's gains and limits; keys of the table [driver] in a vehicle file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range


@dataclass(frozen=True)
class DriverParameters:
    """How a driver, or a cruise control in his place, holds speed."""

    speed_gain_Nmspm: Annotated[float, Range(0.0)] = 1500.0
    """Drive torque per speed error [N m s/m]: 1 km/h off asks for about 0.9 m/s2 of a 1.4 t car."""
    speed_integral_gain_Nmpm: Annotated[float, Range(0.0)] = 600.0
    """Drive torque per integrated speed error [N m/m]: drag is trimmed out within some seconds."""
