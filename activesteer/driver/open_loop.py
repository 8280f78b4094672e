"""Steering robots: open loop and constant radius."""

from __future__ import annotations

from typing import Final

from activesteer.core.signals import DriverCommand, Measurement, Motion, Setpoint, new_message
from activesteer.driver.base import DriverParameters, DriverSetup, Drivetrain
from activesteer.errors import ManeuverError
from activesteer.native.records import NativeBlock
from activesteer.native.shared_laws import shared

_STANDSTILL_MPS: Final = 0.05
"""Speed below which a car that is to stand needs no torque [m/s]."""


class SpeedHold(NativeBlock):
    """Speed control by drive torque and engine braking; a negative speed engages the reverse gear."""

    _gain_Nmspm: float
    _integral_gain_Nmpm: float
    _wheel_radius_m: float
    _spin_mps: float
    _spin_slip: float
    _keep: float
    _return: float
    _timestep_s: float
    _integral_Nm: float
    _pedal: float
    saturated: bool

    def __init__(
        self, parameters: DriverParameters, drive: Drivetrain, mass_kg: float, wheel_radius_m: float, timestep_s: float
    ) -> None:
        """Create the speed control of one run."""
        self._gain_Nmspm = parameters.speed_gain_1ps * mass_kg * wheel_radius_m
        self._integral_gain_Nmpm = parameters.speed_integral_gain_1ps2 * mass_kg * wheel_radius_m
        self.drive = drive
        self._wheel_radius_m = wheel_radius_m
        self._spin_mps = parameters.spin_mps
        self._spin_slip = parameters.spin_slip
        self._keep = max(0.0, 1.0 - timestep_s / parameters.foot_lag_s)
        self._return = parameters.foot_return_per_s * timestep_s
        self._timestep_s = timestep_s
        self._integral_Nm = 0.0
        self._pedal = 1.0
        self.saturated = False

    def step(self, speed_demand_mps: float, measurement: Measurement) -> float:
        """Return the total torque at the driven wheels for a speed [N m]."""
        engine_radps, gear = self.drive.speed_radps(measurement.wheel_speed_radps), 1 if speed_demand_mps >= 0.0 else -1
        limits_Nm = self.drive.limits_Nm(engine_radps, gear)
        return drive_torque(self, speed_demand_mps, measurement.speed_mps, engine_radps, *limits_Nm)

    def reset(self) -> None:
        """Reset the integral, for example when the driver lifts off the accelerator."""
        take_foot_off(self)


@shared
def drive_torque(
    hold: SpeedHold, speed_demand_mps: float, speed: float, engine_radps: float, low: float, high: float
) -> float:
    """Computation of `SpeedHold.step`."""
    if speed_demand_mps == 0.0 and abs(speed) < _STANDSTILL_MPS:
        take_foot_off(hold)
        return 0.0
    gear = 1 if speed_demand_mps >= 0.0 else -1
    error = speed_demand_mps - speed
    torque = hold._gain_Nmspm * error + hold._integral_Nm
    # Driven wheels that are too fast for the car spin. The driver releases the accelerator while they spin, and presses
    # it again slowly when they roll.
    overspeed = gear * (engine_radps * hold._wheel_radius_m - speed)
    spins = overspeed > hold._spin_mps + hold._spin_slip * abs(speed)
    if spins or hold._pedal < 1.0:
        most, demand = (high, torque) if gear > 0 else (-low, -torque)
        position = demand / most if most > 0.0 else 1.0
        # The driver takes the foot back from its position, not from the floor, or lets it return to the floor.
        held = max(min(hold._pedal, position), 0.0)
        hold._pedal = hold._keep * held if spins else min(1.0, hold._pedal + hold._return)
        if gear > 0:
            high *= hold._pedal
        else:
            low *= hold._pedal
    if torque > high:
        hold.saturated = True
        return high
    if torque < low:
        hold.saturated = True
        return low
    hold.saturated = False
    # The integral is frozen while a limit is active.
    hold._integral_Nm += hold._integral_gain_Nmpm * error * hold._timestep_s
    return torque


