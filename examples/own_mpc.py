"""Steer both axles by model predictive control within an envelope, with your own controller and solver.

    pip install '.[control]'     # in a checkout
    python examples/own_mpc.py
    activesteer run sine_with_dwell -c none -c "examples/own_mpc.py:EnvelopeMpc?sideslip_scale_deg=0.5"

Every 10 ms the controller predicts a quarter of a second and looks for angles, constant in blocks, that minimise

    sum of ((r - r*) / r_s)^2 + (beta / beta_s)^2 + |(u - u*) / u_s|^2 + |(change of u) / d_s|^2 + slack
    with |r| <= mu g / v and |alpha_rear| <= slip angle of the largest force, softened by the slack,

where r* is the yaw rate that the driver demands and u* the angles of its steady turn without sideslip. The rear axle
has the tangent of its curve at the present slip angle: where it slides, steering it has no effect. The front axle has
the stiffness force / slip angle: it is the axle that can be steered back until it loses force.

Source of envelope and tangent: Beal and Gerdes, Model Predictive Control for Vehicle Stabilization at the Limits of
Handling, IEEE Transactions on Control Systems Technology 21 (4), 2013. Rear steering, lags and blocks are added.
Guide: docs/controller.md.
"""

import math

import daqp
import numpy as np
from scipy.linalg import expm

import activesteer
from activesteer import ActuatorCommand

GRAVITY_MPS2 = 9.81
BLOCKS = (1, 2, 3, 6, 12)  # calls for which the angles are constant
CHECKED = (1, 3, 6, 9, 12, 18, 23)  # calls at which the envelope holds
SLACK_WEIGHT = 1e7  # a hundred times the cost of a yaw rate error over the whole horizon


