"""Comparison of measured runs with a simulated one: time shift, noise, residuals, tolerance corridors.

ISO 19364 (steady-state circular driving) and ISO 19365 (sine with dwell) define a corridor around the simulation that
must contain the measurement. The first uses cross plots versus the lateral acceleration, the second plots over time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.lanes import TIME_TOLERANCE_S, corridor
from activesteer.analysis.series import low_pass, rms
from activesteer.core.conventions import Array
from activesteer.core.units import quantity_of
from activesteer.errors import RecordingError
from activesteer.measured.signals import at_sensor
from activesteer.recording import Recording

INPUTS: Final = ("steering_wheel_rad", "rack_m")
"""Channels that align the clocks if both runs have them: another car's response may lag, but not its input."""
RESPONSES: Final = ("yaw_rate_radps", "ay_mps2", "roll_rad", "sideslip_rad")
_STEP_S: Final = 0.01
"""Step of the search [s]. The result is found between its sample times."""
_NEARLY: Final = 0.01
"""Loss of correlation up to which shifts count as equal, such as all periods of a sine. The shortest is taken."""


def time_shift(measured: Recording, simulated: Recording) -> float:
    """Return the delay of the measured run [s]: measured(t) is simulated(t - shift)."""
    # The search maximises the normalised cross-correlation over all shifts at which the runs overlap by half of the
    # shorter run. Between the steps of the search, the mean square of the difference is minimised.
    pairs = _pairs(measured, simulated, INPUTS) or _pairs(measured, simulated, RESPONSES)
    if not pairs:
        return math.nan
    own_s, other_s = (np.arange(time_s[0], time_s[-1], _STEP_S) for time_s in (measured.time_s, simulated.time_s))
    shortest = min(len(own_s), len(other_s))
    if shortest < 4:
        return math.nan
    alike = _alike(
        [(np.interp(own_s, measured.time_s, one), np.interp(other_s, simulated.time_s, other)) for one, other in pairs],
        shortest // 2,
    )
    tops = np.flatnonzero((alike[1:-1] >= alike[:-2]) & (alike[1:-1] > alike[2:])) + 1
    if not len(tops):
        return math.nan
    shifts = (np.arange(len(alike)) - (len(other_s) - 1)) * _STEP_S + own_s[0] - other_s[0]
    best = tops[alike[tops] > alike[tops].max() - _NEARLY]
    coarse = float(shifts[best[np.argmin(np.abs(shifts[best]))]])
    return _refined(coarse, measured.time_s, simulated.time_s, pairs)


def _pairs(measured: Recording, simulated: Recording, names: tuple[str, ...]) -> list[tuple[Array, Array]]:
    """Return signals of both runs, shifted by the mean of the simulation and scaled by its range."""
    pairs = []
    for name in names:
        if name not in measured or name not in simulated:
            continue
        one, other = measured[name], simulated[name]
        size, mean = float(other.std()), float(other.mean())
        if size > 1e-9 and float(one.std()) > 1e-9:
            pairs.append(((one - mean) / size, (other - mean) / size))
    return pairs


def _alike(pairs: list[tuple[Array, Array]], least: int) -> Array:
    """Return the normalised cross-correlation over all shifts with enough overlap."""
    from scipy.signal import correlate  # noqa: PLC0415 - slow to import

    product, first, second = 0.0, 0.0, 0.0
    for one, other in pairs:
        product = product + correlate(one, other, method="fft")
        first = first + correlate(one**2, np.ones_like(other), method="fft")
        second = second + correlate(np.ones_like(one), other**2, method="fft")
    overlap = correlate(np.ones_like(pairs[0][0]), np.ones_like(pairs[0][1]), method="fft")
    size = np.sqrt(np.maximum(first, 1e-9) * np.maximum(second, 1e-9))
    return np.where(overlap > least - 0.5, product / size, -1.0)


def _refined(coarse_s: float, own_s: Array, other_s: Array, pairs: list[tuple[Array, Array]]) -> float:
    from scipy.optimize import minimize_scalar  # noqa: PLC0415 - slow to import

    # The same samples at every shift, so that their number does not matter.
    kept = (own_s - coarse_s >= other_s[0] + _STEP_S) & (own_s - coarse_s <= other_s[-1] - _STEP_S)

    def difference(shift_s: float) -> float:
        return sum(
            float(np.mean((one[kept] - np.interp(own_s[kept] - shift_s, other_s, other)) ** 2)) for one, other in pairs
        )

    bounds = (coarse_s - _STEP_S, coarse_s + _STEP_S)
    optimum: Any = minimize_scalar(difference, bounds=bounds, method="bounded", options={"xatol": 1e-7})
    return float(optimum.x)


