"""The map of a file of measured data: which column is which channel, in which unit and axes."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from activesteer.config import Range, build, read_toml
from activesteer.errors import RecordingError


@dataclass(frozen=True)
class ChannelMap:
    """Where a channel comes from."""

    column: str
    """Name of the column."""
    unit: str = ""
    """Its unit; where not given that of the file, or SI."""
    sign: Literal[1, -1] = 1
    """-1 where the column is the other way round than ISO 8855 (or `axes`) has it."""
    offset: float = 0.0
    """Added to the column, in its unit."""
    zero_until_s: Annotated[float, Range(0.0)] | None = None
    """The mean of the column before this time is taken off."""


@dataclass(frozen=True)
class MeasurementMap:
    """A map file."""

    channels: dict[str, ChannelMap] = field(default_factory=dict)
    """Channel -> where it comes from; by the names that exporters write where none is given."""
    axes: Literal["iso8855", "sae_j670"] = "iso8855"
    """Axes of the file: SAE J670 has y to the right and z down."""
    time: str = ""
    """Name of the time column; found by its name where not given."""
    time_unit: str = ""
    """Unit of the time; where not given that of the file, or s."""
    step_s: Annotated[float, Range(1e-4, 1.0)] | None = None
    """Step of the recording; that of the file where not given."""
    max_gap_s: Annotated[float, Range(0.0)] = 0.1
    """Longest piece without samples that is bridged by a straight line."""
    start_s: float | None = None
    """What is before is left out, in the file's time."""
    end_s: float | None = None
    """What is behind is left out."""
    title: str = ""
    """One line for lists and plots."""
    kind: str = "measured"
    """Kind of the manoeuvre that was driven, as `step_steer`: it says which metrics belong to it."""


def read_map(path: Path | None) -> MeasurementMap:
    """Read a map; the empty one where there is no file.

    Raises:
        RecordingError: it cannot be read, or a key or value is wrong.
    """
    if path is None:
        return MeasurementMap()
    table, source = read_toml(path, RecordingError)
    return build(MeasurementMap, table, source)
