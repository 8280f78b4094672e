"""Low-pass filters without delay, as test standards prescribe them for measured signals."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import RecordingError

_ORDER: Final = 6
"""Order of one pass; forwards and backwards together have the twelve poles of the standards."""
_ENDS_PERIODS: Final = 6.0
"""Periods of the cut-off frequency that the filter needs to die away."""


def low_pass(values: NDArray[np.floating], timestep_s: float, cut_off_Hz: float) -> NDArray[np.float64]:
    """A Butterworth filter of twelve poles without phase: six forwards, the same six backwards.

    Both passes have the cut-off frequency given; together they take a sine of this frequency down to half.

    Args:
        values: Samples at equal distances, shape (n,).
        timestep_s: Distance of the samples [s].
        cut_off_Hz: Cut-off frequency [Hz], below half the sampling frequency.

    Returns:
        Filtered samples, shape (n,).

    Raises:
        RecordingError: the signal is sampled too slowly or too short to be filtered.

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
    # The signal is continued at both ends, mirrored through its end points, until a pass has died away.
    ends = min(len(values) - 1, round(_ENDS_PERIODS / (cut_off_Hz * timestep_s)))
    if ends * timestep_s * cut_off_Hz < 1.0:
        raise RecordingError(
            f"{len(values)} samples are too few for a filter of {cut_off_Hz:g} Hz; "
            f"it needs {1.0 / cut_off_Hz:.3g} s of signal",
            value=len(values),
        )
    sections = butter(_ORDER, cut_off_Hz, fs=1.0 / timestep_s, output="sos")
    filtered = sosfiltfilt(sections, np.asarray(values, dtype=np.float64), padlen=ends)
    return np.asarray(filtered, dtype=np.float64)