_MEDIAN_TO_STD: Final = 1.4826
"""Standard deviation over median absolute deviation of a normal distribution."""
_TWO_SIDED_95: Final = 1.96
"""Half of the 95 % interval of a normal distribution, in standard deviations."""


class Filter(NamedTuple):
    """A zero-phase low-pass filter."""

    poles: int  # poles of both passes together
    steering_cut_off_Hz: float  # cut-off frequency of the steering wheel angle [Hz]
    cut_off_Hz: float  # cut-off frequency of all other channels [Hz]
    source: str  # standard

    def of(self, channel: str) -> float:
        """Return the cut-off frequency of a channel [Hz]."""
        return self.steering_cut_off_Hz if channel == "steering_wheel_rad" else self.cut_off_Hz


FILTERS: Final[dict[str, Filter | None]] = {
    "iso15037": Filter(8, 10.1, 10.1, "ISO 15037-1, as ISO 7401 requires"),
    "fmvss126": Filter(12, 10.0, 6.0, "FMVSS 126, UN R140: 12 poles"),
    "none": None,
}
"""Filters by name. ISO 15037-1 requires a filter of fourth order or higher with -3 dB at 9 Hz or above, and at most 0.5
% of error up to 5 Hz: this one has -3 dB at 9.05 Hz and 0.36 % at 5 Hz."""


def smooth(recording: Recording, channel: str, chosen: Filter | None) -> tuple[Array, float]:
    """Return a filtered channel and the standard deviation of its noise, or 0 if unknown."""
    # What a low-pass filter at a quarter of the sampling rate or lower removes is treated as noise: its median absolute
    # deviation, which the short edges of a manoeuvre do not move. The noise is assumed white: below the cut-off
    # frequency it is as dense as above. A signal that the logger has filtered already shows no noise.
    values = recording[channel]
    step_s = float(np.median(np.diff(recording.time_s)))
    nyquist_Hz = 0.5 / step_s
    split_Hz = min(chosen.of(channel) if chosen else math.inf, 0.5 * nyquist_Hz)
    poles = chosen.poles if chosen else 8
    try:
        rest = values - low_pass(values, step_s, split_Hz, poles)
    except RecordingError:
        if chosen:
            raise
        return values, 0.0
    std = _MEDIAN_TO_STD * float(np.median(np.abs(rest - np.median(rest))))
    density = std / math.sqrt(nyquist_Hz - split_Hz)
    if chosen is None:
        return values, density * math.sqrt(nyquist_Hz)
    cut_Hz = chosen.of(channel)
    return low_pass(values, step_s, cut_Hz, poles), density * math.sqrt(min(cut_Hz, nyquist_Hz))


STANDARDS: Final = {
    "iso19364": "ISO 19364: cross plots versus the lateral acceleration",
    "iso19365": "ISO 19365: over time",
}
SHARE_NEEDED: Final = 0.95
"""Proportion of the samples that must be in the corridor. This is an assumption: the standards require all points of
a mean curve, and do not treat single samples of a noisy signal."""
_ACROSS: Final = "ay_mps2"
_QUOTED: Final = "as quoted from ISO 19364 and ISO 19365; the texts of the standards were not available"
_ASSUMED: Final = "assumption"
_DEG: Final = math.radians(1.0)
_CROSS_POINTS: Final = 1500
"""Largest number of measured and simulated points of a cross plot."""


class Tolerance(NamedTuple):
    """Tolerance of a quantity: offset + gain x magnitude of the simulated value."""

    offset: float  # constant part, SI
    gain: float  # fraction of the simulated value
    source: str  # source of the tolerance

    def width(self, values: Array) -> Array:
        """Return half the width of the corridor around values."""
        return self.offset + self.gain * np.abs(values)


TOLERANCES: Final = {
    "steering_wheel_rad": Tolerance(5.0 * _DEG, 0.03, _QUOTED),
    "ay_mps2": Tolerance(0.1, 0.06, _QUOTED),
    "yaw_rate_radps": Tolerance(0.5 * _DEG, 0.06, _ASSUMED),
    "sideslip_rad": Tolerance(0.3 * _DEG, 0.1, _ASSUMED),
    "roll_rad": Tolerance(0.2 * _DEG, 0.1, _ASSUMED),
    "speed_mps": Tolerance(1.0 / 3.6, 0.01, _ASSUMED),
}
"""Tolerance of each compared channel."""