class EnvelopeMpc:
    """Front superposition and rear steering within an envelope of yaw rate and rear slip angle."""

    interval_s = 0.01

    def __init__(self, setup, yaw_rate_scale_degps=1.0, sideslip_scale_deg=0.35, change_scale_deg=5.0):
        """Take the car, its tyres and its servos from `setup`, and scales of errors that cost the same."""
        self.car, self.timestep_s, self.servos = setup.single_track, setup.timestep_s, setup.gains.servos
        self.estimator, tyres = setup.estimator(), setup.estimation.tyres
        arms_m = self.car.cg_to_rear_m, self.car.cg_to_front_m  # the other axle's arm gives the load
        loads_N = [0.5 * self.car.mass_kg * GRAVITY_MPS2 * arm_m / self.car.wheelbase_m for arm_m in arms_m]
        self.curves = [curve(tyre, load_N) for tyre, load_N in zip(tyres, loads_N, strict=True)]
        self.scales = np.radians([yaw_rate_scale_degps, sideslip_scale_deg, 2.5, 2.0])  # last: the angles u
        self.change_rad = math.radians(change_scale_deg)
        self.limits_rad = np.array([self.servos.superposition_limit_rad, self.servos.rear_limit_rad])
        rates_radps = np.array([self.servos.superposition_rate_radps, self.servos.rear_rate_radps])
        self.reach_rad = rates_radps * self.timestep_s
        self.before_rad, self.lagged_rad = np.zeros(2), 0.0

    def step(self, command, measurement):
        """Return both angles, every 10 ms."""
        now = self.estimator.step(measurement)
        speed_mps, driver_rad = now.speed_mps, command.front_steer_demand_rad
        if speed_mps < 2.0:
            self.before_rad = np.zeros(2)
            return ActuatorCommand(estimate=now)
        most_radps = now.friction * GRAVITY_MPS2 / speed_mps
        self.lagged_rad += -math.expm1(-self.timestep_s * speed_mps / 0.65) * (driver_rad - self.lagged_rad)
        a, b, _ = single_track(self.car, speed_mps, (1.0, 1.0))
        gain_1ps = np.linalg.solve(a, -b[:, 0])[0]  # yaw rate of the car without control per angle
        desired_radps = float(np.clip(gain_1ps * self.lagged_rad, -0.85 * most_radps, 0.85 * most_radps))
        steady_rad = np.linalg.solve(b, -a[:, 0] * desired_radps) - (driver_rad, 0.0)

        added_rad, rear_rad = measurement.superposition_rad, measurement.rear_steer_rad
        turning = now.yaw_rate_radps / speed_mps
        slips_rad = (
            driver_rad + added_rad - now.sideslip_rad - self.car.cg_to_front_m * turning,
            rear_rad - now.sideslip_rad + self.car.cg_to_rear_m * turning,
        )
        softness = secant(*self.curves[0], slips_rad[0] / now.friction)
        slope, offset_rad = tangent(*self.curves[1], slips_rad[1] / now.friction)
        model = single_track(self.car, speed_mps, (softness, slope), now.friction * offset_rad)
        angles_rad, forces = self.curves[1]
        envelope = most_radps, now.friction * angles_rad[forces.argmax()]
        state = np.array([now.yaw_rate_radps, now.sideslip_rad, added_rad, rear_rad, driver_rad])
        demand, outside = self.solve(state, speed_mps, model, desired_radps, steady_rad, envelope)
        self.before_rad = demand
        return ActuatorCommand(
            rear_steer_demand_rad=float(demand[1]),
            superposition_demand_rad=float(demand[0]),
            yaw_rate_desired_radps=desired_radps,
            prediction_rad=float(steady_rad[1]),
            correction_rad=float(demand[1] - steady_rad[1]),
            saturated=outside,
            estimate=now,
        )

    def solve(self, state, speed_mps, model, desired_radps, steady_rad, envelope):
        """Return the first angles, and whether the car leaves the envelope."""
        a, b, c = discrete(*model, self.servos.lag_s, self.timestep_s)
        block_of, unknowns = np.repeat(np.arange(len(BLOCKS)), BLOCKS), 2 * len(BLOCKS)
        fixed = a @ state + b @ self.before_rad + c  # the present demand acts from the next call on
        moved = np.zeros((len(state), unknowns))
        target = np.array([desired_radps, 0.0])
        rows, offsets, checked, checked_offsets = [], [], [], []
        slip = np.array([self.car.cg_to_rear_m / speed_mps, -1.0, 0.0, 1.0, 0.0])
        for call, block in enumerate(block_of):
            chosen = np.zeros((2, unknowns))
            chosen[:, 2 * block : 2 * block + 2] = np.eye(2)
            fixed, moved = a @ fixed + c, a @ moved + b @ chosen
            rows.append(np.vstack([moved[:2], chosen]) / self.scales[:, None])
            offsets.append(np.concatenate([fixed[:2] - target, -steady_rad]) / self.scales)
            if call in CHECKED:
                checked.append([moved[0], slip @ moved])
                checked_offsets.append([fixed[0], slip @ fixed])
        changes = (np.eye(unknowns) - np.eye(unknowns, k=-2)) / self.change_rad
        rows.append(changes)
        offsets.append(np.concatenate([-self.before_rad, np.zeros(unknowns - 2)]) / self.change_rad)
        rows, offsets = np.vstack(rows), np.concatenate(offsets)
        hessian = np.diag([*np.zeros(unknowns), SLACK_WEIGHT, SLACK_WEIGHT])
        hessian[:unknowns, :unknowns] = rows.T @ rows
        gradient = np.concatenate([rows.T @ offsets, [0.0, 0.0]])

        slack = np.tile(np.eye(2), (len(CHECKED), 1))
        checked, at = np.vstack(checked), np.concatenate(checked_offsets)
        bound, free = np.tile(envelope, len(CHECKED)), np.full(len(at), np.inf)
        constraints = np.vstack([np.hstack([checked, -slack]), np.hstack([checked, slack])])
        most = np.tile(self.limits_rad, len(BLOCKS))
        most[:2] = np.minimum(self.before_rad + self.reach_rad, self.limits_rad)
        least = np.tile(-self.limits_rad, len(BLOCKS))
        least[:2] = np.maximum(self.before_rad - self.reach_rad, -self.limits_rad)
        upper = np.concatenate([most, [np.inf, np.inf], bound - at, free])
        lower = np.concatenate([least, [0.0, 0.0], -free, -bound - at])
        x, _, flag, _ = daqp.solve(hessian, gradient, constraints, upper, lower, np.zeros(len(upper), dtype=np.int32))
        if flag <= 0:
            raise RuntimeError(f"DAQP finds no solution (exit flag {flag})")
        return x[:2].copy(), bool(x[-2:].max() > 1e-6)


