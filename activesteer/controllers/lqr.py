"""Linear-quadratic regulator of front and rear wheels about the turn that the driver demands.

The model is the single-track model (eqs. 1 and 2), with tyres that lag by their relaxation length s and actuators that
lag by T_a, whose commands take effect one call later:

    d/dt [r, beta] = A(v) [r, beta] + B(v) [f, g]      yaw rate, sideslip; lagged front and rear angle
    s/v df/dt = delta_V + a - f                        front: driver's angle and superposition a
    s/v dg/dt = delta_H - g                            rear
    T_a da/dt = u_a - a,  T_a ddelta_H/dt = u_H - delta_H

The desired turn has the car's own steady-state yaw rate for the driver's angle (eq. 3), limited by the friction (eq.
6), and no sideslip. Its angles f*, g* solve 0 = A [r*, 0] + B [f*, g*]. `axle_slopes.excess` adds the slip angles
that the axles need because their curves are not straight: without them a car near its limit slides outwards. While the
driver brakes, both angles also compensate the yaw moment M of the brakes, known from their pressures, without a side
force:

    f* - M / (l C_V),  g* + M / (l C_H)

In a steady turn, snow looks like dry road with soft tyres, and a car with soft front tyres turns less. If it were
steered to the turn of new tyres, its rear axle could slide on snow. Therefore, as far as the friction is unknown, a car
that understeers more by its estimated stiffnesses keeps its own turn: the front wheels get the additional slip angle.
Both axles then turn by the same angle, which leaves the yaw rate as it is.

A car with worse rear tyres than those of its file may not bear the desired turn although the estimated friction does.
Therefore the superposition into the turn fades once the desired turn has been at the limit of the known friction for a
time. A lane change is over before.

u* are the angles of the turn at the time when the current demand takes effect, a lag T_a and a call ahead. The law is

    u = u* - K(v) (x - x*),        x = (r, beta, f, g, a, delta_H, u before)

with K from python-control's `dlqr`, which minimises the sum of (x - x*)' Q (x - x*) + (u - u*)' R (u - u*). Q and R
hold the inverse squares of the errors and angles that cost the same (Bryson's rule). K is computed at several speeds
and interpolated. The estimator gives yaw rate and sideslip, sensors give the actuators, and the model gives f and g.

If an actuator has failed, its angle is given: f* or g* is then its position. The other angle and the unavoidable
sideslip beta* solve 0 = A [r*, beta*] + B [f*, g*], and K is computed only for the other actuator.

The model is valid up to about 6 Hz, where body, suspensions and steering column move. R is chosen for a slower loop:
its disk margin, opened at both demands, is to be at least 0.5 from 60 to 160 km/h. This holds for the estimator with
ideal sensors, which it follows at once, and with production sensors (`activesteer linearise --loop controller -c lqr`).

Sources: B. D. O. Anderson and J. B. Moore, Optimal Control: Linear Quadratic Methods, 1989; both axles for yaw rate and
zero sideslip: M. Abe, Vehicle Handling Dynamics, 2009, chapter 8.
"""

from __future__ import annotations

import math
from array import array
from functools import lru_cache
from itertools import chain
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np

from activesteer.controllers.allocation import Allocation, allocated, moment_change
from activesteer.controllers.axle_slopes import AxleSlopes, excess
from activesteer.controllers.corrector import MIN_SPEED_MPS
from activesteer.controllers.esc import brake_levers
from activesteer.controllers.parameters import ControllerSetup, LqrParameters
from activesteer.controllers.turn_reference import (
    ConfidenceMonitor,
    TurnReference,
    confidence,
    desired_ahead,
    desired_turn,
)
from activesteer.core.conventions import GRAVITY_MPS2, Array
from activesteer.core.signals import (
    NO_BRAKES,
    ActuatorCommand,
    DriverCommand,
    Estimate,
    Measurement,
    PerWheel,
    steering,
)
from activesteer.estimation.estimator import Estimator
from activesteer.native.records import NativeBlock, Table, table
from activesteer.native.shared_laws import shared
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters, yaw_rate_gain

