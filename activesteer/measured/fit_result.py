"""Result of a fit, and its page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from activesteer.analysis.series import rms
from activesteer.config import toml_value
from activesteer.conventions import RUN_COLOURS, Array
from activesteer.errors import StudyError
from activesteer.files import json_text, make_folder, write_text
from activesteer.pages import Page, Section, Table, render_page
from activesteer.plotting import Area, Curve, Panel, Picture
from activesteer.units import parameter_title, quantity_of

LEVEL: Final = 0.95
"""Probability that an interval contains the true value."""
_WINDOW: Final = 5.0
"""The autocorrelation is summed over this multiple of the resulting time (Sokal, 1997). Beyond, it is noise."""
_SAME: Final = 2e-3
"""Parameters are the same to the recordings if a combination of them changes all differences by at most this fraction
of their single effects. Their correlation is then 0.999996, which differences of runs cannot distinguish from 1."""
_IN_IT: Final = 0.2
"""Proportion from which a parameter belongs to such a combination."""
_TOO_LITTLE: Final = 0.5
"""Smallest effect of a parameter's whole range on all differences together, relative to the noise. With less, the
standard deviation would be twice the range."""


class Intervals(NamedTuple):
    """Uncertainty of the parameters, relative to their ranges."""

    half_widths: Array  # half of each interval, shape (p,); nan for a parameter at an end of its range
    correlations: Array  # correlations of the errors, shape (p, p); nan likewise
    independent: tuple[float, ...]  # number of independent samples of each series
    freedom: float  # degrees of freedom of the t distribution; infinite for stated noise


def autocorrelation_time(values: Array) -> float:
    """Return the number of neighbouring samples that are worth one independent sample, or 1 for white noise.

    The time is one plus twice the sum of the autocorrelations, as far as these exceed their own noise. The mean is not
    subtracted: an offset is no noise.

    Source: A. Sokal, Monte Carlo methods in statistical mechanics, 1997, eq. 3.19: a window of five times the result.
    """
    count = len(values)
    power = np.abs(np.fft.rfft(values, 2 * count)) ** 2
    covariance = np.fft.irfft(power)[:count]
    if covariance[0] <= 0.0:
        return 1.0
    times = 2.0 * np.cumsum(covariance / covariance[0]) - 1.0
    enough = np.arange(count) >= _WINDOW * times
    time = float(times[np.argmax(enough)]) if enough.any() else float(times.max())
    return min(max(time, 1.0), float(count))


def intervals(series: Sequence[Array], slopes: Sequence[Array], free: NDArray[np.bool_], *, stated: bool) -> Intervals:
    """Return intervals of the parameters, in the linear neighbourhood of the solution.

    Least squares weights each series by its stated noise. If this noise is not trusted, each series gets the variance
    of its residual, and its n samples count as n/tau, with tau its autocorrelation time. The result is exact if the
    derivatives change slowly compared with the noise, and too wide if they change as fast.
    """
    from scipy.stats import t  # noqa: PLC0415 - slow to import

    count, parameters = sum(map(len, series)), int(np.count_nonzero(free))
    squares = [slope[:, free].T @ slope[:, free] for slope in slopes]
    inverse = np.linalg.pinv(sum(squares, np.zeros((parameters, parameters))), hermitian=True)
    if stated:
        covariance, independent, freedom = inverse, tuple(float(len(each)) for each in series), math.inf
    else:
        times = [autocorrelation_time(each) for each in series]
        lost = count / max(count - parameters, 1)
        spread = sum(
            (lost * float(np.mean(each**2)) * time * square
             for each, time, square in zip(series, times, squares, strict=True)),
            np.zeros((parameters, parameters)),
        )  # fmt: skip
        covariance = inverse @ spread @ inverse
        independent = tuple(len(each) / time for each, time in zip(series, times, strict=True))
        freedom = max(sum(independent) - parameters, 1.0)
    deviations = np.sqrt(np.diag(covariance))
    half_widths, correlations = np.full(len(free), np.nan), np.full((len(free), len(free)), np.nan)
    half_widths[free] = t.ppf(0.5 + 0.5 * LEVEL, freedom) * deviations
    correlations[np.ix_(free, free)] = covariance / np.outer(deviations, deviations)
    return Intervals(half_widths, correlations, independent, freedom)


def without_effect(slopes: Sequence[Array]) -> list[int]:
    """Return the parameters whose effect is zero or below the noise."""
    return [int(place) for place in np.flatnonzero(_effects(slopes) < _TOO_LITTLE)]


def told_apart(slopes: Sequence[Array]) -> list[int]:
    """Return parameters of which a combination has no effect, or empty if all can be separated."""
    _, sizes, combinations = np.linalg.svd(np.concatenate(slopes) / _effects(slopes), full_matrices=False)
    if sizes[-1] > _SAME:
        return []
    return [int(place) for place in np.flatnonzero(np.abs(combinations[-1]) > _IN_IT)]


def _effects(slopes: Sequence[Array]) -> Array:
    return np.linalg.norm(np.concatenate(slopes), axis=0)


_ALIKE: Final = 0.95
"""Correlation of two parameters above which a note is given."""
_MUCH: Final = 1.5
"""Residual of a channel relative to its noise above which the car does not explain the channel."""
_HANGS: Final = 5.0
"""Number of samples per independent sample above which a note is given. Filtered noise of a test vehicle, about 20 Hz,
has 2 at 100 Hz."""


class Parameter(NamedTuple):
    """Factor with its fitted value."""

    key: str  # key of the factor
    value: float  # value in the unit of the key; relative if the factor is relative
    half_width: float  # half of the 95 % interval; nan at an end of the range
    start: float  # start of the search
    low: float  # lower end of the range
    high: float  # upper end of the range

    @property
    def at_end(self) -> bool:
        """True if the value is at an end of its range, and so has no interval."""
        return math.isnan(self.half_width)

    @property
    def words(self) -> str:
        """Value and half width, with the significant digits of the latter."""
        if self.at_end or self.half_width <= 0.0:
            return f"{self.value:.5g}"
        digits = max(0, 1 - math.floor(math.log10(self.half_width)))
        return f"{self.value:.{digits}f} +- {self.half_width:.{digits}f}"

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        low, high = self.value - self.half_width, self.value + self.half_width
        return {"value": self.value, "low": low, "high": high, "start": self.start, "range": [self.low, self.high],
                "at_end": self.at_end}  # fmt: skip


class Compared(NamedTuple):
    """Channel of a recording compared with the runs."""

    recording: str  # name of the recording
    channel: str  # name of the channel
    noise: float  # stated standard deviation of its noise, SI
    time_s: Array  # times of the recording [s], shape (n,)
    measured: Array  # measured values, SI, shape (n,)
    before: Array  # simulated minus measured values at the start of the search, relative to the noise, shape (n,)
    after: Array  # the same at its end
    independent: float  # number of independent samples

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, SI."""
        return {
            "recording": self.recording,
            "channel": self.channel,
            "noise": self.noise,
            "rms_before": self.noise * rms(self.before),
            "rms": self.noise * rms(self.after),
            "samples": len(self.measured),
            "independent_samples": self.independent,
        }

    def words(self) -> tuple[str, ...]:
        """Return recording, channel, noise, rms before and after, numbers of all and of independent samples."""
        shown = quantity_of(self.channel)
        sizes = (self.noise, self.noise * rms(self.before), self.noise * rms(self.after))
        return (
            self.recording, shown.label, *(f"{shown.factor * size:.3g} {shown.unit.name}" for size in sizes),
            f"{len(self.measured)}", f"{self.independent:.0f}",
        )  # fmt: skip


