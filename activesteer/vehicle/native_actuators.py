"""Compiled dynamics of servos, drive, brakes, screws, motors and dry friction.

A guide or seal first deflects elastically, then slips: Dahl's model. Its state w is the elastic deflection, its force
-k w:

    dw/dt = v - |v| w / w_slip        w_slip = F / k

On a real road, however even, roughness keeps the dampers moving, much faster than a body rolls. Friction then acts
against the sum of both motions, and only the mean of its force acts on the slow one. For a vibration of normal
distribution with the standard deviation s, and a slow motion of speed v,

    mean of sign(v + vibration) = erf(v / (sqrt(2) s))

which at small speeds is a damper of sqrt(2/pi) F / s. (Control engineers know it as dither.) The road of this package
is perfectly even; without this mean its cars would ride on stuck dampers up to 0.1 g. Therefore w_slip is multiplied by
the mean: friction is dry at rest and while the damper moves faster than the vibration, and smooth below.

Roughness: the velocity spectrum of a road is white and grows with the driving speed (ISO 8608), so s grows with the
root of that speed.

Source: Dahl, A solid friction model, Aerospace Corp. TOR-0158 (1968); Pervozvanski and Canudas de Wit, Asymptotic
analysis of the dither effect in systems with friction, Automatica 38 (2002).

`entry` is an actuator's `ACTUATOR` record, `command` its demand, `state` its activation.

A motor follows its demand with a first-order lag and a rate limit, within its torque-speed map T(n), its power limit
and, where it absorbs power, its regeneration:

    |T| <= min(T(n), P / n),     times the regeneration if T n < 0

Its electric power is the mechanical power at its wheels over the efficiency when it drives, times the efficiency when
it absorbs, plus its idle loss. An open differential turns with the mean speed of its wheels and gives both the same
torque. A splitting differential adds half a difference d to the right torque and takes it from the left one; the power
that this needs, d (n_right - n_left) / 2, counts as the motor's too. If all motors and consumers together exceed a
limit of the battery, all driving (or all absorbing) torques are scaled down.
"""

from __future__ import annotations

import math
from typing import Final

from numba import carray, from_dtype

from activesteer.native.compilation import compiled, inlined
from activesteer.native.memory import pointer_to, records_at
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.electric_actuators import BATTERY, BATTERY_STATE, MOTOR, MOTOR_STATE
from activesteer.vehicle.parameters import CLUTCH_OPEN, drive_limits

_CONTACT_S: Final = 3e-4
"""Time in which a screwed link settles in its play. At 0, the linearised car would lack this mode [s]."""
_links_at: Final = records_at(fb.LINK)
_screws_at: Final = records_at(fb.SCREW)


@inlined
def _polynomial(coefficients, x):
    """Evaluate a polynomial without a constant term."""
    value = 0.0
    for power in range(fb.POWERS - 1, -1, -1):
        value = (value + coefficients[power]) * x
    return value


@inlined
def _played(link, screw_m, longer_m):
    """Return the change of a link's length, limited to the play about the screw's position."""
    half = 0.5 * link.backlash_m
    return min(max(longer_m, screw_m - half), screw_m + half)


@inlined
def _link_rate(link, state, act, ten_length, userdata, timestep_s):
    screw_m = link.sign * act[int(link.screw_act)]
    userdata[int(link.userdata)] = _polynomial(link.angle, screw_m)
    target = _played(link, screw_m, ten_length[int(link.tendon)] - link.rest_m)
    return -math.expm1(-timestep_s / _CONTACT_S) * (target - state) / timestep_s


@inlined
def _motor_load(links, screw, act, ten_length):
    """Return the load torque at the motor, positive if it drives forwards, and the sum of magnitudes [N m]."""
    lead = screw.lead_mprad
    if screw.n_links == 0.0:
        stretch = ten_length[int(screw.column)] - screw.column_rest_m
        load = -screw.column_stiffness_Npm * stretch * screw.column_arm_m * lead
        return load, abs(load)
    load, carried = 0.0, 0.0
    for index in range(int(screw.n_links)):
        link = links[int(screw.links[index])]
        longer_m = ten_length[int(link.tendon)] - link.rest_m
        tension = link.stiffness_Npm * (longer_m - act[int(link.act)])
        load += link.sign * tension * lead
        carried += abs(tension) * lead
    return load, carried


