"""Operations on sampled signals: smoothing, filters, crossings and step responses."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.source import RecordingLike
from activesteer.core.conventions import CORNERS
from activesteer.errors import RecordingError

Array = NDArray[np.floating]
"""Array of floating-point numbers, of any shape."""

# A cubic fit over it leaves a 3 Hz oscillation unchanged to 1e-4 of its amplitude, and reduces white noise at 1 kHz to
# a quarter.
SMOOTHING_S: Final = 0.04
"""Width of the smoothing window [s]."""

RATE_SPAN_S: Final = 0.01
"""Interval over which a rate of change is taken [s]."""

# A car that brakes to rest swings on its tyres, and its sideslip angle is then unrelated to its path.
ANGLES_COUNT_ABOVE_MPS: Final = 10.0 / 3.6
"""Speed above which angles between velocities count in metrics [m/s]."""

_ALL: Final = slice(None)

PEAK_MARGIN: Final = 0.005
"""Relative height above the steady-state value from which a maximum counts as a peak."""


def counted_sideslip(recording: RecordingLike, part: slice = _ALL) -> Array:
    """Return the sideslip angles [rad] in a range of samples, while the car is faster than `ANGLES_COUNT_ABOVE_MPS`."""
    # Without a speed, as in measured data, all samples count. If none counts, there is one sample of 0.
    sideslip_rad = recording["sideslip_rad"][part]
    try:
        slow = recording["speed_mps"][part] <= ANGLES_COUNT_ABOVE_MPS
    except RecordingError:
        return sideslip_rad
    return np.zeros(1) if slow.size and slow.all() else sideslip_rad[~slow]


def counted(recording: RecordingLike, channel: str, part: slice = _ALL) -> Array:
    """Return the samples of a channel that count in metrics (see `counted_sideslip`)."""
    return counted_sideslip(recording, part) if channel == "sideslip_rad" else recording[channel][part]


def peak(recording: RecordingLike, channel: str, part: slice = _ALL) -> dict[str, float]:
    """Return the metric of the peak of a channel in a range of samples."""
    name, _, unit = channel.rpartition("_")
    return {f"{name}_peak_abs_{unit}": float(np.abs(counted(recording, channel, part)).max())}


def sizes(recording: RecordingLike, channel: str) -> dict[str, float]:
    """Return the metrics of the peak and the root mean square of a channel."""
    name, _, unit = channel.rpartition("_")
    return {**peak(recording, channel), f"{name}_rms_{unit}": rms(counted(recording, channel))}


_SAME_FRICTION: Final = 1e-3


def changed_friction(recording: RecordingLike) -> tuple[list[tuple[float, float]], tuple[float, float]]:
    """Return the times of a wheel friction other than the initial friction [s], and the range of this friction."""
    try:
        mu = np.array([recording[f"{corner}_mu"] for corner in CORNERS])
    except RecordingError:  # a recording of another program
        return [], (math.nan, math.nan)
    changed = np.abs(mu - mu[:, :1]) > _SAME_FRICTION
    edges = np.flatnonzero(np.diff(changed.any(axis=0).astype(int), prepend=0, append=0)).reshape(-1, 2)
    if not edges.size:
        return [], (math.nan, math.nan)
    time_s = recording.time_s
    spans_s = [(float(time_s[begin]), float(time_s[end - 1])) for begin, end in edges]
    return spans_s, (float(mu[changed].min()), float(mu[changed].max()))


def smooth(values: Array, timestep_s: float) -> Array:
    """Smooth a signal without delay, by a cubic fitted around every sample (Savitzky and Golay, 1964)."""
    half = round(SMOOTHING_S / timestep_s / 2.0)
    window = 2 * half + 1
    if window < 5 or window > len(values):
        return values
    # Row i of the projection gives the fitted value at place i of a window, from the samples of the window: the middle
    # row slides over the signal, the others serve its two ends. (scipy.signal takes half a second to import.)
    powers = np.vander(np.arange(-half, half + 1) / half, 4)
    fit = powers @ np.linalg.pinv(powers)
    inside = np.convolve(values, fit[half][::-1], mode="valid")
    return np.concatenate((fit[:half] @ values[:window], inside, fit[half + 1 :] @ values[-window:]))


def crossing_time(time_s: Array, values: Array, level: float) -> float:
    """Return the first time when a signal rises through a level, interpolated between samples."""
    rising = np.flatnonzero((values[:-1] < level) & (values[1:] >= level))
    if rising.size == 0:
        return math.nan
    i = int(rising[0])
    fraction = (level - values[i]) / (values[i + 1] - values[i])
    return float(time_s[i] + fraction * (time_s[i + 1] - time_s[i]))


def value_at(time_s: Array, values: Array, at_s: float) -> float:
    """Return the interpolated value at a time, or nan after the end of the run."""
    return float(np.interp(at_s, time_s, values)) if at_s <= time_s[-1] else math.nan


def largest_rate(values: Array, timestep_s: float) -> float:
    """Return the largest rate of change over `RATE_SPAN_S`."""
    # Unlike the slope of a smoothed signal it does not overshoot.
    span = max(1, round(RATE_SPAN_S / timestep_s))
    if len(values) <= span:
        return math.nan
    return float(np.abs(values[span:] - values[:-span]).max() / (span * timestep_s))


def rate_rms(values: Array, timestep_s: float) -> float:
    """Return the root mean square of the rate of change over `RATE_SPAN_S` (see `largest_rate`)."""
    span = max(1, round(RATE_SPAN_S / timestep_s))
    return rms(values[span:] - values[:-span]) / (span * timestep_s)


def rms(values: Array) -> float:
    """Return the root mean square, or nan for no values."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else math.nan


