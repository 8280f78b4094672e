"""Manoeuvres with a given steering wheel angle: step, sweep, slow ramp, random steering and sine with dwell."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, Final

import numpy as np

from activesteer.config import Range
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.core.signals import Setpoint
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import SIGNS, DriveMode, Maneuver, Search, Side, check_begin, check_speed, within

_SEARCH_S: Final = 4.5
"""Length of a run of the amplitude search after the start of the step [s]."""


@dataclass(frozen=True)
class StepInput:
    """Step input at the steering wheel."""

    OVERRULED: ClassVar = {"lateral_acceleration_mps2": {"steering_wheel_rad": None}}

    start_s: Annotated[float, Range(0.0)] = 0.5
    """Time at which the steering wheel begins to turn [s]."""
    rate_radps: Annotated[float, Range(0.1, 50.0)] = math.radians(400.0)
    """Steering wheel rate [rad/s]. ISO 7401 requires at least 200 deg/s."""
    steering_wheel_rad: Annotated[float, Range(-15.0, 15.0)] | None = None
    """Amplitude, left positive [rad]. Default: found by a search."""
    lateral_acceleration_mps2: Annotated[float, Range(-12.0, 12.0)] | None = None
    """Steady-state lateral acceleration of the car without control that the search reaches, left positive [m/s2]."""

    def __post_init__(self) -> None:
        """Check that amplitude or lateral acceleration is given."""
        # With both, a search has found the amplitude.
        if self.steering_wheel_rad is None and self.lateral_acceleration_mps2 is None:
            raise ManeuverError(
                "steering_wheel_deg (the amplitude) or lateral_acceleration_g (which the car without control reaches) "
                "is needed"
            )


@dataclass(frozen=True, kw_only=True)
class StepSteer(Maneuver, kind="step_steer"):
    """A step of the steering wheel angle, ramped at a limited rate."""

    steer: StepInput
    """Step of the steering wheel."""

    def __post_init__(self) -> None:
        """Check that the step starts before the end of the run, and the speed of a search for its amplitude."""
        check_begin("steer.start_s", self.steer.start_s, self.duration_s)
        if self.steer.steering_wheel_rad is None:
            check_speed(self.speed_mps, "steer.lateral_acceleration_mps2", "steer.steering_wheel_deg")

    def setpoint(self, time_s: float) -> Setpoint:
        """Return the steering wheel angle of the ramp (see the base class)."""
        step, (before, after) = self.steer, self._ends
        turned = (time_s - step.start_s) * step.rate_radps
        if turned <= 0.0:
            return before
        amplitude = step.steering_wheel_rad or 0.0
        return after if turned >= abs(amplitude) else self.at_speed(math.copysign(turned, amplitude))

    @cached_property
    def _ends(self) -> tuple[Setpoint, Setpoint]:
        """Setpoints before and after the ramp."""
        amplitude = self.steer.steering_wheel_rad or 0.0
        return self.at_speed(math.copysign(0.0, amplitude)), self.at_speed(amplitude)

    @property
    def search(self) -> Search | None:
        """Return the search for the amplitude, if only the lateral acceleration is given."""
        return steady_turn_search(self, self.steer, self.with_amplitude)

    def with_amplitude(self, steering_wheel_rad: float) -> StepSteer:
        """Return the step with an amplitude [rad], and record its lateral acceleration."""
        return dataclasses.replace(self, steer=dataclasses.replace(self.steer, steering_wheel_rad=steering_wheel_rad))


def steady_turn_search(maneuver: Maneuver, step: StepInput, accept: Callable[[float], Maneuver]) -> Search | None:
    """Return the search for the amplitude of a step, if the table gives only its lateral acceleration."""
    wanted = step.lateral_acceleration_mps2
    if step.steering_wheel_rad is not None or wanted is None:
        return None
    # Of fixed length, so that the amplitude does not depend on the length of the manoeuvre.
    probe = StepSteer(
        kind="step_steer", name=maneuver.name, speed_mps=maneuver.speed_mps, duration_s=step.start_s + _SEARCH_S,
        settle_s=maneuver.settle_s, road=maneuver.road, steer=step,
    )  # fmt: skip
    return Search(probe, wanted, accept)


Frequency = Annotated[float, Range(0.01, 50.0)]


@dataclass(frozen=True)
class Sweep:
    """Sweep input at the steering wheel, with a frequency that rises by the same factor every second."""

    start_s: Annotated[float, Range(0.0)] = 0.5
    """Time at which the sweep begins [s]."""
    length_s: Annotated[float, Range(1.0)] = 60.0
    """Length of the sweep [s]."""
    amplitude_rad: Annotated[float, Range(0.0, 15.0)] = math.radians(9.0)
    """Amplitude [rad]."""
    first_Hz: Frequency = 0.1
    """Frequency at the start [Hz]."""
    last_Hz: Frequency = 5.0
    """Frequency at the end [Hz]."""
    fade_s: Annotated[float, Range(0.0)] = 1.0
    """Time in which the amplitude rises at the start, and falls at the end [s]."""


@dataclass(frozen=True, kw_only=True)
class SineSweep(Maneuver, kind="sine_sweep"):
    """A sine of constant amplitude and rising frequency at constant speed."""

    sweep: Sweep = Sweep()
    """Sweep of the steering wheel."""

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
        """Return the steering wheel angle of the sweep (see the base class)."""
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


@dataclass(frozen=True)
class SlowRamp:
    """Ramp input at the steering wheel."""

    start_s: Annotated[float, Range(0.0)] = 0.5
    """Time at which the steering wheel begins to turn [s]."""
    rate_radps: Annotated[float, Range(-2.0, 2.0)] = math.radians(5.0)
    """Steering wheel rate [rad/s], left positive."""
    end_rad: Annotated[float, Range(0.0, 15.0)] = math.radians(200.0)
    """Angle to either side at which the ramp stops [rad]."""


@dataclass(frozen=True, kw_only=True)
class SlowlyIncreasingSteer(Maneuver, kind="slowly_increasing_steer"):
    """A slow ramp of the steering wheel angle at constant speed, up to the limit of the car."""

    steer: SlowRamp = SlowRamp()
    """Ramp of the steering wheel."""

    def __post_init__(self) -> None:
        """Check that the ramp begins within the run and turns the steering wheel."""
        check_begin("steer.start_s", self.steer.start_s, self.duration_s)
        if self.steer.rate_radps == 0.0 or self.steer.end_rad == 0.0:
            raise ManeuverError("rate_degps and end_deg must not be 0: the steering wheel would not turn", key="steer")

    def setpoint(self, time_s: float) -> Setpoint:
        """Return the steering wheel angle of the ramp (see the base class)."""
        ramp = self.steer
        turned = within((time_s - ramp.start_s) * abs(ramp.rate_radps), ramp.end_rad)
        return self.at_speed(math.copysign(turned, ramp.rate_radps))


_STEP_S: Final = 0.005
"""Distance of the points between which the angle is interpolated [s]."""
_MOST_Hz: Final = 0.1 / _STEP_S
"""Highest frequency [Hz]: there the interpolation departs from a sine by at most 5 % of its amplitude."""
_LINES: Final = 5
"""Smallest number of sines."""


@dataclass(frozen=True)
class RandomSignal:
    """Random steering wheel angle: normally distributed, with constant power density in a frequency band."""

    rms_rad: Annotated[float, Range(0.0, 5.0)] = math.radians(8.0)
    """Root mean square [rad]. Peaks are three to four times as large."""
    lowest_Hz: Frequency = 0.1
    """Lower end of the band [Hz]."""
    highest_Hz: Frequency = 5.0
    """Upper end of the band [Hz]."""
    seed: Annotated[int, Range(0)] = 0
    """Seed of the random phases."""
    fade_s: Annotated[float, Range(0.0)] = 1.0
    """Time in which the signal is faded in at the start [s]."""


@dataclass(frozen=True, kw_only=True)
class RandomSteer(Maneuver, kind="random_steer"):
    """Random steering at constant speed."""

    random: RandomSignal = RandomSignal()
    """Random steering wheel angle."""

    def __post_init__(self) -> None:
        """Check that the band is wide enough for the run. A sum of few sines is not random."""
        random = self.random
        least_Hz = random.lowest_Hz + _LINES / self.duration_s
        if not least_Hz <= random.highest_Hz <= _MOST_Hz:
            raise ManeuverError(
                f"is {random.highest_Hz:g} Hz; with lowest_Hz = {random.lowest_Hz:g} Hz and duration_s = "
                f"{self.duration_s:g} s, {least_Hz:g} to {_MOST_Hz:g} Hz are allowed",
                key="random.highest_Hz",
                value=random.highest_Hz,
                allowed=Range(least_Hz, _MOST_Hz),
            )

    @cached_property
    def _angles_rad(self) -> list[float]:
        """Angle every `_STEP_S`: a sum of sines of equal amplitude and random phase."""
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
        """Return the steering wheel angle (see the base class)."""
        place = max(time_s, 0.0) / _STEP_S
        index = min(int(place), len(self._angles_rad) - 2)
        before, after = self._angles_rad[index], self._angles_rad[index + 1]
        angle = before + (after - before) * (place - index)
        return self.at_speed(angle)


_REFERENCE_MPS2: Final = 0.3 * GRAVITY_MPS2
"""Lateral acceleration whose steering wheel angle in a slow ramp is A [m/s2]: 0.3 g, FMVSS 126, S7.6."""
_RAMP: Final = SlowRamp(start_s=0.5, rate_radps=math.radians(13.5), end_rad=math.radians(270.0))
"""The slow ramp of FMVSS 126, S7.6: 13.5 deg/s."""
_RAMP_S: Final = 20.5


def reference_angle_search(maneuver: Maneuver, accept: Callable[[float], Maneuver]) -> Search:
    """Return the search for A, the steering wheel angle at 0.3 g."""
    probe = SlowlyIncreasingSteer(
        kind="slowly_increasing_steer", name=f"{maneuver.name} (slow ramp to 0.3 g)", speed_mps=maneuver.speed_mps,
        duration_s=_RAMP_S, settle_s=maneuver.settle_s, road=maneuver.road, steer=_RAMP,
    )  # fmt: skip
    return Search(probe, _REFERENCE_MPS2, accept)


@dataclass(frozen=True)
class DwellInput:
    """Sine with dwell at the steering wheel."""

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
        """Check that amplitude or factor is given."""
        # With both, a search has found the amplitude.
        if self.steering_wheel_rad is None and self.amplitude_factor is None:
            raise ManeuverError(
                "steering_wheel_deg (the amplitude) or amplitude_factor (the amplitude as a multiple of the steering "
                "wheel angle at 0.3 g) is needed"
            )

    @property
    def completion_s(self) -> float:
        """Time when the steering wheel is straight again [s]."""
        return self.start_s + 1.0 / self.frequency_Hz + self.dwell_s


@dataclass(frozen=True, kw_only=True)
class SineWithDwell(Maneuver, kind="sine_with_dwell"):
    """A sine with dwell, with the speed held until the sine begins."""

    steer: DwellInput
    """Sine with dwell of the steering wheel."""
    drive: DriveMode = "coast"
    """Drive from the start of the sine: `coast`, which FMVSS 126 requires, or `hold_speed`."""

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
            check_speed(self.speed_mps, "steer.amplitude_factor", "steer.steering_wheel_deg")

    @property
    def search(self) -> Search | None:
        """Return the search for A, if the amplitude is given as a multiple of A."""
        factor = self.steer.amplitude_factor
        if self.steer.steering_wheel_rad is not None or factor is None:
            return None
        return reference_angle_search(self, lambda angle: self.with_amplitude(factor * angle))

    def with_amplitude(self, steering_wheel_rad: float) -> SineWithDwell:
        """Return the manoeuvre with an amplitude [rad], and record its factor."""
        return dataclasses.replace(self, steer=dataclasses.replace(self.steer, steering_wheel_rad=steering_wheel_rad))

    def setpoint(self, time_s: float) -> Setpoint:
        """Return the steering wheel angle of the sine (see the base class)."""
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
