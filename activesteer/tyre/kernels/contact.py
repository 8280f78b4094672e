"""One wheel on the road: contact kinematics, slip with relaxation, standstill, and the Magic Formula.

All functions are pure functions of the state. The three relaxation states of a tyre are the deflections of its contact
patch against the rim: `deflection_x_m` along and `deflection_y_m` across the wheel's heading [m], and
`deflection_z_rad`, the twist about the normal of the road (Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, section
8.6, the restricted fully non-linear model; the twist in the same form over half the contact length a):

    d(u)/dt = -V_sx - |V_x| u / sigma_kappa        kappa' = u / sigma_kappa
    d(v)/dt =  V_sy - |V_x| v / sigma_alpha        tan(alpha') = v / sigma_alpha      (ISO-W sign of alpha)
    d(w)/dt =  psi_dot - |V_x| w / a               phi' = w / a                       (turn slip)

The turn slip enters the formula at low speed only, where steering twists the patch (parking). It fades out with the
other standstill terms, so that the usual formula without turn slip applies at speed.

Three additions make the states usable from standstill to any speed:

* The rates are mean values over the step, exact for slip speeds held within it, and the forces belong to its end.
  Nothing gets stiff when sigma becomes small, and at rest the tyre is a spring, not an amplifier.
* At low speed, a contact patch that slides as a whole limits the deflection (the "wind-up" of Pacejka, eq. 8.125 ff.).
  |V_x| is replaced by max(|V_x|, |V_s| / slip_limit), at rest with one |V_s| / slip_limit for both axes, so that a
  sliding tyre pulls against its sliding. Above `low_speed_mps` the slip limit comes from the tyre file, separately for
  each axis, so that the formula's steady state is reached exactly within its range of validity.
* At low speed a viscous term acts in addition to the spring (Pacejka, eq. 8.129: k_Vlow) and fades out with a cosine.
  It enters as a slip, so that the friction limit bounds it.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from activesteer.native.compilation import compiled
from activesteer.tyre.kernels.magic_formula import limit_flags, slip_stiffnesses, steady_state
from activesteer.tyre.kernels.slip import MIN_RELAXATION_LENGTH_M, relaxation_lengths
from activesteer.tyre.kernels.vertical import (
    bottoming_force,
    contact_patch,
    effective_rolling_radius,
    free_radius,
    vertical_force_loaded,
)

_LIFTED_DECAY_PER_S: Final = 20.0
"""Decay rate of the deflection of a lifted tyre [1/s]: a carcass rings down within some tenths of a second."""
_SLIDING_TO_LINEAR: Final = 3.0
"""Slip of full sliding over slip at which the linear force would reach the friction limit: 3 for a brush model."""
_SLIDING_TWIST_RAD: Final = 0.12
"""Twist at which the whole patch slides about its middle [rad]: parking torques level off after about 5 to 8 deg."""
_NO_TURN_SLIP_1PM: Final = 1e-12
"""Turn slip that stands for zero in the formula with turn slip. Zero would select the formula without it."""
_SMALLEST_SLIP_LIMIT: Final = 0.01
"""Smallest slip limit of a deflection, for any range in a tyre file."""
_MAX_LOAD_STEPS: Final = 8
_CAUTIOUS: Final = 0.1
"""Fraction of the load that remains if a step of the search would lift the tyre."""
_LOAD_TOLERANCE: Final = 1e-9
"""Tolerance of the load, relative to the load, in the search for load and horizontal forces."""


class WheelForces(NamedTuple):
    """Forces and intermediate quantities of one tyre, in the ISO-W frame at the contact point."""

    fx_N: float
    fy_N: float
    fz_N: float
    mx_Nm: float
    my_Nm: float
    mz_Nm: float
    slip_ratio: float
    slip_angle_rad: float
    inclination_rad: float
    deflection_x_rate_mps: float
    deflection_y_rate_mps: float
    deflection_z_rate_radps: float
    loaded_radius_m: float
    heading_x: float
    heading_y: float
    arm_x_m: float
    arm_y_m: float
    arm_z_m: float
    limited: float
    friction_utilisation: float


class _Rolling(NamedTuple):
    """Forces and rates of a tyre at a given load above zero."""

    fx_N: float
    fy_N: float
    mx_Nm: float
    my_Nm: float
    mz_Nm: float
    slip_ratio: float
    slip_angle_rad: float
    deflection_x_rate_mps: float
    deflection_y_rate_mps: float
    deflection_z_rate_radps: float
    limited: float
    friction_utilisation: float


@compiled
def _mean_decay(x):
    """Return the mean of exp(-t) over t from 0 to x, the average remaining fraction of a rate over a step."""
    return -math.expm1(-x) / x if x > 1e-9 else 1.0


@compiled
def _low_speed_slip_limit(file_limit, sliding_slip, fraction):
    """Return the slip at which the deflection is limited: the sliding slip at rest, the file's limit in motion."""
    return file_limit + (min(sliding_slip, file_limit) - file_limit) * fraction