class Fit(NamedTuple):
    """Result of a fit."""

    parameters: tuple[Parameter, ...]  # fitted factors
    correlations: Array  # correlations of the parameters' errors, shape (p, p); nan at an end of a range
    compared: tuple[Compared, ...]  # all channels of all recordings
    basis: str  # basis of the intervals: `residuals` or `noise`
    freedom: float  # degrees of freedom of the t distribution; infinite with `noise`
    misfit: float  # rms of the residuals relative to the noise; 1 if the car explains everything but the noise
    rounds: int  # number of parameter sets tried, each with its derivatives
    runs: int  # number of runs
    settled: bool  # whether the search converged
    overrides: dict[str, Any]  # key -> value that drives the fitted car in every recording
    own: dict[str, dict[str, Any]]  # recording -> additional values for that recording
    notes: tuple[str, ...] = ()  # warnings, one sentence each

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {
            "parameters": {one.key: one.to_json() for one in self.parameters},
            "correlations": self.correlations.tolist(),
            "channels": [each.to_json() for each in self.compared],
            "intervals": {"level": LEVEL, "basis": self.basis, "degrees_of_freedom": self.freedom},
            "misfit": self.misfit,
            "rounds": self.rounds,
            "runs": self.runs,
            "settled": self.settled,
            "overrides": self.overrides,
            "own_overrides": self.own,
            "notes": list(self.notes),
        }

    def pairs(self, least: float) -> list[tuple[str, str, float]]:
        """Return pairs of parameters with at least this correlation of their errors; the largest first."""
        keys = [one.key for one in self.parameters]
        found = [
            (one, other, float(self.correlations[row, column]))
            for row, one in enumerate(keys)
            for column, other in enumerate(keys[:row])
            if abs(self.correlations[row, column]) >= least
        ]
        return sorted(found, key=lambda pair: -abs(pair[2]))


