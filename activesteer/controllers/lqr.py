"""Front and rear wheels together: a linear-quadratic regulator about the turn that the driver demands.

The model is the single-track model (eqs. 1 and 2), with tyres that lag by their relaxation length s and actuators that
lag by T_a, whose commands take effect one call later:

    d/dt [r, beta] = A(v) [r, beta] + B(v) [f, g]      yaw rate, sideslip; lagged front and rear angle
    s/v df/dt = delta_V + a - f                        front: driver's angle and superposition a
    s/v dg/dt = delta_H - g                            rear
    T_a da/dt = u_a - a,  T_a ddelta_H/dt = u_H - delta_H

The desired turn has the car's own steady-state yaw rate for the driver's angle (eq. 3), limited by the friction (eq.
6), and no sideslip. Its angles f*, g* solve 0 = A [r*, 0] + B [f*, g*]. `AxleSlopes.excess_rad` adds the slip angles
that the axles need because their curves are not straight: without them a car near its limit slides outwards. While the
driver brakes, both angles also compensate the yaw moment M of the brakes, known from their pressures, without a side
force:

    f* - M / (l C_V),  g* + M / (l C_H)

u* are the angles of the turn at the time when the present demand takes effect, a lag T_a and a call ahead. The law is

    u = u* - K(v) (x - x*),        x = (r, beta, f, g, a, delta_H, u before)

with K from python-control's `dlqr`, which minimises the sum of (x - x*)' Q (x - x*) + (u - u*)' R (u - u*). Q and R
hold the inverse squares of the errors and angles that cost the same (Bryson's rule). K is computed at several speeds
and interpolated. The estimator gives yaw rate and sideslip, sensors give the actuators, and the model gives f and g.

If an actuator has failed, its angle is given: f* or g* is then its position. The other angle and the unavoidable
sideslip beta* solve 0 = A [r*, beta*] + B [f*, g*], and K is computed for the other actuator alone.

The model is valid up to about 6 Hz, where body, suspensions and steering column move. R is chosen for a slower loop:
its disk margin, opened at both demands, is to be at least 0.5 from 60 to 160 km/h. This holds for the estimator with
ideal sensors, which it follows at once, and with production sensors (`activesteer margins -c lqr`).

Sources: B. D. O. Anderson and J. B. Moore, Optimal Control: Linear Quadratic Methods, 1989; both axles for yaw rate and
zero sideslip: M. Abe, Vehicle Handling Dynamics, 2009, chapter 8.
"""

from __future__ import annotations

import itertools
import math
from functools import lru_cache
from operator import mul
from typing import Final, NamedTuple

import numpy as np

from activesteer.controllers.axle_slopes import AxleSlopes
from activesteer.controllers.confidence import ConfidenceMonitor, bounded
from activesteer.controllers.desired_yaw_rate import MIN_SPEED_MPS
from activesteer.controllers.esc import brake_levers
from activesteer.controllers.file_gains import LqrParameters
from activesteer.controllers.parameters import ControllerSetup
from activesteer.controllers.turn_reference import TurnReference
from activesteer.conventions import Array
from activesteer.signals import NO_BRAKES, ActuatorCommand, DriverCommand, Estimate, Measurement
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters

SPEED_STEP_MPS: Final = 5.0
SPEEDS_MPS: Final = tuple(SPEED_STEP_MPS * (number + 1) for number in range(14))
"""Speeds at which the gains are computed, evenly spaced [m/s]; outside them the nearest speed counts."""
STATES: Final = ("yaw_rate", "sideslip", "front", "rear", "superposition", "rear_actuator", "superposition_before",
                 "rear_before")  # fmt: skip
"""States of the model; the angles in pairs, front before rear."""
BOTH: Final = (True, True)
"""Both actuators work: superposition, rear steering."""
_STEADY: Final = 6
"""Number of values of the steady turn in a row of the schedule, before the rows of K."""
_FULL_MPS: Final = 8.0
"""Speed from which the controller acts fully; below it fades out until `MIN_SPEED_MPS` [m/s]."""


