"""One controller for rear steering, front superposition and brakes: desired forces, then their allocation.

The desired changes of yaw moment and side force remove the errors in given times:

    M_z = J_z (r* - r) / T_r,     F_y = -m v (beta - beta*) / T_b

where r* is the desired yaw rate of `lqr`. The moment is limited to the moment that the steering demands of `lqr` would
make with tyres that never saturate; more moment from the steering is accepted. In every call a quadratic programme
allocates the forces to the superposition angle a, the rear angle delta_H and the brake forces F_i:

    minimise    |W (B (u - u now) - (M_z, F_y))|^2 + |(a, delta_H) - (u_a, u_H)|^2 / s^2 + |F|^2 / F_0^2 + c sum F_i
    subject to  angles within their limits and within what their rates allow in a time ahead,
                0 <= F_i <= a part of the friction under each wheel

u_a and u_H are the demands of the state feedback `lqr` without limits. s is small, so that the steering follows the
feedback while it can. B holds the slopes of the axle curves at the present slip angles and friction, and the lever arms
of the brakes. If an axle slides or reaches a limit, more angle gives no more force, and the brakes make the rest. The
cost c of a brake force keeps the brakes idle for a moment below a threshold.

On a road of two sides the anti-lock system holds back the brakes of the better side, to help the driver. Here the
steering compensates the moment of the brakes (see `lqr`), so the sides may differ more. The controller sets this
pressure difference: a limit that falls with the errors of the car, and at most what the remaining angles can hold with
the tyres in their present state.

If an actuator does not follow its demand (`SupervisedActuator`), its measured position becomes its bounds. The state
feedback is then computed for the other actuator alone, about the turn that is still possible. The controller gets no
message about a fault.

On a car whose electric axles can split their torque (`tv`), the difference of each axle is a further unknown, as the
force D that the right wheel gets and the left one loses, at the cost D^2 / F_0^2 and without a threshold: the motors
act before the brakes, within the limits that `tv` has.

B neglects the side force that a wheel loses while it brakes.

Sources: T. A. Johansen and T. I. Fossen, Control allocation - A survey, Automatica 49 (2013); M. Abe, Vehicle Handling
Dynamics, 2009, on steering and moments together; D. Arnstrom, A. Bemporad, D. Axehill, A dual active-set solver for
embedded quadratic programming using recursive LDL' updates, IEEE TAC 67 (2022).
"""

from __future__ import annotations

import math

import numpy as np

from activesteer.controllers.axle_slopes import AxleSlopes
from activesteer.controllers.desired_yaw_rate import MIN_SPEED_MPS
from activesteer.controllers.file_gains import IntegratedParameters
from activesteer.controllers.lqr import Lqr, Turn
from activesteer.controllers.parameters import ControllerSetup
from activesteer.controllers.quadratic_programme import solver
from activesteer.controllers.split_axles import SplitTorques
from activesteer.controllers.supervised_actuator import SupervisedActuator
from activesteer.signals import NO_BRAKES, ActuatorCommand, DriverCommand, Measurement

_FORCES = 6
"""Number of angles and brake forces; after them come the differences of electric axles."""
_KILO = 1e3
"""Brake forces are in kN, so that all unknowns have a similar size."""


