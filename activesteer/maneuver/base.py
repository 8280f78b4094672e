"""Base of all manoeuvres: kinds, speed, road, duration, setpoints and input files."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, ClassVar, Final, Literal, NamedTuple

from activesteer.config import Range, Source, build, field_in_unit, find_file
from activesteer.config.faults import Fault, check_faults
from activesteer.core import limits
from activesteer.core.files import is_file, read_bytes, read_csv
from activesteer.core.signals import Setpoint, new_message
from activesteer.errors import ManeuverError, nearest_names, shown
from activesteer.road.course import Course
from activesteer.road.crg import packed, referenced
from activesteer.road.road import Road

MAX_SPEED_MPS: Final = 100.0
"""Largest speed of a manoeuvre [m/s]."""
Speed = Annotated[float, Range(-20.0, MAX_SPEED_MPS)]
Side = Literal["left", "right"]
SIGNS: Final[dict[Side, float]] = {"left": 1.0, "right": -1.0}
"""Sign of y, of steering and of yaw on each side (ISO 8855)."""
DriveMode = Literal["hold_speed", "coast"]

MIN_SEARCH_SPEED_MPS: Final = 30.0 / 3.6
"""Speed below which the lateral acceleration hardly depends on the steering wheel angle [m/s]."""

KINDS: Final[dict[str, type[Maneuver]]] = {}
"""Classes by value of `kind` in a file. A class registers itself: `class StepSteer(Maneuver, kind="step_steer")`."""


class NamedFile(NamedTuple):
    """A key of a manoeuvre that names a file, and the neighbouring keys that the file fills."""

    key: tuple[str, ...]  # the key, as the path of names to it
    fills: tuple[str, ...]  # keys that it fills, in the same table
    read: Callable[[Path], dict[str, Any]]  # function from the file to the values of these keys
    folder: str  # folder of the file among those that are kept with a recording; empty if the values are the whole file


@dataclass(frozen=True, kw_only=True)
class Maneuver(ABC):
    """Base of all kinds of manoeuvres.

    The fields are the keys of the TOML file.

    Examples:
        >>> from activesteer.scenario import resolve
        >>> table = {"kind": "open_loop", "speed_kmh": 72.0, "duration_s": 4.0, "hold_last": True,
        ...          "steering": {"time_s": [1.0, 2.0], "steering_wheel_deg": [0.0, 45.0]}}
        >>> maneuver = resolve(table).maneuver
        >>> maneuver.speed_mps
        20.0
        >>> round(maneuver.setpoint(1.5).steering_wheel_demand_rad, 4)
        0.3927
    """

    kind: str
    """Kind of manoeuvre."""
    name: str = ""
    """Short name, for files and tables. Default: the file's name."""
    title: str = ""
    """Title in one line, for lists and plots."""
    speed_mps: Speed
    """Speed at the start [m/s]."""
    duration_s: Annotated[float, Range(0.01, 3600.0)]
    """Length of the recording [s]."""
    settle_s: Annotated[float, Range(0.0, 60.0)] = 2.0
    """Time before the recording in which the car drives straight ahead and its speed settles [s]."""
    road: Road = Road()
    """Road of the manoeuvre."""
    fault: tuple[Fault, ...] = ()
    """Faults of actuators and sensors, and their times."""

    FILES: ClassVar[tuple[NamedFile, ...]] = ()
    """Keys of this kind that name files."""

    def __init_subclass__(cls, kind: str = "") -> None:
        """Register a kind in the table of kinds."""
        if kind:
            KINDS[kind] = cls

    @abstractmethod
    def setpoint(self, time_s: float) -> Setpoint:
        """Return the setpoint for the driver.

        Args:
            time_s: Time since the start of the recording [s].
        """

    @cached_property
    def course(self) -> Course | None:
        """Path, lanes and cones, or None if the manoeuvre sets the steering wheel angle instead."""
        return None

    def sequence(self) -> Any:
        """Return the object that follows the car through the phases of a run, or None without phases."""
        return None

    @property
    def ground(self) -> Road:
        """Road for the car. If the road follows the course, its friction does too."""
        return self.road.laid(self.course)

    @property
    def search(self) -> Search | None:
        """Search to be driven before the manoeuvre, or None if all values are known."""
        return None

    def settling_setpoint(self) -> Setpoint:
        """Return the setpoint while the car settles before the recording: straight ahead."""
        return self.at_speed(0.0)

    def at_speed(self, steering_wheel_rad: float, hold_speed: bool = True) -> Setpoint:
        """Return a setpoint with a steering wheel angle and the speed of the manoeuvre.

        Args:
            steering_wheel_rad: Steering wheel angle, left positive [rad].
            hold_speed: Whether the drive holds the speed; otherwise there is no drive torque.
        """
        return new_message(Setpoint, (steering_wheel_rad, self.speed_mps, 0.0, hold_speed, None, None, None, None, 0.0))


