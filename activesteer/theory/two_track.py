"""Parameters that a two-track model needs beyond those of the single-track model: load transfer, roll and pitch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range

_Positive = Annotated[float, Range(1e-9)]


@dataclass(frozen=True)
class TwoTrackParameters:
    """Keys of the table [two_track] in a vehicle file."""

    load_height_m: _Positive
    """Moment that changes the wheel loads, per mass and acceleration: height of the centre of gravity above the road,
    plus the effect of the body's inclination [m]."""
    front_track_m: _Positive
    """Distance between the front wheels' contact points [m]."""
    rear_track_m: _Positive
    """Distance between the rear wheels' contact points [m]."""
    front_load_transfer_fraction: Annotated[float, Range(0.0, 1.0)]
    """Front axle's share of the lateral load transfer in a turn."""
    roll_gradient_radpmps2: Annotated[float, Range(0.0, 0.1)]
    """Roll angle per lateral acceleration, out of the turn [rad/(m/s2)]."""
    roll_frequency_Hz: Annotated[float, Range(0.1, 10.0)]
    """Natural frequency of the body's roll [Hz]."""
    roll_damping: Annotated[float, Range(0.01, 10.0)]
    """Damping ratio of the body's roll."""
    roll_arm_m: Annotated[float, Range(0.0, 2.0)]
    """Height of the centre of gravity above the body's roll axis [m]."""
    pitch_gradient_radpmps2: Annotated[float, Range(0.0, 0.1)]
    """Pitch angle per deceleration, nose down [rad/(m/s2)]."""
    wheel_inertia_kgm2: _Positive = 1.0
    """Inertia of a wheel about its axis [kg m2]; 1.0 belongs to a wheel of 18 kg and 16 inches."""
