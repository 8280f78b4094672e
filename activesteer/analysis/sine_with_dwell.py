"""Metrics of a sine with dwell by FMVSS 126 and UN Regulation 140.

The two yaw rate ratios count from the *completion* of steer, the end of the sine. The lateral displacement counts from
the *start* of steer. Steering wheel angle and yaw rate are filtered as in the standards (10 and 6 Hz, twelve poles, no
phase). The filter rounds the corner at the end of the sine, which shifts the completion by some 0.015 s, here as in a
measured test. The evaluation differs from the evaluation of a measured test in three points:

- Nothing is zeroed: simulated signals have no offset.
- The displacement comes from the recorded position, which is exact. The standards integrate the lateral acceleration
  twice, since a test car has no position.
- Sideslip is recorded, and its peaks are unfiltered.

Source: 49 CFR 571.126 (FMVSS 126), S5.2 and S7.11; UN Regulation 140.
"""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Final, NamedTuple

import numpy as np

from activesteer.analysis.series import Array, crossing_time, low_pass, peak, timestep, value_at
from activesteer.analysis.source import RecordingLike, entry
from activesteer.errors import RecordingError
from activesteer.recording.contents import events_of

STEERING_CUT_OFF_Hz: Final = 10.0
"""Cut-off frequency for the steering wheel angle [Hz]."""
MOTION_CUT_OFF_Hz: Final = 6.0
"""Cut-off frequency for yaw rate and lateral acceleration [Hz]."""
LONGEST_CREEP_S: Final = 0.1
"""Longest time from the threshold to the centre [s]. A slower steering wheel creeps, and its line is extrapolated."""
PEAK_PROMINENCE: Final = 0.02
"""Least prominence of a peak of the yaw rate, as a fraction of the largest peak."""
INSTANTS_S: Final = (1.0, 1.75)
"""Times after the completion of steer at which the yaw rate is compared with its peak [s]."""
END_OF_STEER: Final = "end of steer"
DISPLACEMENT_TIME_S: Final = 1.07
"""Time after the start of steer at which the lateral displacement is taken [s]. FMVSS 126 requires 1.83 m from a
car up to 3500 kg, from 5 A on."""
RATIO_LIMITS: Final = (0.35, 0.20)
"""Largest allowed ratios at `INSTANTS_S`."""

_FAST_RADPS: Final = math.radians(75.0)
"""Rate of the steering wheel at the end of the range for zeroing [rad/s]."""
_FAST_FOR_S: Final = 0.2
"""Least duration of this rate [s]."""
_THRESHOLD_RAD: Final = math.radians(5.0)
"""Steering wheel angle that marks the start of steer when it is first exceeded [rad]. The range for zeroing ends
before it."""
_RANGE_S: Final = 1.0
"""Length of the range for zeroing [s]."""
_AVERAGED_S: Final = 0.1
"""Window of the moving average of the rate [s]."""

PEAKS: Final = ("yaw_rate_radps", "ay_mps2", "sideslip_rad", "roll_rad", "steering_wheel_rad")
"""Channels whose largest magnitude is a metric."""


class Steering(NamedTuple):
    """Times and side of a sine with dwell."""

    side: float  # 1 for a sine that begins to the left, -1 to the right
    begin_s: float  # time at which the wheel first passes 5 deg [s]
    reversal_s: float  # time at which it passes the centre between the two halves [s]
    completion_s: float  # time at which it is back at the centre after the second half [s]
    straight: slice  # samples before the sine in which every signal shall be zero


def steering(recording: RecordingLike) -> Steering:
    """Return start, reversal and completion of a sine with dwell, interpolated between samples."""
    time_s = recording.time_s
    angle = low_pass(recording["steering_wheel_rad"], timestep(time_s), STEERING_CUT_OFF_Hz)
    if abs(angle[0]) > _THRESHOLD_RAD:  # more than the offset of a sensor
        problem = "the sine with dwell has no start: the steering wheel is already turned in the first sample"
        raise RecordingError(problem, value=float(angle[0]))
    straight = _zeroing_range(time_s, angle)
    angle -= _offset(recording["steering_wheel_rad"], straight)
    turned = np.flatnonzero(np.abs(angle) > _THRESHOLD_RAD)
    if turned.size == 0:
        raise RecordingError(
            f"the recording holds no sine with dwell: the steering wheel turns by "
            f"{math.degrees(float(np.abs(angle).max())):.3g} deg at most; more than "
            f"{math.degrees(_THRESHOLD_RAD):.3g} deg are needed",
            value=float(np.abs(angle).max()),
        )
    side = math.copysign(1.0, angle[turned[0]])
    begin_s = crossing_time(time_s, side * angle, _THRESHOLD_RAD)
    other = np.flatnonzero(-side * angle > _THRESHOLD_RAD)
    if other.size == 0:
        raise RecordingError(
            "the recording holds no sine with dwell: the steering wheel turns to one side only",
            value=float(np.abs(angle).max()),
        )
    reversal_s = _crossing_before(time_s, -side * angle, int(other[0]))
    completion_s = _completion(time_s, -side * angle, int(other[0]))
    return Steering(side, begin_s, reversal_s, completion_s, straight)


