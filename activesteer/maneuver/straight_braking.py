"""Braking straight ahead to rest, on a road of one friction (ISO 21994) or of two sides (ISO 14512)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver
from activesteer.maneuver.brake_in_turn import BrakeInput
from activesteer.road.course import Course
from activesteer.road.path import Path
from activesteer.signals import Setpoint

_MIN_SPEED_MPS: Final = 10.0 / 3.6
"""Lowest speed from which braking can be evaluated [m/s]."""


@dataclass(frozen=True, kw_only=True)
class StraightBraking(Maneuver):
    """Driving straight ahead, then braking with an open clutch until the car stands."""

    brake: BrakeInput
    """The brake."""
    hold_line: bool = True
    """Whether the driver keeps the car on a straight line; otherwise the steering wheel is held straight."""

    def __post_init__(self) -> None:
        """Check that the car drives forwards and brakes within the run."""
        if self.speed_mps < _MIN_SPEED_MPS:
            min_kmh = 3.6 * _MIN_SPEED_MPS
            raise ManeuverError(
                f"is {3.6 * self.speed_mps:g} km/h; braking begins at {min_kmh:g} km/h or more, forwards",
                key="speed_kmh",
                value=3.6 * self.speed_mps,
                allowed=Range(min_kmh),
            )
        pressed_s = self.brake.start_s + self.brake.rise_s
        if pressed_s >= self.duration_s:
            raise ManeuverError(
                f"the brake is pressed down at {pressed_s:g} s, but the run ends at {self.duration_s:g} s",
                key="brake.start_s",
                value=self.brake.start_s,
            )

    @property
    def course(self) -> Course | None:
        """The straight line that the driver keeps; None if the steering wheel is held."""
        return self._course if self.hold_line else None

    @cached_property
    def _course(self) -> Course:
        return Course(Path.through([0.0, self.speed_mps * self.duration_s], [0.0, 0.0]))

    def setpoint(self, time_s: float) -> Setpoint:
        """Speed, then the ramp of the brake; see the base class."""
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