@shared
def take_foot_off(hold: SpeedHold) -> None:
    """Computation of `SpeedHold.reset`."""
    hold._integral_Nm = 0.0
    hold._pedal = 1.0
    hold.saturated = False


NO_RACK: Final = "the steering wheel of this car drives no rack; give steering_wheel_rad"


class OpenLoopDriver(NativeBlock):
    """A steering robot with a cruise control.

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
        """Create the driver of one run.

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
        """Create the driver for a car."""
        mass_kg = setup.single_track.mass_kg
        speed_hold = SpeedHold(setup.parameters, setup.drive, mass_kg, setup.wheel_radius_m, setup.timestep_s)
        return cls(speed_hold, setup.steering_ratio, setup.steering_wheel_limit_rad, setup.rack_per_steering_wheel_m)

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """Return the command (see `Driver`).

        Raises:
            ManeuverError: the setpoint is a rack position and the car has no rack.
        """
        if setpoint.rack_demand_m is None:
            return self.steer_to(setpoint.steering_wheel_demand_rad, setpoint, measurement)
        if self._rack_per_steering_wheel_m is None:
            raise ManeuverError(NO_RACK, key="steering.rack_m")
        return self.steer_to(setpoint.rack_demand_m / self._rack_per_steering_wheel_m, setpoint, measurement)

    def steer_to(self, angle: float, setpoint: Setpoint, measurement: Measurement) -> DriverCommand:
        """Return the command for a steering wheel angle [rad] that replaces the angle of the setpoint."""
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
    """Computation of `OpenLoopDriver.steer_to`, which also returns the gear and whether a limit is active."""
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


_TIME_CONSTANT_S: Final = 0.5
"""Time constant for a curvature error [s]: slower than the car's response, faster than the rise of the speed."""
_MIN_SPEED_MPS: Final = 1.0
"""Speed below which the correction is off: yaw rate over speed is not the curvature of the path there [m/s]."""


class ConstantRadiusDriver(NativeBlock):
    """Steering by curvature: Ackermann angle, and the integral of the curvature error."""

    _wheelbase_m: float
    _fraction: float
    _correction_1pm: float

    def __init__(self, robot: OpenLoopDriver, wheelbase_m: float, timestep_s: float) -> None:
        """Create the driver of one run."""
        self.robot = robot
        self._wheelbase_m = wheelbase_m
        self._fraction = timestep_s / _TIME_CONSTANT_S
        self._correction_1pm = 0.0

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """Return the command (see `Driver`). A setpoint without a curvature gives the steering wheel angle instead."""
        curvature = setpoint.curvature_demand_1pm
        if curvature is None:
            return self.robot.step(setpoint, measurement, motion)
        robot = self.robot
        angle = circle_angle(self, robot, curvature)
        command = robot.steer_to(angle, setpoint, measurement)
        if command.steering_wheel_demand_rad == angle:
            correct_circle(self, curvature, measurement.yaw_rate_radps, measurement.speed_mps)
        return command


@shared
def circle_angle(block: ConstantRadiusDriver, robot: OpenLoopDriver, curvature_1pm: float) -> float:
    """Return the steering wheel angle for a curvature [rad]."""
    return robot.steering_ratio * block._wheelbase_m * (curvature_1pm + block._correction_1pm)


@shared
def correct_circle(block: ConstantRadiusDriver, curvature_1pm: float, yaw_rate_radps: float, speed_mps: float) -> None:
    """Integrate the curvature error while the steering wheel is not at its stop."""
    # Yaw rate over speed is the curvature of the path while the sideslip angle is constant.
    if speed_mps > _MIN_SPEED_MPS:
        block._correction_1pm += block._fraction * (curvature_1pm - yaw_rate_radps / speed_mps)
