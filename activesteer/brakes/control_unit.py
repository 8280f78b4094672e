"""One step of the brakes: demand, control unit at its own rate, pressures."""

from __future__ import annotations

from activesteer.brakes.antilock import antilock
from activesteer.brakes.hydraulics import ask, flow, pedal_pressure
from activesteer.brakes.records import NO_LIMIT_NM
from activesteer.brakes.reference_speed import follow_car, follow_wheels
from activesteer.brakes.traction import traction
from activesteer.compilation import compiled


@compiled
def step_brakes(setup, state, speeds_radps, ax_mps2, pedal, drive_Nm, asked_Nm, steered_Pa):
    """Make one step.

    Args:
        setup: A `BRAKE_SETUP`.
        state: Its `BRAKE_STATE`.
        speeds_radps: Measured rotational speeds of the wheels [rad/s], order of `CORNERS`.
        ax_mps2: Measured longitudinal acceleration [m/s2].
        pedal: Brake pedal position, 0 to 1.
        drive_Nm: Drive torque that driver and controller demand [Nm].
        asked_Nm: Brake torques that the controller demands [Nm], order of `CORNERS`.
        steered_Pa: Side-to-side difference that the controller steers against [Pa].

    Returns:
        The drive torque that traction control leaves [Nm].
    """
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
