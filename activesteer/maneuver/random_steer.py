"""Random steering (ISO 7401): all frequencies of a band at once, for frequency responses."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Final

import numpy as np

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import Maneuver
from activesteer.maneuver.sine_sweep import Frequency
from activesteer.signals import Setpoint

_STEP_S: Final = 0.005
"""Distance of the points between which the angle is interpolated [s]."""
_MOST_Hz: Final = 0.1 / _STEP_S
"""Highest frequency [Hz]: there the interpolation departs from a sine by at most 5 % of its amplitude."""
_LINES: Final = 5
"""Smallest number of sines."""


@dataclass(frozen=True)
class RandomSignal:
    """The steering wheel angle: normally distributed, with the same power at all frequencies of a band."""

    rms_rad: Annotated[float, Range(0.0, 5.0)] = math.radians(8.0)
    """Root mean square [rad]; peaks are three to four times as large."""
    lowest_Hz: Frequency = 0.1
    """Lower end of the band [Hz]."""
    highest_Hz: Frequency = 5.0
    """Upper end of the band [Hz]."""
    seed: Annotated[int, Range(0)] = 0
    """Seed of the random phases."""
    fade_s: Annotated[float, Range(0.0)] = 1.0
    """Time in which the signal is faded in at the beginning [s]."""


@dataclass(frozen=True, kw_only=True)
class RandomSteer(Maneuver):
    """Random steering at constant speed."""

    random: RandomSignal = RandomSignal()
    """The angle."""

    def __post_init__(self) -> None:
        """Check that the band is wide enough for a run of this length: a sum of few sines is not random."""
        random = self.random
        least_Hz = random.lowest_Hz + _LINES / self.duration_s
        if not least_Hz <= random.highest_Hz <= _MOST_Hz:
            raise ManeuverError(
                f"is {random.highest_Hz:g} Hz; above lowest_Hz, {random.lowest_Hz:g} Hz, and in {self.duration_s:g} s "
                f"(duration_s), allowed is {least_Hz:g} to {_MOST_Hz:g} Hz",
                key="random.highest_Hz",
                value=random.highest_Hz,
                allowed=Range(least_Hz, _MOST_Hz),
            )

    @cached_property
    def _angles_rad(self) -> list[float]:
        """Angle every `_STEP_S`: a sum of sines within the band, of equal amplitudes and random phases."""
        random = self.random
        points = math.ceil(self.duration_s / _STEP_S) + 2
        lines_Hz = np.fft.rfftfreq(points, _STEP_S)
        inside = (lines_Hz >= random.lowest_Hz) & (lines_Hz <= random.highest_Hz)
        phases = np.random.default_rng(random.seed).uniform(0.0, 2.0 * math.pi, len(lines_Hz))
        angles = np.fft.irfft(np.where(inside, np.exp(1j * phases), 0.0), points)
        angles *= random.rms_rad / math.sqrt(float(np.mean(angles**2)))
        if random.fade_s > 0.0:
            fraction = np.minimum(np.arange(points) * _STEP_S / random.fade_s, 1.0)
            angles *= 0.5 - 0.5 * np.cos(math.pi * fraction)
        return angles.tolist()

    def setpoint(self, time_s: float) -> Setpoint:
        """Steering wheel angle; see the base class."""
        place = max(time_s, 0.0) / _STEP_S
        index = min(int(place), len(self._angles_rad) - 2)
        before, after = self._angles_rad[index], self._angles_rad[index + 1]
        angle = before + (after - before) * (place - index)
        return self.at_speed(angle)