def rests_on(found: Fit) -> list[str]:
    """Return the meaning and the limits of the intervals, one sentence each."""
    if found.basis == "noise":
        lines = ["The intervals rest on the stated noise: white, normal, and independent in every channel."]
    else:
        lines = [
            "The intervals rest on the residuals of every channel: their variance, and their number of independent "
            f"samples by autocorrelation (t distribution, {found.freedom:.0f} degrees of freedom)."
        ]
    return [
        *lines,
        "They are 95 % intervals of single parameters, from the derivatives at the end of the search.",
        "The inputs are used as recorded: the intervals contain neither noise and offsets of steering and speed, nor "
        "errors of the model of the car.",
    ]


def notes_of(found: Fit) -> tuple[str, ...]:
    """Return warnings, one sentence each."""
    notes = []
    if not found.settled:
        notes.append(f"the search did not converge in {found.rounds} rounds; restart it from its end (fit.start)")
    for one in found.parameters:
        if one.at_end:
            notes.append(
                f"{one.key} is at an end of its range, {one.value:.5g}: it has no interval, and the other intervals "
                "hold for this value"
            )
        elif 2.0 * one.half_width > one.high - one.low:
            notes.append(f"{one.key} is almost unknown: its interval is wider than its range")
    notes += [
        f"{one} and {other} can hardly be separated: the correlation of their errors is {value:.3f}"
        for one, other, value in found.pairs(_ALIKE)
    ]
    for each in found.compared:
        left = rms(each.after)
        where = f"{quantity_of(each.channel).label} in {each.recording}"
        if left > _MUCH:
            notes.append(
                f"the residual of the {where} is {left:.1f} times its noise: car or inputs differ, and errors may "
                "exceed the intervals"
            )
        elif left < 1.0 / _MUCH:
            notes.append(f"the residual of the {where} is {left:.2g} of the stated noise, which is too large")
        elif len(each.after) > _HANGS * each.independent:
            notes.append(
                f"the residual of the {where} is not white: {len(each.after)} samples count as {each.independent:.0f}; "
                "car or inputs differ, or the noise is filtered"
            )
    return tuple(notes)


def write_fit(found: Fit, name: str, folder: Path) -> list[Path]:
    """Write `fit.json`, `overrides.toml` and `fit.html`, and return their paths. Existing files are replaced."""
    make_folder(folder, StudyError)
    texts = {
        "fit.json": json_text(found.to_json()) + "\n",
        "overrides.toml": overrides_text(found, name),
        "fit.html": render_page(fit_page(found, name)),
    }
    return [write_text(folder / file, text, StudyError) for file, text in texts.items()]