class Compared(NamedTuple):
    """Comparison of one channel: measured and simulated values, and the tolerance."""

    channel: str  # name of the channel
    tolerance: Tolerance  # allowed difference
    # sample times [s] in the simulation's time or, in a cross plot, measured lateral accelerations [m/s2], shape (n,)
    x: Array
    measured: Array  # measured values, the mean of several runs, shape (n,)
    confidence: Array  # half of the 95 % interval of the mean, shape (n,); zero for one run
    simulated: Array  # simulated values, shape (n,); in a cross plot, values of the nearest point
    low: Array  # lower edge of the corridor at x; in a cross plot, of the curve of the simulation
    high: Array  # upper edge
    within: NDArray[np.bool_]  # which samples are in the corridor, shape (n,)
    noise: float = 0.0  # allowance for the noise of the measurement, by which the corridor is wider; 0 if none was made

    @property
    def residual(self) -> Array:
        """Measured minus simulated values."""
        return self.measured - self.simulated

    @property
    def share_inside(self) -> float:
        """Proportion of the samples in the corridor."""
        return float(np.mean(self.within))

    @property
    def inside(self) -> bool:
        """True if enough samples are inside the corridor."""
        return self.share_inside >= SHARE_NEEDED

    def to_json(self) -> dict[str, Any]:
        """Return the comparison of the channel as JSON values, SI."""
        return {
            "channel": self.channel,
            "rms": rms(self.residual),
            "confidence_rms": rms(self.confidence),
            "offset": self.tolerance.offset,
            "gain": self.tolerance.gain,
            "noise_allowance": self.noise,
            "source": self.tolerance.source,
            "share_inside": self.share_inside,
            "inside": self.inside,
        }


class Comparison(NamedTuple):
    """Comparison of measured runs with a simulation."""

    standard: str  # key of `STANDARDS`
    shifts_s: tuple[float, ...]  # delay of each measured run [s]; nan if unknown, and then not corrected
    quantities: tuple[Compared, ...]  # channels that all runs have
    filtered: str = "none"  # key of `FILTERS`
    unfiltered: tuple[str, ...] = ()  # channels that could not be filtered, and the reasons

    @property
    def inside(self) -> bool:
        """True if every channel is inside its corridor."""
        return all(quantity.inside for quantity in self.quantities)

    def to_json(self) -> dict[str, Any]:
        """Return the comparison as JSON values, SI."""
        return {
            "standard": self.standard,
            "time_shift_s": float(np.mean(self.shifts_s)),
            "time_shifts_s": list(self.shifts_s),
            "filter": {"name": self.filtered} | (chosen._asdict() if (chosen := FILTERS[self.filtered]) else {}),
            "unfiltered": list(self.unfiltered),
            "quantities": [quantity.to_json() for quantity in self.quantities],
            "inside": self.inside,
        }


def compare(
    measured: Sequence[Recording],
    simulated: Recording,
    standard: str = "iso19365",
    *,
    filtered: str = "iso15037",
    noise: bool = True,
    tolerances: Mapping[str, Tolerance] = TOLERANCES,
    aligned: bool = True,
) -> Comparison:
    """Compare measured runs of a manoeuvre with its simulation."""
    simulated = at_sensor(simulated)
    names = [name for name in tolerances if all(name in run for run in (*measured, simulated))]
    if standard == "iso19364" and _ACROSS not in names:
        raise RecordingError(f"cross plots need {_ACROSS} in every run", value=_ACROSS)
    if not names:
        raise RecordingError(
            f"the runs have none of the compared channels: {', '.join(tolerances)}", allowed=tuple(tolerances)
        )
    shifts = tuple(time_shift(run, simulated) if aligned else 0.0 for run in measured)
    made_up = [0.0 if math.isnan(shift) else shift for shift in shifts]
    start = max(simulated.time_s[0], *(run.time_s[0] - shift for run, shift in zip(measured, made_up, strict=True)))
    end = min(simulated.time_s[-1], *(run.time_s[-1] - shift for run, shift in zip(measured, made_up, strict=True)))
    time_s = measured[0].time_s - made_up[0]
    time_s = time_s[(time_s >= start - 1e-9) & (time_s <= end + 1e-9)]
    if len(time_s) < 10:
        raise RecordingError(f"the runs have {len(time_s)} samples in common; at least 10 are needed")

    smoothed, problems = dict[str, list[tuple[Array, float]]](), list[str]()
    for name in names:
        try:
            smoothed[name] = [smooth(run, name, FILTERS[filtered]) for run in (*measured, simulated)]
        except RecordingError as reason:
            problems.append(f"{quantity_of(name).label}: {reason.problem}")
            smoothed[name] = [smooth(run, name, None) for run in (*measured, simulated)]
    allowed = dict.fromkeys(names, 0.0)
    for name, (*sides, _) in smoothed.items() if noise else ():
        # Half of the 95 % interval of the noise in the average of several runs.
        allowed[name] = _TWO_SIDED_95 * math.sqrt(sum(remaining**2 for _, remaining in sides)) / len(sides)

    def mean_of(name: str) -> tuple[Array, Array]:
        values = np.stack([
            np.interp(time_s + shift, run.time_s, side[0])
            for run, side, shift in zip(measured, smoothed[name], made_up, strict=False)
        ])  # fmt: skip
        return values.mean(axis=0), _confidence(values)

    simulated_of = {name: sides[-1][0] for name, sides in smoothed.items()}
    found = []
    for name in names:
        if standard == "iso19365":
            tolerance, (mean, confidence) = tolerances[name], mean_of(name)
            values = np.interp(time_s, simulated.time_s, simulated_of[name])
            low, high = corridor(time_s, values, tolerance.width(values) + allowed[name])
            sides = mean, confidence, values, low, high, (mean >= low) & (mean <= high)
            found.append(Compared(name, tolerance, time_s, *sides, allowed[name]))
        elif name not in (_ACROSS, "speed_mps"):
            width = tolerances[_ACROSS].width(simulated_of[_ACROSS]) + allowed[_ACROSS]
            curve = simulated_of[_ACROSS], width, simulated_of[name]
            found.append(_crossed(name, tolerances[name], mean_of(_ACROSS)[0], *mean_of(name), curve, allowed[name]))
    return Comparison(standard, shifts, tuple(found), filtered, tuple(problems))


