"""The compiled two-track model of the estimator: lateral motion, axle forces, and their errors.

For the axles i = f, r:

    m (v_y' + r v_x) = F_f cos d_f + F_r cos d_r + X_f sin d_f + m g_y
    J_z r'           = l_f (F_f cos d_f + X_f sin d_f) - l_r F_r cos d_r + M_x
    s_i / v_x a_i'   = d_i - (v_y + h_i p' +- l_i r) / v_x - c_i F_i - q_i p + e_i - a_i
    F_i              = sum over the axle's wheels of u F_y(a_i / u, F_z)
    p'' + 2 D w p' + w^2 p = w^2 k a_y

with the steer angles d, the gravity g_y across an inclined road, the longitudinal forces X and their moment M_x, slip
angles a that build up over the relaxation lengths s, the car's own tyre F_y under the wheel's load, the friction u of
the road by similarity (u w at the rear axle, which may have other tyres), and the stiffness k_i of the tyres of an axle
relative to new ones: u F_y(k_i a_i / u, F_z), which changes the slope of the curve and not its peak, as LKY does in the
Magic Formula. With a longitudinal force, a friction circle reduces u. That lowers the largest force but hardly the
force at small slip angles, as in the Magic Formula of combined slip (0.7 of the friction for the brake take 8 % at 2
deg). The body rolls by p as a mass on a spring. The points of the wheels whose slip acts on the tyres, contact points
or wheel centres, then move sideways by h_i p' relative to the centre of gravity. Springs and dampers of the body load
the wheels. The compliance c_i is the difference between the identified cornering stiffness of the axle and the
stiffness of its tyres:

    c_i = 1 / C_i - 1 / (2 C_tyre) - q_i k / m_i

It includes elastokinematics and steering column. The roll steer q_i (with the thrust of the wheels' camber) follows the
body's roll and thus later than the force. In a steady turn with the axle's mass m_i = F_i / a_y it acts like a
compliance, so its part is subtracted from the identified one. The slip angle error e_i covers the unknowns of tyre and
axle; like the offsets of sensors and the friction it is a state.

Sources:
    Kiencke and Nielsen, Automotive Control Systems, 2nd ed. 2005, chapters 8 and 9 (two-track model in observers).
    Doumiati, Charara, Victorino, Lechner, Vehicle Dynamics Estimation using Kalman Filtering, 2013, chapter 4
        (load transfer, relaxation).
    Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, sections 4.2 (similarity) and 7.2 (relaxation of the slip angle).
"""

from __future__ import annotations

import math
from typing import Final

from activesteer.estimation.records import (
    BANK,
    FRICTION,
    FRONT_ERROR,
    FRONT_SLIP,
    FRONT_STIFFNESS,
    LATERAL_SPEED,
    N_STATES,
    REAR_ERROR,
    REAR_RATIO,
    REAR_SLIP,
    REAR_STIFFNESS,
    YAW_RATE,
)
from activesteer.native.compilation import compiled, inlined

LEAST_FRICTION: Final = 0.05
LARGEST_FRICTION: Final = 1.5
"""Bounds of the estimated friction [-]."""
LEAST_RATIO: Final = 0.5
LARGEST_RATIO: Final = 1.5
"""Bounds of the friction of the rear tyres relative to the friction of the front tyres [-]."""
LEAST_STIFFNESS: Final = 0.3
LARGEST_STIFFNESS: Final = 2.0
"""Bounds of the estimated stiffness of the tyres relative to new tyres [-]."""
SLOWEST_MPS: Final = 3.0
"""Speed below which the car is assumed to roll without slip angles, which the sensors cannot show [m/s]."""
# By the compact's Magic Formula, at 1 to 6 deg, 0.65 to 0.72 of the lateral force remain at a slip of 12 %, where the
# brake force is largest. At 20 %, which an anti-lock system allows at times, 0.45 to 0.53 remain. The circle with one
# half leaves 0.92 to 0.51.
_LEAST_LEFT: Final = 0.5
"""Smallest fraction of its friction that a wheel keeps for lateral force, for any longitudinal force."""
_CREEP_S: Final = 0.3
"""Time constant of the yaw rate of an almost standing car [s]."""
_LONGEST_STEP_S: Final = 0.005
"""Longest step of the integration [s]: the tyres lag by about 20 ms."""


@inlined
def _between(forces_N, angle_step_rad, load_step_N, angle_rad, load_N):
    """Interpolate the lateral force of a tyre in its grid, at a non-negative slip angle."""
    rows, columns = forces_N.shape
    across = min(angle_rad / angle_step_rad, columns - 1.000001)
    down = min(max(load_N / load_step_N, 0.0), rows - 1.000001)
    column, row = int(across), int(down)
    right, below = across - column, down - row
    upper = forces_N[row, column] + right * (forces_N[row, column + 1] - forces_N[row, column])
    lower = forces_N[row + 1, column] + right * (forces_N[row + 1, column + 1] - forces_N[row + 1, column])
    return upper + below * (lower - upper)


@compiled
def axle_force(forces_N, angle_step_rad, load_step_N, angle_rad, load_N, shift_N, left_N, right_N, friction, stiffness):
    """Return the lateral force of both tyres of an axle [N], positive for a positive slip angle."""
    # `load_N` is the mean load of both wheels, `shift_N` the load transfer from the left to the right wheel. `left_N`
    # and `right_N` are longitudinal forces, and `stiffness` is relative to new tyres.
    size_rad, total_N = min(max(stiffness, LEAST_STIFFNESS), LARGEST_STIFFNESS) * abs(angle_rad) / friction, 0.0
    for sign, along_N in ((-1.0, left_N), (1.0, right_N)):
        own_N = max(load_N + sign * shift_N, 0.0)
        used = along_N / (friction * own_N + 1.0)
        left = math.sqrt(max(1.0 - used * used, _LEAST_LEFT * _LEAST_LEFT))
        total_N += left * _between(forces_N, angle_step_rad, load_step_N, size_rad / left, own_N)
    return math.copysign(friction * total_N, angle_rad)