SPEED_STEP_MPS: Final = 5.0
SPEEDS_MPS: Final = tuple(SPEED_STEP_MPS * (number + 1) for number in range(14))
"""Speeds at which the gains are computed, evenly spaced [m/s]; outside them the nearest speed counts."""
STATES: Final = ("yaw_rate", "sideslip", "front", "rear", "superposition", "rear_actuator", "superposition_before",
                 "rear_before")  # fmt: skip
"""States of the model, with angles in pairs, front before rear."""
BOTH: Final = (True, True)
"""Flags for two working actuators: superposition, rear steering."""
_STEADY: Final = 6
"""Number of values of the steady turn in a row of the schedule, before the rows of K."""
_ROW: Final = _STEADY + 2 * len(STATES)
"""Number of values in a row of the schedule."""
_SPEED, _SIDESLIP, _YAW_RATE, _FRICTION, _FRICTION_STD, _FRONT_STIFFNESS, _REAR_STIFFNESS = map(
    Estimate._fields.index,
    ("speed_mps", "sideslip_rad", "yaw_rate_radps", "friction", "friction_std", "front_stiffness", "rear_stiffness"),
)
_SAME_RAD: Final = 1e-6
"""Difference of an angle from its demand that does not count as a limit [rad]."""
_LIMIT_FROM, _LIMIT_TO = 0.95, 1.05
"""Use of the known friction from which the time at the limit starts to count, and counts fully [-]. First choice."""
_FULL_MPS: Final = 8.0
"""Speed from which the controller acts fully; below it, its action fades out until `MIN_SPEED_MPS` [m/s]."""


class Turn(NamedTuple):
    """Desired turn, with its superposition and rear angle."""

    estimate: Estimate
    desired_radps: float
    sideslip_rad: float
    steady_rad: tuple[float, float]
    demand_rad: tuple[float, float]  # without limits
    range_rad: tuple[float, float]  # smallest and largest superposition that driver and yaw rate allow