class Turn(NamedTuple):
    """The desired turn and the angles for it: superposition and rear angle.

    Attributes:
        estimate: Estimate of the motion.
        desired_radps: Desired yaw rate [rad/s].
        sideslip_rad: Steady-state sideslip angle [rad].
        steady_rad: Steady-state angles [rad].
        demand_rad: Angles that the state feedback demands, without limits [rad].
        against_rad: Limit of the superposition against the driver's angle [rad].
    """

    estimate: Estimate
    desired_radps: float
    sideslip_rad: float
    steady_rad: tuple[float, float]
    demand_rad: tuple[float, float]
    against_rad: float


class Lqr:
    """Rear steering and front superposition by one state feedback."""

    interval_s = 0.005
    reads = ("lqr", "servos", "estimator")
    gains = LqrParameters
    derived = ("_schedules",)

    def __init__(self, setup: ControllerSetup) -> None:
        """Make the controller of one run."""
        p = self._parameters = setup.gains.lqr
        self._servos = setup.gains.servos
        self._estimator = setup.estimator()
        self._confidence = ConfidenceMonitor(setup, self._estimator)
        self._car, self._interval_s = setup.single_track, setup.timestep_s
        self._reference = TurnReference(self._car, p.reference_length_m, p.friction_fraction, setup.timestep_s)
        self._curves = AxleSlopes(setup)
        self._schedules: dict[tuple[bool, bool], list[list[tuple[float, float]]]] = {}
        self._front_rad = self._rear_rad = 0.0
        self._before = 0.0, 0.0
        known, (front, rear) = setup.estimation, brake_levers(setup)
        assert known is not None  # an estimator exists
        self._torque_per_pressure_NmpPa = known.brake_torque_per_pressure_NmpPa
        self._moment_per_torque = 1.0 / front, -1.0 / front, 1.0 / rear, -1.0 / rear
        wheelbase_m = self._car.wheelbase_m
        self._compensation_radpNm = (
            -1.0 / (wheelbase_m * self._car.front_stiffness_Nprad),
            1.0 / (wheelbase_m * self._car.rear_stiffness_Nprad),
        )

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> Lqr:
        """Make the controller for a car."""
        return cls(setup)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return both angles."""
        servos, turn = self._servos, self.turn(command, measurement)
        speed_mps = turn.estimate.speed_mps
        if speed_mps < MIN_SPEED_MPS:
            self.apply(0.0, 0.0)
            return ActuatorCommand(estimate=turn.estimate)
        fade = min((speed_mps - MIN_SPEED_MPS) / (_FULL_MPS - MIN_SPEED_MPS), 1.0)
        added_demand, rear_demand = (fade * angle for angle in turn.demand_rad)
        driver = command.front_steer_demand_rad
        added = bounded(added_demand, driver, turn.against_rad, servos.superposition_limit_rad)
        rear = min(max(rear_demand, -servos.rear_limit_rad), servos.rear_limit_rad)
        self.apply(added, rear)
        saturated = (added, rear) != (added_demand, rear_demand)
        steady = turn.steady_rad[1]
        return ActuatorCommand(
            rear, added, turn.desired_radps, steady, rear - steady, saturated, estimate=turn.estimate
        )

    def turn(
        self,
        command: DriverCommand,
        measurement: Measurement,
        works: tuple[bool, bool] = BOTH,
        own_brakes_Nm: tuple[float, float, float, float] = NO_BRAKES,
    ) -> Turn:
        """Return the desired turn and the demands of the state feedback, all zero below walking speed.

        Args:
            command: Command of the driver.
            measurement: Measurement of the car's sensors.
            works: Whether superposition and rear steering work.
            own_brakes_Nm: Brake torques demanded by the controller itself, order of `CORNERS` [Nm].
        """
        p, now = self._parameters, self._estimator.step(measurement)
        speed, driver = now.speed_mps, command.front_steer_demand_rad
        confidence = self._confidence.step(now)
        if speed < MIN_SPEED_MPS:
            return Turn(now, 0.0, 0.0, (0.0, 0.0), (0.0, 0.0), 0.0)
        desired = self._reference.step(driver, speed, now.friction + p.friction_deviations * now.friction_std)
        added, turned = measurement.superposition_rad, measurement.rear_steer_rad
        # The tyres follow the angles over their relaxation length.
        fraction = -math.expm1(-self._interval_s * speed / p.relaxation_length_m)
        self._front_rad += fraction * (driver + added - self._front_rad)
        self._rear_rad += fraction * (turned - self._rear_rad)
        row = self._gains(works, speed)
        given = 0.0 if works[0] and works[1] else driver + added if works[1] else turned
        front, rear, sideslip = self._steady(row, works, given, desired, now)
        # The present demand takes effect a call and a lag later.
        coming = self._reference.ahead(self._servos.lag_s + self._interval_s)
        next_front, next_rear, _ = self._steady(row, works, given, coming, now)
        brake_front, brake_rear = 0.0, 0.0
        if command.brake_pedal > 0.0 and works[0] and works[1]:
            moment_Nm = self._brakes_moment(measurement, own_brakes_Nm)
            brake_front, brake_rear = (moment_Nm * angle for angle in self._compensation_radpNm)
        front, rear = front + brake_front, rear + brake_rear
        steady = front - driver, rear
        held = next_front + brake_front - driver, next_rear + brake_rear
        errors = (
            now.yaw_rate_radps - desired,
            now.sideslip_rad - sideslip,
            self._front_rad - front,
            self._rear_rad - rear,
            added - steady[0],
            turned - rear,
            self._before[0] - held[0],
            self._before[1] - held[1],
        )
        second = _STEADY + len(errors)
        demand = (
            confidence.authority * (held[0] - sum(map(mul, row[_STEADY:second], errors))),
            confidence.authority * (held[1] - sum(map(mul, row[second:], errors))),
        )
        most = self._servos.superposition_limit_rad
        against = p.against_driver_rad + confidence.friction * max(most - p.against_driver_rad, 0.0)
        return Turn(now, desired, sideslip, steady, demand, against)

    def _steady(
        self, row: list[float], works: tuple[bool, bool], given_rad: float, yaw_rate_radps: float, now: Estimate
    ) -> tuple[float, float, float]:
        """Return front angle, rear angle and sideslip of a steady turn, for a row of the schedule [rad]."""
        front_r, front_g, rear_r, rear_g, sideslip_r, sideslip_g = row[:_STEADY]
        ay_mps2 = now.speed_mps * yaw_rate_radps
        front_more, rear_more = self._curves.excess_rad(ay_mps2, now.friction)
        # An axle with a given angle gets its additional slip angle from the sideslip, and the other axle follows.
        less = 0.0 if works[0] and works[1] else rear_more if works[0] else front_more
        front = front_r * yaw_rate_radps + front_g * given_rad + front_more - less
        rear = rear_r * yaw_rate_radps + rear_g * given_rad + rear_more - less
        return front, rear, sideslip_r * yaw_rate_radps + sideslip_g * given_rad - less

    def _brakes_moment(self, measurement: Measurement, own_Nm: tuple[float, float, float, float]) -> float:
        """Return the yaw moment of the driver's brakes from their pressures [Nm]."""
        moment_Nm = 0.0
        for arm, per_pressure, pressure, own in zip(
            self._moment_per_torque, self._torque_per_pressure_NmpPa, measurement.brake_pressure_Pa, own_Nm, strict=True
        ):
            moment_Nm += arm * max(per_pressure * pressure - own, 0.0)
        return moment_Nm

    def apply(self, superposition_rad: float, rear_rad: float) -> None:
        """Store the final demands of the actuators; for a failed actuator its position."""
        self._before = superposition_rad, rear_rad

    def _gains(self, works: tuple[bool, bool], speed_mps: float) -> list[float]:
        """Interpolate the schedule at a speed."""
        if (lines := self._schedules.get(works)) is None:
            rows = schedule(self._car, self._parameters, self._servos.lag_s, self._interval_s, works)
            lines = [[(a, b - a) for a, b in zip(*ends, strict=True)] for ends in itertools.pairwise(rows)]
            self._schedules[works] = lines
        place = min(max(speed_mps / SPEED_STEP_MPS - 1.0, 0.0), len(lines) - 1e-6)
        index = int(place)
        part = place - index
        return [start + part * rise for start, rise in lines[index]]