@compiled
def forces_of(known, tyres, memory, state):
    """Return the lateral forces of both axles, across their wheels [N]."""
    friction = min(max(state[FRICTION], LEAST_FRICTION), LARGEST_FRICTION)
    forward_N, along_N = known.along_load_kg * memory.ax_mps2, memory.along_N
    front_N = axle_force(
        tyres[0], known.angle_step_rad, known.front_load_step_N, state[FRONT_SLIP], known.front_load_N - forward_N,
        known.front_load_kg * memory.loading_mps2, along_N[0], along_N[1], friction,
        state[FRONT_STIFFNESS],
    )  # fmt: skip
    rear_N = axle_force(
        tyres[1], known.angle_step_rad, known.rear_load_step_N, state[REAR_SLIP], known.rear_load_N + forward_N,
        known.rear_load_kg * memory.loading_mps2, along_N[2], along_N[3],
        friction * min(max(state[REAR_RATIO], LEAST_RATIO), LARGEST_RATIO),
        state[REAR_STIFFNESS],
    )  # fmt: skip
    return front_N, rear_N


@inlined
def slip_angles(known, memory, state, vx_mps):
    """Return the slip angles of both axles that follow from the motion of the car only [rad]."""
    across_mps, rate_radps = state[LATERAL_SPEED], memory.roll_rate_radps
    front_mps = across_mps + known.front_roll_arm_m * rate_radps + known.cg_to_front_m * state[YAW_RATE]
    rear_mps = across_mps + known.rear_roll_arm_m * rate_radps - known.cg_to_rear_m * state[YAW_RATE]
    front_rad, rear_rad = memory.front_angle_rad - front_mps / vx_mps, memory.rear_angle_rad - rear_mps / vx_mps
    return front_rad, rear_rad


@compiled
def follow(known, tyres, memory, state, duration_s, out):
    """Compute the state after an interval with constant inputs. `out` may be `state` itself."""
    for index in range(N_STATES):
        out[index] = state[index]
    vx = memory.speed_mps
    df, dr = memory.front_angle_rad, memory.rear_angle_rad
    if vx < SLOWEST_MPS:
        # Rolling without slip angles: the middle of the rear axle moves in the direction of its wheels.
        turned = vx * (df - dr) / (known.cg_to_front_m + known.cg_to_rear_m)
        out[YAW_RATE] += (1.0 - math.exp(-duration_s / _CREEP_S)) * (turned - out[YAW_RATE])
        out[LATERAL_SPEED] = known.cg_to_rear_m * out[YAW_RATE] + vx * dr
        out[FRONT_SLIP] = out[REAR_SLIP] = 0.0
        return
    steps = max(1, math.ceil(duration_s / _LONGEST_STEP_S - 1e-9))
    dt = duration_s / steps
    follow_front = 1.0 - math.exp(-dt * vx / known.front_relaxation_m)
    follow_rear = 1.0 - math.exp(-dt * vx / known.rear_relaxation_m)
    cos_f, sin_f, cos_r = math.cos(df), math.sin(df), math.cos(dr)
    for _ in range(steps):
        front_N, rear_N = forces_of(known, tyres, memory, out)
        front_rad, rear_rad = slip_angles(known, memory, out, vx)
        front_rad += out[FRONT_ERROR] - known.front_compliance_radpN * front_N
        front_rad -= known.front_roll_steer * memory.roll_rad
        rear_rad += out[REAR_ERROR] - known.rear_compliance_radpN * rear_N
        rear_rad -= known.rear_roll_steer * memory.roll_rad
        out[FRONT_SLIP] += follow_front * (front_rad - out[FRONT_SLIP])
        out[REAR_SLIP] += follow_rear * (rear_rad - out[REAR_SLIP])
        across_N, behind_N = front_N * cos_f + memory.front_along_N * sin_f, rear_N * cos_r
        turning_Nm = known.cg_to_front_m * across_N - known.cg_to_rear_m * behind_N + memory.moment_Nm
        out[LATERAL_SPEED] += dt * ((across_N + behind_N) / known.mass_kg + out[BANK] - out[YAW_RATE] * vx)
        out[YAW_RATE] += dt * turning_Nm / known.yaw_inertia_kgm2


@compiled
def follow_roll(known, memory, ay_mps2, duration_s):
    """Advance the roll and the load transfer: springs and dampers carry (p + 2 D p' / w) / k in place of a_y."""
    speed, damping, gradient = known.roll_speed_radps, known.roll_damping, known.roll_gradient_radpmps2
    steps = max(1, math.ceil(duration_s / _LONGEST_STEP_S - 1e-9))
    dt = duration_s / steps
    for _ in range(steps):
        pull = speed * (gradient * ay_mps2 - memory.roll_rad) - 2.0 * damping * memory.roll_rate_radps
        memory.roll_rate_radps += dt * speed * pull
        memory.roll_rad += dt * memory.roll_rate_radps
    # A body that does not roll loads the wheels at once.
    carried = memory.roll_rad + 2.0 * damping / speed * memory.roll_rate_radps
    memory.loading_mps2 = carried / gradient if gradient > 0.0 else ay_mps2
