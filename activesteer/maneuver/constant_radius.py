"""Constant radius (ISO 4138): the driver keeps the car on a circle while its speed rises slowly to the limit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver, within
from activesteer.signals import Setpoint


@dataclass(frozen=True)
class Circle:
    """The circle and the speed on it."""

    radius_m: Annotated[float, Range(-2000.0, 2000.0)] = 100.0
    """Radius of the path of the centre of gravity [m], positive to the left."""
    entry_s: Annotated[float, Range(0.1, 60.0)] = 4.0
    """Time in which the curvature rises from zero to its value on the circle, at the initial speed [s]."""
    acceleration_mps2: Annotated[float, Range(0.01, 2.0)] = 0.4
    """Rate of change of the speed after the entry [m/s2]."""
    end_speed_mps: Annotated[float, Range(0.0, 100.0)] = 30.0
    """Final speed [m/s]."""


@dataclass(frozen=True, kw_only=True)
class ConstantRadius(Maneuver):
    """A circle at a slowly rising speed."""

    circle: Circle = Circle()
    """The circle."""

    def __post_init__(self) -> None:
        """Check that a car can drive the circle and that its speed rises."""
        circle = self.circle
        if abs(circle.radius_m) < 10.0:
            raise ManeuverError(
                f"is {circle.radius_m:g} m; at least 10 m to either side are needed",
                key="circle.radius_m",
                value=circle.radius_m,
            )
        if circle.end_speed_mps <= self.speed_mps:
            raise ManeuverError(
                f"is {3.6 * circle.end_speed_mps:g} km/h; it must be above the speed at the "
                f"start, {3.6 * self.speed_mps:g} km/h (speed_kmh)",
                key="circle.end_speed_kmh",
                value=3.6 * circle.end_speed_mps,
            )

    def setpoint(self, time_s: float) -> Setpoint:
        """Curvature and speed; see the base class."""
        circle = self.circle
        fraction = within(time_s / circle.entry_s, 1.0)
        # Half a wave of a cosine: the curvature has no kink at the beginning and the end of the rise.
        curvature = 0.5 * (1.0 - math.cos(math.pi * fraction)) / circle.radius_m
        rising_s = max(time_s - circle.entry_s, 0.0)
        speed = min(self.speed_mps + rising_s * circle.acceleration_mps2, circle.end_speed_mps)
        return Setpoint(0.0, speed, 0.0, True, curvature)

    def settling_setpoint(self) -> Setpoint:
        """Straight ahead, with the curvature as the setpoint."""
        return self.setpoint(0.0)