@compiled
def _rolling_tyre(  # noqa: PLR0915 - one evaluation, compiled as one function
    p, mu, pressure_Pa, low_speed_mps, low_speed_damping_Nspm, timestep_s, fz, vx, vsy, spin, turn, gamma, u, v, w
):
    """Evaluate a tyre at a load above zero, with velocities along and across its heading."""
    vsx = vx - spin * effective_rolling_radius(p, fz, spin, pressure_Pa)
    limit_x = max(p.KPUMAX if vsx < 0.0 else -p.KPUMIN, _SMALLEST_SLIP_LIMIT)
    limit_y = max(math.tan(min(p.ALPMAX if vsy > 0.0 else -p.ALPMIN, 1.5)), _SMALLEST_SLIP_LIMIT)
    speed = abs(vx)
    fraction = 0.0
    damping_slip_x = 0.0
    damping_slip_y = 0.0
    if speed < low_speed_mps:
        fraction = 0.5 * (1.0 + math.cos(math.pi * speed / low_speed_mps))
        stiffness_x, stiffness_y = slip_stiffnesses(p, fz, gamma, pressure_Pa)
        stiffness_x = abs(stiffness_x)
        stiffness_y = abs(stiffness_y)
        sliding = _SLIDING_TO_LINEAR * mu / p.REFERENCE_FRICTION * fz
        limit_x = _low_speed_slip_limit(limit_x, sliding / stiffness_x, fraction)
        limit_y = _low_speed_slip_limit(limit_y, sliding / stiffness_y, fraction)
        damping_slip_x = -low_speed_damping_Nspm * fraction * vsx / stiffness_x
        damping_slip_y = low_speed_damping_Nspm * fraction * vsy / stiffness_y

    sigma_x, sigma_y = relaxation_lengths(p, fz, gamma, pressure_Pa)
    if p.RELAXATION_OFF != 0.0:
        sigma_x *= fraction
        sigma_y *= fraction
    sigma_x = max(sigma_x, MIN_RELAXATION_LENGTH_M)
    sigma_y = max(sigma_y, MIN_RELAXATION_LENGTH_M)
    sliding_x = abs(vsx) / limit_x
    sliding_y = abs(vsy) / limit_y
    held = 1.0
    if fraction > 0.0:
        # A patch that slides as a whole is dragged along the direction of sliding, so one rate serves both deflections.
        together = fraction * math.sqrt(sliding_x * sliding_x + sliding_y * sliding_y)
        sliding_x = (1.0 - fraction) * sliding_x + together
        sliding_y = (1.0 - fraction) * sliding_y + together
        # A patch that slid at higher speed may have more deflection than sliding at this speed allows. Sliding releases
        # the surplus, so that it does not push the car away at rest.
        held = max(1.0, math.hypot(u / (sigma_x * limit_x), v / (sigma_y * limit_y)))
    rolling = speed + p.SPEED_OFFSET
    carry_x = max(rolling, sliding_x)
    carry_y = max(rolling, sliding_y)
    rate_x = (-vsx - carry_x * u / held / sigma_x) * _mean_decay(timestep_s * carry_x / sigma_x)
    rate_x -= u * (1.0 - 1.0 / held) / timestep_s
    rate_y = (vsy - carry_y * v / held / sigma_y) * _mean_decay(timestep_s * carry_y / sigma_y)
    rate_y -= v * (1.0 - 1.0 / held) / timestep_s
    half_length = max(0.5 * contact_patch(p, fz, pressure_Pa)[0], MIN_RELAXATION_LENGTH_M)
    carry_z = max(speed, abs(turn) * half_length / _SLIDING_TWIST_RAD)
    rate_z = (turn - carry_z * w / half_length) * _mean_decay(timestep_s * carry_z / half_length)
    kappa = (u + timestep_s * rate_x) / sigma_x + damping_slip_x
    alpha = math.atan((v + timestep_s * rate_y) / sigma_y + damping_slip_y)

    # If the wind-up limit of a rolling tyre holds the deflection, the slip is outside the valid range.
    limited = 0.0
    beyond = speed >= low_speed_mps and (carry_x > rolling or carry_y > rolling)
    if beyond or limit_flags(p, fz, kappa, alpha, gamma, pressure_Pa) != 0:
        limited = 1.0
    # Camber acts by the path of the tread through the patch of a rolling tyre; at rest there is no such path.
    gamma *= 1.0 - fraction
    straight = steady_state(p, fz, kappa, alpha, gamma, pressure_Pa, vx, mu, 0.0)
    fx, fy, mx, my, mz = straight.fx_N, straight.fy_N, straight.mx_Nm, straight.my_Nm, straight.mz_Nm
    if fraction > 0.0:
        # The formula with turn slip treats camber differently, even at zero turn slip: both are blended, not switched.
        turn_slip = (w + timestep_s * rate_z) / half_length
        if turn_slip == 0.0:
            turn_slip = _NO_TURN_SLIP_1PM
        twisted = steady_state(p, fz, kappa, alpha, gamma, pressure_Pa, vx, mu, turn_slip)
        fx += fraction * (twisted.fx_N - fx)
        fy += fraction * (twisted.fy_N - fy)
        mx += fraction * (twisted.mx_Nm - mx)
        my += fraction * (twisted.my_Nm - my)
        mz += fraction * (twisted.mz_Nm - mz)
    # Beyond the range of the file the formula gives the forces of its largest load.
    load = min(fz, p.FZMAX)
    use = math.hypot(fx / (straight.friction_x * load), fy / (straight.friction_y * load))
    return _Rolling(fx, fy, mx, my, mz, kappa, alpha, rate_x, rate_y, rate_z, limited, use)


