"""Braking straight ahead (ISO 21994, ISO 14512) and in a turn (ISO 7975)."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final

from activesteer.config import Range
from activesteer.core.path import Path
from activesteer.core.signals import Setpoint
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver, Search, check_speed, within
from activesteer.maneuver.steering_tests import StepInput, steady_turn_search
from activesteer.road.course import Course


@dataclass(frozen=True)
class TurnInput(StepInput):
    """Steering wheel input at the entry of the turn."""

    rate_radps: Annotated[float, Range(0.1, 50.0)] = math.radians(60.0)
    """Steering wheel rate [rad/s]."""


@dataclass(frozen=True)
class BrakeInput:
    """Brake pedal input."""

    pedal: Annotated[float, Range(0.0, 1.0)]
    """Pedal position [-]."""
    start_s: Annotated[float, Range(0.0)] = 6.0
    """Time at which the driver begins to press the pedal and releases the throttle [s]."""
    rise_s: Annotated[float, Range(0.01, 5.0)] = 0.2
    """Time until the pedal is in position [s]."""

    def check_end(self, duration_s: float) -> None:
        """Check that the pedal reaches its position before the end of the run."""
        pressed_s = self.start_s + self.rise_s
        if pressed_s >= duration_s:
            problem = f"the brake is pressed down at {pressed_s:g} s, but the run ends at {duration_s:g} s"
            raise ManeuverError(problem, key="brake.start_s", value=self.start_s)


@dataclass(frozen=True, kw_only=True)
class BrakeInTurn(Maneuver, kind="brake_in_turn"):
    """A turn at constant speed and steering wheel angle, then braking."""

    turn: TurnInput
    """Entry of the turn."""
    brake: BrakeInput
    """Brake pedal input."""

    def __post_init__(self) -> None:
        """Check that turn and brake follow each other within the run."""
        turn, brake = self.turn, self.brake
        if brake.start_s <= turn.start_s:
            raise ManeuverError(
                f"is {brake.start_s:g} s; it must be above turn.start_s, {turn.start_s:g} s",
                key="brake.start_s",
                value=brake.start_s,
            )
        brake.check_end(self.duration_s)
        if turn.steering_wheel_rad is None:
            check_speed(self.speed_mps, "turn.lateral_acceleration_mps2", "turn.steering_wheel_deg")

    @property
    def search(self) -> Search | None:
        """Return the search for the angle by a step steer, if only the lateral acceleration is given."""
        turn = self.turn

        def accept(angle: float) -> BrakeInTurn:
            return dataclasses.replace(self, turn=dataclasses.replace(turn, steering_wheel_rad=angle))

        # A turn is entered slowly, but the search drives a quick step.
        step = StepInput(
            steering_wheel_rad=turn.steering_wheel_rad, lateral_acceleration_mps2=turn.lateral_acceleration_mps2
        )
        return steady_turn_search(self, step, accept)

    def setpoint(self, time_s: float) -> Setpoint:
        """Return the ramp of the steering wheel, then the ramp of the brake (see the base class)."""
        turn, brake = self.turn, self.brake
        amplitude = turn.steering_wheel_rad or 0.0
        turned = within((time_s - turn.start_s) * turn.rate_radps, abs(amplitude))
        angle = math.copysign(turned, amplitude)
        if time_s < brake.start_s:
            return self.at_speed(angle)
        pressed = within((time_s - brake.start_s) / brake.rise_s, 1.0)
        return Setpoint(angle, self.speed_mps, pressed * brake.pedal, False)


_MIN_SPEED_MPS: Final = 10.0 / 3.6
"""Lowest speed from which braking can be evaluated [m/s]."""


@dataclass(frozen=True, kw_only=True)
class StraightBraking(Maneuver, kind="straight_braking"):
    """Driving straight ahead, then braking to rest with an open clutch."""

    brake: BrakeInput
    """Brake pedal input."""
    hold_line: bool = True
    """True if the driver keeps the car on a straight line. Otherwise the steering wheel is held straight."""

    def __post_init__(self) -> None:
        """Check that the car drives forwards and brakes within the run."""
        check_speed(self.speed_mps, "braking", least_mps=_MIN_SPEED_MPS)
        self.brake.check_end(self.duration_s)

    @cached_property
    def course(self) -> Course | None:
        """Straight line that the driver follows, or None if the steering wheel is held."""
        return Course(Path.through([0.0, self.speed_mps * self.duration_s], [0.0, 0.0])) if self.hold_line else None

    def setpoint(self, time_s: float) -> Setpoint:
        """Return the speed, then the ramp of the brake (see the base class)."""
        brake, (before, after) = self.brake, self._ends
        if time_s < brake.start_s:
            return before
        pressed = (time_s - brake.start_s) / brake.rise_s
        return after if pressed >= 1.0 else after._replace(brake_pedal=pressed * brake.pedal)

    @cached_property
    def _ends(self) -> tuple[Setpoint, Setpoint]:
        """Setpoints before and after the ramp of the brake."""
        course = self.course
        before = self.settling_setpoint()._replace(path=None if course is None else course.path)
        return before, before._replace(brake_pedal=self.brake.pedal, hold_speed=False)
