"""Anti-lock control of the four wheels, with pressure cycles around the limit of the road.

A wheel that is braked harder than the road permits loses speed quickly, since its inertia is small compared with the
car's. Its deceleration shows this before its slip is large, on any road, without knowing the slip at peak friction.
Each wheel runs through the phases

    OFF -> RELEASE -> RECOVER -> BUILD -> RELEASE ...
    OFF -> RELEASE -> RECOVER -> HOLD -> RELEASE ...      at low speed

RELEASE lowers the pressure to a fraction of the friction torque (`friction_Nm`, from pressure and deceleration of the
wheel). On ice it lowers the pressure further, if that leaves too little torque to speed the wheel up, and still further
if the wheel does not gain speed. RECOVER waits until the wheel rolls with the car again. BUILD starts just below the
last friction torque and rises slowly, and faster the longer it lasts, as on a road with increasing friction. A wheel
whose limit exceeds the driver's demand is OFF. A front wheel that a controller brakes beyond the pedal may slip by
`intervention_slip`: a tyre at a large slip angle takes brake force only with a large slip (van Zanten 2000).

At low speed the tyre builds up force slowly (relaxation length over speed), so that a wheel swings on it, and neither
its deceleration nor a small slip indicate locking. There HOLD keeps the mean friction torque of the cycles before, and
only a large slip releases the wheel. Beyond the peak of its friction a wheel would lock at a held pressure, so each
wheel first rolls at less, in RECOVER, over the distance in which its tyre follows its slip.
At standstill, rising pressures hand the car over to the driver.

Source of the cycle by wheel deceleration: Bosch, Automotive Handbook, chapter on ABS; Pasillas-Lepine (2006), Hybrid
modeling and limit cycle analysis for a class of five-phase anti-lock brake algorithms. Fractions, thresholds and rates
are chosen.
"""

from __future__ import annotations

from typing import Final

from activesteer.native.compilation import compiled, inlined

OFF, RELEASE, RECOVER, BUILD, HOLD = 0.0, 1.0, 2.0, 3.0, 4.0

_REGAINS_mps2: Final = 3.0
"""Acceleration relative to the car above which a wheel is recovering; below it, the wheel rolls with the car."""
_LOCKED_SLIP: Final = 0.9
"""Slip beyond which a wheel counts as standing, apart from its swinging on the tyre."""
_PATIENCE_S: Final = 0.03
"""Time in which a released wheel must gain speed before its pressure is lowered further [s]."""
_TYRE_LAG_M: Final = 0.5
"""Distance after which a slowly rolling tyre follows its slip [m], about a relaxation length."""
_SETTLES_S: Final = 0.08
"""Time in which the wheel follows the first pressure of BUILD, while the tyre's carcass winds up [s]."""
_KEPT: Final = 0.9
"""Friction torque of a wheel that is released again within this time, as a fraction of the previous one."""
_MEAN_S: Final = 0.5
"""Time constant of the mean friction torque of a wheel [s]; a cycle lasts about 0.1 s."""
_HELD_LESS: Final = 0.95
"""Held torque after a release, as a fraction of the torque held before."""
_IMPATIENCE_S: Final = 0.25
"""Time in which the rate of BUILD increases by its initial value [s]."""


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
def _hold(setup, state, wheel):
    held_Nm = max(state.mean_Nm[wheel], 0.0)
    state.limit_Pa[wheel] = held_Nm / setup.torque_per_pressure_NmpPa[wheel]
    _begin(state, wheel, HOLD)


@compiled
def _roll_before_hold(setup, state, wheel):
    """Lower the pressure of a cycling wheel, which would lock at a constant pressure."""
    rolls_Nm = setup.release_fraction * max(state.mean_Nm[wheel], 0.0)
    state.limit_Pa[wheel] = rolls_Nm / setup.torque_per_pressure_NmpPa[wheel]
    state.regained_mps2[wheel] = 0.0
    _begin(state, wheel, RECOVER)


@compiled
def _resume(setup, state, wheel, slow):
    """Build up pressure again from just below the last friction torque."""
    if slow:
        _hold(setup, state, wheel)
        return
    borne_Nm = setup.resume_fraction * state.borne_Nm[wheel]
    state.limit_Pa[wheel] = borne_Nm / setup.torque_per_pressure_NmpPa[wheel]
    _begin(state, wheel, BUILD)


@inlined
def _largest_slip(setup, state, wheel, fed_Pa):
    """Slip that always releases a wheel, larger for a front wheel that a controller brakes."""
    return setup.intervention_slip if wheel < 2 and state.demand_Pa[wheel] > fed_Pa else setup.largest_slip


@inlined
def _least_slip(setup, state, wheel, car_mps2):
    """Smallest slip at which the deceleration of a wheel can release it."""
    phase = state.phase[wheel]
    minimum = setup.first_slip if phase == OFF else setup.min_slip - setup.min_slip_gain_s2pm * car_mps2
    if phase == BUILD and state.phase_s[wheel] < _SETTLES_S:
        minimum *= 2.0
    return minimum + setup.min_slip_speed_mps / state.reference_mps


@inlined
def _follow_mean(setup, state, wheel, slow):
    """Update the friction torque at the limit: its peak before the first release, its mean in cycles."""
    difference_Nm = state.friction_Nm[wheel] - state.mean_Nm[wheel]
    if state.phase[wheel] == OFF and difference_Nm > 0.0:
        state.mean_Nm[wheel] += difference_Nm
    elif state.phase[wheel] == OFF or not slow:
        state.mean_Nm[wheel] += setup.interval_s / _MEAN_S * difference_Nm


