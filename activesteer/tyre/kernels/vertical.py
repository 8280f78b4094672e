"""Compiled formulas of vertical force, deflection and radii of a tyre.

Source: Besselink, Schmeitz, Pacejka, An improved Magic Formula/Swift tyre model that can handle inflation pressure
changes, Vehicle System Dynamics 48 (2010) S1, equations 1 to 10 (the same in Pacejka 2012, A3.1 to A3.7); camber and
side force terms of MF 6.2: MF-Tyre/MF-Swift 6.2 equation manual (2013).

`deflection_m` is the free radius minus the loaded radius of the rotating tyre; zero or less gives no force.
"""

from __future__ import annotations

import math

from activesteer.native.compilation import compiled

MF62 = 62.0
_SOFTEST = 0.1
"""Smallest factor of the vertical stiffness due to horizontal forces. Real tyres stay above 0.8."""


@compiled
def stiffness_pressure_factor(p, pressure_Pa: float) -> float:
    """Return the factor of the vertical stiffness due to the inflation pressure (equation 5)."""
    pressure = min(max(pressure_Pa, p.PRESMIN), p.PRESMAX)
    return 1.0 + p.PFZ1 * (pressure / p.NOMPRES - 1.0)


@compiled
def free_radius(p, omega_radps: float) -> float:
    """Radius of the rotating, unloaded tyre [m] at a rotational speed [rad/s] (equation 1)."""
    speed = omega_radps * p.UNLOADED_RADIUS / p.LONGVL
    return p.UNLOADED_RADIUS * (p.Q_RE0 + p.Q_V1 * speed * speed)


@compiled
def effective_rolling_radius(p, fz_N: float, omega_radps: float, pressure_Pa: float) -> float:
    """Effective rolling radius [m], forward over rotational speed of a freely rolling wheel (eq. 7); load < 0 is 0."""
    fz0 = p.FNOMIN
    ratio = max(fz_N, 0.0) / fz0
    stiffness = p.VERTICAL_STIFFNESS * stiffness_pressure_factor(p, pressure_Pa)
    if p.RADIUS_BY_DEFLECTION != 0.0:
        return free_radius(p, omega_radps) - max(fz_N, 0.0) / (3.0 * stiffness)
    curve = p.DREFF * math.atan(p.BREFF * ratio) + p.FREFF * ratio
    return free_radius(p, omega_radps) - fz0 / stiffness * curve


@compiled
def _softening(p, omega: float, fx: float, fy: float) -> float:
    """Return the factor of the vertical stiffness due to speed and horizontal forces (equation 2)."""
    r0, fz0 = p.UNLOADED_RADIUS, p.FNOMIN
    x, y = p.Q_FCX * fx / fz0, p.Q_FCY * fy / fz0
    return max(1.0 + p.Q_V2 * abs(omega) * r0 / p.LONGVL - x * x - y * y, _SOFTEST)


@compiled
def vertical_force_loaded(
    p, deflection_m: float, omega_radps: float, pressure_Pa: float, fx_N: float, fy_N: float, gamma_rad: float
) -> float:
    """Elastic vertical force [N], with the softening by horizontal forces (ISO-W) and by camber.

    Source: Besselink 2010, equations 2 to 5; MF 6.2 manual for FITTYP 62.
    """
    r0, fz0 = p.UNLOADED_RADIUS, p.FNOMIN
    gamma, fy = p.SIDE * gamma_rad, p.SIDE * fy_N
    q1 = p.Q_FZ1 + p.Q_FZ3 * gamma * gamma
    if p.MF_VERSION == MF62:
        free = free_radius(p, omega_radps)
        loaded = free - deflection_m
        ratio = loaded / free
        offset = (p.Q_FYS1 + p.Q_FYS2 * ratio + p.Q_FYS3 * ratio * ratio) * gamma
        rho_free = max(deflection_m, 0.0)
        rho_camber = 0.0
        denominator = p.Q_CAM1 * free + p.Q_CAM2 * free * free
        if denominator != 0.0 and gamma != 0.0:
            tread = (1.075 - 0.5 * p.ASPECT_RATIO) * p.WIDTH
            shape = (p.Q_CAM1 * loaded + p.Q_CAM2 * loaded * loaded) / denominator
            rho_camber = shape * shape * tread / 8.0 * abs(math.tan(gamma)) - p.Q_CAM3 * rho_free * abs(gamma)
        # The shoulder of a cambered tyre touches the road before its middle.
        rho = (deflection_m + rho_camber) / r0
        if rho <= 0.0:
            return 0.0
        x = p.Q_FCX * fx_N / fz0
        y = rho**p.Q_FCY2 * p.Q_FCY * (fy - offset) / fz0
        soft = 1.0 + p.Q_V2 * abs(omega_radps) * r0 / p.LONGVL - x * x - y * y
    else:
        if deflection_m <= 0.0:
            return 0.0
        rho = deflection_m / r0
        soft = _softening(p, omega_radps, fx_N, fy)
    return max(soft * stiffness_pressure_factor(p, pressure_Pa) * (q1 * rho + p.Q_FZ2 * rho * rho) * fz0, 0.0)


