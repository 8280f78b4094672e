"""Low-pass filters without delay, as test standards prescribe them for measured signals."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import RecordingError

_ENDS_PERIODS: Final = 6.0
"""Time in which the filter dies away, in periods of the cut-off frequency."""


def low_pass(
    values: NDArray[np.floating], timestep_s: float, cut_off_Hz: float, poles: int = 12
) -> NDArray[np.float64]:
    """Apply a Butterworth filter without phase: half of its poles forwards, the same backwards.

    Both passes have the given cut-off frequency; together they halve a sine of this frequency.

    Args:
        values: Samples at equal distances, shape (n,).
        timestep_s: Interval between the samples [s].
        cut_off_Hz: Cut-off frequency [Hz], below half the sampling frequency.
        poles: Number of poles of both passes together, even.

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
    # The signal is mirrored at both end points, for as long as a pass needs to die away.
    ends = min(len(values) - 1, round(_ENDS_PERIODS / (cut_off_Hz * timestep_s)))
    if ends * timestep_s * cut_off_Hz < 1.0:
        raise RecordingError(
            f"{len(values)} samples are too few for a filter of {cut_off_Hz:g} Hz; "
            f"it needs {1.0 / cut_off_Hz:.3g} s of signal",
            value=len(values),
        )
    sections = butter(poles // 2, cut_off_Hz, fs=1.0 / timestep_s, output="sos")
    filtered = sosfiltfilt(sections, np.asarray(values, dtype=np.float64), padlen=ends)
    return np.asarray(filtered, dtype=np.float64)
