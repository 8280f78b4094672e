"""Interface of a recording for the analysis: channels by name, times and metadata."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Protocol

import numpy as np

from activesteer.core.conventions import Array
from activesteer.core.limits import fail
from activesteer.errors import RecordingError
from activesteer.road.course import Course, Footprint, course_of, footprint_of


class RecordingLike(Protocol):
    """A recorded run, such as `activesteer.recording.Recording`."""

    @property
    def time_s(self) -> Array:
        """Time of the samples [s], ascending, shape (n,)."""
        ...

    @property
    def metadata(self) -> Mapping[str, Any]:
        """Description of the run, with `maneuver.kind`."""
        ...

    def __getitem__(self, name: str, /) -> Array:
        """Return a channel over `time_s`, shape (n,)."""
        ...


class Evaluable:
    """A recorded run that can be evaluated: finite values, at least two rows."""

    def __init__(self, recording: RecordingLike) -> None:
        """Reject a run that is too short."""
        if len(recording.time_s) < 2:
            raise RecordingError(f"a run of {len(recording.time_s)} rows cannot be evaluated; at least 2 are needed")
        self._recording = recording
        self.time_s, self.metadata = recording.time_s, recording.metadata

    def __getitem__(self, name: str, /) -> Array:
        """Return a channel over time, shape (n,)."""
        values = self._recording[name]
        usable = np.abs(values) <= _MAX_VALUE
        if not usable.all():
            row = int(np.argmin(usable))
            raise RecordingError(
                f"channel {name} is {values[row]:g} at {self.time_s[row]:.3f} s, and cannot be evaluated",
                value=name,
            )
        return values


_MAX_VALUE: Final = 1e30
"""Bound far above the values of every channel of a car. Its square is still finite."""


def entry(recording: RecordingLike, table: str, key: str) -> str:
    """Return an entry of a metadata table as a string, empty if it does not exist."""
    values = recording.metadata.get(table)
    return str(values.get(key, "")) if isinstance(values, Mapping) else ""


def read_course(recording: RecordingLike) -> Course:
    """Return the course of a run."""
    course = course_of(recording.metadata)
    if course is None:
        raise fail("course", "is missing: the manoeuvre has no path")
    return course


def read_footprint(recording: RecordingLike) -> Footprint:
    """Return the dimensions of the car of a run."""
    footprint = footprint_of(recording.metadata)
    if footprint is None:
        raise fail("car", "is missing: the sizes of the car are needed")
    return footprint
