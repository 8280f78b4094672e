"""The timeline of a playback: simulated time."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

TIMELINE: Final = "time"
"""Name of the timeline in the viewer."""


def times(time_s: NDArray[np.float64]) -> list[rr.TimeColumn]:
    """Return the time index of columns.

    Args:
        time_s: Time of each row [s], shape (n,).
    """
    return [rr.TimeColumn(TIMELINE, duration=np.rint(time_s * 1e9).astype("timedelta64[ns]"))]
