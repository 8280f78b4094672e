"""What the analysis needs of a recording: arrays by channel name, their time, and the metadata."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from activesteer.errors import RecordingError


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
