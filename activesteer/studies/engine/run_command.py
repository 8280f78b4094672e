"""Command line that repeats a run of a study."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from typing import Any

from activesteer.config import toml_value
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable


def run_command(
    maneuver: FileOrTable,
    controller: str,
    vehicle: FileOrTable,
    overrides: Mapping[str, Any],
    driver: Any = DEFAULT_DRIVER,
) -> str:
    """Return the `activesteer run` that repeats a run to the last bit.

    A manoeuvre or vehicle given as a table appears as its name. The override `driver` replaces the driver.
    """
    changes = dict(overrides)
    driver = changes.pop("driver", driver)
    words = ["activesteer", "run", _name(maneuver), "-c", controller]
    if _name(vehicle) != "compact":
        words += ["--vehicle", _name(vehicle)]
    if _name(driver) != DEFAULT_DRIVER:
        words += ["--driver", _name(driver)]
    for key, value in changes.items():
        words += ["--set", f"{key}={toml_value(value)}"]
    return shlex.join(words)


def _name(item: Any) -> str:
    return str(item.get("name", "table")) if isinstance(item, Mapping) else os.fspath(item)
