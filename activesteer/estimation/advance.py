"""Compiled step of the estimator: update the filters with new samples, and compute the estimate.

The inertial sensors are late by their delay and low-pass. The filters run at the time of the measurement: a buffer
holds angles, wheel speeds and pressures until then. From there only the model runs to the current time, with the later
angles.

Two things show the friction where the lateral forces do not. Errors that the filter does not explain add up until the
friction is made unknown again (a cumulative sum). And while the brakes slide wheels of both sides, the car uses nearly
all of its friction.

Sources:
    Page, Continuous inspection schemes, Biometrika 41, 1954 (cumulative sum).
    Gustafsson, Slip-based tire-road friction estimation, Automatica 33, 1997 (such a test next to a Kalman filter).

Arguments of the compiled functions of this folder:

    known       knowledge of the car and its sensors, a record of `known_of`
    tyres       grids of front and rear tyres' lateral force, shape (2, loads, slip angles) [N]
    memory      states, covariances and inputs, a record of `MEMORY`, which is changed
    said        a measurement, in the order of `SAID`
    line        measurements of the last calls, a ring buffer
    duration_s  time since the last step [s]
"""

from __future__ import annotations

import math
from typing import Final

from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.estimation.kalman_filter import SLIDING_S, begin, correct, predict, reopen, take_in_friction
from activesteer.estimation.records import (
    AY_OFFSET,
    FRICTION,
    FRONT_STIFFNESS,
    LATERAL_SPEED,
    N_STATES,
    REAR_RATIO,
    REAR_STIFFNESS,
    SAID_AX,
    SAID_AY,
    SAID_RATE,
    SAID_REAR,
    SAID_SPINS,
    SAID_SUPERPOSITION,
    SAID_WHEEL,
    YAW_RATE,
)
from activesteer.estimation.speed_filter import correct_speed, predict_speed, read_wheels, start_speed
from activesteer.estimation.two_track_model import SLOWEST_MPS, follow, follow_roll, forces_of
from activesteer.native.compilation import compiled, inlined

_SHORTEST_S: Final = 0.004
"""Shortest time between two steps of the filters, and step of the model on its way to the current time [s]."""
# The used friction is the acceleration over the largest one that the tyres allow on the road of their files. Its
# largest value is forgotten with `friction_s`. Only forces that need a higher friction show one. Without the upper
# bound, front wheels that reach snow before the rear ones were explained by more friction.
_USED_FRACTION: Final = 0.85
"""The friction is at least the used friction times this, and at most the largest used friction over this. The upper
bound is never below the assumed friction."""
_USED_S: Final = 0.2
"""Time constant of this acceleration: a car rocks when it stops [s]."""
# Errors are 0.3 to 0.9 on average in ordinary runs, as covariances include errors that last, and 2 to 5 for 0.1 s where
# wheels reach snow. The second number was chosen from 6, 10 and 16 by the share of the samples with the true friction
# inside two deviations, on 112 recordings (comparison, seed 9).
_EXPLAINED: Final = 1.5
_UNEXPLAINED: Final = 6.0
"""The squared errors over their covariances, minus the first number, are summed up, and the sum is never below 0. If
it exceeds the second number, the car has reached another road."""
_SHOWING_MPS2: Final = 2.0  # with 1 m/s2 a curve with a bank of 4 deg was mistaken for snow
"""Lateral acceleration, measured or expected, below which packed snow bears the car as dry asphalt does [m/s2]."""
_SHOWING_USED: Final = 0.5  # first value tried; without it, a filter that was sure of ice stayed lost for a second
"""Fraction of the filter's friction from which errors show that it is wrong, if lower than `_SHOWING_MPS2`."""
_SLIDING_SLIP: Final = 0.05  # of a wheel at its limit, in the brush model at 3 u / c: 5 % on snow
_SLIDING_USED: Final = 0.95
_SLIDING_MPS2: Final = 1.0
"""Least slip of a sliding wheel, fraction of the friction that a car then uses, least deceleration [m/s2]."""
_ALIKE: Final = 0.6
"""Ratio of the used friction of both sides below which the road has two frictions, and one number is wrong."""


