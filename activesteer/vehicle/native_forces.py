"""The native callbacks: tyres, dampers, drag and axles of curves as passive forces, and the dynamics of our actuators.

Compiled once by numba, cached on disk, called by the engine without any Python. They are pure functions of the state:
what they leave in `userdata` is scratch for the recorder, written anew at every evaluation. Models without our block
are left alone.

Forces reach the joints by the transposed Jacobian: for every degree of freedom between the world and the body, the
scalar product of its motion axis (`cdof`, about the centre of mass of the tree) with the wrench about the same point.
"""

from __future__ import annotations

import math
from typing import Any, Final

import mujoco
from numba import carray, from_dtype, types

from activesteer.compilation import compiled_callback, inlined
from activesteer.errors import ModelError
from activesteer.tyre.kernels.contact import tyre_on_road
from activesteer.tyre.kernels.record import TYRE_RECORD
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.dry_friction import friction_rate
from activesteer.vehicle.engine_layout import EngineLayout, engine_layout
from activesteer.vehicle.native_guide import guides
from activesteer.vehicle.native_memory import array_at, f64_pointer, pointer_to, word
from activesteer.vehicle.powertrain import CLUTCH_OPEN, drive_limits

_MARKER: Final = fb.MARKER
_CONTACT_S: Final = 3e-4
"""Time in which a screwed link finds its place in the play; of 0, the linearised car would have no such mode [s]."""
_tyre_pointer: Final = pointer_to(from_dtype(TYRE_RECORD))


@inlined
def _our_block(model, m_count, m_numbers):
    """The block of a model of ours, or an empty array."""
    count = word(model + m_count)
    numbers = carray(f64_pointer(word(model + m_numbers)), (count,))
    if count < fb.TRAILER_SIZE or numbers[count - 1] != _MARKER:
        return numbers[:0]
    return numbers[int(numbers[count - 2]) :]


@inlined
def _apply(qfrc, cdof, chain, fx, fy, fz, tx, ty, tz):
    """Adds J^T w for a wrench about the tree's centre of mass."""
    for index in range(chain.size):
        dof = int(chain[index])
        axis = 6 * dof
        qfrc[dof] += (
            cdof[axis] * tx + cdof[axis + 1] * ty + cdof[axis + 2] * tz
            + cdof[axis + 3] * fx + cdof[axis + 4] * fy + cdof[axis + 5] * fz
        )  # fmt: skip


@inlined
def _interpolate(x, xs, ys, count):
    """Piecewise linear curve, continued with the slope of its ends."""
    index = 1
    while index < count - 1 and x > xs[index]:
        index += 1
    return ys[index - 1] + (x - xs[index - 1]) * (ys[index] - ys[index - 1]) / (xs[index] - xs[index - 1])


@inlined
def _road_mu(block, mu, x, y):
    """Friction of the road at a place [m], world axes; `mu` where no area says otherwise."""
    if block[fb.AREAS_FELT] == 0.0:
        return mu
    start = int(block[fb.AREAS_START])
    for index in range(int(block[fb.N_AREAS]) - 1, -1, -1):
        area = block[start + index * fb.AREA_SIZE :]
        if area[fb.R_START_m] <= x < area[fb.R_END_m] and area[fb.R_RIGHT_m] < y <= area[fb.R_LEFT_m]:
            return area[fb.R_MU]
    return mu


