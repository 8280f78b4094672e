"""The driver on a path: looks ahead and steers so that the car will be where the path is.

An optimal preview controller: with a single-track model of his car in mind, the driver finds the one steering angle
that, held over the preview time, leaves the least mean square distance between the path and where the car will be. It
is found anew whenever he looks, and reaches the steering wheel after a reaction delay, a neuromuscular lag, and within
limits of rate and angle.

Source: C. C. MacAdam, Application of an optimal preview control for simulation of closed-loop automobile driving,
IEEE Transactions on Systems, Man, and Cybernetics 11 (1981), 393-399.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from activesteer.compilation import compiled
from activesteer.conventions import Array
from activesteer.driver.open_loop import OpenLoopDriver
from activesteer.driver.parameters import DriverParameters
from activesteer.road.path import Path
from activesteer.road.path_search import PathSearch, nearest, point_at
from activesteer.signals import DriverCommand, Measurement, Motion, Reference

LateralModel = Callable[[float], tuple[Array, Array]]
"""Speed [m/s] -> system matrix (2, 2) and input matrix (2, k) of a model with the states yaw rate [rad/s] and sideslip
angle [rad], whose first input is the front steer angle [rad]."""

PREVIEW_INTERVAL_S: Final = 0.01
"""Time between two looks at the road [s]; short beside the delay and the lag that follow."""
_POINTS: Final = 12
"""Points on the path ahead at which the distance counts."""
_WINDOW_M: Final = 5.0
"""How far along the path the car can have come between two looks, with a margin [m]."""
_MIN_SPEED_MPS: Final = 3.0
"""Slower than this, the driver holds the steering wheel [m/s]."""
_SPEED_STEP_MPS: Final = 0.5
"""The driver's picture of his car is that of a speed rounded to this [m/s]."""


class _Preview(NamedTuple):
    """What the driver's model says of the points ahead.

    Attributes:
        times_s: When the car will pass them [s], shape (n,).
        by_yaw_rate_m: Lateral position then, of a yaw rate of 1 rad/s now, shape (n,).
        by_sideslip_m: The same of a sideslip angle of 1 rad now.
        by_steering_m: The same of a steer angle of 1 rad held from now on.
    """

    times_s: Array
    by_yaw_rate_m: Array
    by_sideslip_m: Array
    by_steering_m: Array


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
        self._preview_s = parameters.preview_s
        self._previews: dict[int, _Preview] = {}
        lag_s = parameters.neuromuscular_lag_s
        self._share = 1.0 - math.exp(-timestep_s / lag_s) if lag_s > 0.0 else 1.0
        self._most_change_rad = parameters.steering_rate_limit_radps * timestep_s
        self._decided_rad = deque([0.0] * (round(parameters.reaction_delay_s / PREVIEW_INTERVAL_S) + 1))
        self._wheel_rad = 0.0
        self._along_m = 0.0
        self._preview_every_steps = max(1, round(PREVIEW_INTERVAL_S / timestep_s))
        self._steps = 0

    def _update_preview(self, path: Path, motion: Motion) -> None:
        """Looks at the road ahead and decides on a steering wheel angle."""
        search = PathSearch(path)
        if motion.speed_mps < _MIN_SPEED_MPS:
            self._along_m = search.nearest(motion.x_m, motion.y_m, self._along_m, _WINDOW_M)
            self._decide(self._decided_rad[-1])
            return
        preview = self._preview(motion.speed_mps)
        self._along_m, angle = _best_steering(*motion, self._along_m, *search.line, *preview)
        self._decide(self.robot.steering_ratio * angle)

    def _decide(self, steering_wheel_rad: float) -> None:
        """Puts an angle into the line; what stands at its head is what the hands now begin to do."""
        self._decided_rad.append(steering_wheel_rad)
        self._decided_rad.popleft()

    def step(self, reference: Reference, measurement: Measurement, motion: Motion) -> DriverCommand:
        """What the driver does now.

        Args:
            reference: The path and the speed that are asked for; without a path he goes on as decided before.
            measurement: What the car's sensors say.
            motion: Where the car is and how it moves; looked at every `PREVIEW_INTERVAL_S`.

        Returns:
            The command.
        """
        if self._steps % self._preview_every_steps == 0 and reference.path is not None:
            self._update_preview(reference.path, motion)
        self._steps += 1
        change = self._share * (self._decided_rad[0] - self._wheel_rad)
        most = self._most_change_rad
        saturated = True
        if change > most:
            change = most
        elif change < -most:
            change = -most
        else:
            saturated = False
        wheel = self._wheel_rad + change
        command = self.robot.turn(wheel, reference, measurement)
        self._wheel_rad = command.steering_wheel_demand_rad
        return command._replace(saturated=True) if saturated else command

    def _preview(self, speed_mps: float) -> _Preview:
        """The model's answers at a speed; kept, because a run has few speeds."""
        rounded = round(speed_mps / _SPEED_STEP_MPS)
        found = self._previews.get(rounded)
        if found is None:
            found = self._previews[rounded] = _look_ahead(rounded * _SPEED_STEP_MPS, self._model, self._preview_s)
        return found


