"""The driver on a path: knows his car, looks ahead, and steers as a linear-quadratic regulator with preview does.

With a single-track model of his car in mind, of his arms, and of the time that passes before they move, the driver
weighs how far he is off the path against how fast he turns the steering wheel, over all the time to come. What that
asks of him is linear in how the car moves, in what he has decided and not yet done, and in where the path is at each
moment of his preview; the gains are found once for each speed. He decides anew whenever he looks, and what he decides
reaches the steering wheel after the reaction delay, the neuromuscular lag, and within limits of rate and angle.

Sources: R. S. Sharp and V. Valtetsiotis, Optimal preview car steering control, Vehicle System Dynamics 35 supplement
(2001), 101-117; D. J. Cole, A. J. Pick and A. M. C. Odhams, Predictive and linear quadratic methods for potential
application to modelling driver steering control, Vehicle System Dynamics 44 (2006), 259-284.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from activesteer.compilation import compiled
from activesteer.conventions import Array
from activesteer.driver.open_loop import OpenLoopDriver
from activesteer.driver.parameters import DriverParameters
from activesteer.road.path import Path
from activesteer.road.path_search import PathSearch, nearest, point_at
from activesteer.signals import DriverCommand, Measurement, Motion, Setpoint

LateralModel = Callable[[float], tuple[Array, Array]]
"""Speed [m/s] -> system matrix (2, 2) and input matrix (2, k) of a model with the states yaw rate [rad/s] and sideslip
angle [rad], whose first input is the front steer angle [rad]."""

PREVIEW_INTERVAL_S: Final = 0.01
"""Time between two looks at the road [s]; short beside the delay and the lag that follow."""
_WINDOW_M: Final = 5.0
"""How far along the path the car can have come between two looks, with a margin [m]."""
_MIN_SPEED_MPS: Final = 3.0
"""Slower than this, the driver holds the steering wheel [m/s]."""
_SPEED_STEP_MPS: Final = 0.5
"""The driver's picture of his car is that of a speed rounded to this [m/s]."""
_TANGENT: Final = 10
"""Looks from the beginning to the end of the last piece of path, which goes on straight behind the preview."""
_LEAST_LAG_S: Final = 1e-3
"""Arms without a lag follow within a step of the engine [s]."""


class SteeringGains(NamedTuple):
    """What the driver decides to have at the steering wheel, for each unit of what he knows.

    Attributes:
        per_yaw_rate_s: Per yaw rate [rad/(rad/s)].
        per_sideslip: Per radian of sideslip [-].
        per_angle: Per radian at which the steering wheel stands [-].
        per_waiting: Per radian of the decisions that still wait, the newest first [-], shape (m,).
        per_path_radpm: Per metre by which the path lies to the left of the line straight ahead, at the car and at every
            look to come within the preview [rad/m], shape (n,).
    """

    per_yaw_rate_s: float
    per_sideslip: float
    per_angle: float
    per_waiting: Array
    per_path_radpm: Array


