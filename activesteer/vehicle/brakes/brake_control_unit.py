"""One step of the brakes: demand, control unit, speed estimate, traction control, and pressures.

While no brake acts, the wheels that are not driven give the speed. While a brake acts, the fastest wheel is closest to
the car's speed, and the acceleration is integrated from the last unbraked time on. The measured acceleration is the
specific force along the inclined body; its part from gravity on a slope is learned while the car rolls.
"""

from __future__ import annotations

from typing import Final

from activesteer.native.compilation import compiled, inlined
from activesteer.vehicle.brakes.antilock import antilock
from activesteer.vehicle.brakes.records import NO_LIMIT_NM


@inlined
def pedal_pressure(setup, pedal):
    """Return the pressure of the pedal [Pa], linear beyond its dead travel."""
    return max(pedal - setup.dead_travel, 0.0) / (1.0 - setup.dead_travel) * setup.full_pedal_pressure_Pa


@compiled
def ask(setup, state, pedal, asked_Nm):
    """Sum the pressure demands of driver and controller, limited to the highest pressure."""
    highest, fed = setup.full_pedal_pressure_Pa, pedal_pressure(setup, pedal)
    for wheel in range(4):
        pressure = fed
        if asked_Nm[wheel] != 0.0:
            pressure += asked_Nm[wheel] / setup.torque_per_pressure_NmpPa[wheel]
        state.demand_Pa[wheel] = min(max(pressure, 0.0), highest)


@compiled
def flow(setup, state, pedal):
    """Advance the pressures by one step. The pedal feeds a brake up to the pedal pressure, and the pump beyond it."""
    # The torque of a brake is its torque per pressure, 2 mu_pad A_piston r_effective, times the pressure.
    fed = pedal_pressure(setup, pedal)
    for wheel in range(4):
        pressure = state.pressure_Pa[wheel]
        wanted = max(min(state.demand_Pa[wheel], state.allowed_Pa[wheel]), state.traction_Pa[wheel])
        rise = setup.rise_Paps if pressure < fed else setup.pump_rise_Paps
        change = (wanted - pressure) * setup.follow
        change = min(max(change, -setup.fall_Paps * setup.timestep_s), rise * setup.timestep_s)
        state.pressure_Pa[wheel] = pressure + change


_SLACK_mps2: Final = 0.2
"""Additional deceleration of the estimate, so that the fastest wheel corrects it upwards [m/s2]."""
_CATCH_UP_mps2: Final = 2.0
"""Largest rate of that correction [m/s2]: a wheel that swings on its suspension is briefly faster than the car."""
_LEARN_S: Final = 0.5
"""Time constant of the learned offset of the acceleration [s]."""
_LARGEST_OFFSET_mps2: Final = 3.0
"""Largest offset; no road is steeper than this [m/s2]."""
_SMOOTH_S: Final = 0.005
"""Time constant of the wheel accelerations [s]."""


@compiled
def follow_wheels(setup, state, speeds_radps):
    """Update circumferential speeds, accelerations and friction torques of the wheels after an interval."""
    fraction = setup.interval_s / (setup.interval_s + _SMOOTH_S)
    for wheel in range(4):
        speed = setup.rolling_radius_m[wheel] * speeds_radps[wheel]
        rate = (speed - state.wheel_mps[wheel]) / setup.interval_s
        state.wheel_mps2[wheel] += fraction * (rate - state.wheel_mps2[wheel])
        state.wheel_mps[wheel] = speed
        # J d omega/dt = r F_x - T_brake
        borne = setup.torque_per_pressure_NmpPa[wheel] * state.pressure_Pa[wheel]
        borne += setup.inertia_kgm2[wheel] / setup.rolling_radius_m[wheel] * state.wheel_mps2[wheel]
        state.friction_Nm[wheel] += fraction * (borne - state.friction_Nm[wheel])


