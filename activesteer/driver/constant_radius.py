"""The driver on a circle: turns the steering wheel until the car's path has the curvature that is asked for."""

from __future__ import annotations

from typing import Final

from activesteer.driver.open_loop import OpenLoopDriver
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint

_TIME_CONSTANT_S: Final = 0.5
"""Time in which an error of the curvature is steered away [s]: slower than the car answers, faster than speed rises."""
_MIN_SPEED_MPS: Final = 1.0
"""Below this speed yaw rate over speed says nothing about the path and no correction is made [m/s]."""


class ConstantRadiusDriver:
    """Steers by curvature: Ackermann angle, and the integral of what the measured curvature lacks.

    The measured curvature is yaw rate over speed, which is that of the path where the sideslip angle does not change.
    The integral stands still while the steering wheel is at its stop.
    """

    def __init__(self, robot: OpenLoopDriver, wheelbase_m: float, timestep_s: float) -> None:
        """Makes the driver of one run.

        Args:
            robot: Turns the steering wheel and holds the speed.
            wheelbase_m: Wheelbase [m].
            timestep_s: Time between two steps [s].
        """
        self.robot = robot
        self.speed_hold = robot.speed_hold
        self._wheelbase_m = wheelbase_m
        self._share = timestep_s / _TIME_CONSTANT_S
        self._correction_1pm = 0.0

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """What the driver does now.

        Args:
            setpoint: What is asked; without a curvature its steering wheel angle is taken.
            measurement: What the car's sensors say.
            motion: Not used.

        Returns:
            The command.
        """
        curvature = setpoint.curvature_demand_1pm
        if curvature is None:
            return self.robot.step(setpoint, measurement, motion)
        robot = self.robot
        angle = robot.steering_ratio * self._wheelbase_m * (curvature + self._correction_1pm)
        command = robot.turn(angle, setpoint, measurement)
        if command.steering_wheel_demand_rad == angle and measurement.speed_mps > _MIN_SPEED_MPS:
            error = curvature - measurement.yaw_rate_radps / measurement.speed_mps
            self._correction_1pm += self._share * error
        return command
