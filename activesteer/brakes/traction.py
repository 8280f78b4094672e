"""Traction control: engine and brakes keep the driven wheels near the speed of the car."""

from __future__ import annotations

from activesteer.brakes.records import NO_LIMIT_NM
from activesteer.compilation import compiled


@compiled
def traction(setup, state, torque_Nm, braked):
    """Decide once.

    The mean speed of the driven wheels may exceed that of the car by a fraction and a constant. A proportional and an
    integral part reduce the drive torque by the excess; the integral starts from the torque at that instant. Of two
    wheels behind a differential the faster one is braked, so that the differential passes its torque to the other.

    Args:
        setup: A `BRAKE_SETUP`.
        state: Its `BRAKE_STATE`; `drive_limit_Nm`, `traction_Nm` and `traction_Pa` are advanced.
        torque_Nm: Drive torque that driver and controller demand [Nm].
        braked: Whether a brake is applied or demanded.
    """
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