@compiled
def follow_car(setup, state, ax_mps2, braked):
    """Update the reference speed, and the offset of the acceleration, after an interval."""
    fastest, slowest, rolling, free = -1e9, 1e9, 0.0, 0.0
    for wheel in range(4):
        fastest = max(fastest, state.wheel_mps[wheel])
        slowest = min(slowest, state.wheel_mps[wheel])
        if setup.drive_fraction[wheel] == 0.0:
            rolling += state.wheel_mps[wheel]
            free += 1.0
    if braked:
        # Brakes do not make a car faster; if a slope does, the wheels show it.
        rate_mps2 = min(ax_mps2 - state.offset_mps2, 0.0) - _SLACK_mps2
        integrated = state.reference_mps + rate_mps2 * setup.interval_s
        caught_up = min(fastest, integrated + _CATCH_UP_mps2 * setup.interval_s)
        state.reference_mps = max(integrated, caught_up, 0.0)
        return
    before = state.reference_mps
    state.reference_mps = rolling / free if free > 0.0 else slowest
    error = ax_mps2 - (state.reference_mps - before) / setup.interval_s
    offset = state.offset_mps2 + setup.interval_s / _LEARN_S * (error - state.offset_mps2)
    state.offset_mps2 = min(max(offset, -_LARGEST_OFFSET_mps2), _LARGEST_OFFSET_mps2)


@compiled
def traction(setup, state, torque_Nm, braked):
    """Make the decisions of traction control: engine limit, motor torques and brake pressures."""
    # The mean speed of the driven wheels may exceed the speed of the car by a fraction and a constant. A proportional
    # and an integral part reduce the drive torque by the excess. The integral starts from the torque at that time. The
    # faster of two wheels behind a differential is braked, so that the differential passes its torque to the other.
    turning, other = 0.0, 0.0
    for wheel in range(4):
        turning += setup.drive_fraction[wheel] * state.wheel_mps[wheel]
    excess = turning - (1.0 + setup.slip) * state.reference_mps - setup.spin_mps
    if braked or torque_Nm <= 0.0 or (state.drive_limit_Nm == NO_LIMIT_NM and excess <= 0.0):
        state.drive_limit_Nm = NO_LIMIT_NM
        state.tcs_active = 0.0
        state.traction_Pa[:] = 0.0
        return
    state.tcs_active = 1.0
    if state.drive_limit_Nm == NO_LIMIT_NM:
        state.traction_Nm = torque_Nm
    state.traction_Nm -= setup.engine_integral_gain_Nmpm * excess * setup.interval_s
    state.traction_Nm = max(state.traction_Nm, 0.0)
    state.drive_limit_Nm = max(state.traction_Nm - setup.engine_gain_Nmspm * excess, 0.0)
    if state.traction_Nm > torque_Nm:
        state.drive_limit_Nm = NO_LIMIT_NM
    for wheel in range(4):
        other = state.wheel_mps[wheel + 1 - 2 * (wheel % 2)]
        beyond = state.wheel_mps[wheel] - other - setup.spin_mps
        pressure = setup.brake_gain_Paspm * beyond if setup.differential[wheel] != 0.0 else 0.0
        state.traction_Pa[wheel] = min(max(pressure, 0.0), setup.brake_limit_Pa)


@compiled
def step_brakes(setup, state, speeds_radps, ax_mps2, pedal, drive_Nm, asked_Nm, steered_Pa):
    """Make one step with measured speeds and acceleration; return the drive torque after traction control [Nm]."""
    ask(setup, state, pedal, asked_Nm)
    state.steps_left -= 1.0
    if state.steps_left <= 0.0:
        state.steps_left = setup.interval_steps
        braked = False
        for wheel in range(4):
            braked |= state.demand_Pa[wheel] > 0.0
        follow_wheels(setup, state, speeds_radps)
        follow_car(setup, state, ax_mps2, braked)
        if setup.abs != 0.0:
            antilock(setup, state, ax_mps2, steered_Pa, pedal_pressure(setup, pedal))
        if setup.tcs != 0.0:
            traction(setup, state, drive_Nm, braked)
    flow(setup, state, pedal)
    return min(drive_Nm, state.drive_limit_Nm) if state.drive_limit_Nm < NO_LIMIT_NM else drive_Nm
