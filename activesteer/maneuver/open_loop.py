"""Open loop: steering wheel angle, speed and brake as tables over time."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver
from activesteer.maneuver.choices import DRIVES, check_choice
from activesteer.signals import Reference


@dataclass(frozen=True)
class SteeringTable:
    """Steering wheel angle over time."""

    time_s: tuple[float, ...] = (0.0,)
    """Times, increasing [s]; linear between them, constant outside."""
    steering_wheel_rad: tuple[float, ...] = (0.0,)
    """Angles, left positive [rad]."""


@dataclass(frozen=True)
class SpeedTable:
    """Speed to hold over time."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    speed_mps: tuple[float, ...]
    """Speeds [m/s]."""


@dataclass(frozen=True)
class BrakeTable:
    """Brake pedal over time."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    pedal: Annotated[tuple[float, ...], Range(0.0, 1.0)]
    """Pedal positions, 0 to 1."""


@dataclass(frozen=True, kw_only=True)
class OpenLoop(Maneuver):
    """Tables over time; the drive holds the speed, or the car coasts."""

    steering: SteeringTable = SteeringTable()
    """Steering wheel; straight ahead where not given."""
    speed: SpeedTable | None = None
    """Speed to hold; the speed at the start where not given."""
    brake: BrakeTable | None = None
    """Brake; released where not given. While it is pressed, the drive is off."""
    drive: str = "hold_speed"
    """`hold_speed` or `coast`."""

    def __post_init__(self) -> None:
        """Checks the tables.

        Raises:
            ManeuverError: a table's columns differ in length, or its times do not increase.
        """
        check_choice("drive", self.drive, DRIVES)
        for key, table, column in (
            ("steering", self.steering, "steering_wheel_rad"),
            ("speed", self.speed, "speed_mps"),
            ("brake", self.brake, "pedal"),
        ):
            if table is not None:
                self._check(key, table.time_s, getattr(table, column))

    def _check(self, key: str, times: tuple[float, ...], values: tuple[float, ...]) -> None:
        if not times or len(times) != len(values):
            msg = f"{key}: has {len(times)} times and {len(values)} values; as many of each are needed, at least one"
            raise ManeuverError(msg)
        for earlier, later in pairwise(times):
            if later <= earlier:
                msg = f"{key}.time_s: does not increase from {earlier:g} to {later:g} s"
                raise ManeuverError(msg)

    def reference(self, time_s: float) -> Reference:
        """Values of the tables; see the base class."""
        angle = _interpolate(time_s, self.steering.time_s, self.steering.steering_wheel_rad)
        speed = self.speed_mps if self.speed is None else _interpolate(time_s, self.speed.time_s, self.speed.speed_mps)
        pedal = 0.0 if self.brake is None else _interpolate(time_s, self.brake.time_s, self.brake.pedal)
        return Reference(angle, speed, pedal, hold_speed=self.drive == "hold_speed" and pedal == 0.0)


def _interpolate(x: float, xs: tuple[float, ...], ys: tuple[float, ...]) -> float:
    """Piecewise linear, constant outside; plain floats because it runs every step."""
    index = bisect_right(xs, x)
    if index == 0:
        return ys[0]
    if index == len(xs):
        return ys[-1]
    x0, x1 = xs[index - 1], xs[index]
    return ys[index - 1] + (ys[index] - ys[index - 1]) * (x - x0) / (x1 - x0)