@compiled
def _best_steering(
    x, y, yaw, speed, lateral_speed, yaw_rate,
    around, spacing, xs, ys, heading_first, heading_last,
    times, by_yaw_rate, by_sideslip, by_steering,
):  # fmt: skip
    """Where the car is along the path, and the road-wheel angle that, held from now on, keeps it closest to the path.

    Args are the members of `Motion`, the arc length where the car last was [m], `PathSearch.line` and the members of
    `_Preview`.

    Returns:
        Arc length [m] and angle [rad], the latter in the least squares sense.
    """
    along = nearest(x, y, around, _WINDOW_M, spacing, xs, ys, heading_first, heading_last)
    cos, sin = math.cos(yaw), math.sin(yaw)
    sideslip = math.atan2(lateral_speed, speed)
    product, square = 0.0, 0.0
    for index in range(len(times)):
        ahead_x, ahead_y = point_at(along + speed * times[index], spacing, xs, ys, heading_first, heading_last)
        wanted = cos * (ahead_y - y) - sin * (ahead_x - x)
        missing = wanted - yaw_rate * by_yaw_rate[index] - sideslip * by_sideslip[index]
        product += missing * by_steering[index]
        square += by_steering[index] * by_steering[index]
    return along, product / square


class SteeringGains(NamedTuple):
    """What the driver steers, at the road wheel, for each unit by which the car is off a straight path.

    Attributes:
        per_offset_radpm: Per metre to the left of it [rad/m].
        per_heading: Per radian of heading [-].
        per_yaw_rate_s: Per yaw rate [rad/(rad/s)].
        per_sideslip: Per radian of sideslip [-].
    """

    per_offset_radpm: float
    per_heading: float
    per_yaw_rate_s: float
    per_sideslip: float


def steering_gains(speed_mps: float, model: LateralModel, preview_s: float) -> SteeringGains:
    """The preview driver's decision for small motions about a straight path: `_best_steering` with straight points.

    Args:
        speed_mps: Speed [m/s].
        model: The car as the driver knows it.
        preview_s: How far ahead he looks [s].
    """
    ahead = _look_ahead(round(speed_mps / _SPEED_STEP_MPS) * _SPEED_STEP_MPS, model, preview_s)
    weight = -ahead.by_steering_m / (ahead.by_steering_m @ ahead.by_steering_m)
    return SteeringGains(
        per_offset_radpm=float(weight.sum()),
        per_heading=float(weight @ ahead.times_s) * speed_mps,
        per_yaw_rate_s=float(weight @ ahead.by_yaw_rate_m),
        per_sideslip=float(weight @ ahead.by_sideslip_m),
    )


def _look_ahead(speed_mps: float, model: LateralModel, preview_s: float) -> _Preview:
    """Solves the model over the preview time, exactly for a steering angle that is held."""
    from scipy.linalg import expm  # noqa: PLC0415 - slow to import, and only a driver on a path needs it

    a, b = model(speed_mps)
    # States: yaw rate, sideslip angle, heading, lateral position; then the steering angle, which stays as it is.
    system = np.zeros((5, 5))
    system[:2, :2] = a
    system[:2, 4] = b[:, 0]
    system[2, 0] = 1.0
    system[3, 1:3] = speed_mps
    step_s = preview_s / _POINTS
    one_step = expm(system * step_s)
    transition = np.eye(5)
    lateral = np.empty((_POINTS, 5))
    for row in lateral:
        transition = one_step @ transition
        row[:] = transition[3]
    times_s = step_s * np.arange(1.0, _POINTS + 1.0, dtype=np.float64)
    return _Preview(times_s, lateral[:, 0].copy(), lateral[:, 1].copy(), lateral[:, 4].copy())
