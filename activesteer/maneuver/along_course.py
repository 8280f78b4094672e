"""Base of the manoeuvres along a course: the driver follows a path and holds the speed."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver
from activesteer.road.course import Course
from activesteer.signals import Setpoint

Width = Annotated[float, Range(0.5, 4.0)]

_MIN_SPEED_MPS: Final = 5.0 / 3.6
"""Below this speed a preview of one or two seconds ends within the car's own length [m/s]."""
_AFTER_S: Final = 3.5
"""Time after the last gate in which the car can be seen to settle [s]."""


@dataclass(frozen=True, kw_only=True)
class AlongCourse(Maneuver):
    """Base of the kinds that are driven along a course at constant speed."""

    def __post_init__(self) -> None:
        """Check that the car drives forwards and passes the last gate within the run."""
        if self.speed_mps < _MIN_SPEED_MPS:
            raise ManeuverError(
                f"is {3.6 * self.speed_mps:g} km/h; a course is driven forwards, at no less than "
                f"{3.6 * _MIN_SPEED_MPS:g} km/h",
                key="speed_kmh",
                value=3.6 * self.speed_mps,
            )
        last = self.course.last_gate_x_m
        if last is not None and self.duration_s * self.speed_mps < last:
            gate_s = last / self.speed_mps
            raise ManeuverError(
                f"is {self.duration_s:g} s, but at {3.6 * self.speed_mps:g} km/h the last gate, {last:g} m "
                f"from the start, is reached at {gate_s:.1f} s; the car settles by {gate_s + _AFTER_S:.1f} s",
                key="duration_s",
                value=self.duration_s,
                allowed=Range(gate_s + _AFTER_S),
            )

    @property
    def course(self) -> Course:
        """Path, lanes and cones."""
        return self._course

    @cached_property
    def _course(self) -> Course:
        return self._make_course()

    @abstractmethod
    def _make_course(self) -> Course:
        """Lay out the course; called once."""

    def setpoint(self, time_s: float) -> Setpoint:
        """Path and speed."""
        return self._setpoint

    @cached_property
    def _setpoint(self) -> Setpoint:
        return self.settling_setpoint()._replace(path=self.course.path)


def known_width(vehicle_width_m: float | None) -> float:
    """Return the width of the vehicle, for which a course is laid out [m]."""
    if vehicle_width_m is None:
        raise ManeuverError(
            "is missing; it comes from the vehicle file (width_m) unless it is given here", key="vehicle_width_m"
        )
    return vehicle_width_m
