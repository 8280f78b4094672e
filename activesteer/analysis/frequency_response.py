"""Frequency responses of recorded runs to their steering (ISO 7401), for continuous and random input.

The run begins and ends with the car going straight, so that the discrete Fourier transform of the whole run has no
leakage. The response at a frequency is the cross spectrum over the spectrum of the input, both summed over the
neighbouring lines. The coherence is the share of the output that follows from the input by a linear system.

Source: ISO 7401, Road vehicles - Lateral transient response test methods; J. S. Bendat and A. G. Piersol, Random Data
(2010), chapters 6 and 9 (the estimate H1, the coherence, the random error); P. D. Welch, IEEE Transactions on Audio and
Electroacoustics 15 (1967) 70-73 (averaged spectra of overlapping segments).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.series import timestep
from activesteer.analysis.source import RecordingLike
from activesteer.core.conventions import Array
from activesteer.errors import RecordingError

INPUT: Final = "steering_wheel_demand_rad"
"""The driver's demand. The steering wheel follows it within a millisecond."""
HALF_BAND_LINES: Final = 2
"""Number of lines to either side that are summed into one value."""
MIN_SPECTRUM: Final = 1e-3
"""Least amplitude of the input for a response, as a fraction of the largest amplitude of the input."""
LOWEST_Hz: Final = 0.2
HIGHEST_Hz: Final = 4.0
"""Range of the metrics [Hz]."""


class FrequencyResponse(NamedTuple):
    """Response of one output to the input."""

    frequency_Hz: NDArray[np.floating]  # frequencies [Hz], shape (n,)
    response: NDArray[np.complex128]  # output over input, complex, shape (n,)
    coherence: Array  # coherence, 0 to 1, shape (n,)
    # relative standard error of the gain by coherence and number of averages, shape (n,), or empty for one run; it is
    # also the standard error of the phase [rad]
    gain_error: Array = np.zeros(0)
    averages: float = 1.0  # number of independent segments


def frequency_response(recording: RecordingLike, output: str, frequency_Hz: Array) -> FrequencyResponse:
    """Return the response of a channel to the steering, at the spectral lines nearest to given frequencies [Hz]."""
    count, step_s = len(recording.time_s), timestep(recording.time_s)
    u, y = np.fft.rfft(recording[INPUT]), np.fft.rfft(recording[output])
    lines_Hz = np.fft.rfftfreq(count, step_s)
    places = np.rint(frequency_Hz / lines_Hz[1]).astype(int)
    if places.min() <= HALF_BAND_LINES or places.max() + HALF_BAND_LINES >= len(lines_Hz):
        low, high = float(frequency_Hz.min()), float(frequency_Hz.max())
        raise RecordingError(
            f"a run of {count * step_s:.3g} s has no response from {low:.3g} to {high:.3g} Hz; "
            f"its spectrum ends at {lines_Hz[-1]:.3g} Hz, without {HALF_BAND_LINES + 1} lines at each end",
            value=(low, high),
        )
    band = places[:, None] + np.arange(-HALF_BAND_LINES, HALF_BAND_LINES + 1)
    power_u = (np.abs(u[band]) ** 2).sum(axis=1)
    power_y = (np.abs(y[band]) ** 2).sum(axis=1)
    cross = (u[band].conj() * y[band]).sum(axis=1)
    return _response_of(lines_Hz[places], power_u, power_y, cross, float((np.abs(u) ** 2).max()))


def _response_of(
    frequency_Hz: NDArray[np.floating], power_u: Array, power_y: Array, cross: NDArray[np.complex128], largest: float
) -> FrequencyResponse:
    """Return the H1 estimate and the coherence, from the spectra of input and output and their cross spectrum."""
    missing = ~(power_u > MIN_SPECTRUM**2 * largest)
    if missing.any():
        raise RecordingError(
            f"the steering ({INPUT}) does not contain {frequency_Hz[missing][0]:.3g} Hz: "
            "no response can be evaluated there",
            value=float(frequency_Hz[missing][0]),
        )
    with np.errstate(invalid="ignore"):
        coherence = np.abs(cross) ** 2 / (power_u * power_y)
    # Without any output the response is zero, and the coherence is perfect.
    return FrequencyResponse(frequency_Hz, cross / power_u, np.where(power_y > 0.0, coherence, 1.0))


