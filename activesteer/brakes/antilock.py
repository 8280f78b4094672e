"""Anti-lock control of the four wheels: pressure in cycles about what the road bears.

A wheel that is braked harder than the road bears loses speed quickly, since its inertia is small beside the car's: that
shows by its deceleration before its slip is large, on any road, without knowing where the friction has its peak. So
each wheel goes round

    OFF -> RELEASE -> RECOVER -> BUILD -> RELEASE ...

RELEASE lowers the pressure to a fraction of what the friction bore (`friction_Nm`, from pressure and deceleration of
the wheel), on ice further, where that leaves too little torque to speed the wheel up, and still further if the wheel
does not gain speed; RECOVER waits until it rolls with the car again; BUILD begins just below what was borne and rises
slowly, the faster the longer it lasts, as on a road that has become better. A wheel whose limit comes above what the
driver asks for is OFF. A car that is nearly at rest is handed over to him by pressures that rise slowly.

Source of the cycle by wheel deceleration: Bosch, Automotive Handbook, chapter on ABS; Pasillas-Lepine (2006), Hybrid
modeling and limit cycle analysis for a class of five-phase anti-lock brake algorithms. Shares, thresholds and rates are
chosen.
"""

from __future__ import annotations

from typing import Final

from activesteer.compilation import compiled

OFF, RELEASE, RECOVER, BUILD = 0.0, 1.0, 2.0, 3.0

_REGAINS_mps2: Final = 3.0
"""A wheel that gains speed on the car by more than this is recovering; by less it rolls with it in any case [m/s2]."""
_PATIENCE_S: Final = 0.03
"""Time that a released wheel gets to gain speed before its pressure is taken down further [s]."""
_SETTLES_S: Final = 0.08
"""Time in which the wheel follows the first pressure of building up, as the tyre's carcass winds up [s]."""
_KEPT: Final = 0.9
"""What a wheel that is released again so soon is still trusted to bear, as a fraction of what it bore before."""
_IMPATIENCE_S: Final = 0.25
"""Time after which building up becomes faster by its own amount [s]."""


@compiled
def _begin(state, wheel, phase):
    state.phase[wheel] = phase
    state.phase_s[wheel] = 0.0


@compiled
def _release(setup, state, wheel):
    borne = max(state.friction_Nm[wheel], 0.0)
    if state.phase[wheel] == BUILD and state.phase_s[wheel] < _SETTLES_S:
        borne = max(borne, _KEPT * state.borne_Nm[wheel])
    state.borne_Nm[wheel] = borne
    needed_Nm = setup.inertia_kgm2[wheel] / setup.rolling_radius_m[wheel] * setup.regain_mps2
    left = max(min(setup.release_fraction * borne, borne - needed_Nm), 0.0)
    state.limit_Pa[wheel] = left / setup.torque_per_pressure_NmpPa[wheel]
    _begin(state, wheel, RELEASE)