class PathPreviewDriver:
    """Follows a path.

    Attributes:
        robot: Limits the steering wheel angle and holds the speed.
    """

    def __init__(
        self, robot: OpenLoopDriver, model: LateralModel, parameters: DriverParameters, timestep_s: float
    ) -> None:
        """Makes the driver of one run.

        Args:
            robot: Limits the steering wheel angle and holds the speed.
            model: The car as the driver knows it.
            parameters: The driver.
            timestep_s: Time between two steps [s].
        """
        self.robot = robot
        self._model = model
        self._parameters = parameters
        self._gains: dict[int, SteeringGains] = {}
        lag_s = parameters.neuromuscular_lag_s
        self._share = 1.0 - math.exp(-timestep_s / lag_s) if lag_s > 0.0 else 1.0
        self._most_change_rad = parameters.steering_rate_limit_radps * timestep_s
        self._decided_rad = np.zeros(round(parameters.reaction_delay_s / PREVIEW_INTERVAL_S) + 1)
        self._acted_on_rad = 0.0
        self._wheel_rad = 0.0
        self._along_m = 0.0
        self._preview_every_steps = max(1, round(PREVIEW_INTERVAL_S / timestep_s))
        self._steps = 0

    def _update_preview(self, path: Path, motion: Motion) -> None:
        """Looks at the road ahead and decides on a steering wheel angle; the hands go on to the next decision."""
        search, decided = PathSearch(path), self._decided_rad
        if motion.speed_mps < _MIN_SPEED_MPS:
            self._along_m = search.nearest(motion.x_m, motion.y_m, self._along_m, _WINDOW_M)
            angle = float(decided[0])
        else:
            rounded = round(motion.speed_mps / _SPEED_STEP_MPS)
            gains = self._gains.get(rounded)
            if gains is None:
                speed_mps = rounded * _SPEED_STEP_MPS
                gains = steering_gains(speed_mps, self._model, self._parameters, self.robot.steering_ratio)
                self._gains[rounded] = gains
            self._along_m, angle = _decide(*motion, self._along_m, *search.line, decided, self._wheel_rad, *gains)
        decided[1:] = decided[:-1]
        decided[0] = min(max(angle, -self.robot.steering_wheel_limit_rad), self.robot.steering_wheel_limit_rad)
        self._acted_on_rad = float(decided[-1])

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """What the driver does now.

        Args:
            setpoint: The path and the speed that are asked for; without a path he goes on as decided before.
            measurement: What the car's sensors say.
            motion: Where the car is and how it moves; looked at every `PREVIEW_INTERVAL_S`.

        Returns:
            The command.
        """
        if self._steps % self._preview_every_steps == 0 and setpoint.path is not None:
            self._update_preview(setpoint.path, motion)
        self._steps += 1
        change = self._share * (self._acted_on_rad - self._wheel_rad)
        most = self._most_change_rad
        saturated = True
        if change > most:
            change = most
        elif change < -most:
            change = -most
        else:
            saturated = False
        wheel = self._wheel_rad + change
        command = self.robot.turn(wheel, setpoint, measurement)
        self._wheel_rad = command.steering_wheel_demand_rad
        return command._replace(saturated=True) if saturated else command


@compiled
def _decide(
    x, y, yaw, speed, lateral_speed, yaw_rate,
    around, spacing, xs, ys, heading_first, heading_last,
    decided, wheel, per_yaw_rate, per_sideslip, per_angle, per_waiting, per_path,
):  # fmt: skip
    """Where the car is along the path, and the steering wheel angle that the driver decides on.

    Args are the members of `Motion`, the arc length where the car last was [m], `PathSearch.line`, the decisions
    before this one, the newest first, and the steering wheel angle [rad], and the members of `SteeringGains`.

    Returns:
        Arc length [m] and angle [rad].
    """
    along = nearest(x, y, around, _WINDOW_M, spacing, xs, ys, heading_first, heading_last)
    cos, sin = math.cos(yaw), math.sin(yaw)
    angle = per_yaw_rate * yaw_rate + per_sideslip * math.atan2(lateral_speed, speed) + per_angle * wheel
    for index in range(len(per_waiting)):
        angle += per_waiting[index] * decided[index]
    for index in range(len(per_path)):
        ahead = along + speed * PREVIEW_INTERVAL_S * index
        ahead_x, ahead_y = point_at(ahead, spacing, xs, ys, heading_first, heading_last)
        angle += per_path[index] * (cos * (ahead_y - y) - sin * (ahead_x - x))
    return along, angle


def steering_gains(
    speed_mps: float, model: LateralModel, parameters: DriverParameters, steering_ratio: float
) -> SteeringGains:
    """The gains of a driver: a linear-quadratic regulator behind a delay that he knows, with preview.

    Minimised is the sum over all looks to come of e^2 + (T e')^2 + (d'/r)^2, with the offset e of the car from the
    path and its rate e', the steering wheel rate d', T = `return_time_s` and r = `steering_rate_per_metre_radps`.
    Sharp and Valtetsiotis weigh the heading in place of e'; in a bend the car has a sideslip angle, and its heading
    would draw it off the path. Here everything that is weighed is 0 in a steady bend.

    Behind the preview the path goes on straight. The gains of its points need not be known for that: a path that is
    moved aside or turned together with the car asks for the same steering, which gives their sum and their moment.

    Args:
        speed_mps: Speed [m/s].
        model: The car as the driver knows it.
        parameters: The driver.
        steering_ratio: Steering wheel angle over road-wheel angle [-].
    """
    car, steered = (tuple(matrix.ravel().tolist()) for matrix in model(speed_mps))
    return _steering_gains(speed_mps, car, steered, parameters, steering_ratio)


