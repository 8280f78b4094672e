"""Sine sweep (ISO 7401): a small sine of rising frequency at the steering wheel, for the frequency response."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver
from activesteer.signals import Setpoint

Frequency = Annotated[float, Range(0.01, 50.0)]


@dataclass(frozen=True)
class Sweep:
    """The sweep at the steering wheel; its frequency rises by the same factor every second."""

    start_s: Annotated[float, Range(0.0)] = 0.5
    """Time at which the sweep begins [s]."""
    length_s: Annotated[float, Range(1.0)] = 60.0
    """Length of the sweep [s]."""
    amplitude_rad: Annotated[float, Range(0.0, 15.0)] = math.radians(9.0)
    """Amplitude [rad]."""
    first_Hz: Frequency = 0.1
    """Frequency at the beginning [Hz]."""
    last_Hz: Frequency = 5.0
    """Frequency at the end [Hz]."""
    fade_s: Annotated[float, Range(0.0)] = 1.0
    """Time in which the amplitude rises at the beginning, and falls at the end [s]."""


@dataclass(frozen=True, kw_only=True)
class SineSweep(Maneuver):
    """A sine of constant amplitude and rising frequency at constant speed."""

    sweep: Sweep = Sweep()
    """The sweep."""

    def __post_init__(self) -> None:
        """Check that the frequency rises and that the sweep ends within the run."""
        sweep = self.sweep
        if sweep.last_Hz <= sweep.first_Hz:
            raise ManeuverError(
                f"is {sweep.last_Hz:g} Hz; it must be above first_Hz, {sweep.first_Hz:g} Hz",
                key="sweep.last_Hz",
                value=sweep.last_Hz,
            )
        if sweep.start_s + sweep.length_s > self.duration_s:
            end = sweep.start_s + sweep.length_s
            raise ManeuverError(
                f"the sweep ends at {end:g} s, but the run at {self.duration_s:g} s (duration_s)", key="sweep.length_s"
            )
        if 2.0 * sweep.fade_s > sweep.length_s:
            raise ManeuverError(
                f"twice {sweep.fade_s:g} s is longer than the sweep, {sweep.length_s:g} s (length_s)",
                key="sweep.fade_s",
            )

    def setpoint(self, time_s: float) -> Setpoint:
        """Steering wheel angle of the sweep; see the base class."""
        sweep = self.sweep
        t = time_s - sweep.start_s
        angle = 0.0
        if 0.0 < t < sweep.length_s:
            growth = math.log(sweep.last_Hz / sweep.first_Hz) / sweep.length_s
            phase = 2.0 * math.pi * sweep.first_Hz * math.expm1(growth * t) / growth
            angle = sweep.amplitude_rad * math.sin(phase)
            to_edge = min(t, sweep.length_s - t)
            if to_edge < sweep.fade_s:
                angle *= 0.5 - 0.5 * math.cos(math.pi * to_edge / sweep.fade_s)
        return self.at_speed(angle)
