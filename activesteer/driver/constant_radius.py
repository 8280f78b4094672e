"""The driver on a circle: turns the steering wheel until the path of the car has the desired curvature."""

from __future__ import annotations

from typing import Final

from activesteer.driver.open_loop import OpenLoopDriver
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint

_TIME_CONSTANT_S: Final = 0.5
"""Time constant for an error of the curvature [s]: slower than the car's answer, faster than the rise of the speed."""
_MIN_SPEED_MPS: Final = 1.0
"""Below this speed there is no correction: yaw rate over speed is not the curvature of the path [m/s]."""


class ConstantRadiusDriver:
    """Steering by curvature: Ackermann angle, and the integral of the curvature error.

    The measured curvature is yaw rate over speed: the curvature of the path while the sideslip angle is constant. The
    integral stands still while the steering wheel is at its stop.
    """

    def __init__(self, robot: OpenLoopDriver, wheelbase_m: float, timestep_s: float) -> None:
        """Make the driver of one run.

        Args:
            robot: Turns the steering wheel and holds the speed.
            wheelbase_m: Wheelbase [m].
            timestep_s: Time between two steps [s].
        """
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
        angle = robot.steering_ratio * self._wheelbase_m * (curvature + self._correction_1pm)
        command = robot.turn(angle, setpoint, measurement)
        if command.steering_wheel_demand_rad == angle and measurement.speed_mps > _MIN_SPEED_MPS:
            error = curvature - measurement.yaw_rate_radps / measurement.speed_mps
            self._correction_1pm += self._fraction * error
        return command
