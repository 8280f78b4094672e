"""Integrated control of rear steering, front superposition and brakes, with priority for the steering.

The angles come from `lqr` with its allocation, within their limits and rates (`controllers/allocation.py`). The law of
`esc` gives the yaw moment that the car needs to stay under control, beyond its bands:

    M_s = J_z (error beyond its band) / T_r + J_z (sideslip beyond its limit) / T_b^2

where the desired yaw rate falls if the road does not support the turn (`BorneTurnReference`). The angles still change
the moment by M_u within the time ahead. The missing moment grows with the size of the stability demand, from zero on:

    M_x = min(|M_s| / M_0, 1) max(|M_s| - M_u, 0),                       to the side of M_s

It does not depend on the demand of the state feedback: while an axle slides, the feedback mostly acts against the
sideslip, with both axles to the same side. In every call a quadratic programme allocates M_x to the brake forces F_i:

    minimise    ((B F - M_x) / M_1)^2 + |F|^2 / F_0^2 + c sum F_i
    subject to  0 <= F_i <= the limit of `esc`

B holds the lever arms, and the side force that a wheel loses while it brakes: if a tyre at its limit brakes, the car
turns in less with a front tyre, and more with a rear tyre. The outer front wheel therefore brakes against oversteer,
and the inner rear wheel against understeer. The cost c of a brake force keeps the brakes idle for a moment below the
threshold M_0.

On split friction, the anti-lock system limits the brakes on the side with higher friction, to help the driver. Here the
steering compensates for the moment of the brakes (see `lqr`), so the sides may differ more. The controller sets this
pressure difference: a limit that falls with the errors of the car, and at most what the remaining angles can hold with
the tyres in their current state. It also falls in turns, where the outer rear wheel needs its side force.

If an actuator does not follow its demand (`SupervisedActuator`), it holds its position. The state feedback is then
computed only for the other actuator, about the turn that is still possible. The controller gets no message about a
fault.

Both demands of the steering fade while the estimator does not explain the motion of the car (see `lqr`). M_x fades only
while the estimator does not explain the yaw rate. After a jump of friction it explains the yaw rate, and the brakes
must act.

On a car whose electric axles can split their torque (`tv`), the difference of each axle is a further unknown, as the
force D that the right wheel gets and the left one loses, at the cost D^2 / F_0^2 and without a threshold: the motors
act before the brakes, within the limits that `tv` has.

Sources: T. A. Johansen and T. I. Fossen, Control allocation - A survey, Automatica 49 (2013); M. Abe, Vehicle Handling
Dynamics, 2009, on steering and moments together; D. Arnstrom, A. Bemporad, D. Axehill, A dual active-set solver for
embedded quadratic programming using recursive LDL' updates, IEEE TAC 67 (2022); A. van Zanten, Bosch ESP Systems: 5
Years of Experience, SAE 2000-01-1633, on the wheels that brake.
"""

from __future__ import annotations

import functools
import math
from collections import deque
from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np

from activesteer.controllers.axle_slopes import slopes
from activesteer.controllers.corrector import MIN_SPEED_MPS
from activesteer.controllers.esc import beyond, stabilising
from activesteer.controllers.lqr import Lqr, Turn
from activesteer.controllers.parameters import ControllerSetup, EscParameters, IntegratedParameters
from activesteer.controllers.torque_vectoring import SplitTorques
from activesteer.controllers.turn_reference import BorneTurnReference, ConfidenceMonitor, confidence
from activesteer.core.conventions import Array
from activesteer.core.signals import NO_BRAKES, ActuatorCommand, DriverCommand, Estimate, Measurement
from activesteer.errors import ControllerError, not_installed

Solve = Callable[[Array, Array, Array, Array, Array], Array]
"""Function of H, f, A, lower, upper that minimises x' H x / 2 + f' x over x; the bounds are for x, then for A x."""


def solver() -> Solve:
    """Return the dual active-set method of DAQP. Every call starts cold, so the solver has no state."""
    try:
        import daqp  # noqa: PLC0415 - an extra
    except ImportError as error:
        raise not_installed(ControllerError, "this controller", "daqp", "control") from error
    return functools.partial(_solve, daqp.solve)


def _solve(solve_once: Any, h: Array, f: Array, a: Array, lower: Array, upper: Array) -> Array:
    x, _, flag, _ = solve_once(h, f, a, upper, lower, np.zeros(len(upper), dtype=np.int32))
    if flag <= 0:
        raise ControllerError(f"DAQP finds no solution (exit flag {flag})")
    return x