class Lqr(NativeBlock):
    """Rear steering and front superposition by one state feedback."""

    interval_s = 0.005
    reads = ("lqr", "servos", "estimator")
    compiled_in = "activesteer.controllers.native_lqr"
    rates_radps = MappingProxyType({"rear": math.radians(25.0), "superposition": math.radians(25.0)})
    """Actuator rates that remove 3 deg within the time in which the car responds, `removal_s` [rad/s]."""
    gains = LqrParameters
    derived = ("_schedule", "_superposition_works", "_rear_works")
    _estimator: Estimator
    _confidence: ConfidenceMonitor
    _reference: TurnReference
    _curves: AxleSlopes
    _allocation: Allocation
    _schedule: Table
    _superposition_works: bool
    _rear_works: bool
    _interval_s: float
    _lag_s: float
    _relaxation_length_m: float
    _friction_deviations: float
    _against_driver_rad: float
    _superposition_limit_rad: float
    _hold_s: float
    _decay_s: float
    _lacking_radps: float
    _against_s: float
    _at_limit_s: float
    _turned_radps: float
    _driver_before_rad: float
    _torque_per_pressure_NmpPa: PerWheel
    _moment_per_torque: PerWheel
    _front_slip_s2radpm: float
    _rear_slip_s2radpm: float
    _front_compensation_radpNm: float
    _rear_compensation_radpNm: float
    _front_rad: float
    _rear_rad: float
    _superposition_before_rad: float
    _rear_before_rad: float

    def __init__(self, setup: ControllerSetup) -> None:
        """Create the controller of one run."""
        p = self._parameters = setup.gains.lqr
        self._servos = setup.gains.servos
        self._estimator = setup.estimator()
        self._confidence = ConfidenceMonitor(setup)
        self._car, self._interval_s = setup.single_track, setup.timestep_s
        self._reference = TurnReference(self._car, p.reference_length_m, p.friction_fraction, setup.timestep_s)
        self._allocation = Allocation(setup)
        self._curves = self._allocation._curves
        self._adapt(BOTH)
        self._lag_s, self._hold_s, self._decay_s = self._servos.lag_s, p.hold_s, p.decay_s
        self._lacking_radps = p.lacking_radps
        self._against_s = self._driver_before_rad = 0.0
        self._at_limit_s = self._turned_radps = 0.0
        self._superposition_limit_rad = self._servos.superposition_limit_rad
        self._relaxation_length_m, self._friction_deviations = p.relaxation_length_m, p.friction_deviations
        self._against_driver_rad = p.against_driver_rad
        self._front_rad = self._rear_rad = self._superposition_before_rad = self._rear_before_rad = 0.0
        known, (front, rear) = setup.estimation, brake_levers(setup)
        assert known is not None  # an estimator exists
        self._torque_per_pressure_NmpPa = known.brake_torque_per_pressure_NmpPa
        self._moment_per_torque = 1.0 / front, -1.0 / front, 1.0 / rear, -1.0 / rear
        wheelbase_m, wheel_N = self._car.wheelbase_m, self._car.wheel_loads_N
        self._front_slip_s2radpm, self._rear_slip_s2radpm = (
            2.0 * load_N / GRAVITY_MPS2 / stiffness_Nprad
            for load_N, stiffness_Nprad in zip(
                wheel_N, (self._car.front_stiffness_Nprad, self._car.rear_stiffness_Nprad), strict=True
            )
        )
        self._front_compensation_radpNm = -1.0 / (wheelbase_m * self._car.front_stiffness_Nprad)
        self._rear_compensation_radpNm = 1.0 / (wheelbase_m * self._car.rear_stiffness_Nprad)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the demanded angles of superposition and rear wheels."""
        now = self._estimator.step(measurement)
        return steering(
            regulated(
                self, now, self._estimator.innovation, command.front_steer_demand_rad, command.brake_pedal,
                measurement.superposition_rad, measurement.rear_steer_rad, measurement.brake_pressure_Pa,
            ),
            now,
        )  # fmt: skip

    def turn(
        self,
        command: DriverCommand,
        measurement: Measurement,
        works: tuple[bool, bool] = BOTH,
        own_brakes_Nm: PerWheel = NO_BRAKES,
    ) -> Turn:
        """Return the desired turn and the feedback demands, which are zero below walking speed."""
        if works != (self._superposition_works, self._rear_works):
            self._adapt(works)
        now = self._estimator.step(measurement)
        desired, sideslip, *angles = fed_back(
            self, now, self._estimator.innovation, command.front_steer_demand_rad, command.brake_pedal,
            measurement.superposition_rad, measurement.rear_steer_rad, measurement.brake_pressure_Pa, own_brakes_Nm,
        )  # fmt: skip
        steady, demand, allowed = (angles[0], angles[1]), (angles[2], angles[3]), (angles[4], angles[5])
        return Turn(now, desired, sideslip, steady, demand, allowed)

    def _adapt(self, works: tuple[bool, bool]) -> None:
        """Select the gains for the actuators that work."""
        rows = schedule(self._car, self._parameters, self._servos.lag_s, self._interval_s, works)
        self._schedule = array("d", chain.from_iterable(rows))
        self._superposition_works, self._rear_works = works

    def allocate(
        self, turn: Turn, command: DriverCommand, measurement: Measurement, works: tuple[bool, bool]
    ) -> tuple[float, float, float]:
        """Return the limited superposition and rear angle [rad], and the moment change that they cause."""
        now, driver_rad = turn.estimate, command.front_steer_demand_rad
        at_rad = measurement.superposition_rad, measurement.rear_steer_rad
        angles_rad = allocated(
            self._allocation, now, driver_rad, at_rad, turn.demand_rad, turn.range_rad, works,
            turn.desired_radps * now.speed_mps, self._confidence._authority,
        )  # fmt: skip
        return *angles_rad, moment_change(self._allocation, now, driver_rad, at_rad, angles_rad)

    def apply(self, superposition_rad: float, rear_rad: float) -> None:
        """Store the final demands of the actuators, or the position of a failed actuator."""
        self._superposition_before_rad, self._rear_before_rad = superposition_rad, rear_rad


@shared
def regulated(
    block: Lqr,
    now: Estimate,
    innovation: float,
    driver_rad: float,
    brake_pedal: float,
    superposition_rad: float,
    rear_rad: float,
    pressures_Pa: PerWheel,
) -> tuple[float, float, float, float, float, bool]:
    """Return the first fields of an `ActuatorCommand` by the law of `Lqr.step`."""
    desired, _, _, steady, front_demand, rear_demand, least, most = fed_back(
        block, now, innovation, driver_rad, brake_pedal, superposition_rad, rear_rad, pressures_Pa, NO_BRAKES
    )
    speed = now[_SPEED]
    if speed < MIN_SPEED_MPS:
        block._superposition_before_rad = block._rear_before_rad = 0.0
        return 0.0, 0.0, 0.0, 0.0, 0.0, False
    fade = min((speed - MIN_SPEED_MPS) / (_FULL_MPS - MIN_SPEED_MPS), 1.0)
    front_demand, rear_demand = fade * front_demand, fade * rear_demand
    added, rear = allocated(
        block._allocation, now, driver_rad, (superposition_rad, rear_rad), (front_demand, rear_demand), (least, most),
        BOTH, desired * speed, fade * block._confidence._authority,
    )  # fmt: skip
    block._superposition_before_rad, block._rear_before_rad = added, rear
    off = max(abs(added - front_demand), abs(rear - rear_demand))
    return rear, added, desired, steady, rear - steady, off > _SAME_RAD


@shared
def fed_back(
    block: Lqr,
    now: Estimate,
    innovation: float,
    driver_rad: float,
    brake_pedal: float,
    superposition_rad: float,
    rear_rad: float,
    pressures_Pa: PerWheel,
    own_brakes_Nm: PerWheel,
) -> tuple[float, float, float, float, float, float, float, float]:
    """Computation of `Lqr.turn`, with the estimate and then the fields of `Turn`."""
    speed, friction = now[_SPEED], now[_FRICTION]
    certain, authority = confidence(block._confidence, innovation, now[_FRICTION_STD])
    if speed < MIN_SPEED_MPS:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    assumed = friction + block._friction_deviations * now[_FRICTION_STD]
    understeer = _understeer(block, now, certain)
    # Front angle of this car over that of a car with new tyres, for the same turn.
    further = 1.0 + understeer * speed * yaw_rate_gain(block._reference._single_track, speed)
    desired = desired_turn(block._reference, driver_rad / further, speed, assumed)
    # The tyres follow the angles over their relaxation length.
    fraction = -math.expm1(-block._interval_s * speed / block._relaxation_length_m)
    block._front_rad += fraction * (driver_rad + superposition_rad - block._front_rad)
    block._rear_rad += fraction * (rear_rad - block._rear_rad)
    given, both = 0.0, block._superposition_works and block._rear_works
    if not both:
        given = driver_rad + superposition_rad if block._rear_works else rear_rad
    rows, (start, part) = table(block._schedule), _place(speed)
    turning = (
        _gain(rows, start, part, 0), _gain(rows, start, part, 1), _gain(rows, start, part, 2),
        _gain(rows, start, part, 3), _gain(rows, start, part, 4), _gain(rows, start, part, 5),
    )  # fmt: skip
    front, rear, sideslip = _steady(block, turning, speed, friction, given, desired, understeer)
    # The present demand takes effect a call and a lag later.
    coming = desired_ahead(block._reference, block._lag_s + block._interval_s)
    next_front, next_rear, _ = _steady(block, turning, speed, friction, given, coming, understeer)
    brake_front, brake_rear = 0.0, 0.0
    if brake_pedal > 0.0 and both:
        moment_Nm = 0.0
        for wheel in range(4):
            torque_Nm = block._torque_per_pressure_NmpPa[wheel] * pressures_Pa[wheel] - own_brakes_Nm[wheel]
            moment_Nm += block._moment_per_torque[wheel] * max(torque_Nm, 0.0)
        brake_front = moment_Nm * block._front_compensation_radpNm
        brake_rear = moment_Nm * block._rear_compensation_radpNm
    front, rear = front + brake_front, rear + brake_rear
    steady, held_front, held_rear = front - driver_rad, next_front + brake_front - driver_rad, next_rear + brake_rear
    errors = (
        now[_YAW_RATE] - desired,
        now[_SIDESLIP] - sideslip,
        block._front_rad - front,
        block._rear_rad - rear,
        superposition_rad - steady,
        rear_rad - rear,
        block._superposition_before_rad - held_front,
        block._rear_before_rad - held_rear,
    )
    front_feedback, rear_feedback = 0.0, 0.0
    for place in range(len(errors)):
        front_feedback += _gain(rows, start, part, _STEADY + place) * errors[place]
        rear_feedback += _gain(rows, start, part, _STEADY + len(errors) + place) * errors[place]
    limit = block._superposition_limit_rad
    against = block._against_driver_rad
    against += certain * max(limit - against, 0.0)
    against *= _patience(block, driver_rad)
    least, most = -against if driver_rad > 0.0 else -limit, against if driver_rad < 0.0 else limit
    # No superposition turns the car further from the desired yaw rate, as the sideslip asks while the rear axle slides.
    lacking = (desired - now[_YAW_RATE]) / block._lacking_radps
    least *= min(max(1.0 - lacking, 0.0), 1.0)
    most *= min(max(1.0 + lacking, 0.0), 1.0)
    further = 1.0 - certain * _faded_at_limit(
        block, desired, speed * abs(desired) / (block._reference._most_mps2 * friction)
    )
    if desired > 0.0:
        most *= further
    else:
        least *= further
    front_demand, rear_demand = authority * (held_front - front_feedback), authority * (held_rear - rear_feedback)
    return desired, sideslip, steady, rear, front_demand, rear_demand, least, most


@shared
def _understeer(block: Lqr, now: Estimate, certain: float) -> float:
    """Return the understeer gradient of softer tyres, at least 0, which fades with `certain` friction [s2 rad/m]."""
    front = 1.0 + (1.0 - certain) * min(now[_FRONT_STIFFNESS] - 1.0, 0.0)
    rear = 1.0 + (1.0 - certain) * min(now[_REAR_STIFFNESS] - 1.0, 0.0)
    more = block._front_slip_s2radpm * (1.0 / front - 1.0) - block._rear_slip_s2radpm * (1.0 / rear - 1.0)
    return more if more > 0.0 else 0.0


@shared
def _patience(block: Lqr, driver_rad: float) -> float:
    """Return the fraction of the superposition that may still act against the driver."""
    before = block._driver_before_rad
    # It counts the time of a superposition against a driver whose angle is not below its own lagged value.
    if driver_rad * before < 0.0:
        block._against_s = 0.0
    elif abs(driver_rad) < abs(before):
        block._against_s = max(block._against_s - block._interval_s, 0.0)
    elif block._superposition_before_rad * driver_rad < 0.0:
        block._against_s = min(block._against_s + block._interval_s, block._hold_s + block._decay_s)
    block._driver_before_rad += -math.expm1(-block._interval_s / block._hold_s) * (driver_rad - before)
    return min((block._hold_s + block._decay_s - block._against_s) / block._decay_s, 1.0)


@shared
def _faded_at_limit(block: Lqr, desired_radps: float, used: float) -> float:
    """Return the part of the superposition into the turn that has faded, 0 to 1."""
    if desired_radps * block._turned_radps < 0.0:
        block._at_limit_s = 0.0
    block._turned_radps = desired_radps
    counts = min((used - _LIMIT_FROM) / (_LIMIT_TO - _LIMIT_FROM), 1.0)
    if counts > 0.0:
        block._at_limit_s = min(block._at_limit_s + counts * block._interval_s, block._hold_s + block._decay_s)
    else:
        block._at_limit_s = max(block._at_limit_s - block._interval_s, 0.0)
    return min(max((block._at_limit_s - block._hold_s) / block._decay_s, 0.0), 1.0)


@shared
def _steady(
    block: Lqr,
    gains: tuple[float, ...],
    speed_mps: float,
    friction: float,
    given_rad: float,
    yaw_rate_radps: float,
    understeer_s2radpm: float,
) -> tuple[float, float, float]:
    """Return front angle, rear angle and sideslip angle of a steady turn from the gain schedule [rad]."""
    ay_mps2 = speed_mps * yaw_rate_radps
    front_more, rear_more = excess(block._curves, ay_mps2, friction)
    front_more += understeer_s2radpm * ay_mps2
    # An axle with a given angle gets its additional slip angle from the sideslip, and the other axle follows.
    less = 0.0
    if not (block._superposition_works and block._rear_works):
        less = rear_more if block._superposition_works else front_more
    front = gains[0] * yaw_rate_radps + gains[1] * given_rad + front_more - less
    rear = gains[2] * yaw_rate_radps + gains[3] * given_rad + rear_more - less
    return front, rear, gains[4] * yaw_rate_radps + gains[5] * given_rad - less


@shared
def _place(speed_mps: float) -> tuple[int, float]:
    """Return the index of the schedule row below a speed, and the fraction of the way to the next row."""
    place = min(max(speed_mps / SPEED_STEP_MPS - 1.0, 0.0), len(SPEEDS_MPS) - 1 - 1e-6)
    return _ROW * int(place), place - int(place)


@shared
def _gain(rows: Table, start: int, part: float, column: int) -> float:
    """Interpolate a column of the schedule."""
    low = rows[start + column]
    return low + part * (rows[start + _ROW + column] - low)


@lru_cache(maxsize=64)
def schedule(
    car: SingleTrackParameters,
    parameters: LqrParameters,
    servo_lag_s: float,
    interval_s: float,
    works: tuple[bool, bool] = BOTH,
) -> tuple[tuple[float, ...], ...]:
    """Return the gains of `steady_turn` [s, -] at each of `SPEEDS_MPS`, then the rows of K in the order of `STATES`."""
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
    """Return front angle, rear angle and sideslip of a steady turn, per yaw rate and per given angle: shape (3, 2)."""
    a, b = SingleTrack(car).matrices(speed_mps)
    turn = np.zeros((3, 2))
    if works == BOTH:
        # With `in_phase` the rear wheels never turn out of phase, which would swing the tail out of the lane. The turn
        # has the sideslip of the car with straight rear wheels, below the speed at which this sideslip changes sign.
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
    """Return the matrices (8, 8) of `STATES` and (8, 2) of superposition and rear angle, both held over one call."""
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
    """Return the feedback gains of both actuators at a speed, shape (2, 8), with a zero row for a failed actuator."""
    import control  # noqa: PLC0415 - takes longer to import than a run takes to start

    a, b = model(car, parameters, servo_lag_s, speed_mps, interval_s)
    q = np.zeros((8, 8))
    q[0, 0], q[1, 1] = parameters.yaw_rate_scale_radps**-2, parameters.sideslip_scale_rad**-2
    weights = np.array([parameters.superposition_scale_rad**-2, parameters.rear_scale_rad**-2])
    gains, used = np.zeros((2, 8)), [axle for axle in range(2) if works[axle]]
    if used:
        gains[used], _, _ = control.dlqr(a, b[:, used], q, np.diag(weights[used]))
    return gains