@inlined
def _wheels(block, timestep_s, xpos, xmat, com, cvel, cdof, act, userdata, qfrc):
    for index in range(int(block[fb.N_WHEELS])):
        wheel = block[int(block[fb.WHEELS_START]) + index * fb.WHEEL_SIZE :]
        body = int(wheel[fb.W_BODY])
        root = int(wheel[fb.W_ROOT])
        to_x = xpos[3 * body] - com[3 * root]
        to_y = xpos[3 * body + 1] - com[3 * root + 1]
        to_z = xpos[3 * body + 2] - com[3 * root + 2]
        wx, wy, wz = cvel[6 * body], cvel[6 * body + 1], cvel[6 * body + 2]
        tyre_start = int(wheel[fb.W_TYRE_START])
        ax, ay, az = xmat[9 * body + 1], xmat[9 * body + 4], xmat[9 * body + 7]
        # Down in the wheel plane to the road, as in `tyre_on_road`.
        reach = xpos[3 * body + 2] * az / (ax * ax + ay * ay)
        contact_x = xpos[3 * body] + reach * ax
        contact_y = xpos[3 * body + 1] + reach * ay
        mu = _road_mu(block, wheel[fb.W_MU], contact_x, contact_y)
        tyre = tyre_on_road(
            carray(_tyre_pointer(block.ctypes.data + 8 * tyre_start), (1,))[0],
            mu,
            wheel[fb.W_PRESSURE_Pa],
            wheel[fb.W_LOW_SPEED_mps],
            wheel[fb.W_LOW_SPEED_DAMPING_Nspm],
            timestep_s,
            xpos[3 * body + 2],
            ax,
            ay,
            az,
            cvel[6 * body + 3] + wy * to_z - wz * to_y,
            cvel[6 * body + 4] + wz * to_x - wx * to_z,
            cvel[6 * body + 5] + wx * to_y - wy * to_x,
            wx,
            wy,
            wz,
            act[int(wheel[fb.W_ACT_X])],
            act[int(wheel[fb.W_ACT_Y])],
            act[int(wheel[fb.W_ACT_Z])],
        )
        out = userdata[index * fb.USERDATA_PER_WHEEL :]
        out[fb.U_FX] = tyre.fx_N
        out[fb.U_FY] = tyre.fy_N
        out[fb.U_FZ] = tyre.fz_N
        out[fb.U_MX] = tyre.mx_Nm
        out[fb.U_MY] = tyre.my_Nm
        out[fb.U_MZ] = tyre.mz_Nm
        out[fb.U_SLIP_RATIO] = tyre.slip_ratio
        out[fb.U_SLIP_ANGLE] = tyre.slip_angle_rad
        out[fb.U_INCLINATION] = tyre.inclination_rad
        out[fb.U_RATE_X] = tyre.deflection_x_rate_mps
        out[fb.U_RATE_Y] = tyre.deflection_y_rate_mps
        out[fb.U_RATE_Z] = tyre.deflection_z_rate_radps
        out[fb.U_LOADED_RADIUS] = tyre.loaded_radius_m
        out[fb.U_LIMITED] = tyre.limited
        out[fb.U_FRICTION_UTILISATION] = tyre.friction_utilisation
        out[fb.U_MU] = mu
        out[fb.U_CONTACT_X] = contact_x
        out[fb.U_CONTACT_Y] = contact_y
        hx, hy = tyre.heading_x, tyre.heading_y
        fz = tyre.fz_N
        gx = tyre.fx_N * hx - tyre.fy_N * hy
        gy = tyre.fx_N * hy + tyre.fy_N * hx
        px, py, pz = to_x + tyre.arm_x_m, to_y + tyre.arm_y_m, to_z + tyre.arm_z_m
        chain = wheel[fb.W_CHAIN : fb.W_CHAIN + int(wheel[fb.W_CHAIN_LENGTH])]
        _apply(
            qfrc,
            cdof,
            chain,
            gx,
            gy,
            fz,
            py * fz - pz * gy + tyre.mx_Nm * hx - tyre.my_Nm * hy,
            pz * gx - px * fz + tyre.mx_Nm * hy + tyre.my_Nm * hx,
            px * gy - py * gx + tyre.mz_Nm,
        )


@inlined
def _dampers(block, ten_velocity, jacobian, userdata, qfrc):
    first_slot = int(block[fb.N_WHEELS]) * fb.USERDATA_PER_WHEEL
    for index in range(int(block[fb.N_DAMPERS])):
        damper = block[int(block[fb.DAMPERS_START]) + index * fb.DAMPER_SIZE :]
        force = _interpolate(
            -ten_velocity[int(damper[fb.D_TENDON])],
            damper[fb.D_VELOCITY :],
            damper[fb.D_FORCE :],
            int(damper[fb.D_POINTS]),
        )
        userdata[first_slot + index] = force
        row = int(damper[fb.D_ROW])
        for entry in range(int(damper[fb.D_LENGTH])):
            qfrc[int(damper[fb.D_CHAIN + entry])] += jacobian[row + entry] * force


