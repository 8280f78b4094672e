"""The driver on a circle: turns the steering wheel until the path of the car has the desired curvature."""

from __future__ import annotations

from typing import Final

from activesteer.driver.open_loop import OpenLoopDriver
from activesteer.native_blocks import NativeBlock
from activesteer.shared_laws import shared
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint

_TIME_CONSTANT_S: Final = 0.5
"""Time constant for an error of the curvature [s]: slower than the car's answer, faster than the rise of the speed."""
_MIN_SPEED_MPS: Final = 1.0
"""Below this speed there is no correction: yaw rate over speed is not the curvature of the path [m/s]."""


class ConstantRadiusDriver(NativeBlock):
    """Steering by curvature: Ackermann angle, and the integral of the curvature error.

    The measured curvature is yaw rate over speed: the curvature of the path while the sideslip angle is constant. The
    integral stands still while the steering wheel is at its stop.
    """

    _wheelbase_m: float
    _fraction: float
    _correction_1pm: float

    def __init__(self, robot: OpenLoopDriver, wheelbase_m: float, timestep_s: float) -> None:
        """Make the driver of one run."""
        self.robot = robot
        self.speed_hold = robot.speed_hold
        self._wheelbase_m = wheelbase_m
        self._fraction = timestep_s / _TIME_CONSTANT_S
        self._correction_1pm = 0.0

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """Return the command; a setpoint without a curvature gives the steering wheel angle. See `Driver`."""
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
    """Integrate the curvature error; call it only while the steering wheel is not at its stop."""
    if speed_mps > _MIN_SPEED_MPS:
        block._correction_1pm += block._fraction * (curvature_1pm - yaw_rate_radps / speed_mps)
