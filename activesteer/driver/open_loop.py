"""The open-loop driver: sets the steering wheel angle, holds the speed, presses the brake."""

from __future__ import annotations

from typing import Final

from activesteer.driver.base import DriverSetup
from activesteer.driver.speed_hold import SpeedHold, drive_torque, take_foot_off
from activesteer.errors import ManeuverError
from activesteer.native_blocks import NativeBlock
from activesteer.shared_laws import shared
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint, new_message

NO_RACK: Final = "the steering wheel of this car drives no rack; give steering_wheel_rad"


class OpenLoopDriver(NativeBlock):
    """A steering robot and a cruise control.

    Attributes:
        speed_hold: The cruise control.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        steering_wheel_limit_rad: Lock angle [rad].
    """

    speed_hold: SpeedHold
    steering_ratio: float
    steering_wheel_limit_rad: float

    def __init__(
        self,
        speed_hold: SpeedHold,
        steering_ratio: float,
        steering_wheel_limit_rad: float,
        rack_per_steering_wheel_m: float | None = None,
    ) -> None:
        """Make the driver of one run.

        Args:
            speed_hold: The cruise control.
            steering_ratio: Steering wheel angle over road-wheel angle [-].
            steering_wheel_limit_rad: Lock angle [rad].
            rack_per_steering_wheel_m: Rack travel per steering wheel angle [m/rad]; None without a rack.
        """
        self.speed_hold = speed_hold
        self.steering_ratio = steering_ratio
        self.steering_wheel_limit_rad = steering_wheel_limit_rad
        self._rack_per_steering_wheel_m = rack_per_steering_wheel_m

    @classmethod
    def from_vehicle(cls, setup: DriverSetup) -> OpenLoopDriver:
        """Make the driver for a car."""
        mass_kg = setup.single_track.mass_kg
        speed_hold = SpeedHold(setup.parameters, setup.drive, mass_kg, setup.wheel_radius_m, setup.timestep_s)
        return cls(speed_hold, setup.steering_ratio, setup.steering_wheel_limit_rad, setup.rack_per_steering_wheel_m)

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """Return the command; see `Driver`.

        Raises:
            ManeuverError: the setpoint is a rack position and the car has no rack.
        """
        if setpoint.rack_demand_m is None:
            return self.turn(setpoint.steering_wheel_demand_rad, setpoint, measurement)
        if self._rack_per_steering_wheel_m is None:
            raise ManeuverError(NO_RACK, key="steering.rack_m")
        return self.turn(setpoint.rack_demand_m / self._rack_per_steering_wheel_m, setpoint, measurement)

    def turn(self, angle: float, setpoint: Setpoint, measurement: Measurement) -> DriverCommand:
        """Return the command for a steering wheel angle [rad] in place of the angle of the setpoint."""
        speed_mps, drive = setpoint.speed_demand_mps, self.speed_hold.drive
        engine_radps, limits_Nm = 0.0, (0.0, 0.0)
        if setpoint.hold_speed:
            engine_radps = drive.speed_radps(measurement.wheel_speed_radps)
            limits_Nm = drive.limits_Nm(engine_radps, 1 if speed_mps >= 0.0 else -1)
        angle, torque, saturated, gear = turned(
            self, angle, setpoint.hold_speed, speed_mps, measurement.speed_mps, engine_radps, *limits_Nm
        )
        return new_message(DriverCommand, (
            angle, torque, setpoint.brake_pedal, saturated, setpoint.wheel_torques, gear,
            angle / self.steering_ratio, setpoint.parking_brake,
        ))  # fmt: skip


@shared
def turned(
    robot: OpenLoopDriver,
    angle: float,
    hold_speed: bool,
    speed_demand_mps: float,
    speed_mps: float,
    engine_radps: float,
    low_Nm: float,
    high_Nm: float,
) -> tuple[float, float, bool, int]:
    """Law of `OpenLoopDriver.turn`: steering wheel angle, drive torque, whether a limit is active, gear."""
    saturated = False
    if angle > robot.steering_wheel_limit_rad:
        angle, saturated = robot.steering_wheel_limit_rad, True
    elif angle < -robot.steering_wheel_limit_rad:
        angle, saturated = -robot.steering_wheel_limit_rad, True
    if not hold_speed:
        take_foot_off(robot.speed_hold)
        return angle, 0.0, saturated, 0
    torque = drive_torque(robot.speed_hold, speed_demand_mps, speed_mps, engine_radps, low_Nm, high_Nm)
    return angle, torque, saturated or robot.speed_hold.saturated != 0, 1 if speed_demand_mps >= 0.0 else -1