@inlined
def _drag(block, xpos, xmat, com, cvel, cdof, qfrc):
    """Aerodynamic drag: against the velocity of the pressure point, in the plane of the road."""
    body = int(block[fb.CHASSIS_BODY])
    root = int(block[fb.CHASSIS_ROOT])
    ax, ay, az = block[fb.AERO_X_m], block[fb.AERO_Y_m], block[fb.AERO_Z_m]
    rot = xmat[9 * body : 9 * body + 9]
    px = xpos[3 * body] + rot[0] * ax + rot[1] * ay + rot[2] * az - com[3 * root]
    py = xpos[3 * body + 1] + rot[3] * ax + rot[4] * ay + rot[5] * az - com[3 * root + 1]
    pz = xpos[3 * body + 2] + rot[6] * ax + rot[7] * ay + rot[8] * az - com[3 * root + 2]
    wx, wy, wz = cvel[6 * body], cvel[6 * body + 1], cvel[6 * body + 2]
    vx = cvel[6 * body + 3] + wy * pz - wz * py
    vy = cvel[6 * body + 4] + wz * px - wx * pz
    factor = -block[fb.DRAG_Ns2pm2] * (vx * vx + vy * vy) ** 0.5
    fx, fy = factor * vx, factor * vy
    start = int(block[fb.CHASSIS_DOFS])
    chain = block[start : start + int(block[fb.CHASSIS_N_DOFS])]
    _apply(qfrc, cdof, chain, fx, fy, 0.0, -pz * fy, pz * fx, px * fy - py * fx)


@inlined
def _drive_rate(block, qvel, fraction, lag_s, command, state, timestep_s):
    """Rate of a wheel's drive torque: a first-order lag, within what the engine can give at the speed of its wheels."""
    if block[fb.GEAR] == CLUTCH_OPEN:
        return (command - state) / timestep_s
    speed = 0.0
    for index in range(int(block[fb.N_WHEELS])):
        wheel = block[int(block[fb.WHEELS_START]) + index * fb.WHEEL_SIZE :]
        speed += wheel[fb.W_DRIVE_FRACTION] * qvel[int(wheel[fb.W_SPIN])]
    low, high = drive_limits(
        speed,
        block[fb.GEAR],
        block[fb.ENGINE_TORQUE_Nm],
        block[fb.ENGINE_POWER_W],
        block[fb.ENGINE_LIMIT_radps],
        block[fb.ENGINE_DRAG_Nm],
    )
    torque = state - (command - state) * math.expm1(-timestep_s / lag_s)
    if fraction == 0.0:
        # Not driven: nothing is commanded, and what came past the engine before dies away.
        return (torque - state) / timestep_s
    return (min(max(torque, fraction * low), fraction * high) - state) / timestep_s


@inlined
def _brake_rate(entry, qvel, command, state, timestep_s):
    """Elasto-plastic friction: the pads wind up with the wheel and slip where the torque reaches the demand."""
    speed = qvel[int(entry[fb.A_SECOND])]
    # The drag of pads, bearings and seals is always there; it is also what keeps a car from creeping at rest.
    limit = min(max(command, entry[fb.A_LOW]), entry[fb.A_HIGH]) / entry[fb.A_FIRST]
    wound = min(max(state + timestep_s * speed, -limit), limit)
    return (wound - state) / timestep_s


@inlined
def _friction_rate(entry, qvel, ten_velocity, state, timestep_s):
    """Dry friction of a damper, which the road shakes, or of the rack."""
    index = int(entry[fb.A_SECOND])
    speed = ten_velocity[index] if entry[fb.A_HIGH] == fb.ALONG_TENDON else qvel[index]
    # The free joint of the chassis is the first (`Vehicle` sees to it): its velocity in the world.
    vibration = entry[fb.A_FIRST] * (qvel[0] * qvel[0] + qvel[1] * qvel[1]) ** 0.25
    return friction_rate(state, speed, vibration, entry[fb.A_LOW], timestep_s)


@inlined
def _polynomial(coefficients, x):
    """Value of a polynomial without a constant term."""
    value = 0.0
    for power in range(fb.POWERS - 1, -1, -1):
        value = (value + coefficients[power]) * x
    return value


