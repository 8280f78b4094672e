"""Frequency response to random steering by ISO 7401: averaged spectra of several runs, coherence, and remaining error.

Source: P. D. Welch, IEEE Transactions on Audio and Electroacoustics 15 (1967) 70-73 (averaged spectra of overlapping
segments); J. S. Bendat and A. G. Piersol, Random Data (2010), chapters 6 and 9 (the estimate H1, its random error).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from activesteer.analysis.frequency_response import INPUT, FrequencyResponse, response_of
from activesteer.analysis.series import timestep
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import Array
from activesteer.errors import RecordingError

SEGMENT_S: Final = 20.0
"""Length of a segment [s]: the spectra have a line every 0.05 Hz."""
_HANN_OVERLAP: Final = 1.0 + 2.0 / 36.0
"""Segments with Hann windows that overlap by half, for each independent segment (Welch, 1967)."""


class RandomResponse(NamedTuple):
    """An averaged frequency response.

    Attributes:
        response: The response, and its coherence.
        gain_error: Relative standard error of the gain by coherence and number of averages, shape (n,); it is also the
            standard error of the phase [rad].
        averages: Number of independent segments.
    """

    response: FrequencyResponse
    gain_error: Array
    averages: float


def random_response(
    recordings: Sequence[RecordingLike], output: str, lowest_Hz: float, highest_Hz: float, input_channel: str = INPUT
) -> RandomResponse:
    """Return the response of a channel to random steering, at all lines of a range.

    The segments are finite, and the response to the end of a segment is lost. The gain is therefore low by some per
    mille if the response dies away within a second. The error holds for small deviations: coherence above some 0.3.

    Args:
        recordings: Runs with different random steering, of at least `SEGMENT_S` each, all with one time step.
        output: Channel.
        lowest_Hz: Least frequency [Hz].
        highest_Hz: Greatest frequency [Hz].
        input_channel: Input of the response.
    """
    if not recordings:
        raise RecordingError("there is no run with random steering")
    from scipy import signal  # noqa: PLC0415 - slow to import, and lists of standards do not need it

    step_s = timestep(np.asarray(recordings[0].time_s, dtype=np.float64))
    length = round(SEGMENT_S / step_s)
    spectra, counts = [], []
    for recording in recordings:
        u, y = (np.asarray(recording[name], dtype=np.float64) for name in (input_channel, output))
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
    lines_Hz = np.asarray(np.fft.rfftfreq(length, step_s), dtype=np.float64)
    inside = (lines_Hz >= lowest_Hz - 1e-9) & (lines_Hz <= highest_Hz + 1e-9)
    largest = float(power_u.max())
    found = response_of(lines_Hz[inside], power_u[inside], power_y[inside], cross[inside], input_channel, largest)
    with np.errstate(divide="ignore"):
        error = np.sqrt(0.5 * np.maximum(1.0 / found.coherence - 1.0, 0.0) / averages)
    return RandomResponse(found, error, averages)