@compiled
def bottoming_force(p, deflection_m: float, omega_radps: float) -> float:
    """Additional vertical force [N] once the tyre is pressed onto the rim."""
    room = free_radius(p, omega_radps) - p.RIM_RADIUS - p.BOTTOM_OFFST
    return p.BOTTOM_STIFF * max(deflection_m - room, 0.0)


@compiled
def vertical_force(p, deflection_m: float, omega_radps: float, pressure_Pa: float) -> float:
    """Elastic vertical force [N] of a tyre without horizontal forces and camber, with bottoming on the rim."""
    elastic = vertical_force_loaded(p, deflection_m, omega_radps, pressure_Pa, 0.0, 0.0, 0.0)
    return elastic + bottoming_force(p, deflection_m, omega_radps)


@compiled
def deflection_under_load(
    p, fz_N: float, omega_radps: float, pressure_Pa: float, fx_N: float, fy_N: float, gamma_rad: float
) -> float:
    """Deflection [m] under a load, inverse of `vertical_force_loaded` without bottoming; by a search for MF 6.2."""
    if fz_N <= 0.0:
        return 0.0
    r0, fz0 = p.UNLOADED_RADIUS, p.FNOMIN
    if p.MF_VERSION != MF62:
        soft = _softening(p, omega_radps, fx_N, fy_N) * stiffness_pressure_factor(p, pressure_Pa)
        load = fz_N / (fz0 * soft)
        q1 = p.Q_FZ1 + p.Q_FZ3 * gamma_rad * gamma_rad
        # The root that stays finite if the quadratic term vanishes.
        return r0 * 2.0 * load / (q1 + math.sqrt(q1 * q1 + 4.0 * p.Q_FZ2 * load))
    low, high = -0.5 * r0, r0
    for _ in range(100):
        middle = 0.5 * (low + high)
        if vertical_force_loaded(p, middle, omega_radps, pressure_Pa, fx_N, fy_N, gamma_rad) < fz_N:
            low = middle
        else:
            high = middle
        if high - low < 1e-15 * r0:
            break
    return 0.5 * (low + high)


@compiled
def contact_patch(p, fz_N: float, pressure_Pa: float):
    """Return length and width of the contact patch [m] (equations 9 and 10)."""
    # Without Q_RA or Q_RB in the file (MF 5.2), the length follows from the vertical stiffness by the estimate of the
    # MF-Tyre 5.2 manual, and the width is the width of the tyre.
    fz = max(fz_N, 0.0)
    r0, fz0 = p.UNLOADED_RADIUS, p.FNOMIN
    stiffness = p.VERTICAL_STIFFNESS * stiffness_pressure_factor(p, pressure_Pa)
    fz = min(fz, max(r0 - p.RIM_RADIUS - p.BOTTOM_OFFST, 0.0) * stiffness)
    ratio = fz / (stiffness * r0)
    if p.Q_RA_GIVEN != 0.0:
        half_length = r0 * (p.Q_RA2 * ratio + p.Q_RA1 * math.sqrt(ratio))
    else:
        y = math.log10(r0 * p.VERTICAL_STIFFNESS / fz0)
        q_a1 = ((-0.0388 * y + 0.2509) * y - 0.6283) * y + 0.6279
        half_length = r0 * (1.693 * q_a1 * q_a1 * fz / fz0 + q_a1 * math.sqrt(fz / fz0))
    half_width = 0.5 * p.WIDTH
    if p.Q_RB_GIVEN != 0.0:
        half_width = p.WIDTH * (p.Q_RB2 * ratio + p.Q_RB1 * ratio ** (1.0 / 3.0))
    return 2.0 * half_length, 2.0 * half_width