@dataclass(frozen=True)
class Search:
    """Search for a steering wheel angle by driving the car without control."""

    probe: Maneuver
    """Manoeuvre to drive: step steers, whose steady state counts, or one slow ramp to the left."""
    lateral_acceleration_mps2: float
    """Lateral acceleration to reach [m/s2], left positive."""
    accept: Callable[[float], Maneuver]
    """Function from the steering wheel angle found [rad] to the manoeuvre with it."""


def within(value: float, most: float) -> float:
    """Limit a value to the range from 0 to `most`."""
    return 0.0 if value < 0.0 else most if value > most else value


def check_begin(key: str, start_s: float, duration_s: float) -> None:
    """Check that an input begins before the end of the run."""
    if start_s >= duration_s:
        problem = f"is {start_s:g} s, but the run ends at {duration_s:g} s (duration_s)"
        raise ManeuverError(problem, key=key, value=start_s)


def check_speed(speed_mps: float, needing: str, instead: str = "", least_mps: float = MIN_SEARCH_SPEED_MPS) -> None:
    """Check that the car drives forwards and fast enough."""
    if speed_mps < least_mps:
        given, least = 3.6 * speed_mps, 3.6 * least_mps
        problem = f"is {given:g} km/h; {needing} needs at least {least:g} km/h, forwards"
        problem += f", or give {instead}" if instead else ""
        raise ManeuverError(problem, key="speed_kmh", value=given, allowed=Range(least))


def read_columns(
    path: Path, required: Sequence[str], optional: Sequence[str] = ()
) -> tuple[dict[str, list[float]], list[int]]:
    """Read required and optional columns of a CSV file with a header; a key in degrees or km/h fills its SI key."""
    rows = read_csv(path, ManeuverError)
    if not rows:
        raise ManeuverError("is empty; its first line must name the columns", file=path.name, line=1)
    header, rows = rows[0], rows[1:]
    places: dict[str, tuple[int, str, float]] = {}
    for place, given in enumerate(header.cells):
        name, factor = field_in_unit(given, (*required, *optional))
        if name is None:
            continue
        if name in places:
            raise ManeuverError(
                f"{places[name][1]} and {given} are the same column; leave one out",
                file=path.name,
                line=header.line,
                key=given,
            )
        places[name] = place, given, factor
    for row in rows:
        if any(row.cells[len(header.cells) :]):
            raise ManeuverError(
                f"has {len(row.cells)} cells, but the first line {len(header.cells)}; decimal commas need semicolons",
                file=path.name,
                line=row.line,
            )
    for name in required:
        if name not in places:
            raise ManeuverError(
                f"must name the columns {' and '.join(required)}; {name} is missing",
                file=path.name,
                line=header.line,
                key=name,
                allowed=(*required, *optional),
            )
    columns: dict[str, list[float]] = {name: [] for name in places}
    for name, (place, given, factor) in places.items():
        for row in rows:
            cell = row.cells[place] if place < len(row.cells) else ""
            number = limits.number_in(cell, ManeuverError, file=path.name, line=row.line, key=given)
            columns[name].append(number * factor)
    return columns, [row.line for row in rows]