def overrides_text(found: Fit, name: str) -> str:
    """The file for `--overrides`: what holds in all recordings, and as comments what belongs to one of them."""
    words = {one.key: one.words if one.value == found.overrides.get(one.key) else f"{one.words}, relative to the files"
             for one in found.parameters}  # fmt: skip
    lines = [f"# Found by `activesteer fit {name}.toml`; for --overrides, or the table [overrides] of a study."]
    lines += [f'"{key}" = {toml_value(value)}  # {words[key]}' for key, value in found.overrides.items()]
    for recording, own in found.own.items():
        lines += [f"# in {recording} alone: {key} = {toml_value(value)}" for key, value in own.items()]
    return "\n".join(lines) + "\n"


def fit_page(found: Fit, name: str) -> Page:
    """Return the page of a fit."""
    lead: list[str | Markup] = [
        f"{found.runs} runs in {found.rounds} rounds; the remaining difference is {found.misfit:.3g} times the noise "
        "as stated."
    ]
    lead += [Markup('<span class="failed">{}.</span>').format(note[0].upper() + note[1:]) for note in found.notes]
    sections = [Section(tables=[parameter_table(found)])]
    if len(found.parameters) > 1:
        sections.append(Section("Correlation of their errors", tables=[correlation_table(found)]))
    columns = [
        "recording", "channel", "stated noise", "rms at the start", "rms at the end", "samples", "independent samples",
    ]  # fmt: skip
    sections.append(
        Section("Remaining differences", tables=[Table("", columns, [each.words() for each in found.compared])])
    )
    for recording, compared in groupby(found.compared, lambda each: each.recording):
        sections.append(Section(recording, pictures=[picture(list(compared))]))
    sections.append(Section("Assumptions", points=rests_on(found)))
    return Page(f"activesteer fit: {name}", f"Parameters from recordings: {name}", lead, sections)


def parameter_table(found: Fit) -> Table:
    """Return the table of the parameters, with intervals."""
    rows = [
        (
            Markup('{}<br><code class="key">{}</code>').format(parameter_title(one.key), one.key),
            one.words.replace("+-", "\N{PLUS-MINUS SIGN}"), f"{one.start:.5g}", f"{one.low:.5g} to {one.high:.5g}",
        )
        for one in found.parameters
    ]  # fmt: skip
    outside = frozenset(number for number, one in enumerate(found.parameters) if one.at_end)
    return Table("", ["parameter", "value and 95 % interval", "at the start", "range"], rows, outside)


def correlation_table(found: Fit) -> Table:
    """Return the table of the correlations of the parameters' errors."""
    rows = [
        (f"{number} {parameter_title(one.key)}", *("-" if math.isnan(value) else f"{value:+.3f}" for value in values))
        for number, (one, values) in enumerate(zip(found.parameters, found.correlations, strict=True), start=1)
    ]
    return Table("", ["", *(str(number) for number in range(1, len(rows) + 1))], rows)


def picture(compared: list[Compared]) -> Picture:
    """Return the channels of one recording: measured and simulated values, and beside them their difference."""
    panels = []
    for each in compared:
        shown = quantity_of(each.channel)
        noise = shown.factor * each.noise
        measured = shown.factor * each.measured
        over = "time of the recording [s]"
        curves = [
            Curve(each.time_s, measured, "measured", RUN_COLOURS[1], "", marker=".", size=2.0),
            Curve(each.time_s, measured + noise * each.before, "at the start", "#888888", "--", 1.0),
            Curve(each.time_s, measured + noise * each.after, "fitted", RUN_COLOURS[2]),
        ]
        rest = [
            Curve(each.time_s, noise * each.before, "", "#888888", "--", 0.8),
            Curve(each.time_s, noise * each.after, "", RUN_COLOURS[2], width=0.8),
        ]
        band = Area(each.time_s[[0, -1]], -2.0 * noise, 2.0 * noise, "2 standard deviations of the noise")
        panels.append(Panel(over, "", curves, shown.title))
        panels.append(Panel(over, "", rest, f"Simulated less measured [{shown.unit.name}]", [band]))
    return Picture("", panels, columns=2, width_in=11.0, height_in=2.5 * len(compared))
