"""One step of the electric drive: demands of the wheels to torques of the wheels, and the power of the battery.

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

from typing import Final

from numba import carray, from_dtype

from activesteer.compilation import compiled, inlined
from activesteer.native_memory import pointer_to
from activesteer.vehicle.motor_records import BATTERY, BATTERY_STATE, MOTOR, MOTOR_STATE

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
def _motor_limits(motor, speed_radps):
    """Return the least and the greatest torque of a motor at its wheels together, at their mean speed."""
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
    """Return the torque one step later."""
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
    """Scale torques down where the battery is at a limit; write the powers of motors and battery."""
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
    """Make one step.

    Args:
        motors_address: Address of `MOTOR` records.
        count: Their number.
        battery_address: Address of a `BATTERY`.
        states_address: Address of a `BATTERY_STATE`, followed by a `MOTOR_STATE` for each motor; advanced.
        ctrl: Inputs of the actuators, with the demands of the wheels [N m]; the torques of the motors replace them.
        drives: Places of the four wheels in `ctrl`.
        qvel: Velocities of the engine's degrees of freedom.
        spins: Places of the four wheels in `qvel`.
        timestep_s: Step of the engine [s].
        torques_set: Whether the torques of the wheels are given, so that the motors are off and `ctrl` stays.
    """
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
        low, high = _motor_limits(motor, 0.5 * (qvel[spins[left]] + qvel[spins[right]]))
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
