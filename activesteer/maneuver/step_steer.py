"""Step steer (ISO 7401): the steering wheel is turned fast and then held, while the drive holds the speed."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, Final

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver, Search
from activesteer.signals import Setpoint

_SEARCH_S: Final = 4.5
"""Length of a run of the amplitude search after the beginning of the step [s]."""


@dataclass(frozen=True)
class StepInput:
    """The step at the steering wheel."""

    OVERRULED: ClassVar = {"lateral_acceleration_mps2": {"steering_wheel_rad": None}}

    start_s: Annotated[float, Range(0.0)] = 0.5
    """Time at which the steering wheel begins to turn [s]."""
    rate_radps: Annotated[float, Range(0.1, 50.0)] = math.radians(400.0)
    """Steering wheel rate [rad/s]; ISO 7401 requires at least 200 deg/s."""
    steering_wheel_rad: Annotated[float, Range(-15.0, 15.0)] | None = None
    """Amplitude, left positive [rad]. Default: found by a search."""
    lateral_acceleration_mps2: Annotated[float, Range(-12.0, 12.0)] | None = None
    """Steady-state lateral acceleration of the car without control that the search reaches, left positive [m/s2]."""

    def __post_init__(self) -> None:
        """Check that amplitude or lateral acceleration is given; with both, a search has found the amplitude."""
        if self.steering_wheel_rad is None and self.lateral_acceleration_mps2 is None:
            raise ManeuverError(
                "steering_wheel_deg (the amplitude) or lateral_acceleration_g (which the car without control reaches) "
                "is needed"
            )


@dataclass(frozen=True, kw_only=True)
class StepSteer(Maneuver):
    """A step of the steering wheel angle, ramped at a limited rate."""

    steer: StepInput
    """The step."""

    def __post_init__(self) -> None:
        """Check that the step starts before the end of the run."""
        step = self.steer
        if step.start_s >= self.duration_s:
            raise ManeuverError(
                f"is {step.start_s:g} s, but the run ends at {self.duration_s:g} s (duration_s)",
                key="steer.start_s",
                value=step.start_s,
            )

    def setpoint(self, time_s: float) -> Setpoint:
        """Steering wheel angle of the ramp; see the base class."""
        step, (before, after) = self.steer, self._ends
        turned = (time_s - step.start_s) * step.rate_radps
        if turned <= 0.0:
            return before
        amplitude = step.steering_wheel_rad or 0.0
        return after if turned >= abs(amplitude) else self.at_speed(math.copysign(turned, amplitude))

    @cached_property
    def _ends(self) -> tuple[Setpoint, Setpoint]:
        """Setpoints before and after the ramp."""
        amplitude = self.steer.steering_wheel_rad or 0.0
        return self.at_speed(math.copysign(0.0, amplitude)), self.at_speed(amplitude)

    @property
    def search(self) -> SteadyTurn | None:
        """Search for the amplitude, if only the lateral acceleration is given."""
        wanted = self.steer.lateral_acceleration_mps2
        if self.steer.steering_wheel_rad is not None or wanted is None:
            return None
        # Of fixed length, so that the amplitude does not depend on the length of the manoeuvre.
        probe = dataclasses.replace(self, duration_s=self.steer.start_s + _SEARCH_S)
        return SteadyTurn(probe, wanted, self.with_amplitude)

    def with_amplitude(self, steering_wheel_rad: float) -> StepSteer:
        """Return the step with an amplitude [rad]; the lateral acceleration stays on record."""
        return dataclasses.replace(self, steer=dataclasses.replace(self.steer, steering_wheel_rad=steering_wheel_rad))


@dataclass(frozen=True)
class SteadyTurn(Search):
    """Search for the amplitude of a step steer that gives a steady-state lateral acceleration."""

    probe: StepSteer
