"""Identity of a run: a hash of all its files, the controller's source, overrides and versions."""

from __future__ import annotations

import functools
import hashlib
import json
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import activesteer
from activesteer.controllers import find_controller, is_variant, read_variant
from activesteer.plugins.file import source_of
from activesteer.plugins.formats import format_of
from activesteer.scenario import Scenario, describe
from activesteer.version import __version__

_DECIDING: Final = (
    "config", "conventions.py", "coupling", "signals.py", "theory", "road", "maneuver", "driver", "controllers",
    "estimation", "tyre", "brakes", "sensors", "faults", "vehicle", "scenario", "simulation", "analysis",
)  # fmt: skip
"""Parts of the package that a result depends on."""


def digest(value: Any) -> str:
    """Return the hash of JSON values that may contain bytes."""
    return hashlib.sha256(json.dumps(value, sort_keys=True, default=_of_bytes).encode()).hexdigest()


def _of_bytes(value: object) -> str:
    if not isinstance(value, bytes):
        raise TypeError(f"{type(value).__name__} has no hash that is the same everywhere")
    return hashlib.sha256(value).hexdigest()


@functools.cache
def source_digest() -> str:
    """Return the hash of the sources that results depend on; the version number does not change with every edit."""
    package = Path(activesteer.__file__).parent
    found = {}
    for part in _DECIDING:
        inside = (path for path in (package / part).rglob("*") if path.suffix in (".py", ".txt"))
        for path in [package / part] if part.endswith(".py") else sorted(inside):
            found[path.relative_to(package).as_posix()] = path.read_bytes()
    return digest(found)[:12]


@functools.cache
def versions() -> dict[str, str]:
    """Return the versions of activesteer, its sources and its dependencies."""
    found = {"activesteer": __version__, "source": source_digest(), "python": platform.python_version()}
    for package in ("mujoco", "numpy", "scipy", "numba"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found


def deciding_versions() -> dict[str, str]:
    """Return the versions that the identity of a run depends on."""
    return {key: versions()[key] for key in ("activesteer", "source", "mujoco")}


def files_digest(scenario: Scenario) -> str:
    """Return the hash of the content of all files of a scenario."""
    return digest(scenario.files)


def controller_digest(controller: str) -> str:
    """Return the hash of a controller: its name, its parameters, and the source of a user's own controller."""
    path, _, name = controller.partition(":")
    if format_of(controller) is not None:
        source: Any = {"fmu": find_controller(controller).files}
    else:
        source = read_variant(controller).files if is_variant(controller) else source_of(controller)
    return digest({"name": f"{Path(path).name}:{name}", "source": source})


def run_id(scenario: Scenario, controller: str, seed: int, timestep_s: float) -> str:
    """Return the identity of a run: equal if and only if everything that decides the result is equal.

    Returns:
        16 hexadecimal digits.
    """
    parts = {
        "scenario": describe(scenario) | {"overrides": None},
        "files": scenario.files,
        "controller": controller_digest(controller),
        "seed": seed,
        "timestep_s": timestep_s,
        "versions": deciding_versions(),
    }
    return digest(parts)[:16]
