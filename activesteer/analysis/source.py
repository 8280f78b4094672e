"""What the analysis needs of a recording: arrays by channel name, their time, and the metadata."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import RecordingError
from activesteer.road.course import Course, course_of
from activesteer.road.footprint import Footprint, footprint_of


class RecordingLike(Protocol):
    """A recorded run; `activesteer.recording.Recording` is one."""

    @property
    def time_s(self) -> NDArray[np.float64]:
        """Time of the samples [s], ascending, shape (n,)."""
        ...

    @property
    def metadata(self) -> Mapping[str, Any]:
        """What was run, with `maneuver.kind`."""
        ...

    def __getitem__(self, name: str, /) -> NDArray[Any]:
        """One channel over `time_s`, shape (n,)."""
        ...


def maneuver_kind(recording: RecordingLike) -> str:
    """Kind of the manoeuvre that was driven (`step_steer` ...).

    Raises:
        RecordingError: the metadata does not say.
    """
    maneuver = recording.metadata.get("maneuver")
    kind = maneuver.get("kind") if isinstance(maneuver, Mapping) else None
    if not isinstance(kind, str):
        raise RecordingError(
            f"the metadata of the recording name no kind of manoeuvre: 'maneuver' is {maneuver!r}, "
            "expected a table with the key 'kind'"
        )
    return kind


def read_course(recording: RecordingLike) -> Course:
    """The course of a run.

    Raises:
        RecordingError: the metadata hold none, or a wrong one.
    """
    course = course_of(recording.metadata)
    if course is None:
        raise RecordingError("the metadata of the recording have no table 'course': the manoeuvre has no path")
    return course


def read_footprint(recording: RecordingLike) -> Footprint:
    """Sizes of the car of a run.

    Raises:
        RecordingError: the metadata do not give them, or wrong ones.
    """
    footprint = footprint_of(recording.metadata)
    if footprint is None:
        raise RecordingError("the metadata of the recording have no table 'car': its sizes are needed")
    return footprint