@compiled
def _load(p, deflection, spin, pressure_Pa, damping_N, fx, fy, gamma):
    """Return the load under horizontal forces [N]. The damper changes it by at most the spring force."""
    elastic = vertical_force_loaded(p, deflection, spin, pressure_Pa, fx, fy, gamma)
    elastic += bottoming_force(p, deflection, spin)
    # The load is continuous when the tyre touches down or lifts off, and the road never pulls.
    return elastic + min(max(damping_N, -elastic), elastic)


@compiled
def tyre_on_road(
    p,
    mu,
    pressure_Pa,
    low_speed_mps,
    low_speed_damping_Nspm,
    timestep_s,
    centre_height_m,
    axis_x,
    axis_y,
    axis_z,
    velocity_x_mps,
    velocity_y_mps,
    velocity_z_mps,
    spin_x_radps,
    spin_y_radps,
    spin_z_radps,
    deflection_x_m,
    deflection_y_m,
    deflection_z_rad,
):
    """Return the `WheelForces` of a tyre on the plane road z = 0, with the rates of its relaxation states.

    All vectors are in the world frame. The axis is the unit vector of the spin axis, pointing to the left side of the
    car. Height and velocity belong to the wheel centre, and the angular velocity includes the spin. `mu` is relative to
    the friction of the tyre file. The arm leads from the wheel centre to the contact point. `limited` is 1.0 beyond
    a limit of validity of the tyre file. `friction_utilisation` is
    sqrt((F_x / mu_x F_z)^2 + (F_y / mu_y F_z)^2), with the peak coefficients of the file at this load, camber and
    pressure on this road. It exceeds 1 by as much as the file's shifts and weights of combined slip allow.
    """
    horizontal = math.sqrt(axis_x * axis_x + axis_y * axis_y)
    heading_x = axis_y / horizontal
    heading_y = -axis_x / horizontal
    gamma = math.atan2(axis_z, horizontal)
    loaded_radius = centre_height_m / horizontal
    # From the centre straight down in the wheel plane: -(n - (n.s) s) / |n - (n.s) s| times the loaded radius.
    arm_x = loaded_radius * axis_z * axis_x / horizontal
    arm_y = loaded_radius * axis_z * axis_y / horizontal
    arm_z = -centre_height_m

    spin = spin_x_radps * axis_x + spin_y_radps * axis_y + spin_z_radps * axis_z
    # Angular velocity of the wheel plane, without the spin; it moves the contact point across the heading.
    turn_x = spin_x_radps - spin * axis_x
    turn_y = spin_y_radps - spin * axis_y
    turn_z = spin_z_radps - spin * axis_z
    contact_x = velocity_x_mps + turn_y * arm_z - turn_z * arm_y
    contact_y = velocity_y_mps + turn_z * arm_x - turn_x * arm_z
    vx = velocity_x_mps * heading_x + velocity_y_mps * heading_y
    vsy = contact_y * heading_x - contact_x * heading_y
    if p.SLIP_AT_CENTRE != 0.0:
        vsy = velocity_y_mps * heading_x - velocity_x_mps * heading_y

    deflection = free_radius(p, spin) - loaded_radius
    axis_z_rate = turn_x * axis_y - turn_y * axis_x
    closing = -(velocity_z_mps / horizontal + centre_height_m * axis_z * axis_z_rate / horizontal**3)
    damping = p.VERTICAL_DAMPING * closing
    fz = _load(p, deflection, spin, pressure_Pa, damping, 0.0, 0.0, gamma)
    if fz <= 0.0:
        decay = -_LIFTED_DECAY_PER_S
        return WheelForces(
            0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, gamma, decay * deflection_x_m, decay * deflection_y_m,
            decay * deflection_z_rad, loaded_radius, heading_x, heading_y, arm_x, arm_y, arm_z, 0.0, 0.0,
        )  # fmt: skip

    rolling = _rolling_tyre(
        p, mu, pressure_Pa, low_speed_mps, low_speed_damping_Nspm, timestep_s, fz, vx, vsy, spin, turn_z, gamma,
        deflection_x_m, deflection_y_m, deflection_z_rad,
    )  # fmt: skip
    if p.Q_FCX != 0.0 or p.Q_FCY != 0.0:
        # Horizontal forces soften the tyre, and the load makes the horizontal forces: a secant search for both.
        fz_before = fz
        step = _load(p, deflection, spin, pressure_Pa, damping, rolling.fx_N, rolling.fy_N, gamma) - fz
        fz = fz + step if fz + step > 0.0 else _CAUTIOUS * fz
        for _ in range(_MAX_LOAD_STEPS):
            rolling = _rolling_tyre(
                p, mu, pressure_Pa, low_speed_mps, low_speed_damping_Nspm, timestep_s, fz, vx, vsy, spin, turn_z, gamma,
                deflection_x_m, deflection_y_m, deflection_z_rad,
            )  # fmt: skip
            missing = _load(p, deflection, spin, pressure_Pa, damping, rolling.fx_N, rolling.fy_N, gamma) - fz
            if abs(missing) <= _LOAD_TOLERANCE * fz or missing == step:
                break
            fz_next = fz + missing * (fz - fz_before) / (step - missing)
            fz_before = fz
            step = missing
            fz = fz_next if fz_next > 0.0 else _CAUTIOUS * fz
    return WheelForces(
        rolling.fx_N, rolling.fy_N, fz, rolling.mx_Nm, rolling.my_Nm, rolling.mz_Nm,
        rolling.slip_ratio, rolling.slip_angle_rad, gamma,
        rolling.deflection_x_rate_mps, rolling.deflection_y_rate_mps, rolling.deflection_z_rate_radps,
        loaded_radius, heading_x, heading_y, arm_x, arm_y, arm_z, rolling.limited, rolling.friction_utilisation,
    )  # fmt: skip