def _profile(file: Path) -> dict[str, Any]:
    columns, _ = read_columns(file, ("s_m",), ("z_m", "left_z_m", "right_z_m"))
    given = set(columns) - {"s_m"}
    if given == {"z_m"}:
        return {"heights": {"s_m": columns["s_m"], "left_z_m": columns["z_m"]}}
    if given != {"left_z_m", "right_z_m"}:
        problem = f"has the heights {sorted(given)}; z_m, or left_z_m and right_z_m are needed"
        raise ManeuverError(problem, file=file.name)
    return {"heights": columns}


def _crg(file: Path) -> dict[str, Any]:
    """Return the packed content of an OpenCRG file and the files that it refers to."""
    files = {file.name: read_bytes(file, ManeuverError, limits.MAX_CRG_BYTES)}
    name, place = file.name, file
    for _ in range(limits.MAX_CRG_FILES):
        other = referenced(files[name])
        if other is None:
            return {"crg_data": list(packed(files))}
        found = next(
            (path for path in (place.parent / other, place.parent / PurePosixPath(other).name) if is_file(path)), None
        )
        if found is None:
            raise ManeuverError(f"refers to {shown(other)}, which is not found next to it", file=name)
        name, place = other, found
        files[name] = read_bytes(found, ManeuverError, limits.MAX_CRG_BYTES)
    raise ManeuverError(f"refers to more than {limits.MAX_CRG_FILES} files in a chain", file=file.name)


_ROAD_FILES: Final = (
    NamedFile(("road", "profile"), ("heights",), _profile, "road"),
    NamedFile(("road", "crg"), ("crg_data",), _crg, ""),
)


def with_files(
    kind: type[Maneuver], table: Mapping[str, Any], folder: Path | None, source: Source
) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Insert the values of the files into a table, and return the CSV files for the recording."""
    # A table without a file has no `folder`. It comes from a recording, and may have both the name of a file and the
    # values that were read then, unless an override names another file.
    filled, files = dict(table), {}
    for key, fills, read, kept in (*kind.FILES, *_ROAD_FILES):
        *above, last = key
        holder = filled.get(above[0]) if above else filled
        name = holder.get(last) if isinstance(holder, Mapping) else None
        if holder is None or not isinstance(name, str):
            continue
        given = next((each for each in fills if each in holder), None)
        if given is not None and ".".join(key) not in source.overridden:
            if folder is None:
                continue
            raise source.fail(key, f"{last} and {given} both give the values; leave one out")
        file = find_file(name, () if folder is None else (folder,), "*.csv", source, key)
        try:
            values = read(file)
        except ManeuverError as reason:
            raise source.fail(key, str(reason), reason.value, reason.allowed) from reason
        filled |= {above[0]: {**holder, **values}} if above else values
        if kept:
            files[f"{kept}/{file.name}"] = read_bytes(file, ManeuverError, limits.MAX_CSV_BYTES)
    return filled, files


def maneuver_class(table: Mapping[str, Any], source: Source) -> type[Maneuver]:
    """Return the class of a manoeuvre table."""
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        problem = "is missing" if kind is None else f"there is no kind {shown(kind)}"
        help_ = nearest_names(kind if isinstance(kind, str) else "", KINDS)
        raise source.fail(("kind",), f"{problem}; {help_}", kind, sorted(KINDS))
    return KINDS[kind]


def build_maneuver(table: Mapping[str, Any], source: Source) -> Maneuver:
    """Build a manoeuvre from its table."""
    maneuver = build(maneuver_class(table, source), table, source)
    if maneuver.fault:
        check_faults(maneuver.fault, maneuver.duration_s, source.fail)
    try:
        _ = maneuver.ground
    except ManeuverError as reason:
        raise source.placed((), reason) from reason
    return maneuver
