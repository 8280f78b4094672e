"""The control unit's estimate of the car's speed, from the wheels and the longitudinal acceleration.

While no brake acts, the wheels that are not driven give the speed. While a brake acts, the fastest wheel is closest to
the car's speed, and the acceleration is integrated from the last unbraked instant on. The measured acceleration is the
specific force along the inclined body; its part from gravity on a slope is learned while the car rolls.
"""

from __future__ import annotations

from typing import Final

from activesteer.compilation import compiled

_SLACK_mps2: Final = 0.2
"""Additional deceleration of the estimate, so that the fastest wheel corrects it upwards [m/s2]."""
_CATCH_UP_mps2: Final = 2.0
"""Largest rate of that correction; a wheel that swings on its suspension is for an instant faster than the car [m/s2].
"""
_LEARN_S: Final = 0.5
"""Time constant of the learned offset of the acceleration [s]."""
_LARGEST_OFFSET_mps2: Final = 3.0
"""Largest offset; no road is steeper than this [m/s2]."""
_SMOOTH_S: Final = 0.005
"""Time constant of the wheel accelerations [s]."""


@compiled
def follow_wheels(setup, state, speeds_radps):
    """Update circumferential speeds and accelerations of the wheels, and their friction torques, after an interval.

    Args:
        setup: A `BRAKE_SETUP`.
        state: Its `BRAKE_STATE`; `wheel_mps`, `wheel_mps2` and `friction_Nm` are written.
        speeds_radps: Rotational speeds of the wheels [rad/s], order of `CORNERS`.
    """
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
    """Update the reference speed after an interval.

    Args:
        setup: A `BRAKE_SETUP`.
        state: Its `BRAKE_STATE`; `reference_mps` and `offset_mps2` are advanced.
        ax_mps2: Measured longitudinal acceleration [m/s2].
        braked: Whether a brake is applied or demanded.
    """
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
