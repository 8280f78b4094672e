"""Envelope control: both axles by model predictive control within bounds on yaw rate and rear slip angle.

The car follows the driver within an envelope from which it can be steered back:

    |r| <= mu g / v                  no more yaw rate than the friction can hold
    |alpha_H| <= alpha_peak(mu)      the rear axle below the slip angle of its largest force

The controller uses the model of `lqr`. For an axle that slides, C alpha becomes s C_0 alpha + C_0 e, where s is the
present ratio of force to slip angle, constant over the horizon: an axle that is steered back loses force in proportion
to its slip angle. With the tangent, steering would have no effect.

In every call the programme

    minimise    sum over the horizon of ((r - r*) / r_s)^2 + (beta / beta_s)^2 + |(u - u*) / u_s|^2
                                       + |(u - u before) / d_s|^2 + slack
    subject to  the envelope, softened by a slack, angles within their limits, and the first ones within what the rates
    allow

is solved for angles that are constant in blocks, and the first angles are demanded. r* and u* are the turn of `lqr`.
The matrices depend only on speed and slopes; they are computed once for each point of a grid.

Sources: C. E. Beal and J. C. Gerdes, Model Predictive Control for Vehicle Stabilization at the Limits of Handling, IEEE
Transactions on Control Systems Technology 21 (4), 2013, and C. G. Bobier, J. C. Gerdes, Staying within the nullcline
boundary for vehicle envelope control using a sliding surface, Vehicle System Dynamics 51 (2), 2013: the envelope. Rear
steering, lags and blocks are added.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np

from activesteer.controllers.axle_slopes import AxleSlopes
from activesteer.controllers.desired_yaw_rate import MIN_SPEED_MPS
from activesteer.controllers.file_gains import MpcParameters
from activesteer.controllers.lqr import steady_turn
from activesteer.controllers.parameters import ControllerSetup
from activesteer.controllers.quadratic_programme import solver
from activesteer.controllers.turn_reference import TurnReference
from activesteer.conventions import GRAVITY_MPS2, Array
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters

STATES: Final = ("yaw_rate", "sideslip", "front", "rear", "superposition", "rear_actuator")
GIVEN: Final = ("front_intercept", "rear_intercept", "driver", "desired", "superposition_steady", "rear_steady",
                "superposition_before", "rear_before")  # fmt: skip
"""Given values behind the states, constant over the horizon."""
_SPEED_STEP_MPS: Final = 2.5
_SLOPES: Final = tuple(0.1 * tenth for tenth in range(1, 11))
"""Grid of s; e corrects the difference to the grid [-]."""
_BLOCKS: Final = (1, 2, 3, 6, 12)
"""Steps for which angles are constant; their sum is the horizon."""
_CHECKED_STEPS: Final = (2, 4, 7, 10, 13, 19, 25)
"""Steps at which the envelope holds."""
_SLACK_WEIGHT: Final = 1e7
"""Cost of leaving the envelope by a rad/s or a rad, squared: a hundred times the cost of a yaw rate error over the
whole horizon."""


class Problem(NamedTuple):
    """The programme at a speed and slopes; a call adds z, the states and given values.

    Attributes:
        hessian: Shape (n, n); the unknowns are the blocks' angles in pairs, then the two slacks.
        gradient: Gradient per z, shape (n, len(z)).
        rows: Bounded values per unknown, shape (m, n): envelope from above and from below.
        offsets: Bounded values per z, shape (m, len(z)).
    """

    hessian: Array
    gradient: Array
    rows: Array
    offsets: Array


class Mpc:
    """Front superposition and rear steering within an envelope."""

    interval_s = 0.01
    reads = ("mpc", "servos", "estimator")
    gains = MpcParameters

    def __init__(self, setup: ControllerSetup) -> None:
        """Make the controller of one run."""
        p, servos = setup.gains.mpc, setup.gains.servos
        self._parameters, self._servo_lag_s = p, servos.lag_s
        self._estimator, self._car, self._interval_s = setup.estimator(), setup.single_track, setup.timestep_s
        self._reference = TurnReference(self._car, p.reference_length_m, p.friction_fraction, setup.timestep_s)
        self._slopes, self._solve = AxleSlopes(setup), solver()
        self._limits_rad = np.array([servos.superposition_limit_rad, servos.rear_limit_rad])
        self._reach_rad = np.array([servos.superposition_rate_radps, servos.rear_rate_radps]) * setup.timestep_s
        self._front_rad = self._rear_rad = 0.0
        self._before_rad = np.zeros(2)

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> Mpc:
        """Make the controller for a car."""
        return cls(setup)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return both angles."""
        p, now = self._parameters, self._estimator.step(measurement)
        speed, driver = now.speed_mps, command.front_steer_demand_rad
        if speed < MIN_SPEED_MPS:
            self._before_rad = np.zeros(2)
            return ActuatorCommand(estimate=now)
        desired = self._reference.step(driver, speed, now.friction)
        added, turned = measurement.superposition_rad, measurement.rear_steer_rad
        fraction = -np.expm1(-self._interval_s * speed / p.relaxation_length_m)
        self._front_rad += fraction * (driver + added - self._front_rad)
        self._rear_rad += fraction * (turned - self._rear_rad)
        axles = self._slopes.axles(now, self._front_rad, self._rear_rad)
        slopes = [min(_SLOPES, key=lambda known, axle=axle: abs(known - axle.secant)) for axle in axles]
        cuts = [axle.force_rad - slope * axle.slip_angle_rad for axle, slope in zip(axles, slopes, strict=True)]
        grid_mps = max(_SPEED_STEP_MPS * round(speed / _SPEED_STEP_MPS), 2.0 * _SPEED_STEP_MPS)
        more = self._slopes.excess_rad(speed * desired, now.friction)
        gains = steady_gains(self._car, grid_mps)
        front, rear = (gain * desired + angle for gain, angle in zip(gains, more, strict=False))
        problem = envelope_problem(self._car, p, self._servo_lag_s, self._interval_s, grid_mps, *slopes)
        z = np.array([
            now.yaw_rate_radps, now.sideslip_rad, self._front_rad, self._rear_rad, added, turned,
            *cuts, driver, desired, front - driver, rear, *self._before_rad,
        ])  # fmt: skip
        blocks = len(_BLOCKS)
        least, most = (np.tile(side * self._limits_rad, blocks) for side in (-1.0, 1.0))
        least[:2] = np.clip(self._before_rad - self._reach_rad, -self._limits_rad, self._limits_rad)
        most[:2] = np.clip(self._before_rad + self._reach_rad, -self._limits_rad, self._limits_rad)
        bounds = np.array([now.friction * GRAVITY_MPS2 / speed, self._slopes.peak_rad(1, now.friction)])
        envelope = np.repeat(bounds, len(_CHECKED_STEPS))
        offset = problem.offsets @ z
        free = np.full(len(envelope), np.inf)
        lower = np.concatenate([least, [0.0, 0.0], -free, -envelope - offset[len(envelope) :]])
        upper = np.concatenate([most, [np.inf, np.inf], envelope - offset[: len(envelope)], free])
        solution = self._solve(problem.hessian, problem.gradient @ z, problem.rows, lower, upper)
        self._before_rad = solution[:2]
        added_demand, rear_demand = solution[:2].tolist()
        outside = bool(solution[-2:].max() > 1e-6)
        return ActuatorCommand(
            rear_demand, added_demand, desired, rear, rear_demand - rear, saturated=outside, estimate=now
        )