def frequency_response_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics of a sine sweep, from 0.2 to 4 Hz.

    Returns:
        For yaw rate, lateral acceleration (`ay`) and roll `<name>_gain_...` at 0.2 Hz per steering wheel angle and
        `<name>_phase_at_1Hz_rad`. For the yaw rate also the peak gain over the gain at 0.2 Hz and its frequency, the
        frequency at which the phase passes -45 deg, and the bandwidth, at 0.7 of the gain at 0.2 Hz; nan if the run
        does not reach them. `coherence_min` is the least coherence of the three outputs up to 2 Hz.

    Raises:
        RecordingError: a channel is missing, or the run is not a sweep over this range.
    """
    frequencies = np.geomspace(LOWEST_Hz, HIGHEST_Hz, 80)
    values: dict[str, float] = {}
    coherence = 1.0
    for name, channel, unit in (
        ("yaw_rate", "yaw_rate_radps", "1ps"), ("ay", "ay_mps2", "mps2prad"), ("roll", "roll_rad", "radprad"),
    ):  # fmt: skip
        found = frequency_response(recording, channel, frequencies)
        phase_rad = np.unwrap(np.angle(found.response))
        gain = np.abs(found.response)
        values[f"{name}_gain_{unit}"] = float(gain[0])
        values[f"{name}_phase_at_1Hz_rad"] = float(np.interp(1.0, found.frequency_Hz, phase_rad))
        coherence = min(coherence, float(found.coherence[found.frequency_Hz <= 2.0].min()))
        if name == "yaw_rate":
            top = int(gain.argmax())
            values["yaw_rate_peak_gain_ratio"] = float(gain[top] / gain[0])
            values["yaw_rate_peak_gain_Hz"] = float(found.frequency_Hz[top]) if top else math.nan
            values["yaw_rate_45deg_Hz"] = _falls_to(found.frequency_Hz, phase_rad, -math.pi / 4.0)
            values["yaw_rate_bandwidth_Hz"] = _falls_to(found.frequency_Hz, gain / gain[0], math.sqrt(0.5))
    values["coherence_min"] = coherence
    values["speed_end_mps"] = float(recording["speed_mps"][-1])
    return values


def _falls_to(x: NDArray[np.floating], y: Array, level: float) -> float:
    """Return the first interpolated abscissa where y falls to a level, or nan if y never does."""
    below = np.flatnonzero((y[1:] <= level) & (y[:-1] > level))
    if below.size == 0:
        return math.nan
    i = int(below[0])
    return float(x[i] + (x[i + 1] - x[i]) * (y[i] - level) / (y[i] - y[i + 1]))


SEGMENT_S: Final = 20.0
"""Length of a segment [s]: the spectra have a line every 0.05 Hz."""
_HANN_OVERLAP: Final = 1.0 + 2.0 / 36.0
"""Segments with Hann windows that overlap by half, for each independent segment (Welch, 1967)."""


def random_response(
    recordings: Sequence[RecordingLike], output: str, lowest_Hz: float, highest_Hz: float
) -> FrequencyResponse:
    """Return the response of a channel to random steering in a frequency range, averaged over runs."""
    # The segments are finite, and the response to the end of a segment is lost. The gain is therefore low by some per
    # mille if the response dies away within a second. The error holds for small deviations: coherence above some 0.3.
    if not recordings:
        raise RecordingError("there is no run with random steering")
    from scipy import signal  # noqa: PLC0415 - slow to import, and lists of standards do not need it

    step_s = timestep(recordings[0].time_s)
    length = round(SEGMENT_S / step_s)
    spectra, counts = [], []
    for recording in recordings:
        u, y = recording[INPUT], recording[output]
        if len(u) < length:
            raise RecordingError(
                f"a run of {len(u) * step_s:.3g} s is too short for an average; {SEGMENT_S:g} s are needed",
                value=len(u) * step_s,
            )
        pairs = ((u, u), (y, y), (u, y))
        spectra.append([signal.csd(*pair, fs=1.0 / step_s, nperseg=length)[1] for pair in pairs])
        counts.append(1 + (len(u) - length) // (length - length // 2))
    power_u, power_y, cross = np.average(spectra, axis=0, weights=counts)
    power_u, power_y, averages = power_u.real, power_y.real, sum(counts) / _HANN_OVERLAP
    lines_Hz = np.fft.rfftfreq(length, step_s)
    inside = (lines_Hz >= lowest_Hz - 1e-9) & (lines_Hz <= highest_Hz + 1e-9)
    largest = float(power_u.max())
    found = _response_of(lines_Hz[inside], power_u[inside], power_y[inside], cross[inside], largest)
    with np.errstate(divide="ignore"):
        error = np.sqrt(0.5 * np.maximum(1.0 / found.coherence - 1.0, 0.0) / averages)
    return found._replace(gain_error=error, averages=averages)
