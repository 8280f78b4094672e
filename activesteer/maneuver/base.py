"""Base of all manoeuvres: speed, road, duration, and a setpoint for the driver at any time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from activesteer.config import Range, Source
from activesteer.errors import ManeuverError
from activesteer.faults import Fault
from activesteer.road.course import Course
from activesteer.road.road import Road
from activesteer.signals import Setpoint, new_message

Speed = Annotated[float, Range(-20.0, 100.0)]
Side = Literal["left", "right"]
SIGNS: Final[dict[Side, float]] = {"left": 1.0, "right": -1.0}
"""Side -> sign of y, of steering and of yaw there (ISO 8855)."""
DriveMode = Literal["hold_speed", "coast"]

MIN_SEARCH_SPEED_MPS: Final = 30.0 / 3.6
"""Below this speed the lateral acceleration hardly depends on the steering wheel angle [m/s]."""


@dataclass(frozen=True, kw_only=True)
class Maneuver(ABC):
    """Base of all kinds. The fields are the keys of the TOML file.

    Examples:
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
    """Kind of manoeuvre."""
    name: str = ""
    """Short name, for files and tables. Default: the file's name."""
    title: str = ""
    """One line for lists and plots."""
    speed_mps: Speed
    """Speed at the start [m/s]."""
    duration_s: Annotated[float, Range(0.01, 3600.0)]
    """Length of the recording [s]."""
    settle_s: Annotated[float, Range(0.0, 60.0)] = 2.0
    """Time before the recording in which the car drives straight ahead and its speed settles [s]."""
    road: Road = Road()
    """The road."""
    fault: tuple[Fault, ...] = ()
    """Faults of actuators and sensors, and their times."""

    @classmethod
    def filled_from_csv(
        cls, table: Mapping[str, Any], folder: Path | None, source: Source
    ) -> tuple[dict[str, Any], dict[str, bytes]]:
        """Fill the values of the CSV files that a manoeuvre names into its table.

        A table without a file may have both the name of a CSV and values. It comes from a recording, and the values are
        those that were read then, unless an override names another CSV.

        Args:
            table: The table.
            folder: Folder of the manoeuvre file; None for a table that has no file.
            source: For error messages.

        Returns:
            The table, and the CSV files by their names, to be kept with the recording.

        Raises:
            ManeuverError: a CSV is not found or wrong, or a manoeuvre file gives the values too.
        """
        return dict(table), {}

    @abstractmethod
    def setpoint(self, time_s: float) -> Setpoint:
        """Return the setpoint for the driver.

        Args:
            time_s: Time since the start of the recording [s].
        """

    @property
    def course(self) -> Course | None:
        """Path, lanes and cones, or None if the manoeuvre sets the steering wheel angle instead."""
        return None

    def sequence(self) -> Any:
        """Return what follows the car through the phases of one run, or None if setpoints depend on time alone."""
        return None

    @property
    def ground(self) -> Road:
        """The road as the car drives on it: its friction laid along the path of the course if it follows that path."""
        return self.road.laid(self.course)

    @property
    def search(self) -> Search | None:
        """Search that must be driven before the manoeuvre can be run, or None if all values are known."""
        return None

    def settling_setpoint(self) -> Setpoint:
        """Return the setpoint while the car settles before the recording: straight ahead."""
        return self.at_speed(0.0)

    def at_speed(self, steering_wheel_rad: float, hold_speed: bool = True) -> Setpoint:
        """Return a setpoint with a steering wheel angle and the speed of the manoeuvre.

        Args:
            steering_wheel_rad: Steering wheel angle, left positive [rad].
            hold_speed: Whether the drive holds the speed; otherwise there is no drive torque.
        """
        return new_message(Setpoint, (steering_wheel_rad, self.speed_mps, 0.0, hold_speed, None, None, None, None, 0.0))


@dataclass(frozen=True)
class Search:
    """Search for a steering wheel angle by driving the car without control."""

    probe: Maneuver
    """The manoeuvre that is driven."""
    lateral_acceleration_mps2: float
    """Lateral acceleration to reach [m/s2], left positive."""
    accept: Callable[[float], Maneuver]
    """Function from the steering wheel angle found [rad] to the manoeuvre with it."""


def within(value: float, most: float) -> float:
    """Return a value limited to 0 and `most`. In a setpoint `min` and `max` would take most of the time."""
    return 0.0 if value < 0.0 else most if value > most else value


def check_search_speed(speed_mps: float, aim: str, amplitude: str) -> None:
    """Check that the car drives forwards and fast enough for a search."""
    if speed_mps < MIN_SEARCH_SPEED_MPS:
        minimum = 3.6 * MIN_SEARCH_SPEED_MPS
        raise ManeuverError(
            f"is {3.6 * speed_mps:g} km/h; {aim} needs at least {minimum:g} km/h, or give {amplitude}",
            key="speed_kmh",
            value=3.6 * speed_mps,
            allowed=Range(minimum),
        )
