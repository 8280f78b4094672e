"""Parameters of a driver: the keys of a driver file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from activesteer.config import Range


@dataclass(frozen=True, kw_only=True)
class DriverParameters:
    """Steering along a path, and speed control, of a driver in any car."""

    name: str = ""
    """Short name, for tables. Default: the file's name."""
    title: str = ""
    """One line for lists."""
    preview_s: Annotated[float, Range(0.2, 5.0)]
    """Time ahead for which the driver sees the path [s]; he takes it for straight beyond."""
    preview_points: Literal["all", "one"] = "all"
    """Points of the path that the driver looks at: `all` within the preview, or the `one` at its end, as simple driver
    models do. The one point has the sum of the gains of all."""
    reaction_delay_s: Annotated[float, Range(0.0, 1.0)]
    """Delay from seeing to acting, a multiple of the 10 ms between two looks [s]."""
    neuromuscular_lag_s: Annotated[float, Range(0.0, 0.5)]
    """First-order lag of arms and hands [s]."""
    return_time_s: Annotated[float, Range(0.0, 5.0)]
    """Weight of the drift off the path: a drift costs as much as the offset that it makes in this time. If steering
    costs nothing, an offset decays with this time constant [s]."""
    steering_rate_per_metre_radps: Annotated[float, Range(0.01, 100.0)]
    """Weight of the steering: steering wheel rate that costs as much as an offset of one metre from the path
    [rad/s]."""
    steering_rate_limit_radps: Annotated[float, Range(0.1, 50.0)]
    """Largest steering wheel rate [rad/s]."""
    steering_torque_limit_Nm: Annotated[float, Range(0.5, 200.0)] | None = None
    """Largest torque of the hands at the steering wheel, counted as `hand_torque_Nm` [N m]. Default: no limit."""

    speed_gain_1ps: Annotated[float, Range(0.0)] = 3.4
    """Acceleration per speed error [1/s]: about 0.9 m/s2 for an error of 1 km/h."""
    speed_integral_gain_1ps2: Annotated[float, Range(0.0)] = 1.36
    """Acceleration per integrated speed error [1/s2]: it compensates drag within a few seconds."""

    spin_mps: Annotated[float, Range(0.1)] = 2.0
    """Speed of the driven wheels above the speed of the car at which the foot goes back [m/s]; the driver hears the
    engine."""
    spin_slip: Annotated[float, Range(0.01)] = 0.2
    """Fraction of the car's speed that is added to `spin_mps` [-]: beyond the slip of the largest force, 0.1 to
    0.15."""
    foot_lag_s: Annotated[float, Range(0.01, 2.0)] = 0.15
    """Time constant with which the foot goes back [s]."""
    foot_return_per_s: Annotated[float, Range(0.01, 10.0)] = 0.5
    """Rate at which the foot presses down again, in pedal strokes per second [1/s]."""
