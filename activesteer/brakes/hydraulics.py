"""Pressures of the wheel brakes: a lag behind their demand, with the rate limits of booster, valves and pump."""

from __future__ import annotations

from activesteer.compilation import compiled, inlined


@inlined
def pedal_pressure(setup, pedal):
    """Return the pressure that the pedal feeds [Pa]: none within its dead travel, and linear beyond it."""
    return max(pedal - setup.dead_travel, 0.0) / (1.0 - setup.dead_travel) * setup.full_pedal_pressure_Pa


@compiled
def ask(setup, state, pedal, asked_Nm):
    """Add the pressures that driver and controller demand, between 0 and the highest.

    Args:
        setup: A `BRAKE_SETUP`.
        state: Its `BRAKE_STATE`; `demand_Pa` is written.
        pedal: Brake pedal position, 0 to 1.
        asked_Nm: Brake torques that the controller demands [Nm], order of `CORNERS`.
    """
    highest, fed = setup.full_pedal_pressure_Pa, pedal_pressure(setup, pedal)
    for wheel in range(4):
        pressure = fed
        if asked_Nm[wheel] != 0.0:
            pressure += asked_Nm[wheel] / setup.torque_per_pressure_NmpPa[wheel]
        state.demand_Pa[wheel] = min(max(pressure, 0.0), highest)


@compiled
def flow(setup, state, pedal):
    """Advance the pressures by one step.

    The torque of a brake is its torque per pressure, 2 mu_pad A_piston r_effective, times the pressure.

    Args:
        setup: A `BRAKE_SETUP`.
        state: Its `BRAKE_STATE`; `pressure_Pa` is advanced.
        pedal: Brake pedal position, 0 to 1; up to its pressure the pedal feeds a brake, beyond it the pump does.
    """
    fed = pedal_pressure(setup, pedal)
    for wheel in range(4):
        pressure = state.pressure_Pa[wheel]
        wanted = max(min(state.demand_Pa[wheel], state.allowed_Pa[wheel]), state.traction_Pa[wheel])
        rise = setup.rise_Paps if pressure < fed else setup.pump_rise_Paps
        change = (wanted - pressure) * setup.follow
        change = min(max(change, -setup.fall_Paps * setup.timestep_s), rise * setup.timestep_s)
        state.pressure_Pa[wheel] = pressure + change