class Integrated:
    """State feedback, with allocation of its corrections to steering and brakes."""

    interval_s = 0.005
    reads = (*Lqr.reads, "integrated", "tv")
    gains = IntegratedParameters

    def __init__(self, setup: ControllerSetup) -> None:
        """Make the controller of one run."""
        self._lqr = Lqr.from_vehicle(setup)
        self._parameters, servos = (p := setup.gains.integrated), setup.gains.servos
        self._limits_rad = servos.superposition_limit_rad, servos.rear_limit_rad
        self._reach_rad = p.ahead_s * servos.superposition_rate_radps, p.ahead_s * servos.rear_rate_radps
        self._car, self._slopes = setup.single_track, AxleSlopes(setup)
        self._supervised = [SupervisedActuator(p.tolerance_rad, p.window_s, setup.timestep_s) for _ in range(2)]
        self._solve = solver()
        known = setup.estimation
        assert known is not None  # an estimator exists
        half_m = 0.5 * np.array([known.two_track.front_track_m, known.two_track.rear_track_m])
        # A brake on the left turns the car to the left.
        arms_m = np.repeat(half_m, 2) * (1.0, -1.0, 1.0, -1.0)
        self._radii_m = known.rolling_radius_m
        self._loads_N = tuple(np.repeat(self._slopes.loads_N, 2).tolist())
        self._weights = 1.0 / p.moment_scale_Nm, 1.0 / p.force_scale_N
        self._brake_cost = _KILO * 2.0 * p.brake_threshold_Nm * float(half_m[0]) * self._weights[0] ** 2
        self._torques = SplitTorques(setup, setup.gains.tv.friction_fraction, setup.gains.tv.least_fraction)
        tracks_m = 2.0 * half_m[[axle.place // 2 for axle in setup.split_axles]]
        forces = 4 + len(setup.split_axles)
        self._stay_1prad2 = p.angle_scale_rad**-2
        self._stay = np.diag([self._stay_1prad2] * 2 + [p.brake_scale_N**-2 * _KILO**2] * forces)
        # Yaw moment and side force, weighted, per angle [rad], brake force and torque difference [kN].
        self._effects = np.zeros((2, 2 + forces))
        self._effects[0, 2:] = self._weights[0] * (_KILO * np.concatenate([arms_m, tracks_m]))
        self._no_rows = np.zeros((0, 2 + forces))
        stiffness = self._car.front_stiffness_Nprad, self._car.rear_stiffness_Nprad
        self._straight_Nmprad = np.array(
            [stiffness[0] * self._car.cg_to_front_m, -stiffness[1] * self._car.cg_to_rear_m]
        )
        self._demand_rad, self._brakes_Nm = (0.0, 0.0), NO_BRAKES
        per_pressure_Nm = np.array(known.brake_torque_per_pressure_NmpPa) / known.rolling_radius_m
        self._side_moment_m3 = float(per_pressure_Nm @ np.abs(arms_m)) / 2.0

    @classmethod
    def from_vehicle(cls, setup: ControllerSetup) -> Integrated:
        """Make the controller for a car."""
        return cls(setup)

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
        slopes = self._slopes.at(now, driver + measurement.superposition_rad, measurement.rear_steer_rad)
        car, demand = self._car, turn.demand_rad
        moment = car.yaw_inertia_kgm2 * (turn.desired_radps - now.yaw_rate_radps) / p.yaw_rate_time_s
        force = -car.mass_kg * now.speed_mps * (now.sideslip_rad - turn.sideslip_rad) / p.sideslip_time_s
        lower, upper = self._angle_bounds(at, works, driver, turn.against_rad)
        front, rear = slopes[0] * car.front_stiffness_Nprad, slopes[1] * car.rear_stiffness_Nprad
        per_angle_Nmprad = np.array([front * car.cg_to_front_m, -rear * car.cg_to_rear_m])
        at_rad, demand_rad = np.array(at), np.array(demand)
        within_rad = np.array([min(max(demand[axle], lower[axle]), upper[axle]) for axle in (0, 1)])
        reached = float(per_angle_Nmprad @ (within_rad - at_rad))
        moment = _missing_moment(moment, float(self._straight_Nmprad @ (demand_rad - at_rad)), reached)
        (per_moment, per_force), effects = self._weights, self._effects
        effects[0, :2] = per_moment * per_angle_Nmprad
        effects[1, :2] = per_force * front, per_force * rear
        target = effects[:, :2] @ at_rad
        target += per_moment * (reached + moment), per_force * force
        hessian = 2.0 * (effects.T @ effects + self._stay)
        gradient = -2.0 * (effects.T @ target)
        gradient[:2] -= 2.0 * self._stay_1prad2 * demand_rad
        gradient[2:_FORCES] += self._brake_cost
        friction = p.brake_fraction * now.friction
        most_kN = [friction * load_N / _KILO for load_N in self._loads_N]
        ranges = self._torques.ranges(command, measurement, now)
        least_kN, greatest_kN = (
            [side * each.largest_Nm(side) / (2.0 * _KILO * self._radii_m[each.place]) for each in ranges]
            for side in (-1.0, 1.0)
        )
        bounds = np.array([*lower, 0.0, 0.0, 0.0, 0.0, *least_kN]), np.array([*upper, *most_kN, *greatest_kN])
        solution = self._solve(hessian, gradient, self._no_rows, *bounds).tolist()
        self._demand_rad = added, rear = solution[:2]
        self._lqr.apply(added, rear)
        self._brakes_Nm = fl, fr, rl, rr = tuple(
            _KILO * force_kN * radius_m for force_kN, radius_m in zip(solution[2:_FORCES], self._radii_m, strict=True)
        )
        differences_Nm = [
            2.0 * _KILO * force_kN * self._radii_m[each.place]
            for force_kN, each in zip(solution[_FORCES:], ranges, strict=True)
        ]
        saturated = abs(added - demand[0]) > p.tolerance_rad or abs(rear - demand[1]) > p.tolerance_rad
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
            side_difference_Pa=self._side_difference(turn, at, works, slopes),
            wheel_torque_demand_Nm=self._torques.of_differences(differences_Nm, ranges, command, measurement),
        )

    def _angle_bounds(
        self, at_rad: tuple[float, float], works: tuple[bool, bool], driver_rad: float, against_rad: float
    ) -> tuple[list[float], list[float]]:
        """Return lower and upper bounds of the angles: limits and rates, or the position of a failed actuator [rad]."""
        lower, upper = [0.0, 0.0], [0.0, 0.0]
        for axle in (0, 1):
            place, most = at_rad[axle], self._limits_rad[axle]
            if not works[axle]:
                lower[axle] = upper[axle] = place
                continue
            against = min(against_rad, most) if axle == 0 else most
            least_rad, most_rad = -against if driver_rad > 0.0 else -most, against if driver_rad < 0.0 else most
            low = max(least_rad, place - self._reach_rad[axle])
            upper[axle] = max(min(most_rad, place + self._reach_rad[axle]), low)
            lower[axle] = min(low, most_rad)
        return lower, upper

    def _side_difference(
        self, turn: Turn, at_rad: tuple[float, float], works: tuple[bool, bool], slopes: tuple[float, float]
    ) -> float:
        """Return the allowed pressure difference between the sides for the remaining angles [Pa]."""
        p, car, now = self._parameters, self._car, turn.estimate
        front, rear = (self._limits_rad[axle] - abs(at_rad[axle]) if works[axle] else 0.0 for axle in (0, 1))
        force_N = min(slopes[0] * car.front_stiffness_Nprad * front, slopes[1] * car.rear_stiffness_Nprad * rear)
        moment_Nm = car.wheelbase_m * max(force_N, 0.0)
        off = abs(turn.desired_radps - now.yaw_rate_radps) / p.side_yaw_rate_radps
        off += abs(now.sideslip_rad - turn.sideslip_rad) / p.side_sideslip_rad
        return min(max(1.0 - off, 0.0) * p.side_difference_Pa, moment_Nm / self._side_moment_m3)


def _missing_moment(desired_Nm: float, demanded_Nm: float, reached_Nm: float) -> float:
    """Return the missing part of a moment [Nm].

    Args:
        desired_Nm: Moment that removes the error.
        demanded_Nm: Moment of the state feedback with tyres that never saturate.
        reached_Nm: Moment of its angles within their limits, with the tyres in their present state.

    Returns:
        Moment of the common sign of desired and demanded moment; 0 if their signs differ, or if it is reached.
    """
    if desired_Nm * demanded_Nm <= 0.0:
        return 0.0
    side = math.copysign(1.0, desired_Nm)
    return side * max(min(side * desired_Nm, side * demanded_Nm) - side * reached_Nm, 0.0)