class SupervisedActuator:
    """Monitor of an actuator, which counts as failed from the time at which it has stopped approaching its demand."""

    def __init__(self, tolerance_rad: float, window_s: float, interval_s: float) -> None:
        """Start with a working actuator."""
        self._tolerance_rad = tolerance_rad
        self._steps = max(1, round(window_s / interval_s))
        self._seen: deque[tuple[float, float]] = deque(maxlen=self._steps + 1)
        self._suspected = 0
        self.failed, self.held_rad = False, 0.0

    def step(self, demand_rad: float, position_rad: float) -> bool:
        """Add a sample of demand and position [rad], and return whether the actuator has failed."""
        self._seen.append((demand_rad, position_rad))
        if len(self._seen) <= self._steps:
            return self.failed
        position_then_rad = self._seen[0][1]
        demands_rad = [demand for demand, _ in self._seen]
        gap_rad = min(demands_rad) - position_then_rad
        moved_rad = position_rad - position_then_rad
        if gap_rad < 0.0:
            gap_rad, moved_rad = position_then_rad - max(demands_rad), -moved_rad
        # A slow actuator, a weak supply or a delayed bus still approach. A stuck, floating or runaway actuator does
        # not. A demand that has turned back suspects none.
        if gap_rad > self._tolerance_rad and moved_rad < 0.1 * gap_rad:
            self._suspected += 1
            if self._suspected > self._steps and not self.failed:  # counts as failed if suspected for a whole window
                self.failed, self.held_rad = True, position_rad  # a measured position would creep
        else:
            self._suspected = 0
        return self.failed


_BRAKES = 4
"""Number of brake forces; after them come the differences of electric axles."""
_LEAST_KN = 0.01
"""Brake force that counts as none [kN]."""
_KILO = 1e3
"""Brake forces are in kN, so that all unknowns have a similar size."""