@inlined
def _motor_limits(screw, speed):
    """Return the torque limits set by current, voltage and power at a speed [N m]."""
    high = min(screw.peak_Nm, max(screw.stall_Nm - screw.slope_Nmsprad * speed, 0.0))
    low = -min(screw.peak_Nm, max(screw.stall_Nm + screw.slope_Nmsprad * speed, 0.0))
    if speed > 0.0:
        high = min(high, screw.power_W / speed)
    elif speed < 0.0:
        low = max(low, screw.power_W / speed)
    return low, high


@inlined
def _motor_rate(links, screw, asked, act, ctrl, ten_length, userdata, speed, timestep_s):
    """Return the acceleration of a motor under its control loops, load and dry friction."""
    said = int(screw.userdata)
    userdata[said] = userdata[said + 1] = 0.0
    if screw.seized != 0.0:
        return -speed / timestep_s
    angle = asked.scale * ctrl[int(screw.command)] + asked.offset
    beyond = angle < asked.low or angle > asked.high
    angle = min(max(angle, asked.low), asked.high)
    position, lead = act[int(screw.act)], screw.lead_mprad
    missing = (_polynomial(screw.travel, angle) - position) / lead
    limit = screw.speed_limit_radps
    wanted = min(max(screw.position_gain_1ps * missing, -limit), limit)
    load, carried = _motor_load(links, screw, act, ten_length)
    friction = screw.friction_Nm + screw.load_friction * carried
    # The speed loop with a settled integral part: the torque that the demanded speed needs against load and friction.
    target = speed - (wanted - speed) * math.expm1(-screw.speed_gain_1ps * timestep_s)
    per_torque = timestep_s / screw.inertia_kgm2
    needed = (target - speed) / per_torque - load + math.copysign(friction, target)
    if abs(missing) * lead <= screw.tolerance_m and abs(load) <= friction:
        # The position is reached and the screw is self-locking: no current.
        needed = 0.0
    low, high = _motor_limits(screw, speed)
    torque = min(max(needed, low), high)
    userdata[said] = torque
    userdata[said + 1] = 1.0 if beyond or torque != needed or abs(wanted) == limit else 0.0
    free = speed + per_torque * (torque + load)
    new = math.copysign(max(abs(free) - per_torque * friction, 0.0), free)
    reached = position + timestep_s * lead * new
    if reached > screw.stop_m:
        new = (screw.stop_m - position) / (timestep_s * lead)
    elif reached < -screw.stop_m:
        new = (-screw.stop_m - position) / (timestep_s * lead)
    return (new - speed) / timestep_s


@inlined
def screw_rate(block, header, actuators, entry, act, ctrl, ten_length, userdata, timestep_s):
    """Return the rate of a screwed link's length, of a screw's position, or of its motor's speed."""
    state = act[int(entry.act)]
    if entry.kind == fb.KIND_LINK:
        link = _links_at(block, header.links, header.n_links)[int(entry.record)]
        return _link_rate(link, state, act, ten_length, userdata, timestep_s)
    screw = _screws_at(block, header.screws, header.n_screws)[int(entry.record)]
    if entry.kind == fb.KIND_SCREW:
        return screw.lead_mprad * act[int(screw.motor_act)]
    links = _links_at(block, header.links, header.n_links)
    asked = actuators[int(screw.command)]
    return _motor_rate(links, screw, asked, act, ctrl, ten_length, userdata, state, timestep_s)


_SLOW = 1e-4
"""Speed relative to the vibration's below which the error function is replaced by its tangent."""


@compiled
def friction_rate(
    deflection_m: float, speed_mps: float, vibration_mps: float, slip_m: float, timestep_s: float
) -> float:
    """Return the mean rate of an elastic deflection over a step, exact for a constant speed."""
    if slip_m <= 0.0:
        return -deflection_m / timestep_s
    speed = abs(speed_mps)
    if speed <= _SLOW * vibration_mps:
        per_m = math.sqrt(0.5 * math.pi) * vibration_mps
    else:
        per_m = speed if vibration_mps <= 0.0 else speed / math.erf(speed / (math.sqrt(2.0) * vibration_mps))
    decay = per_m / slip_m * timestep_s
    if decay < 1e-9:
        return speed_mps
    return (speed_mps * slip_m / per_m - deflection_m) * -math.expm1(-decay) / timestep_s


