"""Sine with dwell (FMVSS 126, UN R140): a sine at the steering wheel with a pause at its second peak."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, Final

from activesteer.config import Range
from activesteer.conventions import GRAVITY_MPS2
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import SIGNS, DriveMode, Maneuver, Side, check_search_speed
from activesteer.maneuver.slowly_increasing_steer import RampAngle, SlowlyIncreasingSteer, SlowRamp
from activesteer.signals import Setpoint

_REFERENCE_MPS2: Final = 0.3 * GRAVITY_MPS2
"""Lateral acceleration whose steering wheel angle in a slow ramp is A [m/s2]: 0.3 g, FMVSS 126, S7.6."""
_RAMP: Final = SlowRamp(start_s=0.5, rate_radps=math.radians(13.5), end_rad=math.radians(270.0))
"""The slow ramp of FMVSS 126, S7.6: 13.5 deg/s."""
_RAMP_S: Final = 20.5


def reference_angle_search(maneuver: Maneuver, accept: Callable[[float], Maneuver]) -> RampAngle:
    """Return the search for A, the steering wheel angle at 0.3 g, at the speed and on the road of a manoeuvre."""
    probe = SlowlyIncreasingSteer(
        kind="slowly_increasing_steer", name=f"{maneuver.name} (slow ramp to 0.3 g)", speed_mps=maneuver.speed_mps,
        duration_s=_RAMP_S, settle_s=maneuver.settle_s, road=maneuver.road, steer=_RAMP,
    )  # fmt: skip
    return RampAngle(probe, _REFERENCE_MPS2, accept)


@dataclass(frozen=True)
class DwellInput:
    """The sine with dwell at the steering wheel."""

    OVERRULED: ClassVar = {"amplitude_factor": {"steering_wheel_rad": None}}

    start_s: Annotated[float, Range(0.0)] = 0.5
    """Time at which the sine begins [s]."""
    frequency_Hz: Annotated[float, Range(0.1, 5.0)] = 0.7
    """Frequency of the sine [Hz]."""
    dwell_s: Annotated[float, Range(0.0, 5.0)] = 0.5
    """Length of the pause at the second peak, after three quarters of the period [s]."""
    direction: Side = "left"
    """Direction of the first half-wave: `left` or `right`."""
    steering_wheel_rad: Annotated[float, Range(0.0, 15.0)] | None = None
    """Amplitude [rad]. Default: `amplitude_factor` times A."""
    amplitude_factor: Annotated[float, Range(0.1, 15.0)] | None = None
    """Amplitude as a multiple of A, the steering wheel angle at 0.3 g in a slow ramp of the car without control [-]."""

    def __post_init__(self) -> None:
        """Check the keys. If both amplitude and factor are given, a search has found the amplitude."""
        if self.steering_wheel_rad is None and self.amplitude_factor is None:
            raise ManeuverError(
                "steering_wheel_deg (the amplitude) or amplitude_factor (the amplitude as a multiple of the steering "
                "wheel angle at 0.3 g) is needed"
            )

    @property
    def completion_s(self) -> float:
        """Time at which the steering wheel is straight again [s]."""
        return self.start_s + 1.0 / self.frequency_Hz + self.dwell_s


@dataclass(frozen=True, kw_only=True)
class SineWithDwell(Maneuver):
    """A sine with dwell; the drive holds the speed until the sine begins."""

    steer: DwellInput
    """The sine."""
    drive: DriveMode = "coast"
    """Drive from the beginning of the sine: `coast`, which FMVSS 126 requires, or `hold_speed`."""

    def __post_init__(self) -> None:
        """Check that the sine ends within the run, and that the speed suits a search for A."""
        steer = self.steer
        if steer.completion_s > self.duration_s:
            raise ManeuverError(
                f"is {self.duration_s:g} s, but the sine ends at {steer.completion_s:.3g} s; its "
                f"evaluation needs 1.75 s more, {steer.completion_s + 1.75:.3g} s",
                key="duration_s",
                value=self.duration_s,
                allowed=Range(steer.completion_s + 1.75),
            )
        if steer.steering_wheel_rad is None:
            check_search_speed(self.speed_mps, "steer.amplitude_factor", "steer.steering_wheel_deg")

    @property
    def search(self) -> RampAngle | None:
        """Search for A, if the amplitude is given as a multiple of A."""
        factor = self.steer.amplitude_factor
        if self.steer.steering_wheel_rad is not None or factor is None:
            return None
        return reference_angle_search(self, lambda angle: self.with_amplitude(factor * angle))

    def with_amplitude(self, steering_wheel_rad: float) -> SineWithDwell:
        """Return the manoeuvre with an amplitude [rad]; the factor stays on record."""
        return dataclasses.replace(self, steer=dataclasses.replace(self.steer, steering_wheel_rad=steering_wheel_rad))

    def setpoint(self, time_s: float) -> Setpoint:
        """Steering wheel angle of the sine; see the base class."""
        steer, (before, after) = self.steer, self._ends
        t = time_s - steer.start_s
        if t < 0.0:
            return before
        period = 1.0 / steer.frequency_Hz
        if t == 0.0 or t >= period + steer.dwell_s:
            return after
        # The phase stands still during the pause.
        peak, resumed = 0.75 * period, t - steer.dwell_s
        phase = t if t < peak else peak if resumed < peak else resumed
        amplitude = SIGNS[steer.direction] * (steer.steering_wheel_rad or 0.0)
        return self.at_speed(amplitude * math.sin(2.0 * math.pi * phase / period), after.hold_speed)

    @cached_property
    def _ends(self) -> tuple[Setpoint, Setpoint]:
        """Setpoints before and after the sine."""
        return self.at_speed(0.0), self.at_speed(0.0, self.drive == "hold_speed")
