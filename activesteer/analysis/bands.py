"""Bands of a population's curves: from 10 to 90 % of its runs, drawn behind the nominal curve."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np
import pyarrow.parquet as pq

from activesteer.analysis.claims.stored import claims_for
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import Array
from activesteer.errors import StudyError
from activesteer.files import reading
from activesteer.resources import DEFAULT_DRIVER, studies_dir

TRACK: Final = ("front_axle_x_m", "front_axle_y_m")
"""Channels of the band across the course, y over x."""
FILE: Final = "bands.parquet"


class Band(NamedTuple):
    """A band of one channel."""

    at: Array  # time [s], or x of the front axle centre [m], shape (n,)
    low: Array  # lower edge, shape (n,)
    high: Array  # upper edge, shape (n,)


def bands_of(recording: RecordingLike) -> Mapping[str, Band]:
    """Return the population's bands for a run."""
    maneuver, vehicle, driver = (_name(recording, part) for part in ("maneuver", "vehicle", "driver"))
    if claims_for(recording) is None or recording.metadata.get("overrides") or driver != DEFAULT_DRIVER:
        return {}
    return _stored(vehicle).get((maneuver, str(recording.metadata.get("controller"))), {})


def _name(recording: RecordingLike, part: str) -> str:
    table = recording.metadata.get(part)
    return str(table.get("name")) if isinstance(table, Mapping) else ""


@functools.cache
def _stored(vehicle: str) -> dict[tuple[str, str], dict[str, Band]]:
    path = studies_dir() / "population" / FILE
    if not path.is_file():
        return {}
    with reading(path, StudyError):
        table = pq.read_table(path)
    found: dict[tuple[str, str], dict[str, Band]] = {}
    if (table.schema.metadata or {}).get(b"vehicle", b"").decode() != vehicle:
        return found
    for row in table.to_pylist():
        low, high = (np.array(row[edge], dtype=np.float64) for edge in ("low", "high"))
        band = Band(row["start"] + row["step"] * np.arange(len(low)), low, high)
        found.setdefault((row["maneuver"], row["controller"]), {})[row["channel"]] = band
    return found
