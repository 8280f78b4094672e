"""The open-loop driver: sets the steering wheel angle, holds the speed, presses the brake."""

from __future__ import annotations

from activesteer.driver.base import DriverSetup
from activesteer.driver.speed_hold import SpeedHold
from activesteer.errors import ManeuverError
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint, new_message


class OpenLoopDriver:
    """A steering robot and a cruise control.

    Attributes:
        speed_hold: The cruise control.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
        steering_wheel_limit_rad: Lock angle [rad].
    """

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
            raise ManeuverError(
                "the steering wheel of this car drives no rack; give steering_wheel_rad", key="steering.rack_m"
            )
        return self.turn(setpoint.rack_demand_m / self._rack_per_steering_wheel_m, setpoint, measurement)

    def turn(self, angle: float, setpoint: Setpoint, measurement: Measurement) -> DriverCommand:
        """Return the command for a steering wheel angle [rad] in place of the angle of the setpoint."""
        saturated = False
        if angle > self.steering_wheel_limit_rad:
            angle, saturated = self.steering_wheel_limit_rad, True
        elif angle < -self.steering_wheel_limit_rad:
            angle, saturated = -self.steering_wheel_limit_rad, True
        if setpoint.hold_speed:
            speed_mps, hold = setpoint.speed_demand_mps, self.speed_hold
            torque = hold.step(speed_mps, measurement)
            saturated = saturated or hold.saturated
            gear = 1 if speed_mps >= 0.0 else -1
        else:
            self.speed_hold.reset()
            torque, gear = 0.0, 0
        return new_message(DriverCommand, (
            angle, torque, setpoint.brake_pedal, saturated, setpoint.wheel_torques, gear,
            angle / self.steering_ratio, setpoint.parking_brake,
        ))  # fmt: skip
