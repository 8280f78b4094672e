"""Open loop: tables of steering, speed, brake and wheel torques over time."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar

from activesteer.config import Range, check_points
from activesteer.core.conventions import CORNERS
from activesteer.core.signals import Setpoint, WheelTorques, new_message
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import DriveMode, Maneuver, NamedFile, read_columns


@dataclass(frozen=True)
class SteeringTable:
    """Table of the steering wheel angle or rack position over time."""

    time_s: tuple[float, ...] = (0.0,)
    """Times, increasing [s]; linear between them, constant outside."""
    steering_wheel_rad: tuple[float, ...] | None = None
    """Angles, left positive [rad]. Default: zero, if no rack positions are given."""
    rack_m: tuple[float, ...] | None = None
    """Rack positions from the centre instead of angles, positive steers left [m]."""
    factor: float = 1.0
    """Scale of the column, for a recorded signal with a separate scale."""
    delay_s: float = 0.0
    """Delay of the column, for a recorded signal with a separate clock [s]."""

    def __post_init__(self) -> None:
        """Check that times and exactly one angle column are given, and that factor and delay have an effect."""
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
        """Column that the table gives: angles or rack positions."""
        return self.steering_wheel_rad if self.rack_m is None else self.rack_m  # type: ignore[return-value]


@dataclass(frozen=True)
class SpeedTable:
    """Table of the speed to hold over time."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    speed_mps: tuple[float, ...]
    """Speeds to hold [m/s]."""


@dataclass(frozen=True)
class BrakeTable:
    """Table of the brake pedal over time."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    pedal: Annotated[tuple[float, ...], Range(0.0, 1.0)]
    """Pedal positions, 0 to 1."""


@dataclass(frozen=True)
class ParkingBrakeTable:
    """Table of the parking brake over time."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    applied: Annotated[tuple[float, ...], Range(0.0, 1.0)]
    """Positions, 0 (released) to 1."""


@dataclass(frozen=True)
class SensorOffsetTable:
    """Offsets of the sensors in a repeated measurement: readings minus true values."""

    yaw_rate_radps: float = 0.0
    """Offset of the yaw rate [rad/s]."""
    ax_mps2: float = 0.0
    """Offset of the longitudinal acceleration [m/s2]."""
    ay_mps2: float = 0.0
    """Offset of the lateral acceleration [m/s2]."""
    roll_rad: float = 0.0
    """Offset of the roll angle [rad]."""
    pitch_rad: float = 0.0
    """Offset of the pitch angle [rad]."""
    sideslip_rad: float = 0.0
    """Offset of the sideslip angle [rad]."""


@dataclass(frozen=True)
class WheelTorqueTable:
    """Table of the torques of each wheel over time, zero for a missing column."""

    time_s: tuple[float, ...]
    """Times, increasing [s]; linear between them, constant outside."""
    fl_drive_Nm: tuple[float, ...] | None = None
    """Drive torque, front left, positive forwards [N m]."""
    fr_drive_Nm: tuple[float, ...] | None = None
    """Drive torque, front right [N m]."""
    rl_drive_Nm: tuple[float, ...] | None = None
    """Drive torque, rear left [N m]."""
    rr_drive_Nm: tuple[float, ...] | None = None
    """Drive torque, rear right [N m]."""
    fl_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Brake torque, front left, against the rotation [N m]. The limits of the car's brakes apply."""
    fr_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Brake torque, front right [N m]."""
    rl_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Brake torque, rear left [N m]."""
    rr_brake_Nm: Annotated[tuple[float, ...] | None, Range(0.0)] = None
    """Brake torque, rear right [N m]."""

    def at(self, time_s: float) -> WheelTorques:
        """Return the torques at a time [s]."""
        drive, brake = (
            tuple(
                0.0 if column is None else _interpolate(time_s, self.time_s, column)
                for column in (getattr(self, f"{corner}_{what}_Nm") for corner in CORNERS)
            )
            for what in ("drive", "brake")
        )
        return new_message(WheelTorques, (drive, brake))


def _read(fills: str, columns: Sequence[str], file: Path) -> dict[str, Any]:
    """Read a table from a CSV, which must have at least one of the columns."""
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
    return {fills: values}


