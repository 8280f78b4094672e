"""The tables of an open-loop manoeuvre, and how they are filled from CSV files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Final

from activesteer.config import Range, Source
from activesteer.conventions import CORNERS
from activesteer.errors import ManeuverError
from activesteer.files import MAX_CSV_BYTES, read_bytes
from activesteer.maneuver.csv_table import find_csv, read_columns


def check_table(times_s: Sequence[float], values: Sequence[float]) -> None:
    """A table needs as many values as times, and times that increase.

    Raises:
        ManeuverError: it has not.
    """
    if not times_s or len(times_s) != len(values):
        raise ManeuverError(
            f"has {len(times_s)} times and {len(values)} values; as many of each are needed, at least one"
        )
    for earlier, later in pairwise(times_s):
        if later <= earlier:
            raise ManeuverError(f"does not increase from {earlier:g} to {later:g} s", key="time_s")


@dataclass(frozen=True)
class SteeringTable:
    """Steering wheel angle over time, or where the rack is."""

    time_s: tuple[float, ...] = (0.0,)
    """Times, increasing [s]; linear between them, constant outside."""
    steering_wheel_rad: tuple[float, ...] | None = None
    """Angles, left positive [rad]; zero where neither these nor positions of the rack are given."""
    rack_m: tuple[float, ...] | None = None
    """Positions of the rack instead, from the centre, positive steers left [m]."""

    def __post_init__(self) -> None:
        """Both columns at once would contradict each other, and times alone say nothing.

        Raises:
            ManeuverError: both are given, or times alone.
        """
        if self.steering_wheel_rad is not None and self.rack_m is not None:
            raise ManeuverError(
                "steering_wheel_rad and rack_m are two ways to say where the front wheels go; leave one out"
            )
        if self.steering_wheel_rad is None and self.rack_m is None:
            if self.time_s != (0.0,):
                raise ManeuverError("given without angles; add steering_wheel_deg or rack_m", key="time_s")
            object.__setattr__(self, "steering_wheel_rad", (0.0,) * len(self.time_s))

    @property
    def values(self) -> tuple[float, ...]:
        """The column that is given."""
        return self.steering_wheel_rad if self.rack_m is None else self.rack_m  # type: ignore[return-value]


@dataclass(frozen=True)
class SpeedTable:
    """Speed to hold over time."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    speed_mps: tuple[float, ...]
    """Speeds [m/s]."""


@dataclass(frozen=True)
class BrakeTable:
    """Brake pedal over time."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    pedal: Annotated[tuple[float, ...], Range(0.0, 1.0)]
    """Pedal positions, 0 to 1."""


@dataclass(frozen=True)
class ParkingBrakeTable:
    """Parking brake over time."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    applied: Annotated[tuple[float, ...], Range(0.0, 1.0)]
    """How far it is applied, 0 to 1."""


@dataclass(frozen=True)
class WheelTorqueTable:
    """Torques of each wheel over time; what is not given is zero."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    fl_drive_Nm: tuple[float, ...] | None = None
    """Drive torque, front left, forward positive [N m]."""
    fr_drive_Nm: tuple[float, ...] | None = None
    """Front right."""
    rl_drive_Nm: tuple[float, ...] | None = None
    """Rear left."""
    rr_drive_Nm: tuple[float, ...] | None = None
    """Rear right."""
    fl_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Brake torque, front left, against the rotation [N m]; the car's brakes give no more than they have."""
    fr_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Front right."""
    rl_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Rear left."""
    rr_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Rear right."""

    def columns(self, what: str) -> tuple[tuple[float, ...], ...] | None:
        """Torques of the four wheels, `drive` or `brake`; None where no wheel has any."""
        given = [getattr(self, f"{corner}_{what}_Nm") for corner in CORNERS]
        if all(column is None for column in given):
            return None
        none = (0.0,) * len(self.time_s)
        return tuple(none if column is None else column for column in given)


_CSVS: Final = (
    ("steering_csv", "steering", ("steering_wheel_rad", "rack_m")),
    ("drive_csv", "wheel_torques", tuple(field.name for field in fields(WheelTorqueTable))[1:]),
)
"""Key that names a CSV, table that it fills, and columns of which it must have at least one."""


def with_tables(table: Mapping[str, Any], own: Path | None, source: Source) -> tuple[dict[str, Any], dict[str, bytes]]:
    """An open-loop manoeuvre's table with what its CSV files hold.

    Args:
        table: The table.
        own: Folder of the manoeuvre file; None for a table that has no file.
        source: For error messages.

    Returns:
        The table, and the CSV files by their names, to be kept with the recording. A table without a file may have both
        a CSV's name and values: it comes from a recording, and the values are what was read then, unless an override
        names another CSV.

    Raises:
        ManeuverError: a CSV is not found or wrong, or values are given beside it in a file.
    """
    filled, files = dict(table), {}
    for key, name, columns in _CSVS:
        if not isinstance(filled.get(key), str):
            continue
        if name in filled and key not in source.overridden:
            if own is None:
                continue
            raise source.fail((key,), f"{key} and the table [{name}] are two ways to give the values; leave one out")
        file = find_csv(filled[key], own, source, (key,))
        try:
            filled[name] = _read(file, columns)
        except ManeuverError as reason:
            raise source.fail((key,), str(reason)) from reason
        files[f"tables/{file.name}"] = read_bytes(file, ManeuverError, MAX_CSV_BYTES)
    return filled, files


def _read(file: Path, columns: Sequence[str]) -> dict[str, list[float]]:
    values, lines = read_columns(file, ("time_s",), columns)
    if len(values) == 1:
        raise ManeuverError(
            f"must name at least one of the columns {', '.join(columns)}", file=file.name, line=1, allowed=columns
        )
    for number, (earlier, later) in enumerate(pairwise(values["time_s"]), 1):
        if later <= earlier:
            raise ManeuverError(
                f"does not increase from {earlier:g} to {later:g} s",
                file=file.name,
                line=lines[number],
                key="time_s",
                value=later,
            )
    return values