@lru_cache(maxsize=64)
def _steering_gains(
    speed_mps: float,
    car: tuple[float, ...],
    steered: tuple[float, ...],
    parameters: DriverParameters,
    steering_ratio: float,
) -> SteeringGains:
    """`steering_gains`, kept from one run to the next; the matrices of the car row by row."""
    from scipy.linalg import expm, solve_discrete_are  # noqa: PLC0415 - slow to import, and only this driver needs it

    # States: yaw rate, sideslip angle, heading, lateral position, steering wheel angle; then the decision, held.
    system = np.zeros((6, 6))
    system[:2, :2] = np.reshape(car, (2, 2))
    system[:2, 4] = np.reshape(steered, (2, -1))[:, 0] / steering_ratio
    system[2, 0] = 1.0
    system[3, 1:3] = speed_mps
    lag_s = max(parameters.neuromuscular_lag_s, _LEAST_LAG_S)
    system[4, 4], system[4, 5] = -1.0 / lag_s, 1.0 / lag_s
    period = expm(system * PREVIEW_INTERVAL_S)[:5]
    a, b = period[:, :5], period[:, 5:]
    # The input that is weighed is the mean rate over a period; decision = angle + rate * by_rate_s.
    by_rate_s = PREVIEW_INTERVAL_S / b[4, 0]
    a_rate, b_rate = a.copy(), b * by_rate_s
    a_rate[:, 4] += b[:, 0]
    wrong = np.zeros((2, 5))
    wrong[0, 3] = 1.0
    wrong[1, 1:3] = parameters.return_time_s * speed_mps
    effort = np.array([[parameters.steering_rate_per_metre_radps**-2]])
    cost = solve_discrete_are(a_rate, b_rate, wrong.T @ wrong, effort)
    inverse = 1.0 / (effort + b_rate.T @ cost @ b_rate)
    feedback = (inverse @ b_rate.T @ cost @ a_rate)[0]
    closed = a_rate - b_rate * feedback
    # What a point of the path adds to the cost, linear in the state; it comes nearer by one place with every look. The
    # course of the path is that from the point at the car to the next one.
    waiting = round(parameters.reaction_delay_s / PREVIEW_INTERVAL_S)
    per_path = np.zeros(round(parameters.preview_s / PREVIEW_INTERVAL_S) + 1)
    by_course = parameters.return_time_s / PREVIEW_INTERVAL_S * wrong[1]
    influence = wrong[0] - by_course
    for index in range(waiting + 1, len(per_path)):
        per_path[index] = by_rate_s * inverse[0, 0] * (b_rate[:, 0] @ influence)
        influence = closed.T @ influence
        if index == waiting + 1:
            influence += by_course
    # What he decides acts on the state after the delay: predicted from the state now and the decisions that wait.
    decision = -by_rate_s * feedback
    decision[4] += 1.0
    per_waiting = np.empty(waiting)
    for index in range(waiting):
        per_waiting[index] = decision @ b[:, 0]
        decision = decision @ a
    # Behind the preview: all points together are worth what the car's own offset and heading are.
    ahead = np.arange(float(len(per_path)))
    missing = -decision[3] - per_path.sum()
    lever = -decision[2] / (speed_mps * PREVIEW_INTERVAL_S) - per_path @ ahead - missing * ahead[-1]
    per_path[-1] += missing + lever / _TANGENT
    per_path[-1 - _TANGENT] -= lever / _TANGENT
    return SteeringGains(float(decision[0]), float(decision[1]), float(decision[4]), per_waiting, per_path)
