"""The recordings that are played back together: their names, labels and colours."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import run_looks
from activesteer.drawing.bodywork import CHASSIS
from activesteer.errors import RecordingError
from activesteer.recording import Recording

PLOT_RATE_HZ: Final = 100.0
"""Most samples of a signal that are shown in a second; a screen cannot show more of a run."""


class Run(NamedTuple):
    """A recording as it is shown.

    Attributes:
        recording: The recording, with the rows that are shown: about `PLOT_RATE_HZ` of them in a second.
        name: What it is called in entity paths; of several, numbered, since the viewer sorts by it.
        short: What it was called by whoever asked for it, such as `ars`.
        label: What it is called in legends and titles.
        colour: Its colour, `#rrggbb`.
        poses: Sets of poses that can be shown; a run that diverged ends with some that cannot.
    """

    recording: Recording
    name: str
    short: str
    label: str
    colour: str
    poses: NDArray[np.intp]

    @property
    def scene(self) -> str:
        """Path below which the car stands in the world."""
        return f"{self.name}/scene"

    def channel(self, name: str) -> NDArray[np.float64]:
        """A channel at the rows that are shown."""
        return self.recording[name]

    def has(self, *names: str) -> bool:
        """Whether the recording has all these channels."""
        return all(name in self.recording for name in names)


def runs_of(recordings: Mapping[str, Recording]) -> list[Run]:
    """The runs in the paper's order, the three systems always in the same colours.

    Args:
        recordings: By name, such as that of the controller.

    Raises:
        RecordingError: there is none, or one has no rows or no poses.
    """
    if not recordings:
        raise RecordingError("there is no recording to play back, at least one is needed")
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
        runs.append(Run(shown, path or "run", name, look.label, look.on_dark, poses))
    return runs


def _shown(time_s: NDArray[np.float64]) -> NDArray[np.intp]:
    """Every n-th row, n so that a second has `PLOT_RATE_HZ` of them, and the last one."""
    span_s = float(time_s[-1] - time_s[0])
    step = max(1, round((len(time_s) - 1) / (span_s * PLOT_RATE_HZ))) if span_s > 0.0 else 1
    rows = np.arange(0, len(time_s), step)
    return rows if rows[-1] == len(time_s) - 1 else np.append(rows, len(time_s) - 1)
