"""The filter of the lateral motion: an extended Kalman filter on the two-track model, compiled.

It measures the yaw rate r + b_r and the lateral acceleration a_y + g p + b_y with the roll angle p: an accelerometer
leans with the body. The derivatives of the model are differences. What the model does not know are

    e_i     slip angle errors: Gauss-Markov processes of the size `slip_angle_std_rad` + `slip_angle_fraction` |a_i|
    b_y     offset of the sensor and inclination of the road, likewise
    u       friction, likewise, about what it is taken for until it shows; nothing but forces near the limit shows it
    b_r     offset of the yaw rate's sensor, a random walk
    forces  wrong by `force_std_N` + `force_fraction` |F| for `force_s`, longitudinal ones by `along_fraction` |X|
    noise   of lateral and yaw acceleration

Sources:
    Simon, Optimal State Estimation, 2006, chapter 13 (extended Kalman filter), section 7.2 (coloured noise).
    Doumiati, Charara, Victorino, Lechner, Vehicle Dynamics Estimation using Kalman Filtering, 2013, chapter 5.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.compilation import compiled, inlined
from activesteer.conventions import GRAVITY_MPS2
from activesteer.estimation.records import (
    AY_OFFSET,
    FRICTION,
    FRONT_ERROR,
    FRONT_SLIP,
    LATERAL_SPEED,
    N_STATES,
    RATE_OFFSET,
    REAR_ERROR,
    REAR_SLIP,
    YAW_RATE,
)
from activesteer.estimation.two_track_model import (
    LARGEST_FRICTION,
    LEAST_FRICTION,
    SLOWEST_MPS,
    follow,
    forces_of,
    slip_angles,
)

_DIFFERENCES: Final = np.array([0.01, 0.001, 5e-4, 5e-4, 5e-4, 5e-4, 1.0, 1.0, 0.01])
"""Steps of the differences, in the units of the states."""
_MOST_BRAKED: Final = 0.25
"""Fraction of the front axle's friction beyond which lateral forces say nothing of the friction: brakes then take more
of them, by a circle of friction that is itself not exact, than `force_fraction`."""
_CREEP_MPS: Final = 0.05
"""Standard deviation of the lateral speed of a car that hardly moves [m/s]."""
_CREEP_DENSITY: Final = 0.05
"""Spectral density of its yaw acceleration [rad2/s3]: 0.5 rad/s2 for 0.1 s, when brakes bring it to a stop."""


@compiled
def begin(known, memory):
    """A car that drives straight on.

    Args:
        known: Record of `KNOWN`.
        memory: Record of `MEMORY`; state and covariance are changed.
    """
    state, covariance = memory.state, memory.covariance
    state[:] = 0.0
    state[FRICTION] = known.friction
    covariance[:] = 0.0
    sizes = (
        0.1, 0.02, 0.005, 0.005, known.slip_angle_std_rad, known.slip_angle_std_rad, known.rate_offset_std_radps,
        known.ay_offset_std_mps2, known.friction_std,
    )  # fmt: skip
    for place in range(N_STATES):
        covariance[place, place] = sizes[place] ** 2


@inlined
def _step_of(state, place):
    """Step of a difference, outwards: what is mirrored has mirrored derivatives."""
    return math.copysign(_DIFFERENCES[place], state[place])


@inlined
def _is_braked(known, memory):
    return abs(memory.front_along_N) > 2.0 * _MOST_BRAKED * memory.state[FRICTION] * known.front_load_N


@inlined
def _force_errors(known, front_N, rear_N):
    """Variances of what is wrong with the forces of both axles [N2]."""
    front = known.force_std_N + known.force_fraction * abs(front_N)
    rear = known.force_std_N + known.force_fraction * abs(rear_N)
    return front * front, rear * rear


@compiled
def _differentiate(known, tyres, memory, duration_s, moved, slope):
    """The state after a while, and its derivatives by the state now."""
    state = memory.state
    start, other = state.copy(), np.empty(N_STATES)
    follow(known, tyres, memory, start, duration_s, moved)
    for column in range(N_STATES):
        slope[:, column] = 0.0
        slope[column, column] = 1.0
        if column in (RATE_OFFSET, AY_OFFSET) or (column == FRICTION and _is_braked(known, memory)):
            continue
        step = _step_of(state, column)
        start[column] += step
        follow(known, tyres, memory, start, duration_s, other)
        start[column] = state[column]
        for row in range(N_STATES):
            slope[row, column] = (other[row] - moved[row]) / step


@compiled
def _forget(known, memory, duration_s, moved, slope, added):
    """Gauss-Markov processes go back to their mean, and are made uncertain anew."""
    vx_mps = max(memory.speed_mps, SLOWEST_MPS)
    front_rad, rear_rad = slip_angles(known, memory, memory.state, vx_mps)
    front = known.slip_angle_std_rad + known.slip_angle_fraction * abs(front_rad)
    rear = known.slip_angle_std_rad + known.slip_angle_fraction * abs(rear_rad)
    for place, mean, size, time_s in (
        (FRONT_ERROR, 0.0, front, known.slip_angle_s),
        (REAR_ERROR, 0.0, rear, known.slip_angle_s),
        (AY_OFFSET, 0.0, known.ay_offset_std_mps2, known.ay_offset_s),
        (FRICTION, known.friction, known.friction_std, known.friction_s),
    ):
        kept = math.exp(-duration_s / time_s)
        moved[place] = mean + kept * (moved[place] - mean)
        slope[place, place] = kept
        added[place, place] = size * size * (1.0 - kept * kept)


@compiled
def _add_noise(known, tyres, memory, duration_s, added):
    """What comes to the covariance of the motion in a while."""
    front_N, rear_N = forces_of(known, tyres, memory, memory.state)
    front, rear = _force_errors(known, front_N, rear_N)
    # What is wrong for a time does what white noise of twice that time does.
    density = 2.0 * known.force_s * duration_s
    mass, inertia = known.mass_kg, known.yaw_inertia_kgm2
    to_front, to_rear = known.cg_to_front_m, known.cg_to_rear_m
    turning = to_front * to_front * front + to_rear * to_rear * rear
    for wheel in range(4):
        turning += (known.half_track_m[wheel] * known.along_fraction * memory.along_N[wheel]) ** 2
    added[LATERAL_SPEED, LATERAL_SPEED] = (
        known.lateral_density_m2ps3 * duration_s + density * (front + rear) / mass / mass
    )
    added[YAW_RATE, YAW_RATE] = known.yaw_density_rad2ps3 * duration_s + density * turning / inertia / inertia
    both = density * (to_front * front - to_rear * rear) / mass / inertia
    added[LATERAL_SPEED, YAW_RATE] = added[YAW_RATE, LATERAL_SPEED] = both
    added[RATE_OFFSET, RATE_OFFSET] = known.rate_walk_rad2ps3 * duration_s
    if memory.speed_mps < SLOWEST_MPS:
        added[LATERAL_SPEED, LATERAL_SPEED] = _CREEP_MPS * _CREEP_MPS
        added[YAW_RATE, YAW_RATE] = _CREEP_DENSITY * duration_s
        added[LATERAL_SPEED, YAW_RATE] = added[YAW_RATE, LATERAL_SPEED] = 0.0


@compiled
def predict(known, tyres, memory, duration_s):
    """The state and its covariance after a while.

    Args:
        known: Record of `KNOWN`.
        tyres: Grids of front and rear tyres' lateral force [N].
        memory: Record of `MEMORY`; state and covariance are changed.
        duration_s: Time to go on [s].
    """
    n, covariance = N_STATES, memory.covariance
    moved, slope, half, added = np.empty(n), np.empty((n, n)), np.empty((n, n)), np.zeros((n, n))
    _differentiate(known, tyres, memory, duration_s, moved, slope)
    _forget(known, memory, duration_s, moved, slope, added)
    _add_noise(known, tyres, memory, duration_s, added)
    for row in range(n):
        memory.state[row] = moved[row]
        for column in range(n):
            total = 0.0
            for k in range(n):
                total += slope[row, k] * covariance[k, column]
            half[row, column] = total
    for row in range(n):
        for column in range(row + 1):
            total = added[row, column]
            for k in range(n):
                total += half[row, k] * slope[column, k]
            covariance[row, column] = covariance[column, row] = total
    if _is_braked(known, memory):
        # What is not learned must not follow what is: it would be drawn along by what both had in common before.
        variance = covariance[FRICTION, FRICTION]
        covariance[FRICTION, :] = covariance[:, FRICTION] = 0.0
        covariance[FRICTION, FRICTION] = variance


@inlined
def _take_in(state, covariance, row, error, variance):
    """Takes in one measured number; returns the variance of the error that was expected."""
    n = len(state)
    spread, expected = np.zeros(n), variance
    for i in range(n):
        for k in range(n):
            spread[i] += covariance[i, k] * row[k]
    for i in range(n):
        expected += row[i] * spread[i]
    for i in range(n):
        state[i] += spread[i] / expected * error
        for k in range(i + 1):
            covariance[i, k] -= spread[i] * spread[k] / expected
            covariance[k, i] = covariance[i, k]
    return expected


@compiled
def correct(known, tyres, memory, yaw_rate_radps, ay_mps2, duration_s):
    """Takes in what the sensors said.

    Args:
        known: Record of `KNOWN`.
        tyres: Grids of front and rear tyres' lateral force [N].
        memory: Record of `MEMORY`; state and covariance are changed.
        yaw_rate_radps: Yaw rate as measured [rad/s].
        ay_mps2: Lateral acceleration as measured [m/s2].
        duration_s: Time since they were last taken in [s].

    Returns:
        Squared error of both over its expected covariance: of the chi-square distribution with two degrees of freedom.
    """
    state, covariance, row = memory.state, memory.covariance, np.zeros(N_STATES)
    row[YAW_RATE] = row[RATE_OFFSET] = 1.0
    error = yaw_rate_radps - state[YAW_RATE] - state[RATE_OFFSET]
    variance = known.rate_variance_rad2ps2 + (known.rate_fraction * yaw_rate_radps) ** 2
    # One after the other: the second is expected as the first leaves it.
    innovation = error * error / _take_in(state, covariance, row, error, variance)
    row[YAW_RATE] = row[RATE_OFFSET] = 0.0
    mass = known.mass_kg
    front_N, rear_N = forces_of(known, tyres, memory, state)
    sin_f, cos_f, cos_r = (
        math.sin(memory.front_angle_rad),
        math.cos(memory.front_angle_rad),
        math.cos(memory.rear_angle_rad),
    )
    for place in (FRONT_SLIP, REAR_SLIP, FRICTION):
        if place == FRICTION and _is_braked(known, memory):
            continue
        kept, step = state[place], _step_of(state, place)
        state[place] += step
        other_front_N, other_rear_N = forces_of(known, tyres, memory, state)
        state[place] = kept
        row[place] = ((other_front_N - front_N) * cos_f + (other_rear_N - rear_N) * cos_r) / (mass * step)
    row[AY_OFFSET] = 1.0
    expected = (front_N * cos_f + rear_N * cos_r + memory.front_along_N * sin_f) / mass
    error = ay_mps2 - expected - GRAVITY_MPS2 * memory.roll_rad - state[AY_OFFSET]
    front, rear = _force_errors(known, front_N, rear_N)
    # A force that is wrong stays so: in all that time it counts as one measurement.
    repeated = 1.0 + 2.0 * known.force_s / duration_s
    variance = known.ay_variance_m2ps4 + (known.ay_fraction * ay_mps2) ** 2 + repeated * (front + rear) / (mass * mass)
    innovation += error * error / _take_in(state, covariance, row, error, variance)
    state[FRICTION] = min(max(state[FRICTION], LEAST_FRICTION), LARGEST_FRICTION)
    return innovation
