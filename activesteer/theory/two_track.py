"""What a two-track model knows of a car beyond the single-track model: what loads its wheels and inclines its body."""

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
    and what the body's inclination adds to it [m]."""
    front_track_m: _Positive
    """Distance of the front wheels' contact points [m]."""
    rear_track_m: _Positive
    """The same at the rear [m]."""
    front_load_transfer_fraction: Annotated[float, Range(0.0, 1.0)]
    """Share of the load that changes sides in a turn that the front axle takes."""
    roll_gradient_radpmps2: Annotated[float, Range(0.0, 0.1)]
    """Roll angle per lateral acceleration, out of the turn [rad/(m/s2)]."""
    roll_frequency_Hz: Annotated[float, Range(0.1, 10.0)]
    """Natural frequency of the body's roll [Hz]."""
    roll_damping: Annotated[float, Range(0.01, 10.0)]
    """Its damping, as a share of the critical one."""
    roll_arm_m: Annotated[float, Range(0.0, 2.0)]
    """Height of the centre of gravity above the axis that the body rolls about [m]."""
    pitch_gradient_radpmps2: Annotated[float, Range(0.0, 0.1)]
    """Pitch angle per deceleration, nose down [rad/(m/s2)]."""
    wheel_inertia_kgm2: _Positive = 1.0
    """Inertia of a wheel about its axis [kg m2]; 1.0 is that of a wheel of 18 kg and 16 inches."""
