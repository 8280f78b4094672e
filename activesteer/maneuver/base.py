"""What every manoeuvre has: speed, road, duration, and a setpoint for the driver at any time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.faults import Fault
from activesteer.road.course import Course
from activesteer.road.road import Road
from activesteer.signals import Setpoint, made

Speed = Annotated[float, Range(-20.0, 100.0)]

MIN_SEARCH_SPEED_MPS: Final = 30.0 / 3.6
"""Slower than this, lateral acceleration hardly depends on the steering wheel angle [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Maneuver(ABC):
    """Base of all kinds. The fields are the keys of the TOML file.

    Example:
        >>> from activesteer.scenario import resolve
        >>> table = {"kind": "open_loop", "speed_kmh": 72.0, "duration_s": 4.0, "hold_last": True,
        ...          "steering": {"time_s": [1.0, 2.0], "steering_wheel_deg": [0.0, 45.0]}}
        >>> maneuver = resolve(table).maneuver
        >>> maneuver.speed_mps
        20.0
        >>> round(maneuver.setpoint(1.5).steering_wheel_demand_rad, 4)
        0.3927
    """

    kind: str
    """Which kind of manoeuvre this is."""
    name: str = ""
    """Short name, for files and tables; the file's name where not given."""
    title: str = ""
    """One line for lists and plots."""
    speed_mps: Speed
    """Speed at the start [m/s]."""
    duration_s: Annotated[float, Range(0.01, 3600.0)]
    """Length of the recording [s]."""
    settle_s: Annotated[float, Range(0.0, 60.0)] = 2.0
    """Time before the recording in which the car rolls straight ahead and its speed settles [s]."""
    road: Road = Road()
    """What the wheels roll on."""
    fault: tuple[Fault, ...] = ()
    """What goes wrong with actuators and sensors, and when."""

    @abstractmethod
    def setpoint(self, time_s: float) -> Setpoint:
        """What is asked of the driver.

        Args:
            time_s: Time since the start of the recording [s].

        Returns:
            The setpoint at that time.
        """

    @property
    def course(self) -> Course | None:
        """Path, lanes and cones; None where the manoeuvre says what to do with the steering wheel instead."""
        return None

    @property
    def search(self) -> Search | None:
        """What must be found by driving before the manoeuvre can be run; None where everything is known."""
        return None

    def settling_setpoint(self) -> Setpoint:
        """What is asked of the driver while the car settles before the recording."""
        return self.setpoint(0.0)

    def at_speed(self, steering_wheel_rad: float, hold_speed: bool = True) -> Setpoint:
        """A steering wheel angle [rad], left positive, while the drive holds the speed of the manoeuvre, or none."""
        return made(Setpoint, (steering_wheel_rad, self.speed_mps, 0.0, hold_speed, None, None, None, None, 0.0))


@dataclass(frozen=True)
class Search:
    """What must be found by driving the control-free car before a manoeuvre can be run: a steering wheel angle."""

    probe: Maneuver
    """The manoeuvre by which it is found."""
    lateral_acceleration_mps2: float
    """What is to be reached [m/s2], left positive."""
    accept: Callable[[float], Maneuver]
    """Steering wheel angle found [rad] -> the manoeuvre with it."""


def within(value: float, most: float) -> float:
    """A value, limited to 0 and `most`: as `min` and `max` do it, which cost more than all else in a setpoint."""
    return 0.0 if value < 0.0 else most if value > most else value


def check_search_speed(speed_mps: float, aim: str, amplitude: str) -> None:
    """A search needs a car that drives forwards, and not slowly.

    Args:
        speed_mps: Speed of the manoeuvre [m/s].
        aim: Key that makes the search necessary.
        amplitude: Key to give instead.

    Raises:
        ManeuverError: the speed is too low.
    """
    if speed_mps < MIN_SEARCH_SPEED_MPS:
        minimum = 3.6 * MIN_SEARCH_SPEED_MPS
        raise ManeuverError(
            f"is {3.6 * speed_mps:g} km/h; {aim} needs at least {minimum:g} km/h, or give {amplitude}",
            key="speed_kmh",
            value=3.6 * speed_mps,
            allowed=Range(minimum),
        )