@inlined
def _played(link, screw_m, longer_m):
    """By how much a link is longer where its screw stands, within the play, as the length asks that it has."""
    half = 0.5 * link[fb.L_BACKLASH_m]
    return min(max(longer_m, screw_m - half), screw_m + half)


@inlined
def _link_rate(link, state, act, ten_length, userdata, timestep_s):
    screw_m = link[fb.L_SIGN] * act[int(link[fb.L_SCREW_ACT])]
    userdata[int(link[fb.L_OUT])] = _polynomial(link[fb.L_ANGLE :], screw_m)
    target = _played(link, screw_m, ten_length[int(link[fb.L_TENDON])] - link[fb.L_REST_m])
    return -math.expm1(-timestep_s / _CONTACT_S) * (target - state) / timestep_s


@inlined
def _motor_load(block, screw, act, ten_length):
    """Torque of the load at the motor, positive where it helps forwards, and the sum of its parts' magnitudes [N m]."""
    lead = screw[fb.S_LEAD_mprad]
    if screw[fb.S_N_LINKS] == 0.0:
        stretch = ten_length[int(screw[fb.S_COLUMN])] - screw[fb.S_COLUMN_REST_m]
        load = -screw[fb.S_COLUMN_STIFFNESS_Npm] * stretch * screw[fb.S_COLUMN_ARM_m] * lead
        return load, abs(load)
    load, carried = 0.0, 0.0
    for index in range(int(screw[fb.S_N_LINKS])):
        link = block[int(block[fb.SCREWS_START]) + int(screw[fb.S_LINK + index]) :]
        longer_m = ten_length[int(link[fb.L_TENDON])] - link[fb.L_REST_m]
        tension = link[fb.L_STIFFNESS_Npm] * (longer_m - act[int(link[fb.L_ACT])])
        load += link[fb.L_SIGN] * tension * lead
        carried += abs(tension) * lead
    return load, carried


@inlined
def _motor_rate(block, screw, act, ctrl, ten_length, userdata, speed, timestep_s):
    """Rate of a motor's speed: position and speed loop within current, voltage and power, load, dry friction."""
    out = int(screw[fb.S_OUT])
    userdata[out] = userdata[out + 1] = 0.0
    if screw[fb.S_SEIZED] != 0.0:
        return -speed / timestep_s
    command_actuator = int(screw[fb.S_COMMAND])
    entry = block[int(block[fb.ACTUATORS_START]) + command_actuator * fb.ACTUATOR_SIZE :]
    angle = entry[fb.A_SCALE] * ctrl[command_actuator] + entry[fb.A_OFFSET]
    beyond = angle < entry[fb.A_LOW] or angle > entry[fb.A_HIGH]
    angle = min(max(angle, entry[fb.A_LOW]), entry[fb.A_HIGH])
    position, lead = act[int(screw[fb.S_ACT])], screw[fb.S_LEAD_mprad]
    missing = (_polynomial(screw[fb.S_TRAVEL :], angle) - position) / lead
    limit = screw[fb.S_SPEED_LIMIT_radps]
    wanted = min(max(screw[fb.S_POSITION_GAIN_1ps] * missing, -limit), limit)
    load, carried = _motor_load(block, screw, act, ten_length)
    friction = screw[fb.S_FRICTION_Nm] + screw[fb.S_LOAD_FRICTION] * carried
    # The speed loop, its integral part settled: what the speed asked for needs against load and friction.
    target = speed - (wanted - speed) * math.expm1(-screw[fb.S_SPEED_GAIN_1ps] * timestep_s)
    per_torque = timestep_s / screw[fb.S_INERTIA_kgm2]
    needed = (target - speed) / per_torque - load + math.copysign(friction, target)
    if abs(missing) * lead <= screw[fb.S_TOLERANCE_m] and abs(load) <= friction:
        # It is there, and the screw holds by itself: no current.
        needed = 0.0
    low, high = _motor_limits(screw, speed)
    torque = min(max(needed, low), high)
    userdata[out] = torque
    userdata[out + 1] = 1.0 if beyond or torque != needed or abs(wanted) == limit else 0.0
    free = speed + per_torque * (torque + load)
    new = math.copysign(max(abs(free) - per_torque * friction, 0.0), free)
    reached = position + timestep_s * lead * new
    if reached > screw[fb.S_STOP_m]:
        new = (screw[fb.S_STOP_m] - position) / (timestep_s * lead)
    elif reached < -screw[fb.S_STOP_m]:
        new = (-screw[fb.S_STOP_m] - position) / (timestep_s * lead)
    return (new - speed) / timestep_s