@dataclass(frozen=True, kw_only=True)
class OpenLoop(Maneuver, kind="open_loop"):
    """Tables over time, for a car that holds its speed, coasts or follows wheel torques."""

    steering: SteeringTable = SteeringTable()
    """Steering wheel or rack. Default: straight ahead."""
    steering_csv: str | None = None
    """CSV file with the columns time_s and steering_wheel_rad or rack_m: a path, or a name in the manoeuvre's
    folder."""
    speed: SpeedTable | None = None
    """Speed to hold. Default: the speed at the start."""
    brake: BrakeTable | None = None
    """Brake. Default: released. The drive is off while the brake is pressed or the parking brake is applied."""
    parking_brake: ParkingBrakeTable | None = None
    """Parking brake, at the rear wheels. Default: released."""
    wheel_torques: WheelTorqueTable | None = None
    """Torques of each wheel, without the lag of the engine. If given, neither engine nor brakes act on the car."""
    drive_csv: str | None = None
    """CSV file with the column time_s and any of the columns fl_drive_Nm ... rr_brake_Nm."""
    drive: DriveMode = "hold_speed"
    """`hold_speed` or `coast`. With wheel torques it holds only before the recording starts."""
    sensor_ahead_m: float = 0.0
    """Position of the sensors of a repeated measurement, ahead of the centre of gravity [m]: `fit` and `compare`
    use the motion there."""
    sensor_offset: SensorOffsetTable = SensorOffsetTable()
    """Offsets of these sensors, which `fit` and `compare` add to the motion."""
    hold_last: bool = False
    """True to keep the last value of steering or wheel torques that end before `duration_s`. A single value is always
    kept."""

    FILES: ClassVar = tuple(
        NamedFile((key,), (fills,), partial(_read, fills, columns), "tables")
        for key, fills, columns in (
            ("steering_csv", "steering", ("steering_wheel_rad", "rack_m")),
            ("drive_csv", "wheel_torques", tuple(field.name for field in fields(WheelTorqueTable))[1:]),
        )
    )

    def __post_init__(self) -> None:
        """Check that the tables fit together and last long enough."""
        others = {"speed": self.speed, "brake": self.brake, "parking_brake": self.parking_brake}
        if self.wheel_torques is not None and any(others.values()):
            raise ManeuverError("cannot be given together with a speed or a brake", key="wheel_torques")
        for name, table in {"steering": self.steering, **others, "wheel_torques": self.wheel_torques}.items():
            if table is not None:
                columns = {f"{name}.{field.name}": getattr(table, field.name) for field in fields(table)}
                lists = {key: column for key, column in columns.items() if isinstance(column, tuple)}
                check_points(f"{name}.time_s", table.time_s, lists, Range(1), ManeuverError)
        self._check_end("steering", self.steering.time_s)
        if self.wheel_torques is not None:
            self._check_end("wheel_torques", self.wheel_torques.time_s)

    def _check_end(self, key: str, times_s: tuple[float, ...]) -> None:
        """Reject a table that is shorter than the manoeuvre, unless `hold_last` is set."""
        if len(times_s) > 1 and times_s[-1] < self.duration_s and not self.hold_last:
            problem = (
                f"ends at {times_s[-1]:g} s, before duration_s = {self.duration_s:g}; add points, shorten duration_s, "
                "or keep the last value with hold_last = true"
            )
            raise ManeuverError(problem, key=f"{key}.time_s", value=times_s[-1])

    def setpoint(self, time_s: float) -> Setpoint:
        """Return the values of the tables (see the base class)."""
        steering = self.steering
        value = steering.factor * _interpolate(time_s - steering.delay_s, steering.time_s, steering.values)
        angle, rack = (value, None) if self.steering.rack_m is None else (0.0, value)
        if self.wheel_torques is not None:
            return Setpoint(angle, self.speed_mps, 0.0, False, None, rack, self.wheel_torques.at(time_s))
        speed = self.speed_mps if self.speed is None else _interpolate(time_s, self.speed.time_s, self.speed.speed_mps)
        pedal = 0.0 if self.brake is None else _interpolate(time_s, self.brake.time_s, self.brake.pedal)
        parking = self.parking_brake
        applied = 0.0 if parking is None else _interpolate(time_s, parking.time_s, parking.applied)
        drives = self.drive == "hold_speed" and pedal == 0.0 and applied == 0.0
        return new_message(Setpoint, (angle, speed, pedal, drives, None, rack, None, None, applied))

    def settling_setpoint(self) -> Setpoint:
        """Return the initial setpoint without wheel torques. The car may hold its speed."""
        setpoint = self.setpoint(0.0)
        if self.wheel_torques is None:
            return setpoint
        return setpoint._replace(wheel_torques=None, hold_speed=self.drive == "hold_speed")


def _interpolate(x: float, xs: tuple[float, ...], ys: tuple[float, ...]) -> float:
    """Interpolate linearly, constant outside, in plain floats because every step calls it."""
    index = bisect_right(xs, x)
    if index == 0:
        return ys[0]
    if index == len(xs):
        return ys[-1]
    x0, x1 = xs[index - 1], xs[index]
    return ys[index - 1] + (ys[index] - ys[index - 1]) * (x - x0) / (x1 - x0)
