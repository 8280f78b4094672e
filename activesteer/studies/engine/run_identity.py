"""What decides a run's result, as a hash: the content of all files, the controller's source, overrides, versions."""

from __future__ import annotations

import functools
import hashlib
import json
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import activesteer
from activesteer.controllers import is_variant, read_variant
from activesteer.plugins.file import source_of
from activesteer.scenario import Scenario, describe
from activesteer.version import __version__

_DECIDING: Final = (
    "config", "conventions.py", "signals.py", "theory", "road", "maneuver", "driver", "controllers", "estimation",
    "tyre", "brakes", "sensors", "faults", "vehicle", "scenario", "simulation", "analysis",
)  # fmt: skip
"""Parts of the package that a result depends on."""


def digest(value: Any) -> str:
    """Hash of JSON values, and of bytes among them."""
    return hashlib.sha256(json.dumps(value, sort_keys=True, default=_of_bytes).encode()).hexdigest()


def _of_bytes(value: object) -> str:
    if not isinstance(value, bytes):
        raise TypeError(f"{type(value).__name__} has no hash that is the same everywhere")
    return hashlib.sha256(value).hexdigest()


@functools.cache
def source_digest() -> str:
    """Hash of the package's sources as far as a result depends on them: a version number does not follow every edit."""
    package = Path(activesteer.__file__).parent
    found = {}
    for part in _DECIDING:
        inside = (path for path in (package / part).rglob("*") if path.suffix in (".py", ".txt"))
        for path in [package / part] if part.endswith(".py") else sorted(inside):
            found[path.relative_to(package).as_posix()] = path.read_bytes()
    return digest(found)[:12]


@functools.cache
def versions() -> dict[str, str]:
    """What runs here: activesteer, its sources, and what it rests on."""
    found = {"activesteer": __version__, "source": source_digest(), "python": platform.python_version()}
    for package in ("mujoco", "numpy", "scipy", "numba"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found


def deciding_versions() -> dict[str, str]:
    """Those that a run's id depends on."""
    return {key: versions()[key] for key in ("activesteer", "source", "mujoco")}


def files_digest(scenario: Scenario) -> str:
    """Hash of the content of all files that a scenario was made from."""
    return digest(scenario.files)


def controller_digest(controller: str) -> str:
    """Hash of a controller: its name and parameters, and the source where it is a user's own."""
    path, _, name = controller.partition(":")
    source = read_variant(controller).files if is_variant(controller) else source_of(controller)
    return digest({"name": f"{Path(path).name}:{name}", "source": source})


def run_id(scenario: Scenario, controller: str, seed: int, timestep_s: float) -> str:
    """Identity of a run: the same where, and only where, everything is that decides its result.

    Args:
        scenario: Manoeuvre and car with all overrides applied, not yet prepared.
        controller: Name or file of the controller.
        seed: Of the study.
        timestep_s: Step of the simulation [s].

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
