"""The driver's gains and limits; keys of the table [driver] in a vehicle file."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range


@dataclass(frozen=True)
class DriverParameters:
    """One driver for all manoeuvres, cars and steering systems; how he steers along a path and holds speed."""

    preview_s: Annotated[float, Range(0.2, 5.0)] = 1.3
    """How far ahead the driver looks [s]: 1.3 s in MacAdam (1981), who fitted lane changes of test drivers."""
    reaction_delay_s: Annotated[float, Range(0.0, 1.0)] = 0.2
    """From seeing to acting, in steps of 10 ms, the time between two looks [s]: 0.2 s in MacAdam (1981)."""
    neuromuscular_lag_s: Annotated[float, Range(0.0, 0.5)] = 0.1
    """First-order lag of arms and hands [s]: about 0.1 s in McRuer's crossover model (1967)."""
    steering_rate_limit_radps: Annotated[float, Range(0.1, 50.0)] = math.radians(900.0)
    """How fast the steering wheel is turned at most [rad/s]; test drivers reach 800 to 1200 deg/s."""

    speed_gain_Nmspm: Annotated[float, Range(0.0)] = 1500.0
    """Drive torque per speed error [N m s/m]: 1 km/h off asks for about 0.9 m/s2 of a 1.4 t car."""
    speed_integral_gain_Nmpm: Annotated[float, Range(0.0)] = 600.0
    """Drive torque per integrated speed error [N m/m]: drag is trimmed out within some seconds."""

    spin_mps: Annotated[float, Range(0.1)] = 2.0
    """How much faster than the car the driven wheels may turn before the foot goes back [m/s]; one hears the engine."""
    spin_slip: Annotated[float, Range(0.01)] = 0.2
    """And the share of the car's speed that is added to it [-]: beyond the slip of greatest force, 0.1 to 0.15."""
    foot_lag_s: Annotated[float, Range(0.01, 2.0)] = 0.15
    """Time constant with which the foot goes back [s]."""
    foot_return_per_s: Annotated[float, Range(0.01, 10.0)] = 0.5
    """How fast it presses down again, shares of the whole way per second [1/s]."""