@lru_cache(maxsize=64)
def schedule(
    car: SingleTrackParameters,
    parameters: LqrParameters,
    servo_lag_s: float,
    interval_s: float,
    works: tuple[bool, bool] = BOTH,
) -> tuple[tuple[float, ...], ...]:
    """Return the gains at `SPEEDS_MPS`.

    Args:
        car: The known car.
        parameters: Weights and relaxation length.
        servo_lag_s: Lag of both servos [s].
        interval_s: Time between two calls [s].
        works: Whether superposition and rear steering work.

    Returns:
        For each speed: front angle, rear angle and sideslip, each per desired yaw rate [s] and per given angle [-];
        then the rows of K for superposition and rear angle, in the order of `STATES`.
    """
    return tuple(
        (
            *steady_turn(car, speed_mps, works, in_phase=True).ravel().tolist(),
            *feedback(car, parameters, servo_lag_s, speed_mps, interval_s, works).ravel().tolist(),
        )
        for speed_mps in SPEEDS_MPS
    )


def steady_turn(
    car: SingleTrackParameters, speed_mps: float, works: tuple[bool, bool] = BOTH, *, in_phase: bool = False
) -> Array:
    """Return front angle, rear angle and sideslip of a steady turn; with both actuators there is no sideslip.

    Args:
        car: The known car.
        speed_mps: Speed [m/s].
        works: Whether superposition and rear steering work.
        in_phase: Whether the rear wheels never turn out of phase, which would swing the tail out of the lane: below the
            speed at which the sideslip of the car with straight rear wheels changes sign, the turn has that sideslip.

    Returns:
        Shape (3, 2): each per yaw rate and per given angle of an axle.
    """
    a, b = SingleTrack(car).matrices(speed_mps)
    turn = np.zeros((3, 2))
    if works == BOTH:
        if in_phase:  # the unknowns are front angle and sideslip, for straight rear wheels
            turn[2, 0] = max(float(np.linalg.solve(np.column_stack([b[:, 0], a[:, 1]]), -a[:, 0])[1]), 0.0)
        turn[:2, 0] = np.linalg.solve(b, -a[:, 0] - a[:, 1] * turn[2, 0])
        return turn
    axle = 0 if works[0] else 1
    # The unknowns are the angle of the axle that can still be steered, and the sideslip.
    system = np.column_stack([b[:, axle], a[:, 1]])
    turn[[axle, 2]] = np.linalg.solve(system, -np.column_stack([a[:, 0], b[:, 1 - axle]]))
    turn[1 - axle, 1] = 1.0
    return turn


