"""Inputs of a recording, measured or simulated, as an open-loop manoeuvre."""

from __future__ import annotations

import math
import os
from typing import Any, Final, TypeGuard

import numpy as np

from activesteer.errors import RecordingError
from activesteer.files import user_path
from activesteer.recording import Recording

_LONGEST: Final = 200_000
"""Maximum of points of a table; a longer recording is thinned."""
_ON_GROUND: Final = 0.5
"""Minimum speed of a manoeuvre with a moving car [m/s]."""


def is_recording(maneuver: object) -> TypeGuard[str | os.PathLike[str]]:
    """Return whether a manoeuvre is given as a recording, whose inputs are driven again."""
    return isinstance(maneuver, (str, os.PathLike)) and os.fspath(maneuver).endswith(".mcap")


def recorded_inputs(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the manoeuvre of a file; see `open_loop_of`. A damaged file is used up to the damage."""
    file = user_path(path, RecordingError)
    return open_loop_of(Recording.open(file, recover=True), file.stem)


def led(table: dict[str, Any], lag_s: float) -> dict[str, Any]:
    """Advance the steering demand of a manoeuvre by a lag [s], so that the steering wheel angle is as recorded."""
    steering = table["steering"]
    return table | {"steering": steering | {"time_s": [time_s - lag_s for time_s in steering["time_s"]]}}


def open_loop_of(recording: Recording, name: str) -> dict[str, Any]:
    """Return the manoeuvre with the steering wheel angle, or rack travel, and the speed of a recording.

    The manoeuvre starts at the first row of the recording and has its length.
    A recorded brake pedal (`brake_pedal`, 0 to 1) is pressed again; meanwhile the speed is not held.
    """
    if len(recording) < 2:
        raise RecordingError(f"{name}: {len(recording)} rows are too few to drive", value=len(recording))
    rows = np.arange(0, len(recording), max(1, math.ceil(len(recording) / _LONGEST)))
    time_s = (recording.time_s[rows] - recording.time_s[0]).tolist()

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
        "duration_s": time_s[-1],
        "hold_last": True,
        "steering": {"time_s": time_s, steering[0]: steering[1]},
        "speed": {"time_s": time_s, "speed_mps": speed[1]},
    }
    if (brake := values("brake_pedal")) is not None and any(brake[1]):
        table["brake"] = {"time_s": time_s, "pedal": np.clip(brake[1], 0.0, 1.0).tolist()}
    return table
