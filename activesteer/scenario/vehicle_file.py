"""Files of vehicles, and the inputs that a recording names.

The module edits lines, because tomlkit puts a new key behind the comment that belongs to the next table.
"""

from __future__ import annotations

import math
import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeGuard

import numpy as np

from activesteer.config import read_toml
from activesteer.errors import ParameterError, RecordingError
from activesteer.files import user_path, write_text
from activesteer.recording import Recording

_NOTE: Final = "# Written by `"
"""Start of the comment with the origin of the values, which replaces an older one."""
_SAME: Final = {"characteristic_speed_mps": "characteristic_speed_kmh"}
"""Written key -> its other spelling in a file."""


def write_values(vehicle_file: Path, table: str, values: Mapping[str, str], command: str, date: str) -> None:
    """Replace values in a table of a vehicle file.

    Keys keep their place and their comments; missing keys are added at the end of the table, and a missing table at the
    end of the file. A comment below the header of the table names command and date, such as 2026-11-21.
    """
    before, source = read_toml(vehicle_file)
    lines = source.text.splitlines()
    header = next((number for number, line in enumerate(lines) if _is_header(line, table)), None)
    if header is None:
        lines += ["", f"[{table}]"]
        header, before = len(lines) - 1, {**before, table: {}}
    end = next((number for number in range(header + 1, len(lines)) if _is_header(lines[number])), len(lines))
    # Blank lines and comments above the next header belong to the next table.
    while end > header + 1 and not re.match(r"\s*[\w\"'-]+\s*=", lines[end - 1]):
        end -= 1
    body, missing = [f"{_NOTE}{command}` on {date}."], dict(values)
    for line in lines[header + 1 : end]:
        if line.startswith(_NOTE):
            continue
        pair = re.match(r"(?P<key>\s*[\w-]+\s*=\s*)(?P<value>[^#\s]+)(?P<rest>.*)$", line)
        key = pair["key"].split("=")[0].strip() if pair else ""
        if pair and (new := missing.pop(_SAME.get(key, key), None)) is not None:
            start = pair["key"].replace(key, _SAME.get(key, key))
            body.append(f"{start}{new}{pair['rest']}")
        else:
            body.append(line)
    body += [f"{key} = {value}" for key, value in missing.items()]
    written = "\n".join([*lines[: header + 1], *body, *lines[end:]]) + "\n"
    try:
        after = tomllib.loads(written)
    except tomllib.TOMLDecodeError:
        after = {}
    kept = {key: value for key, value in before[table].items() if key not in {*values, *_SAME}}
    if not after or {**before, table: None} != {**after, table: None} or kept.items() - after[table].items():
        raise ParameterError(
            "needs one key per line; reformat it, or edit it by hand",
            file=str(vehicle_file),
            key=f"[{table}]",
        )
    write_text(vehicle_file, written, ParameterError)


def _is_header(line: str, name: str | None = None) -> bool:
    match = re.fullmatch(r"\s*\[+\s*([^\[\]]+?)\s*\]+\s*(#.*)?", line)
    return match is not None and (name is None or match[1] == name)


_LONGEST: Final = 200_000
"""Maximum of points of a table. A longer recording is thinned."""
_ON_GROUND: Final = 0.5
"""Minimum speed of a manoeuvre with a moving car [m/s]."""


def is_recording(maneuver: object) -> TypeGuard[str | os.PathLike[str]]:
    """Return whether a manoeuvre is given as a recording, whose inputs are driven again."""
    return isinstance(maneuver, (str, os.PathLike)) and os.fspath(maneuver).endswith(".mcap")


def recorded_inputs(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the manoeuvre of a file. See `open_loop_of`. A damaged file is used up to the damage."""
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
