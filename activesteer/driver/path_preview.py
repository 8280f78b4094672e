"""The driver on a path: a linear-quadratic regulator with preview.

The driver knows a single-track model of the car, the lag of the arms and the reaction delay. The regulator weighs the
offset from the path against the steering wheel rate, over all future time. The optimal steering is linear in the motion
of the car, in the pending decisions, and in the path at each time of the preview. Its gains are computed once for each
speed. The driver decides at every look. A decision reaches the steering wheel after the reaction delay and the
neuromuscular lag, within limits of rate and angle.

Sources: R. S. Sharp and V. Valtetsiotis, Optimal preview car steering control, Vehicle System Dynamics 35 supplement
(2001), 101-117; D. J. Cole, A. J. Pick and A. M. C. Odhams, Predictive and linear quadratic methods for potential
application to modelling driver steering control, Vehicle System Dynamics 44 (2006), 259-284.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.core.conventions import Array
from activesteer.core.signals import DriverCommand, Measurement, Motion, Setpoint
from activesteer.driver.base import DriverParameters
from activesteer.driver.open_loop import OpenLoopDriver
from activesteer.native.compilation import compiled
from activesteer.native.records import NativeBlock
from activesteer.native.shared_laws import shared
from activesteer.road.native_path import PathSearch, nearest, point_at

LateralModel = Callable[[float], tuple[Array, Array]]
"""Function from speed [m/s] to matrices (2, 2), (2, k) of yaw rate and sideslip; the first input is the front angle."""

PREVIEW_INTERVAL_S: Final = 0.01
"""Time between two looks at the road [s]; short compared with delay and lag."""
_WINDOW_M: Final = 5.0
"""Largest distance along the path between two looks, with a margin [m]."""
_MIN_SPEED_MPS: Final = 3.0
"""Speed below which the driver holds the steering wheel [m/s]."""
SPEED_STEP_MPS: Final = 0.5
"""Step to which the speed is rounded for the gains [m/s]."""
N_SPEEDS: Final = 402
"""Number of rounded speeds whose gains compiled code can use: to 200 m/s."""
_TANGENT: Final = 10
"""Number of looks in the last section of the preview, which gives the straight path beyond."""
_LEAST_LAG_S: Final = 1e-3
"""Lag of arms without a lag: a step of the engine [s]."""


class SteeringGains(NamedTuple):
    """Preview gains of the steering wheel angle."""

    per_yaw_rate_s: float
    per_sideslip: float
    per_angle: float
    per_waiting: Array  # of decisions, the newest first, shape (m,)
    per_path_radpm: Array  # of the path's distance to the left of the line straight ahead, now and at later looks


class PathPreviewDriver(NativeBlock):
    """Driver that follows a path.

    Attributes:
        robot: Driver that limits the steering wheel angle and holds the speed.
    """

    derived = ("_gains",)
    _fraction: float
    _most_change_rad: float
    _decided_rad: Array
    _target_rad: float
    _wheel_rad: float
    _along_m: float
    _preview_every_steps: int
    _steps: int
    _known: Array
    _row_size: int

    def __init__(
        self, robot: OpenLoopDriver, model: LateralModel, parameters: DriverParameters, timestep_s: float
    ) -> None:
        """Create the driver of one run.

        Args:
            robot: Driver that limits the steering wheel angle and holds the speed.
            model: The car as the driver knows it.
            parameters: The driver.
            timestep_s: Time between two steps [s].
        """
        self.robot = robot
        self._model = model
        self._parameters = parameters
        self._gains: dict[int, Array] = {}
        self._known, self._row_size = np.zeros(N_SPEEDS), 0
        lag_s = parameters.neuromuscular_lag_s
        self._fraction = 1.0 - math.exp(-timestep_s / lag_s) if lag_s > 0.0 else 1.0
        self._most_change_rad = parameters.steering_rate_limit_radps * timestep_s
        self._decided_rad = np.zeros(round(parameters.reaction_delay_s / PREVIEW_INTERVAL_S) + 1)
        self._target_rad = 0.0
        self._wheel_rad = 0.0
        self._along_m = 0.0
        self._preview_every_steps = max(1, round(PREVIEW_INTERVAL_S / timestep_s))
        self._steps = 0

    def gains_at(self, rounded: int) -> Array:
        """Return the gains at a speed in steps of `SPEED_STEP_MPS`, in one row, stored for compiled code."""
        row = self._gains.get(rounded)
        if row is None:
            gains = steering_gains(rounded * SPEED_STEP_MPS, self._model, self._parameters, self.robot.steering_ratio)
            row = self._gains[rounded] = np.concatenate([gains[:3], gains.per_waiting, gains.per_path_radpm])
            self._note(rounded, row)
        return row

    def _note(self, rounded: int, row: Array) -> None:
        if 0 <= rounded < N_SPEEDS:
            self._known.view(np.int64)[rounded] = row.ctypes.data
            self._row_size = row.size

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the attributes, and store the gains anew, because a copy has other memory."""
        self.__dict__.update(state)
        self._known = np.zeros(N_SPEEDS)
        for rounded, row in self._gains.items():
            self._note(rounded, row)

    def step(self, setpoint: Setpoint, measurement: Measurement, motion: Motion) -> DriverCommand:
        """Return the command of the driver. Without a path, the driver repeats the last decisions."""
        path = setpoint.path
        if self._steps % self._preview_every_steps == 0 and path is not None:
            decided = self._decided_rad
            gains = self.gains_at(round(motion.speed_mps / SPEED_STEP_MPS)) if looks(motion.speed_mps) else decided
            look(self, self.robot.steering_wheel_limit_rad, decided, *motion, *PathSearch(path).line, gains)
        self._steps += 1
        wheel, saturated = moved(self)
        command = self.robot.steer_to(wheel, setpoint, measurement)
        self._wheel_rad = command.steering_wheel_demand_rad
        return command._replace(saturated=True) if saturated else command