def _confidence(values: Array) -> Array:
    """Return half of the 95 % interval of the mean (Student), shape (n,)."""
    from scipy.stats import t  # noqa: PLC0415 - slow to import

    count = len(values)
    if count < 2:
        return np.zeros(values.shape[1])
    return t.ppf(0.975, count - 1) * values.std(axis=0, ddof=1) / math.sqrt(count)


def _crossed(
    name: str, tolerance: Tolerance, across: Array, measured: Array, confidence: Array,
    curve: tuple[Array, Array, Array], noise: float,
) -> Compared:  # fmt: skip
    """Compare in a cross plot. A point is inside if it is in the tolerance ellipse of a point of the curve."""
    rows, places = (
        np.unique(np.linspace(0, count - 1, min(count, _CROSS_POINTS)).astype(int))
        for count in (len(across), len(curve[0]))
    )
    x, y, (px, width_x, py) = across[rows], measured[rows], (values[places] for values in curve)
    width_y = tolerance.width(py) + noise
    distance = ((x[:, None] - px) / width_x) ** 2 + ((y[:, None] - py) / width_y) ** 2
    nearest = distance.argmin(axis=1)
    within = distance[np.arange(len(x)), nearest] <= 1.0
    beside, width = py[nearest], width_y[nearest]
    return Compared(name, tolerance, x, y, confidence[rows], beside, beside - width, beside + width, within, noise)


def assumptions(found: Comparison) -> list[str]:
    """Return the assumptions of the verdict that no standard defines, one line each."""
    assumed = [quantity_of(each.channel).label for each in found.quantities if each.tolerance.source == _ASSUMED]
    lines = [f"Tolerances of steering wheel angle and lateral acceleration {_QUOTED}."]
    if assumed:
        lines.append(f"Tolerances of {', '.join(assumed)} are assumptions.")
    if (chosen := FILTERS[found.filtered]) is not None:
        wheel = f", steering wheel {chosen.steering_cut_off_Hz:g} Hz"
        cut = f"{chosen.cut_off_Hz:g} Hz" + wheel * (chosen.steering_cut_off_Hz != chosen.cut_off_Hz)
        lines.append(
            f"Both sides are filtered alike: Butterworth, {chosen.poles} poles, zero phase, {cut} ({chosen.source})."
        )
    lines += [f"Not filtered: {problem}." for problem in found.unfiltered]
    if any(each.noise for each in found.quantities):
        lines.append(
            "The corridor is wider by the noise of the measurement (95 %), estimated from what the filter removes."
        )
    lines.append(f"A quantity is inside if {100.0 * SHARE_NEEDED:g} % of its samples are; this is an assumption.")
    if found.standard == "iso19365":
        lines.append(
            f"The corridor reaches {1e3 * TIME_TOLERANCE_S:g} ms to either side, as between two simulation codes."
        )
    return lines
