"""Braking in a turn (ISO 7975): steady-state cornering, then the brake, the steering wheel held."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver, check_search_speed, within
from activesteer.maneuver.step_steer import SteadyTurn, StepInput, StepSteer
from activesteer.signals import Setpoint


@dataclass(frozen=True)
class TurnInput:
    """The steering wheel on the way into the turn."""

    OVERRULED: ClassVar = {"lateral_acceleration_mps2": {"steering_wheel_rad": None}}

    start_s: Annotated[float, Range(0.0)] = 0.5
    """When it begins to turn [s]."""
    rate_radps: Annotated[float, Range(0.1, 50.0)] = math.radians(60.0)
    """How fast it turns [rad/s]."""
    steering_wheel_rad: Annotated[float, Range(-15.0, 15.0)] | None = None
    """Angle that is then held, left positive [rad]; found by a search where not given."""
    lateral_acceleration_mps2: Annotated[float, Range(-12.0, 12.0)] | None = None
    """Steady-state lateral acceleration of the control-free car that the search aims at, left positive [m/s2]."""

    def __post_init__(self) -> None:
        """Angle or aim must be known; where both are, the angle is what the aim once led to.

        Raises:
            ManeuverError: neither of them is given.
        """
        if self.steering_wheel_rad is None and self.lateral_acceleration_mps2 is None:
            raise ManeuverError(
                "steering_wheel_deg (the angle to hold) or lateral_acceleration_mps2 (what the control-free car shall "
                "reach) is needed"
            )


@dataclass(frozen=True)
class BrakeInput:
    """The brake in the turn."""

    pedal: Annotated[float, Range(0.0, 1.0)]
    """Pedal position [-]."""
    start_s: Annotated[float, Range(0.0)] = 6.0
    """When it begins to be pressed [s]; the throttle is released then."""
    rise_s: Annotated[float, Range(0.01, 5.0)] = 0.2
    """Time in which it is pressed [s]."""


@dataclass(frozen=True, kw_only=True)
class BrakeInTurn(Maneuver):
    """A turn at constant speed and steering wheel angle, braked."""

    turn: TurnInput
    """The way into the turn."""
    brake: BrakeInput
    """The brake."""

    def __post_init__(self) -> None:
        """One thing after the other, within the run.

        Raises:
            ManeuverError: the brake comes before the turn, or after the end, or the car is too slow for the search.
        """
        turn, brake = self.turn, self.brake
        if brake.start_s <= turn.start_s:
            raise ManeuverError(
                f"is {brake.start_s:g} s; it must be above turn.start_s, {turn.start_s:g} s",
                key="brake.start_s",
                value=brake.start_s,
            )
        if brake.start_s + brake.rise_s >= self.duration_s:
            end = brake.start_s + brake.rise_s
            raise ManeuverError(
                f"the brake is pressed down at {end:g} s, but the run ends at {self.duration_s:g} s",
                key="brake.start_s",
            )
        if turn.steering_wheel_rad is None:
            check_search_speed(self.speed_mps, "turn.lateral_acceleration_mps2", "turn.steering_wheel_deg")

    @property
    def search(self) -> SteadyTurn | None:
        """For the steering wheel angle, where only the lateral acceleration is known: that of a step steer."""
        wanted = self.turn.lateral_acceleration_mps2
        if self.turn.steering_wheel_rad is not None or wanted is None:
            return None
        step = StepSteer(
            kind="step_steer", name=self.name, speed_mps=self.speed_mps, duration_s=self.duration_s,
            settle_s=self.settle_s, road=self.road, steer=StepInput(lateral_acceleration_mps2=wanted),
        )  # fmt: skip
        found = step.search
        return None if found is None else dataclasses.replace(found, accept=self.with_amplitude)

    def with_amplitude(self, steering_wheel_rad: float) -> BrakeInTurn:
        """The same with its steering wheel angle known [rad]; the aim that led to it stays on record."""
        return dataclasses.replace(self, turn=dataclasses.replace(self.turn, steering_wheel_rad=steering_wheel_rad))

    def setpoint(self, time_s: float) -> Setpoint:
        """Ramp of the steering wheel, ramp of the brake; see the base class."""
        turn, brake = self.turn, self.brake
        amplitude = turn.steering_wheel_rad or 0.0
        turned = within((time_s - turn.start_s) * turn.rate_radps, abs(amplitude))
        angle = math.copysign(turned, amplitude)
        if time_s < brake.start_s:
            return self.at_speed(angle)
        pressed = within((time_s - brake.start_s) / brake.rise_s, 1.0)
        return Setpoint(angle, self.speed_mps, pressed * brake.pedal, False)

    def settling_setpoint(self) -> Setpoint:
        """Straight ahead at the speed of the manoeuvre."""
        return self.at_speed(0.0)