@inlined
def _slides(memory, duration_s):
    """Return whether wheels of both sides slide under braking on the same friction."""
    left, right = 0.0, 0.0
    for wheel in range(4):
        slip = 1.0 - memory.by_wheel_mps[wheel] / max(memory.speed_mps, SLOWEST_MPS)
        if memory.along_N[wheel] < 0.0 and slip > _SLIDING_SLIP:
            memory.not_slid_s[wheel] = 0.0
        else:
            memory.not_slid_s[wheel] += duration_s
        used = max(-memory.along_N[wheel], 0.0) / max(memory.load_N[wheel], 1.0)
        left, right = (left + used, right) if wheel % 2 == 0 else (left, right + used)
    since_s = max(min(memory.not_slid_s[0], memory.not_slid_s[2]), min(memory.not_slid_s[1], memory.not_slid_s[3]))
    alike = min(left, right) > _ALIKE * max(left, right)
    return since_s < SLIDING_S and alike and memory.ax_mps2 < -_SLIDING_MPS2


@inlined
def _steer(known, memory, steering, actuators):
    """Set the angles of the wheels from measured angles."""
    memory.front_angle_rad = steering[SAID_WHEEL] / known.steering_ratio + actuators[SAID_SUPERPOSITION]
    memory.rear_angle_rad = actuators[SAID_REAR]


@compiled
def _start(known, memory, said, line):
    """Initialise at the first call: the car drives straight ahead at the speed of its wheels."""
    rolled_mps = 0.0
    for wheel in range(4):
        memory.last_spin_radps[wheel] = said[SAID_SPINS + wheel]
        rolled_mps += 0.25 * known.rolling_radius_m[wheel] * said[SAID_SPINS + wheel]
    for place in range(len(line)):
        line[place] = said
    begin(known, memory)
    memory.not_slid_s[:] = SLIDING_S
    start_speed(known, memory, rolled_mps)


@compiled
def _filter(known, tyres, memory, said, line):
    """Advance both filters to the time of the inertial measurement."""
    duration_s, state, count, length = memory.waited_s, memory.state, memory.calls, len(line)
    _steer(known, memory, line[(count - known.steering_age) % length], line[(count - known.actuator_age) % length])
    memory.ax_mps2 = (said[SAID_AX] - memory.ax_offset_mps2) / (1.0 + known.pitch_gain)
    rate_mps2 = said[SAID_AX] / (1.0 + known.pitch_gain) + state[YAW_RATE] * state[LATERAL_SPEED]
    predict_speed(known, memory, rate_mps2, duration_s)
    read_wheels(known, tyres, memory, line[(count - known.wheel_age) % length], duration_s)
    predict(known, tyres, memory, duration_s)
    front_N, rear_N = forces_of(known, tyres, memory, state)
    follow_roll(known, memory, (front_N + rear_N) / known.mass_kg, duration_s)
    memory.innovation, memory.rate_innovation = correct(
        known, tyres, memory, said[SAID_RATE], said[SAID_AY], duration_s
    )
    ay_mps2 = said[SAID_AY] - GRAVITY_MPS2 * memory.roll_rad - state[AY_OFFSET]
    memory.unexplained = max(memory.unexplained + memory.innovation - _EXPLAINED, 0.0)
    showing_mps2 = min(_SHOWING_MPS2, _SHOWING_USED * GRAVITY_MPS2 * state[FRICTION])
    if max(abs(ay_mps2), abs(front_N + rear_N) / known.mass_kg) < showing_mps2:
        memory.unexplained = 0.0
    elif memory.unexplained > _UNEXPLAINED:
        memory.unexplained = 0.0
        reopen(known, memory)
    used = math.hypot(memory.ax_mps2, ay_mps2) / (known.largest_ay_g * GRAVITY_MPS2)
    memory.friction_used += duration_s / (duration_s + _USED_S) * (used - memory.friction_used)
    forgotten = math.exp(-duration_s / known.friction_s)
    memory.friction_borne = max(memory.friction_borne * forgotten, used)
    most = max(known.friction, memory.friction_borne / _USED_FRACTION)
    state[FRICTION] = min(max(state[FRICTION], _USED_FRACTION * memory.friction_used), most)
    memory.left_out = correct_speed(known, memory, duration_s)
    if _slides(memory, duration_s):
        take_in_friction(memory, used / _SLIDING_USED, duration_s)