@lru_cache(maxsize=64)
def steady_gains(car: SingleTrackParameters, speed_mps: float) -> tuple[float, float, float]:
    """Return front angle, rear angle and sideslip of a steady turn per yaw rate; see `lqr.steady_turn`."""
    front, rear, sideslip = steady_turn(car, speed_mps)[:, 0].tolist()
    return front, rear, sideslip


@lru_cache(maxsize=512)
def envelope_problem(
    car: SingleTrackParameters,
    parameters: MpcParameters,
    servo_lag_s: float,
    interval_s: float,
    speed_mps: float,
    front_slope: float = 1.0,
    rear_slope: float = 1.0,
) -> Problem:
    """Return the programme at a speed and slopes.

    Args:
        car: The known car.
        parameters: Weights and relaxation length.
        servo_lag_s: Lag of both servos [s].
        interval_s: Time between two calls, the step of the model [s].
        speed_mps: Speed [m/s].
        front_slope: Force over slip angle of the front axle, 1 at zero slip angle [-].
        rear_slope: Force over slip angle of the rear axle, likewise [-].
    """
    p, size = parameters, len(STATES) + len(GIVEN)
    a, b = model(car, p, servo_lag_s, interval_s, speed_mps, front_slope, rear_slope)
    steps, unknowns = sum(_BLOCKS) + 1, 2 * len(_BLOCKS)
    block_of = np.repeat(np.arange(len(_BLOCKS)), _BLOCKS)
    r, beta, rear = (STATES.index(name) for name in ("yaw_rate", "sideslip", "rear"))
    desired, steady, before = len(STATES) + 3, len(STATES) + 4, len(STATES) + 6
    identity = np.eye(size)
    by_z, by_u = np.eye(size), np.zeros((size, unknowns))
    weighed: list[tuple[Array, Array]] = []
    bounded: dict[str, list[tuple[Array, Array]]] = {"yaw_rate": [], "slip": []}
    for step in range(1, steps + 1):
        by_z, by_u = a @ by_z, a @ by_u
        if step == 1:
            # The present demand acts from the next call on.
            by_z[:, before:] += b
            continue
        place = slice(2 * block_of[step - 2], 2 * block_of[step - 2] + 2)
        by_u[:, place] += b
        weighed.append(((by_z[r] - identity[desired]) / p.yaw_rate_scale_radps, by_u[r] / p.yaw_rate_scale_radps))
        weighed.append((by_z[beta] / p.sideslip_scale_rad, by_u[beta] / p.sideslip_scale_rad))
        for axle, scale in enumerate((p.superposition_scale_rad, p.rear_scale_rad)):
            own = np.zeros(unknowns)
            own[place.start + axle] = 1.0 / scale
            weighed.append((-identity[steady + axle] / scale, own))
        if step in _CHECKED_STEPS:
            bounded["yaw_rate"].append((by_z[r], by_u[r]))
            arm = car.cg_to_rear_m / speed_mps
            by_both = [each[rear] - each[beta] + arm * each[r] for each in (by_z, by_u)]
            bounded["slip"].append((by_both[0], by_both[1]))
    for block in range(len(_BLOCKS)):
        for axle in range(2):
            change = np.zeros(unknowns)
            change[2 * block + axle] = 1.0 / p.change_scale_rad
            if block:
                change[2 * (block - 1) + axle] = -1.0 / p.change_scale_rad
            from_before = -identity[before + axle] / p.change_scale_rad if not block else np.zeros(size)
            weighed.append((from_before, change))
    of_z, of_u = (np.array(part) for part in zip(*weighed, strict=True))
    hessian = np.diag([*np.zeros(unknowns), _SLACK_WEIGHT, _SLACK_WEIGHT])
    hessian[:unknowns, :unknowns] = of_u.T @ of_u
    gradient = np.zeros((unknowns + 2, size))
    gradient[:unknowns] = of_u.T @ of_z
    envelope = [*bounded["yaw_rate"], *bounded["slip"]]
    offsets, rows = (np.array(part) for part in zip(*envelope, strict=True))
    slack = np.repeat(np.eye(2), len(_CHECKED_STEPS), axis=0)
    both = np.vstack([np.hstack([rows, -slack]), np.hstack([rows, slack])])
    return Problem(hessian, gradient, both, np.vstack([offsets, offsets]))


