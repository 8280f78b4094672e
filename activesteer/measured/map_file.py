"""Map of a file of measured data: column, unit and sign of each channel."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from activesteer.config import Range, build, read_toml
from activesteer.errors import RecordingError


@dataclass(frozen=True)
class ChannelMap:
    """Source of a channel."""

    column: str
    """Name of the column."""
    unit: str = ""
    """Unit of the column; by default that of the file, or SI."""
    sign: Literal[1, -1] = 1
    """-1 if the sign of the column is opposite to ISO 8855 (or `axes`)."""
    factor: Annotated[float, Range(1e-12)] = 1.0
    """Scale of the column, for a signal in a unit of its own: `factor` x column has the unit."""
    offset: float = 0.0
    """Offset added to the column, in its unit, before the scale."""
    zero_until_s: Annotated[float, Range(0.0)] | None = None
    """The mean of the column before this time is subtracted."""


@dataclass(frozen=True)
class MeasurementMap:
    """Map file."""

    channels: dict[str, ChannelMap] = field(default_factory=dict)
    """Channel -> its source; by default, columns are recognised by their names."""
    axes: Literal["iso8855", "sae_j670"] = "iso8855"
    """Axes of the file: SAE J670 has y to the right and z down."""
    time: str = ""
    """Name of the time column; recognised by its name by default, as in further files without this column."""
    time_unit: str = ""
    """Unit of the time; by default that of the file, or s."""
    shift_s: dict[str, float] = field(default_factory=dict)
    """File -> time to add to its clock, if several files have clocks of their own [s]."""
    step_s: Annotated[float, Range(1e-4, 1.0)] | None = None
    """Step of the recording; that of the file by default."""
    max_gap_s: Annotated[float, Range(0.0)] = 0.1
    """Longest gap without samples that is bridged by a straight line."""
    start_s: float | None = None
    """Start of the imported part, in the time of the file."""
    end_s: float | None = None
    """End of the imported part."""
    title: str = ""
    """Title for lists and plots."""
    kind: str = "measured"
    """Kind of the driven manoeuvre, such as `step_steer`, which decides its metrics."""


def read_map(path: Path | None) -> MeasurementMap:
    """Read a map; return an empty map without a file.

    Raises:
        RecordingError: the file cannot be read, or a key or value is wrong.
    """
    if path is None:
        return MeasurementMap()
    table, source = read_toml(path, RecordingError)
    return build(MeasurementMap, table, source)
