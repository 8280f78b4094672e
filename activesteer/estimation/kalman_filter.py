"""The filter of the lateral motion: a compiled extended Kalman filter on the two-track model.

It measures the yaw rate r + b_r and the lateral acceleration a_y + g p + b_y with the roll angle p: an accelerometer
leans with the body. Differences give the derivatives of the model. The unknowns of the model are

    e_i     slip angle errors: Gauss-Markov processes of the size
            `slip_angle_std_rad` + `slip_angle_fraction` |a_i| + `slip_angle_braking_s2radpm` |a_x|
    k_i     stiffness of the tyres of an axle relative to new ones, of the size `stiffness_std`, for `stiffness_s`: it
            shows at small slip angles, where the friction does not
    b_y     offset of the lateral accelerometer, likewise
    g_y     gravity across an inclined road, likewise: it moves the car, and the accelerometer does not measure it
    u       friction, likewise, about its assumed value; it is observable only from forces near the limit
    w       friction of the rear tyres relative to the front tyres, likewise, about 1 for `stiffness_s`
    b_r     offset of the yaw rate sensor, a random walk
    forces  errors of `force_std_N` + `force_fraction` |F| for `force_s`, longitudinal errors of `along_fraction` |X|
    noise   of lateral and yaw acceleration

On a road that is assumed to be dry, the slope of the forces over u is 0 at every slip angle that occurs on snow, so an
extended filter explains their lack by soft tyres. Over the range in which u is uncertain the slope is not 0. So the
lateral acceleration is expected from its values at u and at sqrt(3) standard deviations P to both sides:

    slope = (a+ - a-) / (2 sqrt(3 P)),  mean = a + (a+ + a- - 2 a) / 6,  variance + (a+ + a- - 2 a)^2 / 18

A friction that jumps further than this range would be mistaken for soft tyres or for an offset of the accelerometer all
the same. Therefore a value with an unexpectedly large error changes neither stiffness nor offset. It changes lateral
speed and gravity across the road as an error of two standard deviations would (Huber), and `reopen` makes the friction
unknown again (see `advance`).

While brakes or motors use much of the friction, the filter does not change the properties of road and tyres. Their
uncertainty still counts: it makes the lateral speed uncertain, which the lateral acceleration then corrects (Schmidt).

Sources:
    Norgaard, Poulsen, Ravn, New developments in state estimation for nonlinear systems, Automatica 36 (2000), the
    divided-difference filter of second order with h^2 = 3.
    Simon, Optimal State Estimation, 2006, chapter 13 (extended Kalman filter), section 7.2 (coloured noise).
    Schmidt, Application of State-Space Methods to Navigation Problems, Advances in Control Systems 3, 1966.
    Huber, Robust estimation of a location parameter, Annals of Mathematical Statistics 35, 1964 (limited influence).
    Doumiati, Charara, Victorino, Lechner, Vehicle Dynamics Estimation using Kalman Filtering, 2013, chapter 5.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.estimation.records import (
    AVERAGED_S,
    AY_OFFSET,
    BANK,
    EXPLAINED,
    FRICTION,
    FRONT_ERROR,
    FRONT_SLIP,
    FRONT_STIFFNESS,
    LATERAL_SPEED,
    N_MOVING,
    N_STATES,
    RATE_OFFSET,
    REAR_ERROR,
    REAR_RATIO,
    REAR_SLIP,
    REAR_STIFFNESS,
    YAW_RATE,
)
from activesteer.estimation.two_track_model import (
    LARGEST_FRICTION,
    LARGEST_RATIO,
    LARGEST_STIFFNESS,
    LEAST_FRICTION,
    LEAST_RATIO,
    LEAST_STIFFNESS,
    SLOWEST_MPS,
    follow,
    forces_of,
    slip_angles,
)
from activesteer.native.compilation import compiled, inlined

_DIFFERENCES: Final = np.array([0.01, 0.001, 5e-4, 5e-4, 5e-4, 5e-4, 1.0, 1.0, 1.0, 0.01, 0.01, 0.01, 0.01])
"""Steps of the differences, in the units of the states."""
# Brakes or motors reduce the lateral forces by more than `force_fraction`, by a friction circle that is not exact.
_MOST_BRAKED: Final = 0.25
"""Front longitudinal force over friction force above which lateral forces show neither friction nor stiffness."""
# Three times the 0.05 to 0.10 deg RMS that bump steer and roll cause on a straight road of class C (compact, sedan),
# which the model does not know.
_LEAST_SLIP_RAD: Final = math.radians(0.3)
"""Slip angle of an axle below which its stiffness is not estimated."""
# Two standard deviations: something else has then changed. At the edge of snow, one sample moved the offset by 0.34
# m/s2, six of its deviations, and the friction behind was too low by 0.1. In a slalom on snow, errors of eleven
# deviations moved the lateral speed by 0.7 m/s in 0.1 s.
_SURPRISING: Final = 4.0
"""Squared error over its variance above which a value does not change stiffness and accelerometer offset."""
# For a tenth of a second one axle is still on the old road. From 0.1, 0.2, 0.3, by the error of the sideslip angle.
_NEW_RATIO_STD: Final = 0.3
"""Standard deviation of the friction of the rear tyres relative to the front tyres, on a new road."""
SLIDING_S: Final = 0.3  # three cycles of the anti-lock system
"""Time for which a wheel that has slid counts as sliding, and duration of the error of its friction [s]."""
# In braked turns with an anti-lock system, the wheels of two cars used 83 to 101 % of their friction (median).
_SLIDING_STD: Final = 0.15
"""Relative standard deviation of this friction."""
_CREEP_MPS: Final = 0.05
"""Standard deviation of the lateral speed of an almost standing car [m/s]."""
_CREEP_DENSITY: Final = 0.05
"""Spectral density of the yaw acceleration of such a car [rad2/s3]: 0.5 rad/s2 for 0.1 s, when brakes stop the car."""


@compiled
def begin(known, memory):
    """Set state and covariance for a car that drives straight ahead."""
    state, covariance = memory.state, memory.covariance
    state[:] = 0.0
    state[FRICTION] = known.friction
    state[FRONT_STIFFNESS] = state[REAR_STIFFNESS] = state[REAR_RATIO] = 1.0
    covariance[:] = 0.0
    sizes = (
        0.1, 0.02, 0.005, 0.005, known.slip_angle_std_rad, known.slip_angle_std_rad, known.rate_offset_std_radps,
        known.ay_offset_std_mps2, known.bank_std_mps2, known.friction_std, known.stiffness_std, known.stiffness_std,
        known.rear_ratio_std,
    )  # fmt: skip
    for place in range(N_STATES):
        covariance[place, place] = sizes[place] ** 2


@inlined
def _step_of(state, place):
    """Return the step of a finite difference, away from zero. Mirrored states then have mirrored derivatives."""
    return math.copysign(_DIFFERENCES[place], state[place])


@inlined
def _set_braking(known, memory):
    """Set whether longitudinal forces hide road and tyres, and whether the filter takes these as known."""
    plausible = memory.state[FRICTION] + math.sqrt(memory.covariance[FRICTION, FRICTION])
    memory.braked = abs(memory.front_along_N) > 2.0 * _MOST_BRAKED * plausible * known.front_load_N
    # Else a car whose yaw rate has the wrong sign spins: only the lateral acceleration shows its motion.
    memory.taken_as_known = memory.braked and memory.mean_innovation > EXPLAINED


@inlined
def _force_errors(known, front_N, rear_N):
    """Return the variances of the force errors of both axles [N2]."""
    front = known.force_std_N + known.force_fraction * abs(front_N)
    rear = known.force_std_N + known.force_fraction * abs(rear_N)
    return front * front, rear * rear


@compiled
def _differentiate(known, tyres, memory, duration_s, moved, slope):
    """Compute the state after an interval, and its derivatives with respect to the current state."""
    state = memory.state
    start, other = state.copy(), np.empty(N_STATES)
    follow(known, tyres, memory, start, duration_s, moved)
    for column in range(N_STATES):
        slope[:, column] = 0.0
        slope[column, column] = 1.0
        if column in (RATE_OFFSET, AY_OFFSET) or (memory.taken_as_known and column >= FRICTION):
            continue
        step = _step_of(state, column)
        start[column] += step
        follow(known, tyres, memory, start, duration_s, other)
        start[column] = state[column]
        for row in range(N_MOVING):
            slope[row, column] = (other[row] - moved[row]) / step


@compiled
def _forget(known, memory, duration_s, moved, slope, added):
    """Relax the Gauss-Markov processes towards their means, and add their process noise."""
    vx_mps = max(memory.speed_mps, SLOWEST_MPS)
    front_rad, rear_rad = slip_angles(known, memory, memory.state, vx_mps)
    toe_rad = known.slip_angle_std_rad + known.slip_angle_braking_s2radpm * abs(memory.ax_mps2)
    front = toe_rad + known.slip_angle_fraction * abs(front_rad)
    rear = toe_rad + known.slip_angle_fraction * abs(rear_rad)
    for place, mean, size, time_s in (
        (FRONT_ERROR, 0.0, front, known.slip_angle_s),
        (REAR_ERROR, 0.0, rear, known.slip_angle_s),
        (AY_OFFSET, 0.0, known.ay_offset_std_mps2, known.ay_offset_s),
        (BANK, 0.0, known.bank_std_mps2, known.bank_s),
        (FRICTION, known.friction, known.friction_std, known.friction_s),
        (FRONT_STIFFNESS, 1.0, known.stiffness_std, known.stiffness_s),
        (REAR_STIFFNESS, 1.0, known.stiffness_std, known.stiffness_s),
        (REAR_RATIO, 1.0, known.rear_ratio_std, known.stiffness_s),
    ):
        kept = math.exp(-duration_s / time_s)
        moved[place] = mean + kept * (moved[place] - mean)
        slope[place, place] = kept
        added[place, place] = size * size * (1.0 - kept * kept)


@compiled
def _add_noise(known, tyres, memory, duration_s, added):
    """Write the process noise covariance of the motion over an interval."""
    front_N, rear_N = forces_of(known, tyres, memory, memory.state)
    front, rear = _force_errors(known, front_N, rear_N)
    # An error that lasts for a time acts like white noise of twice this time.
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
    cross = density * (to_front * front - to_rear * rear) / mass / inertia
    added[LATERAL_SPEED, YAW_RATE] = added[YAW_RATE, LATERAL_SPEED] = cross
    added[RATE_OFFSET, RATE_OFFSET] = known.rate_walk_rad2ps3 * duration_s
    if memory.speed_mps < SLOWEST_MPS:
        added[LATERAL_SPEED, LATERAL_SPEED] = _CREEP_MPS * _CREEP_MPS
        added[YAW_RATE, YAW_RATE] = _CREEP_DENSITY * duration_s
        added[LATERAL_SPEED, YAW_RATE] = added[YAW_RATE, LATERAL_SPEED] = 0.0


@compiled
def predict(known, tyres, memory, duration_s):
    """Advance the state and its covariance by an interval."""
    n, covariance = N_STATES, memory.covariance
    moved, slope, half, added = np.empty(n), np.empty((n, n)), np.empty((n, n)), np.zeros((n, n))
    was_braked = memory.braked
    _set_braking(known, memory)
    _differentiate(known, tyres, memory, duration_s, moved, slope)
    _forget(known, memory, duration_s, moved, slope, added)
    _add_noise(known, tyres, memory, duration_s, added)
    for row in range(n):
        memory.state[row] = moved[row]
        for column in range(n):
            total = 0.0
            if row < N_MOVING:
                for k in range(n):
                    total += slope[row, k] * covariance[k, column]
            else:
                total = slope[row, row] * covariance[row, column]
            half[row, column] = total
    for row in range(n):
        for column in range(row + 1):
            total = added[row, column]
            if column < N_MOVING:
                for k in range(n):
                    total += half[row, k] * slope[column, k]
            else:
                total += half[row, column] * slope[column, column]
            covariance[row, column] = covariance[column, row] = total
    if memory.taken_as_known or (was_braked and not memory.braked):
        # The friction circle is not exact, so what has happened while braking does not show road and tyres afterwards.
        for place in range(FRICTION, n):
            variance = covariance[place, place]
            covariance[place, :] = covariance[:, place] = 0.0
            covariance[place, place] = variance


@inlined
def _with_friction(known, tyres, memory, friction):
    """Return the lateral acceleration from the tyre forces at another friction [m/s2]."""
    memory.state[FRICTION] = friction
    front_N, rear_N = forces_of(known, tyres, memory, memory.state)
    across_N = front_N * math.cos(memory.front_angle_rad) + rear_N * math.cos(memory.rear_angle_rad)
    return across_N / known.mass_kg


@compiled
def _over_friction(known, tyres, memory, here_mps2):
    """Return slope and curvature of the lateral acceleration versus friction, within its uncertainty."""
    kept, spread = memory.state[FRICTION], math.sqrt(3.0 * memory.covariance[FRICTION, FRICTION])
    high, low = min(kept + spread, LARGEST_FRICTION), max(kept - spread, LEAST_FRICTION)
    above_mps2 = _with_friction(known, tyres, memory, high)
    below_mps2 = _with_friction(known, tyres, memory, low)
    memory.state[FRICTION] = kept
    return (above_mps2 - below_mps2) / (high - low), above_mps2 + below_mps2 - 2.0 * here_mps2


@inlined
def _take_in(state, covariance, row, error, variance, braked):
    """Process one measured value, and return the expected variance of its error."""
    n = len(state)
    spread, expected = np.zeros(n), variance
    for i in range(n):
        for k in range(n):
            spread[i] += covariance[i, k] * row[k]
    for i in range(n):
        expected += row[i] * spread[i]
    # The uncertainty of states without gain counts (Schmidt's filter); a surprise has a limited effect on others.
    surprise = error * error / (_SURPRISING * expected)
    used = np.ones(n)
    if surprise > 1.0:
        used[AY_OFFSET] = used[FRONT_STIFFNESS] = used[REAR_STIFFNESS] = 0.0
        used[LATERAL_SPEED] = used[BANK] = 1.0 / math.sqrt(surprise)
    if braked:  # forces then show neither friction nor stiffness
        used[FRICTION:] = 0.0
    if abs(state[FRONT_SLIP]) < _LEAST_SLIP_RAD:
        used[FRONT_STIFFNESS] = 0.0
    if abs(state[REAR_SLIP]) < _LEAST_SLIP_RAD:
        used[REAR_STIFFNESS] = 0.0
    for i in range(n):
        state[i] += used[i] * spread[i] / expected * error
        for k in range(i + 1):
            part = used[i] + used[k] - used[i] * used[k]
            covariance[i, k] -= part * spread[i] * spread[k] / expected
            covariance[k, i] = covariance[i, k]
    return expected


@compiled
def correct(known, tyres, memory, yaw_rate_radps, ay_mps2, duration_s):
    """Process a measurement, and return its normalised squared error and that of the yaw rate alone (chi-square)."""
    state, covariance, row = memory.state, memory.covariance, np.zeros(N_STATES)
    row[YAW_RATE] = row[RATE_OFFSET] = 1.0
    error = yaw_rate_radps - state[YAW_RATE] - state[RATE_OFFSET]
    variance = known.rate_variance_rad2ps2 + (known.rate_fraction * yaw_rate_radps) ** 2
    # One value after the other: the first changes the expectation of the second.
    of_rate = error * error / _take_in(state, covariance, row, error, variance, memory.braked)
    row[YAW_RATE] = row[RATE_OFFSET] = 0.0
    mass = known.mass_kg
    front_N, rear_N = forces_of(known, tyres, memory, state)
    sin_f, cos_f, cos_r = (
        math.sin(memory.front_angle_rad),
        math.cos(memory.front_angle_rad),
        math.cos(memory.rear_angle_rad),
    )
    here_mps2 = (front_N * cos_f + rear_N * cos_r) / mass
    row[FRICTION], bend_mps2 = _over_friction(known, tyres, memory, here_mps2)
    for place in (FRONT_SLIP, REAR_SLIP, FRONT_STIFFNESS, REAR_STIFFNESS, REAR_RATIO):
        kept, step = state[place], _step_of(state, place)
        state[place] += step
        other_front_N, other_rear_N = forces_of(known, tyres, memory, state)
        state[place] = kept
        row[place] = ((other_front_N - front_N) * cos_f + (other_rear_N - rear_N) * cos_r) / (mass * step)
    if memory.taken_as_known:
        bend_mps2 = 0.0
        row[FRICTION:] = 0.0
    row[AY_OFFSET] = 1.0
    expected = (front_N * cos_f + rear_N * cos_r + memory.front_along_N * sin_f) / mass + bend_mps2 / 6.0
    error = ay_mps2 - expected - GRAVITY_MPS2 * memory.roll_rad - state[AY_OFFSET]
    front, rear = _force_errors(known, front_N, rear_N)
    # A force error lasts: during this time all samples count as one measurement.
    repeated = 1.0 + 2.0 * known.force_s / duration_s
    variance = known.ay_variance_m2ps4 + (known.ay_fraction * ay_mps2) ** 2 + repeated * (front + rear) / (mass * mass)
    variance += bend_mps2 * bend_mps2 / 18.0
    of_both = of_rate + error * error / _take_in(state, covariance, row, error, variance, memory.braked)
    state[FRICTION] = min(max(state[FRICTION], LEAST_FRICTION), LARGEST_FRICTION)
    for place in (FRONT_STIFFNESS, REAR_STIFFNESS):
        state[place] = min(max(state[place], LEAST_STIFFNESS), LARGEST_STIFFNESS)
    state[REAR_RATIO] = min(max(state[REAR_RATIO], LEAST_RATIO), LARGEST_RATIO)
    memory.mean_innovation += duration_s / (duration_s + AVERAGED_S) * (of_both - memory.mean_innovation)
    return of_both, of_rate


@compiled
def reopen(known, memory):
    """Reset the uncertainty of the friction to its initial value, because the road has changed."""
    covariance = memory.covariance
    for place, size in ((FRICTION, known.friction_std), (REAR_RATIO, _NEW_RATIO_STD)):
        variance = max(covariance[place, place], size * size)
        covariance[place, :] = covariance[:, place] = 0.0
        covariance[place, place] = variance


@compiled
def take_in_friction(memory, friction, duration_s):
    """Correct the friction with the friction of sliding wheels."""
    covariance, std = memory.covariance, _SLIDING_STD * friction
    # Its error lasts: during this time all samples count as one measurement.
    variance = std * std * (1.0 + 2.0 * SLIDING_S / duration_s)
    gain = covariance[FRICTION, FRICTION] / (covariance[FRICTION, FRICTION] + variance)
    memory.state[FRICTION] += gain * (friction - memory.state[FRICTION])
    covariance[:, FRICTION] *= 1.0 - gain
    covariance[FRICTION, :] = covariance[:, FRICTION]
