"""Data of a fit: channels of recordings, and the noise of each."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final, NamedTuple

import numpy as np

from activesteer.config import field_in_unit
from activesteer.conventions import Array
from activesteer.errors import RecordingError, nearest_names
from activesteer.measured.fit_file import FitTable
from activesteer.recording import Recording
from activesteer.studies.engine.study_file import StudyFile

_FEWEST: Final = 20
"""Smallest number of samples of a channel in a recording."""


class Measured(NamedTuple):
    """Recording in the time of its manoeuvre.

    Attributes:
        name: Name of its file.
        begin_s: Time of the recording at which the manoeuvre starts [s].
        time_s: Times at which channels are compared [s], shape (n,).
        channels: Measured values there, SI; not finite where missing.
    """

    name: str
    begin_s: float
    time_s: Array
    channels: dict[str, Array]


def noise_of(study: StudyFile, table: FitTable, known: Collection[str]) -> dict[str, float]:
    """Return the standard deviation of the noise of each channel of the table [fit], SI.

    Raises:
        StudyError: a channel is not among the `known` ones, or is given twice.
    """
    found: dict[str, float] = {}
    for key, value in table.noise.items():
        name, factor = field_in_unit(key, known)
        if name is None:
            raise study.source.fail(
                ("fit", "noise", key), f"there is no such channel; {nearest_names(key, known)}", key
            )
        if name in found:
            raise study.source.fail(("fit", "noise", key), "is given twice, in two units", key)
        found[name] = value * factor
    return found


def measured_of(
    recording: Recording, name: str, study: StudyFile, table: FitTable, channels: Collection[str]
) -> Measured:
    """Return the data of a recording that are compared.

    Raises:
        StudyError: the recording lacks a channel.
        RecordingError: a channel has too few samples.
    """
    for channel in channels:
        if channel not in recording:
            have = [each.name for each in recording.channels]
            key = next(key for key in table.noise if field_in_unit(key, (channel,))[0])
            raise study.source.fail(
                ("fit", "noise", key), f"{name} has no such channel; {nearest_names(channel, have)}", channel, have
            )
    if not len(recording):
        raise RecordingError("has no rows", file=f"{name}.mcap")
    begin_s = float(recording.time_s[0])
    time_s = np.asarray(recording.time_s, np.float64)
    # The last row of a run is one step before its end.
    inside = time_s <= time_s[-1] - study.timestep_s
    from_s, until_s = table.windows.get(name, (table.from_s, table.until_s))
    if from_s is not None:
        inside &= time_s >= from_s
    if until_s is not None:
        inside &= time_s <= until_s
    values = {channel: np.asarray(recording[channel], np.float64)[inside] for channel in channels}
    for channel, each in values.items():
        if np.count_nonzero(np.isfinite(each)) < _FEWEST:
            raise RecordingError(
                f"has {np.count_nonzero(np.isfinite(each))} samples to compare, and {_FEWEST} are needed; it is "
                f"recorded from {time_s[0]:g} to {time_s[-1]:g} s, and compared from fit.from_s to fit.until_s",
                file=f"{name}.mcap", key=channel,
            )  # fmt: skip
    return Measured(name, begin_s, time_s[inside] - begin_s, values)
