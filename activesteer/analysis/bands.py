"""Bands of a population's curves: from 10 to 90 % of its runs, drawn behind the nominal curve."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from activesteer.analysis.claims import claims_for
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import Array
from activesteer.errors import StudyError
from activesteer.files import reading
from activesteer.resources import DEFAULT_DRIVER, studies_dir

QUANTILES: Final = (0.1, 0.9)
"""Fractions of the runs below the lower and below the upper edge."""
TRACK: Final = ("front_axle_x_m", "front_axle_y_m")
"""Channels of the band across the course, y over x."""
TRACK_STEP_M: Final = 0.5
FILE: Final = "bands.parquet"
_MANTISSA_BITS: Final = 11
"""Bits that are kept of an edge: an error of 0.02 %, less than the width of a line."""


class Band(NamedTuple):
    """A band of one channel.

    Attributes:
        at: Time [s], or x of the front axle centre [m], shape (n,).
        low: Lower edge, shape (n,).
        high: Upper edge, shape (n,).
    """

    at: Array
    low: Array
    high: Array


def band_over_time(curves: Sequence[Array], step_s: float) -> Band:
    """Return the band of a channel over time.

    Args:
        curves: The channel in every run, every `step_s`; the shortest run ends the band.
        step_s: Time between two values [s].
    """
    length = min(map(len, curves))
    low, high = np.quantile(np.stack([curve[:length] for curve in curves]), QUANTILES, axis=0)
    return Band(step_s * np.arange(length, dtype=np.float64), low, high)


def band_of_tracks(tracks: Sequence[tuple[Array, Array]]) -> Band:
    """Return the band of tracks across the course, to the place that half of the runs reach.

    Args:
        tracks: x and y of the front axle centre in every run [m].
    """
    furthest = [np.maximum.accumulate(x) for x, _ in tracks]
    begin, end = max(float(x[0]) for x in furthest), float(np.median([x[-1] for x in furthest]))
    at = np.arange(begin, end, TRACK_STEP_M)
    # A car that turns round counts until it does so.
    across = [np.interp(at, x, y, right=np.nan) for x, (_, y) in zip(furthest, tracks, strict=True)]
    low, high = np.nanquantile(np.stack(across), QUANTILES, axis=0)
    return Band(at, low, high)


def table_of(bands: Mapping[tuple[str, str, str], Band]) -> pa.Table:
    """Return bands as a table, with the precision of a picture.

    Args:
        bands: (manoeuvre, controller, channel) -> band.
    """
    keys = list(bands)
    edges = pa.list_(pa.float32())
    columns = {name: pa.array([key[place] for key in keys]) for place, name in enumerate(_KEY)}
    columns |= {
        "start": pa.array([float(band.at[0]) for band in bands.values()]),
        "step": pa.array([float(band.at[1] - band.at[0]) for band in bands.values()]),
        "low": pa.array([_rounded(band.low) for band in bands.values()], edges),
        "high": pa.array([_rounded(band.high) for band in bands.values()], edges),
    }
    return pa.table(columns)


_KEY: Final = ("maneuver", "controller", "channel")


def _rounded(values: Array) -> np.ndarray:
    mantissa, exponent = np.frexp(values)
    return np.ldexp(np.round(mantissa * 2.0**_MANTISSA_BITS) / 2.0**_MANTISSA_BITS, exponent).astype(np.float32)


def bands_of(recording: RecordingLike) -> Mapping[str, Band]:
    """Return the population's bands for a run.

    Returns:
        Channel -> band. Empty if the run differs from the paper's, if the population varies another driver, or if no
        population of the car is stored.
    """
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