@inlined
def servo_rate(entry, command, state):
    """Return the rate of a servo: first-order lag with limits of command and rate."""
    rate = (min(max(command, entry.low), entry.high) - state) / entry.lag_s
    return min(max(rate, -entry.rate_limit), entry.rate_limit)


@inlined
def drive_rate(wheels, header, entry, qvel, command, state, timestep_s):
    """Return the rate of a wheel's drive torque: first-order lag within the limits of the engine."""
    # A motor has its dynamics in `step_motors`; its torque is the command.
    if header.gear == CLUTCH_OPEN or entry.motor != 0.0:
        return (command - state) / timestep_s
    speed = 0.0
    for index in range(wheels.size):
        wheel = wheels[index]
        speed += wheel.drive_fraction * qvel[int(wheel.spin_dof)]
    low, high = drive_limits(
        speed,
        header.gear,
        header.engine_torque_Nm,
        header.engine_power_W,
        header.engine_limit_radps,
        header.engine_drag_Nm,
    )
    torque = state - (command - state) * math.expm1(-timestep_s / entry.lag_s)
    fraction = entry.drive_fraction
    if fraction == 0.0:
        # Not driven: the command is 0, and torque set without the engine decays.
        return (torque - state) / timestep_s
    return (min(max(torque, fraction * low), fraction * high) - state) / timestep_s


@inlined
def brake_rate(entry, qvel, command, state, timestep_s):
    """Return the rate of an elasto-plastic brake: it twists with the wheel and slips at the demanded torque."""
    speed = qvel[int(entry.dof)]
    # Drag of pads, bearings and seals acts always; it also keeps a car at rest from creeping.
    limit = min(max(command, entry.low), entry.high) / entry.stiffness
    wound = min(max(state + timestep_s * speed, -limit), limit)
    return (wound - state) / timestep_s


@inlined
def dry_friction_rate(entry, qvel, ten_velocity, state, timestep_s):
    """Return the rate of the dry friction of a damper or of the rack."""
    speed = ten_velocity[int(entry.tendon)] if entry.tendon >= 0.0 else qvel[int(entry.dof)]
    # The free joint of the chassis comes first (`Vehicle` checks it): its velocity in the world.
    vibration = entry.vibration * (qvel[0] * qvel[0] + qvel[1] * qvel[1]) ** 0.25
    return friction_rate(state, speed, vibration, entry.wound_limit, timestep_s)


_motor_pointer: Final = pointer_to(from_dtype(MOTOR))
_motor_state_pointer: Final = pointer_to(from_dtype(MOTOR_STATE))
_battery_pointer: Final = pointer_to(from_dtype(BATTERY))
_given_pointer: Final = pointer_to(from_dtype(BATTERY_STATE))
_BATTERY_BYTES: Final = BATTERY_STATE.itemsize

_FADE: Final = 0.02
"""Fraction of the map's last speed over which the torque fades to zero."""
_STANDSTILL_RADPS: Final = 1.0
"""Speed of the wheels below which regeneration changes into driving the other way [rad/s]."""


@inlined
def _drive_motor_limits(motor, speed_radps):
    """Return the limits of a motor's torque at its wheels together, at their mean speed [N m]."""
    shaft_radps = abs(speed_radps) * motor.gear
    count = int(motor.points)
    top = motor.speed_radps[count - 1]
    if shaft_radps >= top:
        return 0.0, 0.0
    index = 1
    while index < count - 1 and shaft_radps > motor.speed_radps[index]:
        index += 1
    low, high = motor.speed_radps[index - 1], motor.speed_radps[index]
    before, after = motor.torque_Nm[index - 1], motor.torque_Nm[index]
    most = before + (shaft_radps - low) * (after - before) / (high - low)
    if most * shaft_radps > motor.power_W:
        most = motor.power_W / shaft_radps
    most *= motor.gear * min((top - shaft_radps) / (_FADE * top), 1.0)
    absorbed = most * max(motor.regeneration, 1.0 - abs(speed_radps) / _STANDSTILL_RADPS)
    return (-absorbed, most) if speed_radps >= 0.0 else (-most, absorbed)


