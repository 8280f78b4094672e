"""Front and rear wheels together: a linear-quadratic regulator about the turn that the driver asks for.

The model is the single-track model (eqs. 1 and 2) with tyres that answer over their relaxation length s and actuators
with a lag T_a, whose commands take effect one call later:

    d/dt [r, beta] = A(v) [r, beta] + B(v) [f, g]      yaw rate, sideslip; angles that the tyres answer to
    s/v df/dt = delta_V + a - f                        front: driver's angle and superposition a
    s/v dg/dt = delta_H - g                            rear
    T_a da/dt = u_a - a,  T_a ddelta_H/dt = u_H - delta_H

Desired is the turn with the car's own steady yaw rate at the driver's angle (eq. 3), no further than the friction gives
(eq. 6), and without sideslip. It has the angles f*, g* that solve 0 = A [r*, 0] + B [f*, g*]; the law is

    u = u* - K(v) (x - x*),        x = (r, beta, f, g, a, delta_H, u before)

with K from python-control's `dlqr`, which makes the sum of (x - x*)' Q (x - x*) + (u - u*)' R (u - u*) least, Q and R
with the inverse squares of the errors and angles that are to weigh the same (Bryson's rule). K is computed for a row of
speeds and taken linearly between. Yaw rate and sideslip are the estimator's, actuators are measured, f and g are
followed by the model.

Sources: B. D. O. Anderson and J. B. Moore, Optimal Control: Linear Quadratic Methods, 1989; both axles for yaw rate and
zero sideslip: M. Abe, Vehicle Handling Dynamics, 2009, chapter 8.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

import numpy as np
from scipy.linalg import expm

from activesteer.controllers.desired_yaw_rate import MIN_SPEED_MPS
from activesteer.controllers.family_parameters import LqrParameters
from activesteer.controllers.parameters import ControllerSetup
from activesteer.controllers.turn_reference import TurnReference
from activesteer.conventions import Array
from activesteer.estimation import Estimator
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement
from activesteer.theory.single_track import SingleTrack, SingleTrackParameters

SPEED_STEP_MPS: Final = 5.0
SPEEDS_MPS: Final = tuple(SPEED_STEP_MPS * (number + 1) for number in range(14))
"""Speeds at which the gains are computed, evenly spaced [m/s]; beyond them the nearest count."""
STATES: Final = ("yaw_rate", "sideslip", "front", "rear", "superposition", "rear_actuator", "superposition_before",
                 "rear_before")  # fmt: skip
"""Of the model; the angles in pairs, front before rear."""
_FULL_MPS: Final = 8.0
"""From here on the controller does all it does; below it fades out until `MIN_SPEED_MPS` [m/s]."""


class Lqr:
    """Rear steering and front superposition by one state feedback."""

    interval_s = 0.005

    def __init__(
        self, single_track: SingleTrackParameters, parameters: LqrParameters, estimator: Estimator, interval_s: float
    ) -> None:
        """Makes the controller of one run.

        Args:
            single_track: The car as it is known.
            parameters: Weights and limits.
            estimator: Says yaw rate, sideslip and friction.
            interval_s: Time between two calls [s].
        """
        self._parameters, self._estimator = parameters, estimator
        self._rows = schedule(single_track, parameters, interval_s)
        p = parameters
        self._reference = TurnReference(single_track, p.reference_lag_s, p.friction_fraction, interval_s)
        self._interval_s = interval_s
        self._front_rad = self._rear_rad = 0.0
        self._before = 0.0, 0.0

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> Lqr:
        """Makes the controller for a car."""
        return cls(setup.single_track, setup.gains.lqr, setup.estimator(), setup.timestep_s)

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Both angles now.

        Args:
            command: What the driver does.
            measurement: What the car's sensors say.
        """
        p, now = self._parameters, self._estimator.step(measurement)
        speed, driver = now.speed_mps, command.front_steer_demand_rad
        if speed < MIN_SPEED_MPS:
            self._before = 0.0, 0.0
            return ActuatorCommand()
        desired = self._reference.step(driver, speed, now.friction)
        front_gain, rear_gain, *gains = self._gains(speed)
        front, rear = front_gain * desired, rear_gain * desired
        added, turned = measurement.superposition_rad, measurement.rear_steer_rad
        # What the tyres answer to follows the angles over their relaxation length.
        share = -math.expm1(-self._interval_s * speed / p.relaxation_length_m)
        self._front_rad += share * (driver + added - self._front_rad)
        self._rear_rad += share * (turned - self._rear_rad)
        added_desired = front - driver
        errors = (
            now.yaw_rate_radps - desired,
            now.sideslip_rad,
            self._front_rad - front,
            self._rear_rad - rear,
            added - added_desired,
            turned - rear,
            self._before[0] - added_desired,
            self._before[1] - rear,
        )
        count = len(errors)
        added_demand = added_desired - sum([gain * error for gain, error in zip(gains[:count], errors, strict=True)])
        rear_demand = rear - sum([gain * error for gain, error in zip(gains[count:], errors, strict=True)])
        fade = min((speed - MIN_SPEED_MPS) / (_FULL_MPS - MIN_SPEED_MPS), 1.0)
        added_limited = min(max(fade * added_demand, -p.superposition_limit_rad), p.superposition_limit_rad)
        rear_limited = min(max(fade * rear_demand, -p.rear_limit_rad), p.rear_limit_rad)
        self._before = added_limited, rear_limited
        saturated = added_limited != fade * added_demand or rear_limited != fade * rear_demand
        return ActuatorCommand(rear_limited, added_limited, desired, rear, rear_limited - rear, saturated)

    def _gains(self, speed_mps: float) -> list[float]:
        """The row of the schedule at a speed."""
        place = min(max(speed_mps / SPEED_STEP_MPS - 1.0, 0.0), len(self._rows) - 1.000001)
        index = int(place)
        part = place - index
        return [a + part * (b - a) for a, b in zip(self._rows[index], self._rows[index + 1], strict=True)]


