"""Recordings that are played back together, with names, labels and colours."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from activesteer.core.conventions import Array, run_looks
from activesteer.drawing.cars import CHASSIS
from activesteer.errors import RecordingError
from activesteer.recording import Recording

TIMELINE: Final = "time"
"""Name of the timeline in the viewer."""


def times(time_s: NDArray[np.float64]) -> list[rr.TimeColumn]:
    """Return times as the time index of columns."""
    return [rr.TimeColumn(TIMELINE, duration=np.rint(time_s * 1e9).astype("timedelta64[ns]"))]


def send(stream: rr.RecordingStream, path: str, style: Any, time_s: Array, columns: Any, each: int) -> None:
    """Send the style of an entity, and its values over time in groups of `each`."""
    stream.log(path, style, static=True)
    stream.send_columns(path, times(time_s), columns.partition(lengths=[each] * len(time_s)))


class Showing(NamedTuple):
    """Display options of a playback.

    Attributes:
        compare: Whether to leave out the pages of single runs.
        cutaway: Whether bodies are transparent.
        verdict: Results, a line for each run and each claim, at the top of the summary.
    """

    compare: bool = False
    cutaway: bool = False
    verdict: tuple[str, ...] = ()


PLOT_RATE_HZ: Final = 100.0
"""Largest number of samples of a signal shown per second. A screen cannot show more."""


_GREY: Final = "#8d939c"
"""Colour of the first system: its grey on dark cannot be seen on white, and the theme of the viewer is not known."""


class ReplayedRun(NamedTuple):
    """A recording in the viewer.

    Attributes:
        recording: The recording, with the rows that are shown: about `PLOT_RATE_HZ` per second.
        name: Name in entity paths; several runs are numbered, because the viewer sorts by name.
        short: Name given by the caller, such as `ars`.
        label: Name in legends and titles.
        colour: Colour, `#rrggbb`.
        poses: Indices of the poses that can be shown; a run that diverged ends with poses that cannot.
    """

    recording: Recording
    name: str
    short: str
    label: str
    colour: str
    poses: NDArray[np.intp]

    @property
    def scene(self) -> str:
        """Parent entity of the car in the 3D view."""
        return f"{self.name}/scene"

    def channel(self, name: str) -> NDArray[np.float64]:
        """Return a channel at the displayed rows."""
        return self.recording[name]

    def has(self, *names: str) -> bool:
        """Return True if the recording has all these channels."""
        return all(name in self.recording for name in names)


def runs_of(recordings: Mapping[str, Recording]) -> list[ReplayedRun]:
    """Return the runs in the paper's order.

    The three systems always have the same colours.

    Args:
        recordings: Name, such as the name of the controller, to recording.

    Raises:
        RecordingError: there is none, or one has no rows or no poses.
    """
    if not recordings:
        raise RecordingError("there is no recording to play back; at least one is needed")
    runs = []
    for number, (name, look) in enumerate(run_looks(recordings).items(), start=1):
        recording = recordings[name]
        poses = np.flatnonzero(recording.poses.usable())
        if len(recording) == 0 or CHASSIS not in recording.poses.names or len(poses) == 0:
            raise RecordingError(
                f"{name}: {recording!r} has nothing to play back: rows and poses of a car are needed", value=name
            )
        path = re.sub(r"\W", "_", name, flags=re.ASCII)
        path = f"{number}_{path}" if len(recordings) > 1 else path
        shown = recording.at(_shown(recording.time_s))
        runs.append(ReplayedRun(shown, path or "run", name, look.label, look.on_dark if look.place else _GREY, poses))
    return runs


def _shown(time_s: NDArray[np.float64]) -> NDArray[np.intp]:
    """Thin rows to about `PLOT_RATE_HZ` per second, and keep the last row."""
    span_s = float(time_s[-1] - time_s[0])
    step = max(1, round((len(time_s) - 1) / (span_s * PLOT_RATE_HZ))) if span_s > 0.0 else 1
    rows = np.arange(0, len(time_s), step)
    return rows if rows[-1] == len(time_s) - 1 else np.append(rows, len(time_s) - 1)
