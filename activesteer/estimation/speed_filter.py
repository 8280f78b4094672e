"""The filter of the speed: the wheels that can be trusted, and the longitudinal acceleration beside them; compiled.

States are the speed v and the offset b of the acceleration: of the sensor, and of gravity on a slope.

    v' = (f - b) / (1 + g k) + r v_y

with the acceleration f as measured and the pitch gradient k. Every wheel says what the speed is, through the motion of
its centre and through its slip, which follows from the longitudinal force by the brush model:

    R w = (1 + s) ((v - r y_i) cos d + (v_y + r x_i) sin d)
    s   = 3 m / c (1 - (1 - u)^(1/3)),  u = |X| / (m F_z)

c is the tyre's slip stiffness per load and m the friction. How far a wheel is trusted is the slope ds/du: little near
the limit. A braked wheel that turns more slowly than that slips, and a driven one that turns faster spins: it is
left out.

Sources:
    Kiencke and Nielsen, Automotive Control Systems, 2nd ed. 2005, section 8.2 (speed from weighted wheels).
    Tanelli, Savaresi, Cantoni, Longitudinal vehicle speed estimation for traction and braking control systems, IEEE
        CCA 2006.
    Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, section 3.2 (brush model).
"""

from __future__ import annotations

import math
from typing import Final

from activesteer.compilation import compiled, inlined
from activesteer.estimation.records import FRICTION

_GATE: Final = 3.0
"""Standard deviations by which a wheel may slip more than expected before it is left out."""
_FREE: Final = 0.02
"""Fraction of the friction below which a wheel is taken to roll freely."""
_MOST_USED: Final = 0.98
"""Fraction of the friction beyond which the brush model says no slip."""


@compiled
def start_speed(known, memory, speed_mps):
    """Begins with a speed.

    Args:
        known: Record of `KNOWN`.
        memory: Record of `MEMORY`; speed, offset and their variances are changed.
        speed_mps: What the wheels say [m/s].
    """
    memory.speed_mps, memory.ax_offset_mps2 = speed_mps, 0.0
    memory.speed_variance = known.wheel_variance_m2ps2 + (0.01 * speed_mps) ** 2
    memory.speed_offset_covariance, memory.offset_variance = 0.0, known.ax_offset_std_mps2**2


@compiled
def predict_speed(known, memory, rate_mps2, duration_s):
    """The speed after a while.

    Args:
        known: Record of `KNOWN`.
        memory: Record of `MEMORY`; as in `start_speed`.
        rate_mps2: Change of the speed, but for the offset [m/s2].
        duration_s: Time to go on [s].
    """
    memory.speed_mps += duration_s * (rate_mps2 - memory.ax_offset_mps2)
    memory.speed_variance += duration_s * (duration_s * memory.offset_variance - 2.0 * memory.speed_offset_covariance)
    memory.speed_offset_covariance -= duration_s * memory.offset_variance
    memory.speed_variance += duration_s * (known.ax_density_m2ps3 + (known.ax_fraction * rate_mps2) ** 2)
    memory.offset_variance += duration_s * known.ax_offset_density_m2ps5


@inlined
def brush_slip(along_N, load_N, friction, slip_stiffness):
    """Slip of a wheel, its derivative by the fraction of the friction that is used, and that fraction."""
    used = abs(along_N) / (friction * max(load_N, 1.0))
    root = (1.0 - min(used, _MOST_USED)) ** (1.0 / 3.0)
    slip = 3.0 * friction / slip_stiffness * (1.0 - root)
    return math.copysign(slip, along_N), friction / slip_stiffness / (root * root), min(used, 1.0)


@compiled
def correct_speed(known, memory, duration_s):
    """Takes in what the wheels say.

    Args:
        known: Record of `KNOWN`.
        memory: Record of `MEMORY`; as in `start_speed`.
        duration_s: Time since they were last looked at [s].

    Returns:
        How many were left out.
    """
    left_out, friction = 0, memory.state[FRICTION]
    use_std = math.hypot(known.use_std, math.sqrt(memory.covariance[FRICTION, FRICTION]) / friction)
    # A slip that is not what it is taken for stays so: it counts as one measurement in all that time.
    repeated = 1.0 + known.use_s / duration_s
    error_sum, weights = 0.0, 0.0
    for wheel in range(4):
        along_N = memory.along_N[wheel]
        slip, slope, used = brush_slip(along_N, memory.load_N[wheel], friction, known.slip_stiffness[wheel])
        variance = known.wheel_variance_m2ps2
        if used < _MOST_USED:
            variance += repeated * (memory.speed_mps * use_std * used * slope) ** 2
        else:
            slip = 0.0  # at least; how much more nobody knows
        error = memory.by_wheel_mps[wheel] / (1.0 + slip) - memory.speed_mps
        slips = used > _FREE and (error > 0.0) == (along_N > 0.0)
        limit = _GATE * math.sqrt(memory.speed_variance + variance)
        # Brakes slow a wheel down and the engine speeds it up; what is wrong the other way is the estimate.
        if slips and (used >= _MOST_USED or abs(error) > limit):
            left_out += 1
            continue
        error_sum += min(max(error, -limit), limit) / variance
        weights += 1.0 / variance
    # All at once, so that it does not matter which is the first.
    expected = 1.0 + memory.speed_variance * weights
    memory.speed_mps += memory.speed_variance / expected * error_sum
    memory.ax_offset_mps2 += memory.speed_offset_covariance / expected * error_sum
    memory.offset_variance -= memory.speed_offset_covariance**2 * weights / expected
    memory.speed_offset_covariance /= expected
    memory.speed_variance /= expected
    return left_out
