"""Target bands of a vehicle's metrics, from a file with their sources."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from activesteer.config import Source, build, read_toml
from activesteer.errors import nearest_names
from activesteer.resources import models_dir
from activesteer.rigs.kc.metrics_steering import DEFINITIONS


@dataclass(frozen=True)
class Target:
    """Target band of a metric."""

    band: tuple[float, ...]
    """Lowest and highest value, in the metric's unit."""
    source: str
    """Source of the band."""
    remark: str = ""
    """Remark about a value outside the band."""


Targets = dict[tuple[str, str], Target]
"""Targets by axle and metric."""


def load_targets(vehicle: str, path: str | os.PathLike[str] | None = None) -> Targets:
    """Read the target bands of a vehicle.

    Args:
        vehicle: Name of the vehicle, whose bands are in `models/targets/NAME_kc.toml`; without this file there are
            none.
        path: Another file.

    Raises:
        ParameterError: the file cannot be read, or names a metric that does not exist.
    """
    file = Path(path) if path is not None else models_dir() / "targets" / f"{vehicle}_kc.toml"
    if path is None and not file.is_file():
        return {}
    table, source = read_toml(file)
    known = {(axle, definition.name) for definition in DEFINITIONS for axle in definition.axles}
    targets = {}
    for axle, metrics in table.items():
        if not isinstance(metrics, dict):
            raise source.fail([axle], "a table [axle.metric] is needed")
        for name, entry in metrics.items():
            if (axle, name) not in known:
                words = nearest_names(f"{axle}.{name}", [".".join(pair) for pair in known])
                raise source.fail([axle, name], f"there is no such metric; {words}")
            targets[axle, name] = _target(entry, source, (axle, name))
    return targets


def _target(entry: object, source: Source, path: tuple[str, str]) -> Target:
    if not isinstance(entry, dict):
        raise source.fail(path, "a table with band and source is needed")
    target = build(Target, entry, source, path)
    if len(target.band) != 2 or not target.band[0] <= target.band[1]:
        raise source.fail([*path, "band"], f"{list(target.band)} given; a lowest and a highest value are needed")
    return target
