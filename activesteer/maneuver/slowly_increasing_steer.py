"""Slowly increasing steer (ISO 4138, constant speed): the car stays near its steady state."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver, Search, within
from activesteer.signals import Setpoint


@dataclass(frozen=True)
class SlowRamp:
    """The ramp of the steering wheel."""

    start_s: Annotated[float, Range(0.0)] = 0.5
    """Time at which the steering wheel begins to turn [s]."""
    rate_radps: Annotated[float, Range(-2.0, 2.0)] = math.radians(5.0)
    """Steering wheel rate [rad/s], left positive."""
    end_rad: Annotated[float, Range(0.0, 15.0)] = math.radians(200.0)
    """Angle to either side at which the ramp stops [rad]."""


@dataclass(frozen=True, kw_only=True)
class SlowlyIncreasingSteer(Maneuver):
    """A slow ramp of the steering wheel angle at constant speed, up to the limit of the car."""

    steer: SlowRamp = SlowRamp()
    """The ramp."""

    def __post_init__(self) -> None:
        """Check that the ramp begins within the run and turns the steering wheel."""
        ramp = self.steer
        if ramp.start_s >= self.duration_s:
            raise ManeuverError(
                f"is {ramp.start_s:g} s, but the run ends at {self.duration_s:g} s (duration_s)",
                key="steer.start_s",
                value=ramp.start_s,
            )
        if ramp.rate_radps == 0.0 or ramp.end_rad == 0.0:
            raise ManeuverError("rate_degps and end_deg must not be 0: the steering wheel would not turn", key="steer")

    def setpoint(self, time_s: float) -> Setpoint:
        """Steering wheel angle of the ramp; see the base class."""
        ramp = self.steer
        turned = within((time_s - ramp.start_s) * abs(ramp.rate_radps), ramp.end_rad)
        return self.at_speed(math.copysign(turned, ramp.rate_radps))


@dataclass(frozen=True)
class RampAngle(Search):
    """Search for the angle at which a slow ramp to the left reaches a lateral acceleration."""

    probe: SlowlyIncreasingSteer
