"""The dynamics of screws in the toe links and of the superposition's motor; see `toe_link_screws`."""

from __future__ import annotations

import math
from typing import Final

from activesteer.compilation import inlined
from activesteer.native_memory import records_at
from activesteer.vehicle import force_block as fb

_CONTACT_S: Final = 3e-4
"""Time in which a screwed link settles in its play; at 0, the linearised car would lack this mode [s]."""
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
    """Return the change of a link's length within its play: no force if possible, else an end of the play."""
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
    """Return the load torque at the motor, positive if driving forwards, and the sum of its parts' sizes [N m]."""
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
    """Return the least and the greatest torque that current, voltage and power allow at a speed [N m]."""
    high = min(screw.peak_Nm, max(screw.stall_Nm - screw.slope_Nmsprad * speed, 0.0))
    low = -min(screw.peak_Nm, max(screw.stall_Nm + screw.slope_Nmsprad * speed, 0.0))
    if speed > 0.0:
        high = min(high, screw.power_W / speed)
    elif speed < 0.0:
        low = max(low, screw.power_W / speed)
    return low, high


@inlined
def _motor_rate(links, screw, asked, act, ctrl, ten_length, userdata, speed, timestep_s):
    """Return the rate of a motor's speed: both loops within current, voltage and power, load, dry friction."""
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
    """Return the rate of a screwed link's change of length, of a screw's position, or of its motor's speed."""
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
