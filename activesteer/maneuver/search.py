"""What must be found by driving before a manoeuvre can be run: how far to turn the steering wheel."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple

from activesteer.errors import ManeuverError

if TYPE_CHECKING:
    from activesteer.maneuver.base import Maneuver
    from activesteer.maneuver.slowly_increasing_steer import SlowlyIncreasingSteer
    from activesteer.maneuver.step_steer import StepSteer

MIN_SEARCH_SPEED_MPS: Final = 30.0 / 3.6
"""Slower than this, lateral acceleration hardly depends on the steering wheel angle [m/s]."""


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
        raise ManeuverError(
            f"speed_kmh: is {3.6 * speed_mps:g} km/h; {aim} needs at least {3.6 * MIN_SEARCH_SPEED_MPS:g} km/h, or "
            f"give {amplitude}"
        )


class SteadyTurn(NamedTuple):
    """Search for the steering wheel angle that gives a steady-state lateral acceleration.

    Attributes:
        probe: The step steer by which it is found, its amplitude still open.
        lateral_acceleration_mps2: What is to be reached, left positive [m/s2].
        accept: Steering wheel angle found [rad] -> the manoeuvre with it.
    """

    probe: StepSteer
    lateral_acceleration_mps2: float
    accept: Callable[[float], Maneuver]


class RampAngle(NamedTuple):
    """Search for the steering wheel angle at which a slow ramp passes a lateral acceleration.

    Attributes:
        probe: The ramp by which it is found, to the left.
        lateral_acceleration_mps2: What is to be passed [m/s2].
        accept: Steering wheel angle found [rad] -> the manoeuvre with it.
    """

    probe: SlowlyIncreasingSteer
    lateral_acceleration_mps2: float
    accept: Callable[[float], Maneuver]


Search = SteadyTurn | RampAngle
