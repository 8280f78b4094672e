"""Files of other formats that hold a controller or driver, such as FMUs. Each format registers as an entry point.

The group `activesteer.formats` maps the ending of a file to a function of the file and the kind of block, which returns
a `Plugin`. Another distribution can add a format.
"""

from __future__ import annotations

import functools
import os
from importlib.metadata import EntryPoint, entry_points
from typing import Any


@functools.cache
def _formats() -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group="activesteer.formats")}


def format_of(given: Any) -> EntryPoint | None:
    """Return the format of a block that is given as a file, with `?name=value` for parameters; None for others."""
    if not isinstance(given, (str, os.PathLike)):
        return None
    name, dot, ending = os.fspath(given).partition("?")[0].lower().rpartition(".")
    return _formats().get(ending) if name and dot and ending.isalnum() else None
