"""A driver: what he is able to, and how he holds a speed; the keys of a driver file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range


@dataclass(frozen=True, kw_only=True)
class DriverParameters:
    """How somebody steers along a path, and how he holds a speed, in whatever car."""

    name: str = ""
    """Short name, for tables; the file's name where not given."""
    title: str = ""
    """One line for lists."""
    preview_s: Annotated[float, Range(0.2, 5.0)]
    """How far ahead the driver looks [s]; behind it the path goes on straight, as far as he knows."""
    reaction_delay_s: Annotated[float, Range(0.0, 1.0)]
    """From seeing to acting, in steps of 10 ms, the time between two looks [s]."""
    neuromuscular_lag_s: Annotated[float, Range(0.0, 0.5)]
    """First-order lag of arms and hands [s]."""
    return_time_s: Annotated[float, Range(0.0, 5.0)]
    """How he comes back to a path: drifting off it is as unwelcome as the offset that it makes in this time. Where
    steering costs nothing, the time constant with which an offset decays [s]."""
    steering_rate_per_metre_radps: Annotated[float, Range(0.01, 100.0)]
    """How tightly he follows: the rate of the steering wheel that is as unwelcome as being a metre off the path
    [rad/s]."""
    steering_rate_limit_radps: Annotated[float, Range(0.1, 50.0)]
    """How fast the steering wheel is turned at most [rad/s]."""
    steering_torque_limit_Nm: Annotated[float, Range(0.5, 200.0)] | None = None
    """Most torque that the hands hold at the steering wheel, as `hand_torque_Nm` is counted; any if not given [N m]."""

    speed_gain_1ps: Annotated[float, Range(0.0)] = 3.4
    """Acceleration asked for per speed error [1/s]: 1 km/h off asks for about 0.9 m/s2."""
    speed_integral_gain_1ps2: Annotated[float, Range(0.0)] = 1.36
    """The same per integrated speed error [1/s2]: drag is trimmed out within some seconds."""

    spin_mps: Annotated[float, Range(0.1)] = 2.0
    """How much faster than the car the driven wheels may turn before the foot goes back [m/s]; one hears the engine."""
    spin_slip: Annotated[float, Range(0.01)] = 0.2
    """And the share of the car's speed that is added to it [-]: beyond the slip of greatest force, 0.1 to 0.15."""
    foot_lag_s: Annotated[float, Range(0.01, 2.0)] = 0.15
    """Time constant with which the foot goes back [s]."""
    foot_return_per_s: Annotated[float, Range(0.01, 10.0)] = 0.5
    """How fast it presses down again, shares of the whole way per second [1/s]."""