def lag(leader: Array, follower: Array, timestep_s: float, longest_s: float) -> float:
    """Return the lag of a signal behind another signal: the shift with the greatest similarity."""
    count, maximum = len(leader), round(longest_s / timestep_s)
    if count < 2 * maximum:
        return math.nan
    energies = np.cumsum(leader**2), np.cumsum(follower[::-1] ** 2)
    scale = np.sqrt([energies[0][count - k - 1] * energies[1][count - k - 1] for k in range(maximum + 1)])
    if not scale.all():
        return math.nan
    alike = np.array([leader[: count - k] @ follower[k:] for k in range(maximum + 1)]) / scale
    top = int(alike.argmax())
    if top in (0, maximum):
        return math.nan
    before, here, after = alike[top - 1 : top + 2]
    return float(top + 0.5 * (before - after) / (before - 2.0 * here + after)) * timestep_s


def timestep(time_s: Array) -> float:
    """Return the interval between equidistant samples [s]."""
    if len(time_s) < 2:
        raise RecordingError(f"{len(time_s)} samples are too few to analyse; at least 2 are needed", value=len(time_s))
    steps = np.diff(time_s)
    mean_s = float(time_s[-1] - time_s[0]) / (len(time_s) - 1)
    if mean_s <= 0.0 or float(np.abs(steps - mean_s).max()) > 0.01 * mean_s:
        raise RecordingError(
            f"the samples are not equidistant: steps between {steps.min():.6g} s and {steps.max():.6g} s; "
            "metrics need a recording of every step",
            value=(float(steps.min()), float(steps.max())),
        )
    return mean_s


def step_response(
    time_s: Array, values: Array, step_time_s: float, window_s: float, minimum: float
) -> dict[str, float]:
    """Return the metrics of a response to a step: steady state, response time, peak, peak time and overshoot.

    The signal is at zero before the step and may move either way. `smooth` reduces its noise for crossings and maxima;
    the steady-state value is the mean of the samples of a window at the end. The response time is nan if the signal
    never passes 90 %, and all times are nan below the minimum. The peak time is nan if the signal only settles: its
    largest value is in the window, or exceeds the steady-state value by less than `PEAK_MARGIN`.

    Source: ISO 7401, step input: response time, peak response time, overshoot.
    """
    steady_state = float(np.mean(values[time_s >= time_s[-1] - window_s]))
    direction = math.copysign(1.0, steady_state)
    after = time_s >= step_time_s
    moving_s, moving = time_s[after], direction * smooth(values, timestep(time_s))[after]
    top = int(np.argmax(moving))
    peak = direction * float(moving[top])
    found = {"steady_state": steady_state, "response_time_s": math.nan, "peak": peak, "peak_time_s": math.nan}
    if abs(steady_state) < minimum:
        return {**found, "overshoot": math.nan}
    found["response_time_s"] = crossing_time(moving_s, moving, 0.9 * abs(steady_state)) - step_time_s
    found["overshoot"] = overshoot = (peak - steady_state) / steady_state
    if overshoot >= PEAK_MARGIN and moving_s[top] < time_s[-1] - window_s:
        found["peak_time_s"] = float(moving_s[top]) - step_time_s
    return found


_ENDS_PERIODS: Final = 6.0
"""Time in which the response of the filter decays, in periods of the cut-off frequency."""


def low_pass(values: Array, timestep_s: float, cut_off_Hz: float, poles: int = 12) -> NDArray[np.float64]:
    """Apply a zero-phase Butterworth filter, with half of its poles forwards and half backwards.

    Both passes have the given cut-off frequency; together they halve a sine of this frequency.

    Source: 49 CFR 571.126 (FMVSS 126), S7.11; UN Regulation 140: 12-pole phaseless Butterworth.
    """
    from scipy.signal import butter, sosfiltfilt  # noqa: PLC0415 - takes half a second to import

    if cut_off_Hz * timestep_s > 0.499:
        raise RecordingError(
            f"a filter of {cut_off_Hz:g} Hz needs samples less than {0.5 / cut_off_Hz:.3g} s apart; "
            f"the recording has one every {timestep_s:.3g} s",
            value=timestep_s,
            allowed=0.5 / cut_off_Hz,
        )
    # The signal is mirrored at both end points, for as long as a pass needs to die away.
    ends = min(len(values) - 1, round(_ENDS_PERIODS / (cut_off_Hz * timestep_s)))
    if ends * timestep_s * cut_off_Hz < 1.0:
        raise RecordingError(
            f"{len(values)} samples are too few for a filter of {cut_off_Hz:g} Hz; "
            f"it needs {1.0 / cut_off_Hz:.3g} s of signal",
            value=len(values),
        )
    sections = butter(poles // 2, cut_off_Hz, fs=1.0 / timestep_s, output="sos")
    return sosfiltfilt(sections, values, padlen=ends)