@shared
def looks(speed_mps: float) -> bool:
    """Return whether a driver looks ahead at a speed [m/s] and does not hold the steering wheel."""
    return speed_mps >= _MIN_SPEED_MPS


@shared
def look(
    block, limit_rad, decided, x, y, yaw, speed, lateral_speed, yaw_rate,
    spacing, xs, ys, heading_first, heading_last, gains,
):  # fmt: skip
    """Look at the path ahead, decide on a steering wheel angle, and apply the next pending decision."""
    if looks(speed):
        path = 2 + len(decided)  # as many gains as decisions that wait, behind the first three
        along, angle = _decide(
            x, y, yaw, speed, lateral_speed, yaw_rate,
            block._along_m, spacing, xs, ys, heading_first, heading_last,
            decided, block._wheel_rad, gains[0], gains[1], gains[2], gains[3:path], gains[path:],
        )  # fmt: skip
    else:
        along = nearest(x, y, block._along_m, _WINDOW_M, spacing, xs, ys, heading_first, heading_last)
        angle = decided[0]
    block._along_m = along
    for index in range(len(decided) - 1, 0, -1):
        decided[index] = decided[index - 1]
    decided[0] = min(max(angle, -limit_rad), limit_rad)
    block._target_rad = float(decided[-1])


@shared
def moved(block: PathPreviewDriver) -> tuple[float, bool]:
    """Return the next steering wheel angle [rad], and whether the arms are at their limit."""
    change = block._fraction * (block._target_rad - block._wheel_rad)
    most = block._most_change_rad
    saturated = True
    if change > most:
        change = most
    elif change < -most:
        change = -most
    else:
        saturated = False
    return block._wheel_rad + change, saturated


@compiled
def _decide(
    x, y, yaw, speed, lateral_speed, yaw_rate,
    around, spacing, xs, ys, heading_first, heading_last,
    decided, wheel, per_yaw_rate, per_sideslip, per_angle, per_waiting, per_path,
):  # fmt: skip
    """Return the arc length of the car along the path [m], and the driver's next steering wheel angle [rad]."""
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
    """Return the gains of a driver: a linear-quadratic regulator with preview, behind a known delay.

    The regulator minimises the sum over all future looks of e^2 + (T e')^2 + (d'/r)^2: offset e of the car from the
    path, its rate e', steering wheel rate d', T = `return_time_s` and r = `steering_rate_per_metre_radps`. Sharp and
    Valtetsiotis weigh the heading instead of e'. In a bend the car has a sideslip angle, and its heading would draw it
    off the path; the terms used here are 0 in a steady bend.

    A driver who looks at one point steers by its distance from the line straight ahead with the sum of these gains. The
    sum is right for a path that is shifted together with the car; the time of the point decides the damping.

    Beyond the preview the path is straight. Its gains follow without its points: a path that is shifted or turned
    together with the car requires the same steering, which gives the sum and the moment of the gains.
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
    """Return `steering_gains` from a cache whose key is the rows of the car's matrices."""
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
    # The weighed input is the mean rate over a period; decision = angle + rate * by_rate_s.
    by_rate_s = PREVIEW_INTERVAL_S / b[4, 0]
    a_rate, b_rate = a.copy(), b * by_rate_s
    a_rate[:, 4] += b[:, 0]
    errors = np.zeros((2, 5))
    errors[0, 3] = 1.0
    errors[1, 1:3] = parameters.return_time_s * speed_mps
    effort = np.array([[parameters.steering_rate_per_metre_radps**-2]])
    cost = solve_discrete_are(a_rate, b_rate, errors.T @ errors, effort)
    inverse = 1.0 / (effort + b_rate.T @ cost @ b_rate)
    feedback = (inverse @ b_rate.T @ cost @ a_rate)[0]
    closed = a_rate - b_rate * feedback
    # Cost of a point of the path, linear in the state; with every look it comes one place nearer. The course of the
    # path is the direction from the point at the car to the next one.
    waiting = round(parameters.reaction_delay_s / PREVIEW_INTERVAL_S)
    per_path = np.zeros(round(parameters.preview_s / PREVIEW_INTERVAL_S) + 1)
    by_course = parameters.return_time_s / PREVIEW_INTERVAL_S * errors[1]
    influence = errors[0] - by_course
    for index in range(waiting + 1, len(per_path)):
        per_path[index] = by_rate_s * inverse[0, 0] * (b_rate[:, 0] @ influence)
        influence = closed.T @ influence
        if index == waiting + 1:
            influence += by_course
    # A decision acts on the state after the delay, which follows from the present state and the decisions that wait.
    decision = -by_rate_s * feedback
    decision[4] += 1.0
    per_waiting = np.empty(waiting)
    for index in range(waiting):
        per_waiting[index] = decision @ b[:, 0]
        decision = decision @ a
    if parameters.preview_points == "one":
        per_path[:-1], per_path[-1] = 0.0, -decision[3]
        return SteeringGains(float(decision[0]), float(decision[1]), float(decision[4]), per_waiting, per_path)
    # Beyond the preview: all points together count as much as the car's own offset and heading.
    ahead = np.arange(float(len(per_path)))
    missing = -decision[3] - per_path.sum()
    lever = -decision[2] / (speed_mps * PREVIEW_INTERVAL_S) - per_path @ ahead - missing * ahead[-1]
    per_path[-1] += missing + lever / _TANGENT
    per_path[-1 - _TANGENT] -= lever / _TANGENT
    return SteeringGains(float(decision[0]), float(decision[1]), float(decision[4]), per_waiting, per_path)