@lru_cache(maxsize=32)
def schedule(
    single_track: SingleTrackParameters, parameters: LqrParameters, interval_s: float
) -> tuple[tuple[float, ...], ...]:
    """Gains at `SPEEDS_MPS`.

    Args:
        single_track: The car as it is known.
        parameters: Weights and lags.
        interval_s: Time between two calls [s].

    Returns:
        For each speed: front and rear angle per desired yaw rate [s], then the rows of K for superposition and rear
        angle, in the order of `STATES`.
    """
    rows = []
    for speed_mps in SPEEDS_MPS:
        a, b = SingleTrack(single_track).matrices(speed_mps)
        steady = np.linalg.solve(b, -a[:, 0])
        rows.append((*steady.tolist(), *feedback(single_track, parameters, speed_mps, interval_s).ravel().tolist()))
    return tuple(rows)


def model(
    single_track: SingleTrackParameters, parameters: LqrParameters, speed_mps: float, interval_s: float
) -> tuple[Array, Array]:
    """The model from one call to the next, for inputs that are held.

    Returns:
        System matrix, shape (8, 8) over `STATES`; input matrix, shape (8, 2), inputs superposition and rear angle.
    """
    inner, both = np.zeros((8, 8)), np.eye(2)
    inner[:2, :2], inner[:2, 2:4] = SingleTrack(single_track).matrices(speed_mps)
    tyre_1ps, actuator_1ps = speed_mps / parameters.relaxation_length_m, 1.0 / parameters.actuator_lag_s
    inner[2:4, 2:4], inner[2:4, 4:6] = -tyre_1ps * both, tyre_1ps * both
    inner[4:6, 4:6], inner[4:6, 6:] = -actuator_1ps * both, actuator_1ps * both
    a, b = np.array(expm(interval_s * inner), dtype=np.float64), np.zeros((8, 2))
    # The command of this call works in the next interval: now it only takes the place of the one before.
    a[6:] = 0.0
    b[6:] = both
    return a, b


def feedback(
    single_track: SingleTrackParameters, parameters: LqrParameters, speed_mps: float, interval_s: float
) -> Array:
    """K at a speed, shape (2, 8): superposition and rear angle per deviation of `STATES`."""
    import control  # noqa: PLC0415 - takes longer to import than a run takes to start

    a, b = model(single_track, parameters, speed_mps, interval_s)
    q = np.zeros((8, 8))
    q[0, 0], q[1, 1] = parameters.yaw_rate_scale_radps**-2, parameters.sideslip_scale_rad**-2
    r = np.diag([parameters.superposition_scale_rad**-2, parameters.rear_scale_rad**-2])
    gain, _, _ = control.dlqr(a, b, q, r)
    return np.asarray(gain, dtype=np.float64)
