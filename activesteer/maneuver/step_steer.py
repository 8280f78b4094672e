"""Step steer (ISO 7401): the steering wheel is turned at once and then held, speed kept by the drive."""

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
"""Time after the beginning of the step that a run of the search for the amplitude takes [s]."""


@dataclass(frozen=True)
class StepInput:
    """The step at the steering wheel."""

    OVERRULED: ClassVar = {"lateral_acceleration_mps2": {"steering_wheel_rad": None}}

    start_s: Annotated[float, Range(0.0)] = 0.5
    """When the steering wheel begins to turn [s]."""
    rate_radps: Annotated[float, Range(0.1, 50.0)] = math.radians(400.0)
    """How fast it turns [rad/s]; ISO 7401 asks for at least 200 deg/s."""
    steering_wheel_rad: Annotated[float, Range(-15.0, 15.0)] | None = None
    """Amplitude, left positive [rad]; found by a search where not given."""
    lateral_acceleration_mps2: Annotated[float, Range(-12.0, 12.0)] | None = None
    """Steady-state lateral acceleration of the control-free car that the search aims at, left positive [m/s2]."""


@dataclass(frozen=True, kw_only=True)
class StepSteer(Maneuver):
    """A step of the steering wheel angle, ramped at a limited rate."""

    steer: StepInput
    """The step."""

    def __post_init__(self) -> None:
        """Amplitude or aim must be known; where both are, the amplitude is what the aim once led to.

        Raises:
            ManeuverError: neither of them is given, or the step starts after the end.
        """
        step = self.steer
        if step.steering_wheel_rad is None and step.lateral_acceleration_mps2 is None:
            raise ManeuverError(
                "steering_wheel_deg (the amplitude) or lateral_acceleration_g (what the control-free car shall "
                "reach) is needed",
                key="steer",
            )
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
        """Before the ramp and after it."""
        amplitude = self.steer.steering_wheel_rad or 0.0
        return self.at_speed(math.copysign(0.0, amplitude)), self.at_speed(amplitude)

    def settling_setpoint(self) -> Setpoint:
        """Straight ahead at the speed of the manoeuvre."""
        return self.at_speed(0.0)

    @property
    def search(self) -> SteadyTurn | None:
        """For the amplitude, where only the lateral acceleration is known."""
        wanted = self.steer.lateral_acceleration_mps2
        if self.steer.steering_wheel_rad is not None or wanted is None:
            return None
        # Always as long, so that the amplitude does not depend on how long the manoeuvre is.
        probe = dataclasses.replace(self, duration_s=self.steer.start_s + _SEARCH_S)
        return SteadyTurn(probe, wanted, self.with_amplitude)

    def with_amplitude(self, steering_wheel_rad: float) -> StepSteer:
        """The same step with its amplitude known [rad]; the aim that led to it stays on record."""
        return dataclasses.replace(self, steer=dataclasses.replace(self.steer, steering_wheel_rad=steering_wheel_rad))


@dataclass(frozen=True)
class SteadyTurn(Search):
    """Search for the amplitude of a step steer that leads to a steady-state lateral acceleration."""

    probe: StepSteer