@compiled
def _wheel(setup, state, wheel, car_mps2):
    """One interval of one wheel."""
    per_pressure = setup.torque_per_pressure_NmpPa[wheel]
    slip = (state.reference_mps - state.wheel_mps[wheel]) / state.reference_mps
    gain = state.wheel_mps2[wheel] - car_mps2
    # A wheel that stands gains on a car that brakes, too, and yet does not come back.
    regains = gain > _REGAINS_mps2 and (slip < setup.largest_slip or state.wheel_mps2[wheel] > 0.0)
    phase = state.phase[wheel]
    state.phase_s[wheel] += setup.interval_s
    if phase in (OFF, BUILD):
        threshold = setup.first_deceleration_mps2 if phase == OFF else setup.deceleration_mps2
        minimum = setup.first_slip if phase == OFF else setup.min_slip - setup.min_slip_gain_s2pm * car_mps2
        if phase == BUILD and state.phase_s[wheel] < _SETTLES_S:
            minimum *= 2.0
        minimum += setup.min_slip_speed_mps / state.reference_mps
        if (gain < -threshold and slip > minimum) or (slip > setup.largest_slip and gain < _REGAINS_mps2):
            _release(setup, state, wheel)
        elif phase == OFF:
            # Less than the highest where the car has become faster again, after a hand-over.
            highest = setup.full_pedal_pressure_Pa
            state.limit_Pa[wheel] = min(state.limit_Pa[wheel] + setup.hand_over_Paps * setup.interval_s, highest)
        else:
            faster = 1.0 + state.phase_s[wheel] / _IMPATIENCE_S
            rate = setup.build_per_s * faster * state.borne_Nm[wheel] / per_pressure
            state.limit_Pa[wheel] += rate * setup.interval_s
            if state.limit_Pa[wheel] >= setup.full_pedal_pressure_Pa:
                state.limit_Pa[wheel] = setup.full_pedal_pressure_Pa
                _begin(state, wheel, OFF)
    elif phase == RELEASE:
        if regains:
            state.regained_mps2[wheel] = gain
            _begin(state, wheel, RECOVER)
        elif state.phase_s[wheel] > _PATIENCE_S:
            lower = state.limit_Pa[wheel] - setup.fall_Paps * setup.interval_s
            state.limit_Pa[wheel] = max(lower, 0.0)
    else:
        state.borne_Nm[wheel] = max(state.borne_Nm[wheel], state.friction_Nm[wheel])
        state.regained_mps2[wheel] = max(state.regained_mps2[wheel], gain)
        if gain < max(_REGAINS_mps2, setup.rolls_fraction * state.regained_mps2[wheel]):
            state.limit_Pa[wheel] = setup.resume_fraction * state.borne_Nm[wheel] / per_pressure
            _begin(state, wheel, BUILD)
        elif not regains:
            _begin(state, wheel, RELEASE)


@compiled
def antilock(setup, state, ax_mps2, steered_Pa):
    """One decision for all wheels.

    Args:
        setup: A `BRAKE_SETUP`.
        state: Its `BRAKE_STATE`; `limit_Pa`, the phases and `side_Pa` are advanced.
        ax_mps2: Longitudinal acceleration as measured [m/s2].
        steered_Pa: Difference of the sides that the controller steers against, beyond the driver's [Pa].
    """
    highest = setup.full_pedal_pressure_Pa
    slow = state.reference_mps < setup.lowest_speed_mps
    for wheel in range(4):
        idle = state.demand_Pa[wheel] == 0.0 or setup.torque_per_pressure_NmpPa[wheel] == 0.0
        if (idle or slow) and state.phase[wheel] != OFF:
            _begin(state, wheel, OFF)
        if idle:
            state.limit_Pa[wheel] = highest
        elif slow:
            state.limit_Pa[wheel] = min(state.allowed_Pa[wheel] + setup.hand_over_Paps * setup.interval_s, highest)
        else:
            _wheel(setup, state, wheel, ax_mps2 - state.offset_mps2)
        state.allowed_Pa[wheel] = state.limit_Pa[wheel]
    _hold_sides_together(setup, state, steered_Pa)
    if setup.select_low != 0.0:
        most = min(state.limit_Pa[2], state.limit_Pa[3]) + setup.rear_side_fraction * steered_Pa
        state.allowed_Pa[2], state.allowed_Pa[3] = min(state.limit_Pa[2], most), min(state.limit_Pa[3], most)


@compiled
def _hold_sides_together(setup, state, steered_Pa):
    """The front wheel with more grip is let off the other's pressure only as fast as a driver can steer against it."""
    if state.phase[0] == OFF and state.phase[1] == OFF:
        state.side_Pa = setup.side_difference_Pa
        return
    state.side_Pa += setup.side_difference_rise_Paps * setup.interval_s
    for wheel in range(2):
        other = 1 - wheel
        if state.phase[other] != OFF:
            maximum = state.borne_Nm[other] / setup.torque_per_pressure_NmpPa[other] + state.side_Pa + steered_Pa
            state.allowed_Pa[wheel] = min(state.allowed_Pa[wheel], maximum)