def marks(recording: RecordingLike) -> list[tuple[float, str]]:
    """Return the times to mark in plots over time, with labels: of the criterion, phases, or the start of braking."""
    if entry(recording, "maneuver", "brake"):
        with suppress(RecordingError):  # a recording of another program
            pressed = np.flatnonzero(recording["brake_pedal"] > 0.0)
            return [(float(recording.time_s[first]), "brake") for first in pressed[:1].tolist() if first > 0]
    if entry(recording, "maneuver", "kind") != "sine_with_dwell":
        return [(event.time_s, event.what) for event in events_of(recording.metadata) if event.kind == "phase"]
    try:
        completion_s = steering(recording).completion_s
    except RecordingError:
        # An incomplete run has no such times, but it can be shown.
        return []
    return [(completion_s, END_OF_STEER), *((completion_s + s, f"+{s:.2f} s") for s in INSTANTS_S)]


def sine_with_dwell_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of a sine with dwell.

    Returns:
        - `steer_begin_time_s`, `steer_reversal_time_s`, `steer_completion_time_s`: from the start of the run.
        - `yaw_rate_reversal_peak_radps`: first peak of the yaw rate after the reversal, with its sign; and its time.
        - `yaw_rate_after_1000ms_share`, `yaw_rate_after_1750ms_share`: yaw rate so long after the completion of steer,
          as a fraction of this peak; below zero if the car turns the other way by then.
        - `lateral_displacement_m`: displacement of the centre of gravity 1.07 s after the start of steer, across the
          heading at the start, positive to the side of the first half.
        - `lateral_displacement_by_ay_m`: the same from the lateral acceleration, as in the standards.
        - `<name>_peak_abs_<unit>`: over the whole run, sideslip above 10 km/h; `heading_end_rad`, against its first
          sample.

        A value is nan if the run ends before it.

    Raises:
        RecordingError: a channel is missing, or the run contains no sine with dwell.
    """
    times = steering(recording)
    time_s = recording.time_s
    yaw_rate, ay = (
        low_pass(recording[name], timestep(time_s), MOTION_CUT_OFF_Hz) - _offset(recording[name], times.straight)
        for name in ("yaw_rate_radps", "ay_mps2")
    )
    top_s, top = _first_peak(time_s, -times.side * yaw_rate, times.reversal_s)
    values = {
        "steer_begin_time_s": times.begin_s,
        "steer_reversal_time_s": times.reversal_s,
        "steer_completion_time_s": times.completion_s,
        "yaw_rate_reversal_peak_radps": -times.side * top,
        "yaw_rate_reversal_peak_time_s": top_s,
    }
    for instant_s in INSTANTS_S:
        later = -times.side * value_at(time_s, yaw_rate, times.completion_s + instant_s)
        values[f"yaw_rate_after_{1000.0 * instant_s:.0f}ms_share"] = later / top
    values["lateral_displacement_m"] = _displacement(recording, times)
    values["lateral_displacement_by_ay_m"] = times.side * integrated_displacement(time_s, ay, times.begin_s)
    for channel in PEAKS:
        values |= peak(recording, channel)
    values["speed_end_mps"] = float(recording["speed_mps"][-1])
    values["heading_end_rad"] = float(recording["yaw_rad"][-1] - recording["yaw_rad"][0])
    return values


def _zeroing_range(time_s: Array, steering_rad: Array) -> slice:
    """Return the samples for zeroing: the last second before the steering wheel turns fast.

    Source: 49 CFR 571.126 (FMVSS 126), S7.11.4 and S7.11.5; UN Regulation 140, 9.11.
    """
    step_s = timestep(time_s)
    width = max(1, round(_AVERAGED_S / step_s))
    rate = np.convolve(np.gradient(steering_rad, step_s), np.full(width, 1.0 / width), mode="same")
    fast = np.concatenate(([False], np.abs(rate) > _FAST_RADPS, [False])).astype(np.int8)
    begins, ends = np.flatnonzero(np.diff(fast) > 0), np.flatnonzero(np.diff(fast) < 0)
    before = np.abs(steering_rad[begins] - steering_rad[0]) < _THRESHOLD_RAD
    long = begins[before & (ends - begins >= _FAST_FOR_S / step_s)]
    if long.size == 0:
        return slice(0, 0)
    end = int(long[0])
    return slice(max(0, end - round(_RANGE_S / step_s)), end)


def _offset(values: Array, samples: slice) -> float:
    """Return the mean of a signal over some samples, or 0 for no samples."""
    # The signal must be unfiltered: a filter without phase rings before the steering wheel turns.
    return float(np.mean(values[samples])) if samples.stop > samples.start else 0.0


def _crossing_before(time_s: Array, values: Array, index: int) -> float:
    """Return the last time before a sample when a signal rises through zero."""
    rising = np.flatnonzero((values[:index] < 0.0) & (values[1 : index + 1] >= 0.0))
    i = int(rising[-1])
    return float(time_s[i] - values[i] * (time_s[i + 1] - time_s[i]) / (values[i + 1] - values[i]))


def _completion(time_s: Array, angle: Array, start: int) -> float:
    """Return the time when the steering wheel is back at the centre after the second half-wave, here positive."""
    # With an elastic steering system the wheel may creep over the last degrees or stop short of the centre. The line
    # through 10 and 5 deg is then extrapolated to the centre, so that creep does not delay the completion.
    below = np.flatnonzero(angle[start:] < _THRESHOLD_RAD)
    if below.size == 0:
        raise RecordingError(
            f"the sine with dwell is not completed: the steering wheel is still at "
            f"{math.degrees(abs(float(angle[-1]))):.3g} deg when the run ends",
            value=abs(float(angle[-1])),
        )
    end = start + int(below[0])
    near_s = crossing_time(time_s[start:], -angle[start:], -_THRESHOLD_RAD)
    centre_s = crossing_time(time_s[end - 1 :], -angle[end - 1 :], 0.0)
    if centre_s - near_s <= LONGEST_CREEP_S:
        return centre_s
    above = start + np.flatnonzero(angle[start : end + 1] > 2.0 * _THRESHOLD_RAD)
    if above.size == 0:
        raise RecordingError(
            f"the second half of the sine with dwell stays below {math.degrees(2.0 * _THRESHOLD_RAD):.3g} deg: "
            "its completion cannot be determined"
        )
    return near_s + (near_s - crossing_time(time_s[above[-1] :], -angle[above[-1] :], -2.0 * _THRESHOLD_RAD))


def _first_peak(time_s: Array, values: Array, begin_s: float) -> tuple[float, float]:
    """Return time and value of the first prominent maximum after a time, or else of the largest value."""
    from scipy.signal import find_peaks  # noqa: PLC0415 - takes half a second to import

    after = np.flatnonzero(time_s >= begin_s)
    moving = values[after]
    peaks, _ = find_peaks(moving, height=0.0, prominence=PEAK_PROMINENCE * float(np.abs(moving).max()))
    top = int(after[int(peaks[0]) if peaks.size else int(moving.argmax())])
    if not values[top] > 0.0:
        return math.nan, math.nan
    return float(time_s[top]), float(values[top])


def _displacement(recording: RecordingLike, times: Steering) -> float:
    time_s = recording.time_s
    x0, y0, yaw = (value_at(time_s, recording[name], times.begin_s) for name in ("x_m", "y_m", "yaw_rad"))
    x1, y1 = (value_at(time_s, recording[name], times.begin_s + DISPLACEMENT_TIME_S) for name in ("x_m", "y_m"))
    return times.side * ((y1 - y0) * math.cos(yaw) - (x1 - x0) * math.sin(yaw))


def integrated_displacement(time_s: Array, ay_mps2: Array, begin_s: float) -> float:
    """Return the lateral displacement 1.07 s after the start of steer [m] (FMVSS 126, S7.11.9)."""
    end_s = begin_s + DISPLACEMENT_TIME_S
    if end_s > time_s[-1]:
        return math.nan
    # Each acceleration is weighted with the remaining time: one integral replaces two.
    instants_s = np.linspace(begin_s, end_s, 1 + round(DISPLACEMENT_TIME_S / timestep(time_s)))
    return float(np.trapezoid((end_s - instants_s) * np.interp(instants_s, time_s, ay_mps2), instants_s))
