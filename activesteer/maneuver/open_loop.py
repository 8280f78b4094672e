"""Open loop: steering, speed, brake and wheel torques as tables over time."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from activesteer.config import Source
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import DriveMode, Maneuver
from activesteer.maneuver.open_loop_tables import (
    BrakeTable,
    ParkingBrakeTable,
    SpeedTable,
    SteeringTable,
    WheelTorqueTable,
    check_table,
    with_tables,
)
from activesteer.signals import Setpoint, WheelTorques, new_message


@dataclass(frozen=True, kw_only=True)
class OpenLoop(Maneuver):
    """Tables over time. The drive holds the speed, or the car coasts, or the wheel torques are given."""

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
    """Torques of each wheel, without the lag of the engine. If given, nothing else drives or brakes the car."""
    drive_csv: str | None = None
    """CSV file with the column time_s and any of the columns fl_drive_Nm ... rr_brake_Nm."""
    drive: DriveMode = "hold_speed"
    """`hold_speed` or `coast`; with wheel torques it holds only before the recording starts."""
    sensor_ahead_m: float = 0.0
    """Position of the sensors of a repeated measurement, ahead of the centre of gravity [m]: `fit`, `compare` and
    `validate` use the motion there."""
    hold_last: bool = False
    """Whether steering or wheel torques that end before `duration_s` keep their last value; a single value always
    does."""

    @classmethod
    def filled_from_csv(
        cls, table: Mapping[str, Any], folder: Path | None, source: Source
    ) -> tuple[dict[str, Any], dict[str, bytes]]:
        """Fill in the tables of the CSV files; see the base class."""
        return with_tables(table, folder, source)

    def __post_init__(self) -> None:
        """Check the tables."""
        torques = self.wheel_torques
        tables = [("steering", self.steering.time_s, self.steering.values)]
        if self.speed is not None:
            tables.append(("speed", self.speed.time_s, self.speed.speed_mps))
        if self.brake is not None:
            tables.append(("brake", self.brake.time_s, self.brake.pedal))
        if self.parking_brake is not None:
            tables.append(("parking_brake", self.parking_brake.time_s, self.parking_brake.applied))
        if torques is not None:
            columns = [*(torques.columns("drive") or ()), *(torques.columns("brake") or ())]
            tables += [("wheel_torques", torques.time_s, column) for column in columns]
            if self.speed is not None or self.brake is not None or self.parking_brake is not None:
                raise ManeuverError("cannot be given together with a speed or a brake", key="wheel_torques")
        for key, times_s, values in tables:
            try:
                check_table(times_s, values)
            except ManeuverError as reason:
                raise ManeuverError(reason.problem, key=f"{key}.{reason.key}" if reason.key else key) from reason
        self._check_end("steering", self.steering.time_s)
        if torques is not None:
            self._check_end("wheel_torques", torques.time_s)

    def _check_end(self, key: str, times_s: tuple[float, ...]) -> None:
        """Refuse a table that is shorter than the manoeuvre, unless `hold_last` is set."""
        if len(times_s) > 1 and times_s[-1] < self.duration_s and not self.hold_last:
            problem = (
                f"ends at {times_s[-1]:g} s, before duration_s = {self.duration_s:g}; add points, shorten duration_s, "
                "or keep the last value with hold_last = true"
            )
            raise ManeuverError(problem, key=f"{key}.time_s", value=times_s[-1])

    def setpoint(self, time_s: float) -> Setpoint:
        """Values of the tables; see the base class."""
        steering = self.steering
        value = steering.factor * _interpolate(time_s - steering.delay_s, steering.time_s, steering.values)
        angle, rack = (value, None) if self.steering.rack_m is None else (0.0, value)
        if self.wheel_torques is not None:
            return Setpoint(angle, self.speed_mps, 0.0, False, None, rack, self._torques(self.wheel_torques, time_s))
        speed = self.speed_mps if self.speed is None else _interpolate(time_s, self.speed.time_s, self.speed.speed_mps)
        pedal = 0.0 if self.brake is None else _interpolate(time_s, self.brake.time_s, self.brake.pedal)
        parking = self.parking_brake
        applied = 0.0 if parking is None else _interpolate(time_s, parking.time_s, parking.applied)
        drives = self.drive == "hold_speed" and pedal == 0.0 and applied == 0.0
        return new_message(Setpoint, (angle, speed, pedal, drives, None, rack, None, None, applied))

    def settling_setpoint(self) -> Setpoint:
        """Setpoint of the start, but without wheel torques: the car drives at its speed."""
        setpoint = self.setpoint(0.0)
        if self.wheel_torques is None:
            return setpoint
        return setpoint._replace(wheel_torques=None, hold_speed=self.drive == "hold_speed")

    @staticmethod
    def _torques(table: WheelTorqueTable, time_s: float) -> WheelTorques:
        def at(columns: tuple[tuple[float, ...], ...] | None) -> tuple[float, float, float, float]:
            if columns is None:
                return (0.0, 0.0, 0.0, 0.0)
            fl, fr, rl, rr = (_interpolate(time_s, table.time_s, column) for column in columns)
            return fl, fr, rl, rr

        return WheelTorques(at(table.columns("drive")), at(table.columns("brake")))


def _interpolate(x: float, xs: tuple[float, ...], ys: tuple[float, ...]) -> float:
    """Interpolate linearly, constant outside; with plain floats because this runs every step."""
    index = bisect_right(xs, x)
    if index == 0:
        return ys[0]
    if index == len(xs):
        return ys[-1]
    x0, x1 = xs[index - 1], xs[index]
    return ys[index - 1] + (ys[index] - ys[index - 1]) * (x - x0) / (x1 - x0)
