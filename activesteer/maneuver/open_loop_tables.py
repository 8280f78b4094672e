"""The tables of an open-loop manoeuvre, and their CSV files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Final

from activesteer import limits
from activesteer.config import Range, Source
from activesteer.conventions import CORNERS
from activesteer.errors import ManeuverError
from activesteer.files import read_bytes
from activesteer.maneuver.csv_table import find_csv, read_columns


def check_table(times_s: Sequence[float], values: Sequence[float]) -> None:
    """Check that a table has as many values as times, and that its times increase."""
    if not times_s or len(times_s) != len(values):
        raise ManeuverError(
            f"has {len(times_s)} times and {len(values)} values; as many of each are needed, at least one"
        )
    for earlier, later in pairwise(times_s):
        if later <= earlier:
            raise ManeuverError(f"does not increase from {earlier:g} to {later:g} s", key="time_s")


@dataclass(frozen=True)
class SteeringTable:
    """Steering wheel angle or rack position over time."""

    time_s: tuple[float, ...] = (0.0,)
    """Times, increasing [s]; linear between them, constant outside."""
    steering_wheel_rad: tuple[float, ...] | None = None
    """Angles, left positive [rad]. Default: zero, if no rack positions are given."""
    rack_m: tuple[float, ...] | None = None
    """Rack positions from the centre instead of angles, positive steers left [m]."""
    factor: float = 1.0
    """Scale of the column, for a recorded signal with a scale of its own."""
    delay_s: float = 0.0
    """Time by which the column comes later, for a recorded signal with a clock of its own [s]."""

    def __post_init__(self) -> None:
        """Check that times come with one of the two columns, and that factor and delay act on it."""
        if self.steering_wheel_rad is not None and self.rack_m is not None:
            raise ManeuverError("steering_wheel_rad and rack_m both steer the front wheels; leave one out")
        if self.steering_wheel_rad is None and self.rack_m is None:
            if self.time_s != (0.0,):
                raise ManeuverError("given without angles; add steering_wheel_deg or rack_m", key="time_s")
            object.__setattr__(self, "steering_wheel_rad", (0.0,) * len(self.time_s))
        if self.factor != 1.0 and not any(self.values):
            raise ManeuverError("has no effect on a steering wheel that stays at zero; leave it out", key="factor")
        if self.delay_s != 0.0 and len(set(self.values)) == 1:
            raise ManeuverError("has no effect on a steering wheel that stands still; leave it out", key="delay_s")

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
    """Positions, 0 (released) to 1."""


@dataclass(frozen=True)
class WheelTorqueTable:
    """Torques of each wheel over time; a missing column is zero."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    fl_drive_Nm: tuple[float, ...] | None = None
    """Drive torque, front left, positive forwards [N m]."""
    fr_drive_Nm: tuple[float, ...] | None = None
    """Front right."""
    rl_drive_Nm: tuple[float, ...] | None = None
    """Rear left."""
    rr_drive_Nm: tuple[float, ...] | None = None
    """Rear right."""
    fl_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Brake torque, front left, against the rotation [N m]; the limits of the car's brakes apply."""
    fr_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Front right."""
    rl_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Rear left."""
    rr_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Rear right."""

    def columns(self, what: str) -> tuple[tuple[float, ...], ...] | None:
        """Return the torques of the four wheels, `drive` or `brake`; None if no wheel has any."""
        given = [getattr(self, f"{corner}_{what}_Nm") for corner in CORNERS]
        if all(column is None for column in given):
            return None
        none = (0.0,) * len(self.time_s)
        return tuple(none if column is None else column for column in given)


_CSVS: Final = (
    ("steering_csv", "steering", ("steering_wheel_rad", "rack_m")),
    ("drive_csv", "wheel_torques", tuple(field.name for field in fields(WheelTorqueTable))[1:]),
)
"""Key that names a CSV, the table it fills, and the columns of which it must have at least one."""


def with_tables(
    table: Mapping[str, Any], folder: Path | None, source: Source
) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Fill the values of its CSV files into an open-loop table; see `Maneuver.filled_from_csv`."""
    filled, files = dict(table), {}
    for key, name, columns in _CSVS:
        if not isinstance(filled.get(key), str):
            continue
        if name in filled and key not in source.overridden:
            if folder is None:
                continue
            raise source.fail((key,), f"{key} and the table [{name}] both give the values; leave one out")
        file = find_csv(filled[key], folder, source, (key,))
        try:
            filled[name] = _read(file, columns)
        except ManeuverError as reason:
            raise source.fail((key,), str(reason)) from reason
        files[f"tables/{file.name}"] = read_bytes(file, ManeuverError, limits.MAX_CSV_BYTES)
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