@inlined
def _screw_rate(block, entry, act, ctrl, ten_length, userdata, timestep_s):
    """Rate of a screwed link's change of length, of a screw's position, or of its motor's speed."""
    kind, state = entry[fb.A_KIND], act[int(entry[fb.A_ACT])]
    record = block[int(block[fb.SCREWS_START]) + int(entry[fb.A_FIRST]) :]
    if kind == fb.KIND_LINK:
        return _link_rate(record, state, act, ten_length, userdata, timestep_s)
    if kind == fb.KIND_SCREW:
        return record[fb.S_LEAD_mprad] * act[int(record[fb.S_MOTOR_ACT])]
    return _motor_rate(block, record, act, ctrl, ten_length, userdata, state, timestep_s)


@inlined
def _motor_limits(screw, speed):
    """Least and greatest torque that current, voltage and power allow at a speed [N m]."""
    high = min(screw[fb.S_PEAK_Nm], max(screw[fb.S_STALL_Nm] - screw[fb.S_SLOPE_Nmsprad] * speed, 0.0))
    low = -min(screw[fb.S_PEAK_Nm], max(screw[fb.S_STALL_Nm] + screw[fb.S_SLOPE_Nmsprad] * speed, 0.0))
    if speed > 0.0:
        high = min(high, screw[fb.S_POWER_W] / speed)
    elif speed < 0.0:
        low = max(low, screw[fb.S_POWER_W] / speed)
    return low, high


def _make_callbacks(layout: EngineLayout) -> tuple[Any, Any, Any]:
    """Compiles the three callbacks, or loads them from numba's cache.

    The offsets are closure variables on purpose: numba makes those part of the cache key.
    """
    (
        m_count, m_timestep, m_numbers, d_qvel, d_act, d_ctrl, d_userdata, d_xpos, d_xmat, d_com, d_cdof, d_ten_j,
        d_ten_velocity, d_cvel, d_qfrc, d_ten_length, d_sensordata, d_qpos, _,
    ) = layout  # fmt: skip

    @compiled_callback(types.void, types.intp, types.intp)
    def passive(model, data):
        block = _our_block(model, m_count, m_numbers)
        if block.size == 0:
            return
        bodies = int(block[fb.N_BODIES])
        dofs = int(block[fb.N_DOFS])
        timestep_s = carray(f64_pointer(model + m_timestep), (1,))[0]
        xpos = array_at(data, d_xpos, 3 * bodies)
        xmat = array_at(data, d_xmat, 9 * bodies)
        com = array_at(data, d_com, 3 * bodies)
        cvel = array_at(data, d_cvel, 6 * bodies)
        cdof = array_at(data, d_cdof, 6 * dofs)
        act = array_at(data, d_act, int(block[fb.N_ACTIVATIONS]))
        userdata = array_at(data, d_userdata, int(block[fb.N_USERDATA]))
        qfrc = array_at(data, d_qfrc, dofs)
        _wheels(block, timestep_s, xpos, xmat, com, cvel, cdof, act, userdata, qfrc)
        jacobian = array_at(data, d_ten_j, int(block[fb.N_TENDON_JACOBIAN]))
        _dampers(block, array_at(data, d_ten_velocity, int(block[fb.N_TENDONS])), jacobian, userdata, qfrc)
        _drag(block, xpos, xmat, com, cvel, cdof, qfrc)
        guides(
            block, array_at(data, d_qpos, int(block[fb.N_COORDINATES])), array_at(data, d_qvel, dofs), qfrc
        )  # fmt: skip

    @compiled_callback(types.double, types.intp, types.intp, types.intc)
    def actuator_rate(model, data, actuator):
        block = _our_block(model, m_count, m_numbers)
        if block.size == 0:
            return 0.0
        entry = block[int(block[fb.ACTUATORS_START]) + actuator * fb.ACTUATOR_SIZE :]
        kind = entry[fb.A_KIND]
        if kind == fb.KIND_SLIP:
            return array_at(data, d_userdata, int(block[fb.N_USERDATA]))[int(entry[fb.A_FIRST])]
        state = array_at(data, d_act, int(block[fb.N_ACTIVATIONS]))[int(entry[fb.A_ACT])]
        command = entry[fb.A_SCALE] * array_at(data, d_ctrl, int(block[fb.N_CONTROLS]))[actuator] + entry[fb.A_OFFSET]
        if kind == fb.KIND_SERVO:
            # First-order lag behind the limited command, its rate limited.
            command = min(max(command, entry[fb.A_LOW]), entry[fb.A_HIGH])
            rate = (command - state) / entry[fb.A_FIRST]
            return min(max(rate, -entry[fb.A_SECOND]), entry[fb.A_SECOND])
        timestep_s = carray(f64_pointer(model + m_timestep), (1,))[0]
        qvel = array_at(data, d_qvel, int(block[fb.N_DOFS]))
        rate = 0.0
        if kind == fb.KIND_DRIVE:
            rate = _drive_rate(block, qvel, entry[fb.A_FIRST], entry[fb.A_SECOND], command, state, timestep_s)
        elif kind == fb.KIND_FRICTION:
            ten_velocity = array_at(data, d_ten_velocity, int(block[fb.N_TENDONS]))
            rate = _friction_rate(entry, qvel, ten_velocity, state, timestep_s)
        elif kind == fb.KIND_BRAKE:
            rate = _brake_rate(entry, qvel, command, state, timestep_s)
        elif kind >= fb.KIND_LINK:
            rate = _screw_rate(
                block, entry, array_at(data, d_act, int(block[fb.N_ACTIVATIONS])),
                array_at(data, d_ctrl, int(block[fb.N_CONTROLS])),
                array_at(data, d_ten_length, int(block[fb.N_TENDONS])),
                array_at(data, d_userdata, int(block[fb.N_USERDATA])), timestep_s,
            )  # fmt: skip
        return rate

    @compiled_callback(types.void, types.intp, types.intp, types.intc)
    def screw_sensors(model, data, _stage):
        block = _our_block(model, m_count, m_numbers)
        if block.size == 0:
            return
        count, start = int(block[fb.N_SCREW_SENSORS]), int(block[fb.SCREW_SENSORS])
        # Behind them stands how many faults act.
        said = array_at(data, d_userdata, int(block[fb.N_USERDATA]))[-1 - count : -1]
        array_at(data, d_sensordata, start + count)[start:] = said

    return passive, actuator_rate, screw_sensors