class Integrated:
    """State feedback whose corrections are allocated to steering and brakes."""

    interval_s = 0.005
    reads = (
        *Lqr.reads, "integrated", "tv.friction_fraction", "tv.least_fraction",
        # The moment does not depend on the certainty of the estimate.
        *(f"esc.{each.name}" for each in fields(EscParameters) if not each.name.endswith("_deviations")),
    )  # fmt: skip
    rates_radps = Lqr.rates_radps
    gains = IntegratedParameters

    def __init__(self, setup: ControllerSetup) -> None:
        """Create the controller of one run."""
        self._lqr = Lqr(setup)
        self._parameters, self._stability, servos = (p := setup.gains.integrated), setup.gains.esc, setup.gains.servos
        self._limits_rad = servos.superposition_limit_rad, servos.rear_limit_rad
        self._car, self._slopes = setup.single_track, self._lqr._curves
        self._confidence = ConfidenceMonitor(setup)
        self._borne = BorneTurnReference(self._car, self._stability, setup.timestep_s)
        self._supervised = [SupervisedActuator(p.tolerance_rad, p.window_s, setup.timestep_s) for _ in range(2)]
        self._solve = solver()
        known = setup.estimation
        assert known is not None  # an estimator exists
        half_m = 0.5 * np.array(known.two_track.tracks_m)
        # A brake on the left turns the car to the left.
        self._arms_m = np.repeat(half_m, 2) * (1.0, -1.0, 1.0, -1.0)
        self._radii_m = known.rolling_radius_m
        # As with `esc`, the anti-lock system finds the friction: its estimate is one number for both axles.
        self._most_kN = [self._stability.torque_limit_Nm / (_KILO * radius_m) for radius_m in self._radii_m]
        self._per_moment = 1.0 / setup.gains.lqr.moment_scale_Nm
        self._brake_cost = _KILO * 2.0 * p.brake_threshold_Nm * float(half_m[0]) * self._per_moment**2
        self._torques = SplitTorques(setup)
        tracks_m = 2.0 * half_m[[axle.place // 2 for axle in setup.split_axles]]
        forces = _BRAKES + len(setup.split_axles)
        self._stay = np.diag([p.brake_scale_N**-2 * _KILO**2] * forces)
        # Weighted yaw moment per brake force and torque difference [kN].
        self._effects = self._per_moment * _KILO * np.concatenate([self._arms_m, tracks_m])
        self._no_rows = np.zeros((0, forces))
        self._demand_rad, self._brakes_Nm = (0.0, 0.0), NO_BRAKES
        per_pressure_Nm = np.array(known.brake_torque_per_pressure_NmpPa) / known.rolling_radius_m
        self._side_moment_m3 = float(per_pressure_Nm @ np.abs(self._arms_m)) / 2.0

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return angles and brake torques."""
        p, at = self._parameters, (measurement.superposition_rad, measurement.rear_steer_rad)
        works = (
            not self._supervised[0].step(self._demand_rad[0], at[0]),
            not self._supervised[1].step(self._demand_rad[1], at[1]),
        )
        turn = self._lqr.turn(command, measurement, works, self._brakes_Nm)
        now, driver = turn.estimate, command.front_steer_demand_rad
        if now.speed_mps < MIN_SPEED_MPS:
            self._demand_rad, self._brakes_Nm = (0.0, 0.0), NO_BRAKES
            return ActuatorCommand(estimate=now)
        added, rear, steered_Nm = self._lqr.allocate(turn, command, measurement, works)
        added = added if works[0] else self._supervised[0].held_rad
        rear = rear if works[1] else self._supervised[1].held_rad
        missing_Nm = self._missing_moment(now, driver, measurement.ay_mps2, steered_Nm)
        front_angle_rad = driver + measurement.superposition_rad
        front, behind = slopes(self._slopes, now, front_angle_rad, at[1])
        # How far the axles are used: 0 straight ahead to 1 sliding, negative in turns to the right.
        used = math.copysign(1.0 - abs(front), front), math.copysign(1.0 - abs(behind), behind)
        losses_m = -used[0] * self._car.cg_to_front_m, used[1] * self._car.cg_to_rear_m
        effects = self._effects
        effects[:_BRAKES] = self._arms_m + p.brake_side_loss * np.repeat(losses_m, 2)
        effects[:_BRAKES] *= self._per_moment * _KILO
        hessian = 2.0 * (np.outer(effects, effects) + self._stay)
        gradient = -2.0 * self._per_moment * missing_Nm * effects
        gradient[:_BRAKES] += self._brake_cost
        ranges = self._torques.ranges(command, measurement, now)
        least_kN, greatest_kN = (
            [side * each.largest_Nm(side) / (2.0 * _KILO * self._radii_m[each.place]) for each in ranges]
            for side in (-1.0, 1.0)
        )
        bounds = np.array([0.0] * _BRAKES + least_kN), np.array([*self._most_kN, *greatest_kN])
        solution = self._solve(hessian, gradient, self._no_rows, *bounds).tolist()
        self._demand_rad = added, rear
        self._lqr.apply(added, rear)
        # The anti-lock system lets a braked wheel slip more: the solver's last digits are not a demand.
        fl, fr, rl, rr = (
            _KILO * force_kN * radius_m if force_kN > _LEAST_KN else 0.0
            for force_kN, radius_m in zip(solution[:_BRAKES], self._radii_m, strict=True)
        )
        self._brakes_Nm = fl, fr, rl, rr
        differences_Nm = [
            2.0 * _KILO * force_kN * self._radii_m[each.place]
            for force_kN, each in zip(solution[_BRAKES:], ranges, strict=True)
        ]
        saturated = max(abs(added - turn.demand_rad[0]), abs(rear - turn.demand_rad[1])) > p.tolerance_rad
        return ActuatorCommand(
            rear_steer_demand_rad=rear,
            superposition_demand_rad=added,
            yaw_rate_desired_radps=turn.desired_radps,
            prediction_rad=turn.steady_rad[1],
            correction_rad=rear - turn.steady_rad[1],
            saturated=saturated,
            brake_torque_demand_Nm=(fl, fr, rl, rr),
            drive_torque_change_Nm=-min(max(command.drive_torque_demand_Nm, 0.0), fl + fr + rl + rr),
            estimate=now,
            side_difference_Pa=self._side_difference(turn, at, works, (abs(front), abs(behind))),
            wheel_torque_demand_Nm=self._torques.of_differences(differences_Nm, ranges, command, measurement),
        )

    def _missing_moment(self, now: Estimate, driver_rad: float, ay_mps2: float, steered_Nm: float) -> float:
        """Return the yaw moment demand that the steering cannot provide within the horizon [Nm]."""
        p, borne = self._stability, self._borne.borne(driver_rad, now.speed_mps, now.friction, ay_mps2)
        if now.speed_mps < p.least_speed_mps:
            return 0.0
        demand = stabilising(p, borne - now.yaw_rate_radps, beyond(now.sideslip_rad, p.sideslip_limit_rad))
        # Behind a jump of friction the estimator explains the yaw rate and not the lateral acceleration.
        # Twice: the limits of `confidence` are for the sum over two measured values.
        innovation = 2.0 * self._lqr._estimator.rate_innovation
        demand *= confidence(self._confidence, innovation, now.friction_std)[1] * self._car.yaw_inertia_kgm2
        side, part = math.copysign(1.0, demand), min(abs(demand) / self._parameters.brake_threshold_Nm, 1.0)
        return part * side * max(side * (demand - steered_Nm), 0.0)

    def _side_difference(
        self, turn: Turn, at_rad: tuple[float, float], works: tuple[bool, bool], shares: tuple[float, float]
    ) -> float:
        """Return the allowed pressure difference between the sides [Pa]."""
        p, car, now = self._parameters, self._car, turn.estimate
        front, rear = (self._limits_rad[axle] - abs(at_rad[axle]) if works[axle] else 0.0 for axle in (0, 1))
        force_N = min(shares[0] * car.front_stiffness_Nprad * front, shares[1] * car.rear_stiffness_Nprad * rear)
        moment_Nm = car.wheelbase_m * max(force_N, 0.0)
        off = abs(turn.desired_radps - now.yaw_rate_radps) / p.side_yaw_rate_radps
        off += abs(now.sideslip_rad - turn.sideslip_rad) / p.side_sideslip_rad
        off += max(2.0 * abs(now.yaw_rate_radps) * now.speed_mps / p.side_acceleration_mps2 - 1.0, 0.0)
        return min(max(1.0 - off, 0.0) * p.side_difference_Pa, moment_Nm / self._side_moment_m3)
