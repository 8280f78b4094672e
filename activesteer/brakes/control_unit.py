"""One step of the brakes: what is asked, what the control unit makes of it at its own rate, what the wheels get."""

from __future__ import annotations

from activesteer.brakes.antilock import antilock
from activesteer.brakes.hydraulics import ask, flow
from activesteer.brakes.records import NO_LIMIT_NM
from activesteer.brakes.reference_speed import follow_car, follow_wheels
from activesteer.brakes.traction import traction
from activesteer.compilation import compiled


@compiled
def step_brakes(setup, state, speeds_radps, ax_mps2, pedal, drive_Nm, asked_Nm, steered_Pa):
    """One step.

    Args:
        setup: A `BRAKE_SETUP`.
        state: Its `BRAKE_STATE`.
        speeds_radps: Rotational speeds of the wheels as measured [rad/s], order of `CORNERS`.
        ax_mps2: Longitudinal acceleration as measured [m/s2].
        pedal: Brake pedal position, 0 to 1.
        drive_Nm: Drive torque that driver and controller ask for [Nm].
        asked_Nm: Brake torques that the controller asks for [Nm], order of `CORNERS`.
        steered_Pa: Difference of the sides that the controller steers against [Pa].

    Returns:
        The drive torque that is left [Nm].
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
            antilock(setup, state, ax_mps2, steered_Pa)
        if setup.tcs != 0.0:
            traction(setup, state, drive_Nm, braked)
    flow(setup, state, pedal)
    return min(drive_Nm, state.drive_limit_Nm) if state.drive_limit_Nm < NO_LIMIT_NM else drive_Nm