@inlined
def _hand_over(setup, state, wheel):
    """Raise the pressure limit of a wheel by one step towards the full pressure."""
    highest = setup.full_pedal_pressure_Pa
    state.limit_Pa[wheel] = min(state.limit_Pa[wheel] + setup.hand_over_Paps * setup.interval_s, highest)


@inlined
def _rolls_slowly(setup, state, wheel, locking, gain):
    """Advance a wheel in phase OFF, or in phase HOLD at low speed."""
    if locking and gain < _REGAINS_mps2:
        state.mean_Nm[wheel] *= _HELD_LESS
        _release(setup, state, wheel)
    elif state.phase[wheel] == HOLD:
        rate = setup.hold_rise_per_s * state.mean_Nm[wheel] / setup.torque_per_pressure_NmpPa[wheel]
        state.limit_Pa[wheel] += rate * setup.interval_s
    else:
        _hand_over(setup, state, wheel)


@inlined
def _recover(setup, state, wheel, gain, regains, slow, locking):
    """Advance a wheel that regains speed. Let a slow wheel roll until its tyre has followed."""
    state.borne_Nm[wheel] = max(state.borne_Nm[wheel], state.friction_Nm[wheel])
    state.regained_mps2[wheel] = max(state.regained_mps2[wheel], gain)
    if slow and state.phase_s[wheel] < _TYRE_LAG_M / state.reference_mps:
        if locking and not regains:
            _begin(state, wheel, RELEASE)
    elif gain < max(_REGAINS_mps2, setup.rolls_fraction * state.regained_mps2[wheel]):
        _resume(setup, state, wheel, slow)
    elif not regains:
        _begin(state, wheel, RELEASE)


@compiled
def _wheel(setup, state, wheel, car_mps2, fed_Pa):
    """Advance one wheel by one interval."""
    largest_slip = _largest_slip(setup, state, wheel, fed_Pa)
    per_pressure = setup.torque_per_pressure_NmpPa[wheel]
    slip = (state.reference_mps - state.wheel_mps[wheel]) / state.reference_mps
    gain = state.wheel_mps2[wheel] - car_mps2
    # A locked wheel also gains speed relative to a braking car, but does not recover.
    regains = gain > _REGAINS_mps2 and (slip < largest_slip or (slip < _LOCKED_SLIP and state.wheel_mps2[wheel] > 0.0))
    slow = state.reference_mps < setup.hold_speed_mps
    state.phase_s[wheel] += setup.interval_s
    locking = slip > largest_slip + setup.hold_slip_mps / state.reference_mps
    _follow_mean(setup, state, wheel, slow)
    if slow and state.phase[wheel] == BUILD:
        _roll_before_hold(setup, state, wheel)
    phase = state.phase[wheel]
    if slow and phase in (OFF, HOLD):
        _rolls_slowly(setup, state, wheel, locking, gain)
    elif phase == HOLD:
        _begin(state, wheel, BUILD)
    elif phase in (OFF, BUILD):
        threshold = setup.first_deceleration_mps2 if phase == OFF else setup.deceleration_mps2
        minimum = _least_slip(setup, state, wheel, car_mps2) if largest_slip == setup.largest_slip else largest_slip
        if (gain < -threshold and slip > minimum) or (slip > largest_slip and gain < _REGAINS_mps2):
            _release(setup, state, wheel)
        elif phase == OFF:
            _hand_over(setup, state, wheel)
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
        elif state.phase_s[wheel] > (_PATIENCE_S + _TYRE_LAG_M / state.reference_mps if slow else _PATIENCE_S):
            lower = state.limit_Pa[wheel] - setup.fall_Paps * setup.interval_s
            state.limit_Pa[wheel] = max(lower, 0.0)
    else:
        _recover(setup, state, wheel, gain, regains, slow, locking)


@compiled
def antilock(setup, state, ax_mps2, steered_Pa, fed_Pa):
    """Make the decisions of one control interval for all wheels."""
    # The controller steers against `steered_Pa` between the sides, in addition to the driver. It intervenes at a front
    # wheel where it demands more than `fed_Pa`, the pressure of the pedal.
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
            _wheel(setup, state, wheel, ax_mps2 - state.offset_mps2, fed_Pa)
        state.allowed_Pa[wheel] = state.limit_Pa[wheel]
    _hold_sides_together(setup, state, steered_Pa)
    if setup.select_low != 0.0:
        most = min(state.limit_Pa[2], state.limit_Pa[3]) + setup.rear_side_fraction * steered_Pa
        state.allowed_Pa[2], state.allowed_Pa[3] = min(state.limit_Pa[2], most), min(state.limit_Pa[3], most)


@compiled
def _hold_sides_together(setup, state, steered_Pa):
    """Limit the pressure of the front wheel with more grip to what a driver can steer against."""
    if state.phase[0] == OFF and state.phase[1] == OFF:
        state.side_Pa = setup.side_difference_Pa
        return
    state.side_Pa += setup.side_difference_rise_Paps * setup.interval_s
    for wheel in range(2):
        other = 1 - wheel
        if state.phase[other] != OFF:
            maximum = state.borne_Nm[other] / setup.torque_per_pressure_NmpPa[other] + state.side_Pa + steered_Pa
            state.allowed_Pa[wheel] = min(state.allowed_Pa[wheel], maximum)