@inlined
def _followed(motor, torque_Nm, target_Nm):
    """Return the torque of a motor one step later, after lag and rate limit."""
    if motor.stuck != 0.0:
        return torque_Nm
    change = motor.follow * (target_Nm - torque_Nm)
    return torque_Nm + min(max(change, -motor.step_Nm), motor.step_Nm)


@inlined
def _mechanical_power(motor, state, qvel, spins):
    left, right = qvel[spins[int(motor.left)]], qvel[spins[int(motor.right)]]
    return 0.5 * (state.torque_Nm * (left + right) + state.difference_Nm * (right - left))


@inlined
def _use_battery(motors, states, battery, given, qvel, spins):
    """Scale torques down if the battery is at a limit, and write the powers of motors and battery."""
    total_W, driving_W, absorbing_W = battery.auxiliary_W, 0.0, 0.0
    for index in range(len(motors)):
        motor, state = motors[index], states[index]
        mechanical = _mechanical_power(motor, state, qvel, spins)
        total_W += motor.idle_W
        if mechanical > 0.0:
            driving_W += mechanical / motor.efficiency
        else:
            absorbing_W += mechanical * motor.efficiency
    total_W += driving_W + absorbing_W
    less_driving, less_absorbing = 1.0, 1.0
    if total_W > battery.discharge_W and driving_W > 0.0:
        less_driving = max(1.0 - (total_W - battery.discharge_W) / driving_W, 0.0)
    elif total_W < -battery.charge_W and absorbing_W < 0.0:
        less_absorbing = max(1.0 - (total_W + battery.charge_W) / absorbing_W, 0.0)
    given.limited = 1.0 if less_driving < 1.0 or less_absorbing < 1.0 else 0.0
    given.power_W = battery.auxiliary_W
    for index in range(len(motors)):
        motor, state = motors[index], states[index]
        mechanical = _mechanical_power(motor, state, qvel, spins)
        less = less_driving if mechanical > 0.0 else less_absorbing
        if less < 1.0:
            state.torque_Nm *= less
            state.difference_Nm *= less
            state.limited = 1.0
        mechanical *= less
        electric = mechanical / motor.efficiency if mechanical > 0.0 else mechanical * motor.efficiency
        state.power_W = electric + motor.idle_W
        given.power_W += state.power_W


@compiled
def step_motors(
    motors_address, count, battery_address, states_address, ctrl, drives, qvel, spins, timestep_s, torques_set
):  # fmt: skip
    """Advance the motors and the battery by one step."""
    motors = carray(_motor_pointer(motors_address), (count,))
    states = carray(_motor_state_pointer(states_address + _BATTERY_BYTES), (count,))
    for index in range(count):
        motor, state = motors[index], states[index]
        left, right = int(motor.left), int(motor.right)
        demand, difference = ctrl[drives[left]], 0.0
        if left != right:
            difference = min(max(ctrl[drives[right]] - demand, -motor.split_Nm), motor.split_Nm)
            demand += ctrl[drives[right]]
        if torques_set:
            demand = difference = state.torque_Nm = state.difference_Nm = 0.0
        state.demand_Nm = demand
        demand = motor.scale * demand + motor.offset
        low, high = _drive_motor_limits(motor, 0.5 * (qvel[spins[left]] + qvel[spins[right]]))
        state.limited = 1.0 if demand < low or demand > high else 0.0
        torque = _followed(motor, state.torque_Nm, min(max(demand, low), high))
        state.torque_Nm = min(max(torque, low), high)
        state.difference_Nm = _followed(motor, state.difference_Nm, motor.scale * difference)
    battery, given = carray(_battery_pointer(battery_address), (1,))[0], carray(_given_pointer(states_address), (1,))[0]
    _use_battery(motors, states, battery, given, qvel, spins)
    given.energy_J += given.power_W * timestep_s
    for index in range(0 if torques_set else count):
        motor, state = motors[index], states[index]
        left, right = drives[int(motor.left)], drives[int(motor.right)]
        if left == right:
            ctrl[left] = state.torque_Nm
        else:
            ctrl[left] = 0.5 * (state.torque_Nm - state.difference_Nm)
            ctrl[right] = 0.5 * (state.torque_Nm + state.difference_Nm)