@compiled
def _predict_present(known, tyres, memory, line):
    """Predict from the time of the filters to the current time with the model and later steer angles."""
    now, count, length = memory.now, memory.calls, len(line)
    for index in range(N_STATES):
        now[index] = memory.state[index]
    back, stride = round(known.age_s / known.call_s), max(1, round(_SHORTEST_S / known.call_s))
    while back > 0:
        row = line[(count - min(back, length - 1)) % length]
        _steer(known, memory, row, row)
        follow(known, tyres, memory, now, min(stride, back) * known.call_s, now)
        back -= stride


@compiled
def _write_estimate(known, memory):
    """Write the fields of `Estimate`."""
    now, covariance, out = memory.now, memory.covariance, memory.estimate
    ahead_s = known.age_s + memory.waited_s
    speed = memory.speed_mps + ahead_s * (memory.ax_mps2 + now[YAW_RATE] * now[LATERAL_SPEED])
    # The way from the time of the filters to the present adds the error of the forces.
    wrong_N = known.force_std_N + known.force_fraction * known.mass_kg * abs(memory.loading_mps2)
    lever_m = 0.5 * (known.cg_to_front_m + known.cg_to_rear_m)
    lateral_std = math.hypot(math.sqrt(covariance[LATERAL_SPEED, LATERAL_SPEED]), wrong_N / known.mass_kg * ahead_s)
    turning_radps = lever_m * wrong_N / known.yaw_inertia_kgm2 * ahead_s
    rolls = speed > SLOWEST_MPS
    out[0], out[1] = speed, now[LATERAL_SPEED]
    out[2] = math.atan2(now[LATERAL_SPEED], speed) if rolls else 0.0
    # The weaker axle decides what the car can do.
    friction, ratio = now[FRICTION], min(now[REAR_RATIO], 1.0)
    friction_variance = ratio * ratio * covariance[FRICTION, FRICTION]
    if ratio < 1.0:
        friction_variance += friction * friction * covariance[REAR_RATIO, REAR_RATIO]
        friction_variance += 2.0 * friction * ratio * covariance[FRICTION, REAR_RATIO]
    out[3], out[4] = now[YAW_RATE], friction * ratio
    out[5] = math.hypot(math.sqrt(memory.speed_variance), known.radius_std * speed)
    out[6] = lateral_std
    out[7] = math.atan2(lateral_std, max(speed, 0.0))
    out[8] = math.hypot(math.sqrt(covariance[YAW_RATE, YAW_RATE]), turning_radps)
    out[9] = math.hypot(math.sqrt(max(friction_variance, 0.0)), known.friction_fraction * friction * ratio)
    out[10], out[11] = now[FRONT_STIFFNESS], now[REAR_STIFFNESS]
    out[12] = math.sqrt(covariance[FRONT_STIFFNESS, FRONT_STIFFNESS])
    out[13] = math.sqrt(covariance[REAR_STIFFNESS, REAR_STIFFNESS])


@compiled
def advance(known, tyres, memory, said, line):
    """Process the current measurement and return the estimate."""
    k, m = known[0], memory[0]
    first = m.calls == 0
    if first:
        _start(k, m, said, line)
    line[m.calls % len(line)] = said
    m.waited_s += k.call_s
    new = said[SAID_RATE] != m.last[0] or said[SAID_AY] != m.last[1] or said[SAID_AX] != m.last[2]
    if first or (new and m.waited_s > _SHORTEST_S) or m.waited_s >= k.longest_s - 1e-9:
        m.last[0], m.last[1], m.last[2] = said[SAID_RATE], said[SAID_AY], said[SAID_AX]
        _filter(k, tyres, m, said, line)
        m.waited_s = 0.0
        _predict_present(k, tyres, m, line)
    else:
        _steer(k, m, said, said)
        follow(k, tyres, m, m.now, k.call_s, m.now)
    _write_estimate(k, m)
    m.calls += 1