def model(
    car: SingleTrackParameters, parameters: LqrParameters, servo_lag_s: float, speed_mps: float, interval_s: float
) -> tuple[Array, Array]:
    """Return the model from one call to the next, for constant inputs.

    Returns:
        System matrix, shape (8, 8) over `STATES`; input matrix, shape (8, 2), inputs superposition and rear angle.
    """
    inner, both = np.zeros((8, 8)), np.eye(2)
    inner[:2, :2], inner[:2, 2:4] = SingleTrack(car).matrices(speed_mps)
    tyre_1ps, actuator_1ps = speed_mps / parameters.relaxation_length_m, 1.0 / servo_lag_s
    inner[2:4, 2:4], inner[2:4, 4:6] = -tyre_1ps * both, tyre_1ps * both
    inner[4:6, 4:6], inner[4:6, 6:] = -actuator_1ps * both, actuator_1ps * both
    from scipy.linalg import expm  # noqa: PLC0415 - slow to import, and not every run needs it

    a, b = np.array(expm(interval_s * inner), dtype=np.float64), np.zeros((8, 2))
    # The command of this call acts in the next interval: in this one it only replaces the command before.
    a[6:] = 0.0
    b[6:] = both
    return a, b


def feedback(
    car: SingleTrackParameters,
    parameters: LqrParameters,
    servo_lag_s: float,
    speed_mps: float,
    interval_s: float,
    works: tuple[bool, bool] = BOTH,
) -> Array:
    """Return K at a speed, shape (2, 8): superposition and rear angle per deviation of `STATES`; 0 if failed."""
    import control  # noqa: PLC0415 - takes longer to import than a run takes to start

    a, b = model(car, parameters, servo_lag_s, speed_mps, interval_s)
    q = np.zeros((8, 8))
    q[0, 0], q[1, 1] = parameters.yaw_rate_scale_radps**-2, parameters.sideslip_scale_rad**-2
    weights = np.array([parameters.superposition_scale_rad**-2, parameters.rear_scale_rad**-2])
    gains, used = np.zeros((2, 8)), [axle for axle in range(2) if works[axle]]
    if used:
        gains[used], _, _ = control.dlqr(a, b[:, used], q, np.diag(weights[used]))
    return gains
