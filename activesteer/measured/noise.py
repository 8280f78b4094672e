"""Filter of both sides of a comparison, and the allowance for the noise that remains in the measurement."""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.analysis.filters import low_pass
from activesteer.conventions import Array
from activesteer.errors import RecordingError
from activesteer.recording import Recording

_MEDIAN_TO_STD: Final = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution."""
_TWO_SIDED_95: Final = 1.96
"""Half of the 95 % interval of a normal distribution, in standard deviations."""


class Filter(NamedTuple):
    """A low-pass filter without phase.

    Attributes:
        poles: Poles of both passes together.
        cut_off_Hz: Cut-off frequency of the steering wheel angle, and of all other channels [Hz].
        source: Standard.
    """

    poles: int
    cut_off_Hz: tuple[float, float]
    source: str

    def of(self, channel: str) -> float:
        """Return the cut-off frequency of a channel [Hz]."""
        return self.cut_off_Hz[0 if channel == "steering_wheel_rad" else 1]

    def words(self) -> str:
        """Describe the filter."""
        wheel, others = self.cut_off_Hz
        cut = f"{others:g} Hz" if wheel == others else f"{others:g} Hz, steering wheel {wheel:g} Hz"
        return f"Butterworth, {self.poles} poles, zero phase, {cut} ({self.source})"


FILTERS: Final[dict[str, Filter | None]] = {
    "iso15037": Filter(8, (10.1, 10.1), "ISO 15037-1, as ISO 7401 requires"),
    "fmvss126": Filter(12, (10.0, 6.0), "FMVSS 126, UN R140: 12 poles"),
    "none": None,
}
"""Name -> filter. ISO 15037-1 requires a filter of fourth order or higher with -3 dB at 9 Hz or above, and at most
0.5 % of error up to 5 Hz: this one has -3 dB at 9.05 Hz and 0.36 % at 5 Hz."""


class Smooth(NamedTuple):
    """A filtered channel.

    Attributes:
        values: Filtered values; the given ones if they cannot be filtered.
        noise: Standard deviation of the noise that remains in them.
        problem: Reason for which they are not filtered; empty if they are.
    """

    values: Array
    noise: float
    problem: str = ""


def smooth(recording: Recording, channel: str, chosen: Filter | None) -> Smooth:
    """Filter a channel, and estimate the noise that remains.

    What a low-pass filter at a quarter of the sampling rate or lower removes is taken for noise: its median absolute
    deviation, which the short edges of a manoeuvre do not move. The noise is assumed white: below the cut-off frequency
    it is as dense as above. A signal that the logger has filtered already shows no noise.
    """
    values = np.asarray(recording[channel], np.float64)
    step_s = float(np.median(np.diff(recording.time_s)))
    nyquist_Hz = 0.5 / step_s
    split_Hz = min(chosen.of(channel) if chosen else math.inf, 0.5 * nyquist_Hz)
    try:
        poles = chosen.poles if chosen else 8
        rest = values - low_pass(values, step_s, split_Hz, poles)
        std = _MEDIAN_TO_STD * float(np.median(np.abs(rest - np.median(rest))))
        density = std / math.sqrt(nyquist_Hz - split_Hz)
        if chosen is None:
            return Smooth(values, density * math.sqrt(nyquist_Hz))
        cut_Hz = chosen.of(channel)
        return Smooth(low_pass(values, step_s, cut_Hz, poles), density * math.sqrt(min(cut_Hz, nyquist_Hz)))
    except RecordingError as reason:
        return Smooth(values, 0.0, reason.problem if chosen else "")


def allowance(noises: list[float]) -> float:
    """Return half of the 95 % interval of the noise in the mean of several runs."""
    return _TWO_SIDED_95 * math.sqrt(sum(noise**2 for noise in noises)) / len(noises)


def filter_table(name: str) -> dict[str, Any]:
    """Return a filter of `FILTERS` as JSON values."""
    chosen = FILTERS[name]
    if chosen is None:
        return {"name": name}
    wheel, others = chosen.cut_off_Hz
    return {
        "name": name,
        "poles": chosen.poles,
        "steering_cut_off_Hz": wheel,
        "cut_off_Hz": others,
        "source": chosen.source,
    }