def model(
    car: SingleTrackParameters,
    parameters: MpcParameters,
    servo_lag_s: float,
    interval_s: float,
    speed_mps: float,
    front_slope: float,
    rear_slope: float,
) -> tuple[Array, Array]:
    """Return the model of states and given values from one call to the next, for constant angles.

    Returns:
        System matrix over `STATES` and `GIVEN`; input matrix, inputs superposition and rear angle.
    """
    size = len(STATES) + len(GIVEN)
    softer = replace(
        car,
        front_stiffness_Nprad=front_slope * car.front_stiffness_Nprad,
        rear_stiffness_Nprad=rear_slope * car.rear_stiffness_Nprad,
        characteristic_speed_mps=speed_mps,  # not used; it does not exist while the rear axle slides
    )
    inner, both = np.zeros((size + 2, size + 2)), np.eye(2)
    inner[:2, :2], inner[:2, 2:4] = SingleTrack(softer).matrices(speed_mps)
    inner[:2, 6:8] = SingleTrack(car).matrices(speed_mps)[1]
    tyre_1ps, actuator_1ps = speed_mps / parameters.relaxation_length_m, 1.0 / servo_lag_s
    inner[2:4, 2:4], inner[2:4, 4:6] = -tyre_1ps * both, tyre_1ps * both
    inner[2, 8] = tyre_1ps
    inner[4:6, 4:6], inner[4:6, size:] = -actuator_1ps * both, actuator_1ps * both
    from scipy.linalg import expm  # noqa: PLC0415 - slow to import, and not every run needs it

    whole = np.array(expm(interval_s * inner), dtype=np.float64)
    return whole[:size, :size], whole[:size, size:]
