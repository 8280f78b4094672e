"""Inputs of a recording, measured or simulated, as an open-loop manoeuvre."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from activesteer.errors import RecordingError
from activesteer.recording import Recording

_LONGEST: Final = 200_000
"""Most points of a table; what is recorded with more is thinned."""
_ON_GROUND: Final = 0.5
"""Speed from which on a car drives [m/s]."""


def open_loop_of(recording: Recording, name: str) -> dict[str, Any]:
    """The manoeuvre that turns the steering wheel, or moves the rack, and holds the speed as in a recording.

    The time of the manoeuvre is that of the recording, from zero to its end: before its first row the first values
    hold. A brake pedal (`brake_pedal`, 0 to 1) is pressed where it was recorded; meanwhile the speed is not held.

    Args:
        recording: With `steering_wheel_rad` or `rack_m`, and `speed_mps` or `vx_mps`.
        name: What to call it.

    Returns:
        The table of the manoeuvre, for `resolve`.

    Raises:
        RecordingError: steering or speed are missing, not finite, or the recording is too short.
    """
    if len(recording) < 2:
        raise RecordingError(f"{name}: {len(recording)} rows are too few to drive", value=len(recording))
    rows = np.arange(0, len(recording), max(1, math.ceil(len(recording) / _LONGEST)))
    time_s = recording.time_s[rows].tolist()

    def values(*names: str) -> tuple[str, list[float]] | None:
        found = next((channel for channel in names if channel in recording), None)
        if found is None:
            return None
        column = np.asarray(recording[found][rows], np.float64)
        if not np.isfinite(column).all():
            raise RecordingError(f"{name}: {found} is not finite everywhere and cannot be driven", value=found)
        return found, column.tolist()

    steering, speed = values("steering_wheel_rad", "rack_m"), values("speed_mps", "vx_mps")
    if steering is None or speed is None:
        missing = "steering_wheel_rad or rack_m" if steering is None else "speed_mps or vx_mps"
        raise RecordingError(f"{name}: to drive a recording, {missing} is needed", value=missing)
    table: dict[str, Any] = {
        "kind": "open_loop",
        "name": name,
        "title": f"inputs of {name}",
        "speed_mps": max(speed[1][0], _ON_GROUND),
        "duration_s": float(recording.time_s[-1]),
        "hold_last": True,
        "steering": {"time_s": time_s, steering[0]: steering[1]},
        "speed": {"time_s": time_s, "speed_mps": speed[1]},
    }
    if (brake := values("brake_pedal")) is not None and any(brake[1]):
        table["brake"] = {"time_s": time_s, "pedal": np.clip(brake[1], 0.0, 1.0).tolist()}
    return table