_installed: list[Any] = []
"""The callbacks as the engine sees them; kept for the life of the process, since the engine holds bare pointers."""


def install_native_forces() -> None:
    """Installs the callbacks in this process; does nothing where they are installed already.

    Raises:
        ModelError: another part of the program has put a callback of its own in their place.
    """
    slots = (
        ("mjcb_passive", mujoco.get_mjcb_passive(), mujoco.set_mjcb_passive),
        ("mjcb_act_dyn", mujoco.get_mjcb_act_dyn(), mujoco.set_mjcb_act_dyn),
        ("mjcb_sensor", mujoco.get_mjcb_sensor(), mujoco.set_mjcb_sensor),
    )
    for name, present, _ in slots:
        if present is not None and not any(present is ours for ours in _installed):
            raise ModelError(
                f"MuJoCo's {name} is already taken by {present!r}; there is one per process and the tyre forces need "
                f"it: call mujoco.set_{name}(None) before using activesteer",
                value=name,
            )
    if not _installed:
        compiled = _make_callbacks(engine_layout())
        _installed.extend(callback.ctypes for callback in compiled)
    for (_, present, install), ours in zip(slots, _installed, strict=True):
        if present is None:
            install(ours)


def remove_native_forces() -> None:
    """Takes our callbacks out of this process, as for a measurement of the bare engine; others' are left."""
    if any(mujoco.get_mjcb_passive() is ours for ours in _installed):
        mujoco.set_mjcb_passive(None)
    if any(mujoco.get_mjcb_act_dyn() is ours for ours in _installed):
        mujoco.set_mjcb_act_dyn(None)
    if any(mujoco.get_mjcb_sensor() is ours for ours in _installed):
        mujoco.set_mjcb_sensor(None)