def curve(tyre, load_N):
    """Return slip angles [rad] and side forces of a tyre under a load, the slope at zero slip angle being 1."""
    loads_N = tyre.load_step_N * np.arange(len(tyre.force_N))
    forces_N = np.array([np.interp(load_N, loads_N, column) for column in np.array(tyre.force_N).T])
    return tyre.slip_angle_step_rad * np.arange(len(forces_N)), forces_N * tyre.slip_angle_step_rad / forces_N[1]


def secant(angles_rad, forces, slip_rad):
    """Return force versus slip angle, 1 at zero slip angle."""
    size_rad = max(abs(slip_rad), 1e-6)
    return max(np.interp(size_rad, angles_rad, forces) / size_rad, 0.1)


def tangent(angles_rad, forces, slip_rad):
    """Return slope and offset of the tangent, slope * slip angle + offset, 0 where the force falls."""
    size_rad, step_rad = min(abs(slip_rad), angles_rad[-1]), angles_rad[1]
    force, further = np.interp([size_rad, size_rad + step_rad], angles_rad, forces)
    slope = max((further - force) / step_rad, 0.0)
    return slope, math.copysign(force - slope * size_rad, slip_rad)


def single_track(car, speed_mps, softer, offset_rad=0.0):
    """Return the matrices of yaw rate and sideslip angle for the angles of both axles, and their constant rates.

    Both axles' stiffness may be lower; the offset is a slip angle that the rear axle seems to have in addition.
    """
    front, rear = car.front_stiffness_Nprad * softer[0], car.rear_stiffness_Nprad * softer[1]
    lf, lr, momentum = car.cg_to_front_m, car.cg_to_rear_m, car.mass_kg * speed_mps
    moment = rear * lr - front * lf
    a = [
        [-(front * lf**2 + rear * lr**2) / (car.yaw_inertia_kgm2 * speed_mps), moment / car.yaw_inertia_kgm2],
        [moment / (momentum * speed_mps) - 1.0, -(front + rear) / momentum],
    ]
    b = [
        [front * lf / car.yaw_inertia_kgm2, -rear * lr / car.yaw_inertia_kgm2],
        [front / momentum, rear / momentum],
    ]
    more_N = car.rear_stiffness_Nprad * offset_rad
    return np.array(a), np.array(b), np.array([-lr / car.yaw_inertia_kgm2, 1.0 / momentum]) * more_N


def discrete(a, b, c, lag_s, timestep_s):
    """Return the model from one call to the next, for yaw rate, sideslip, both angles and the driver's angle."""
    whole = np.zeros((8, 8))
    whole[:2, :2], whole[:2, 2:4], whole[:2, 4], whole[:2, 7] = a, b, b[:, 0], c
    whole[2:4, 2:4], whole[2:4, 5:7] = -np.eye(2) / lag_s, np.eye(2) / lag_s
    whole = expm(timestep_s * whole)
    return whole[:5, :5], whole[:5, 5:7], whole[:5, 7]


def compare():
    """Drive the same sine with dwell without control and with the controller, with the sensors of a production car."""
    sensors = {"sensors.preset": "production"}
    controllers = {"none": "none", "envelope": EnvelopeMpc}
    return {name: activesteer.simulate("sine_with_dwell", it, overrides=sensors) for name, it in controllers.items()}


if __name__ == "__main__":
    for name, recording in compare().items():
        sideslip_deg = math.degrees(recording.metrics["sideslip_peak_abs_rad"])
        print(f"{name:9} sideslip {sideslip_deg:5.1f} deg, {recording.metrics['lateral_displacement_m']:.2f} m aside")
