"""The compiled filter of the speed. It uses reliable wheels and the longitudinal acceleration.

Load, longitudinal force and speed of each wheel come first, from the sensors:

    F_z = load at rest -+ fraction of the longitudinal acceleration -+ fraction of the lateral one
    X   = (drive - brake - J w') / R

The brake torque follows from the pressure. There is no measurement of the engine: while no brake works, the drive force
is the force that accelerates the car plus its drag and the drag of steered wheels in a turn, F sin d, distributed by
the fractions of the driven wheels.

States are the speed v and the offset b of the acceleration: of the sensor, and of gravity on a slope.

    v' = (f - b) / (1 + g k) + r v_y

with the measured acceleration f and the pitch gradient k. Every wheel gives the speed, through the motion of its centre
and its slip, which follows from the longitudinal force by the brush model:

    R w = (1 + s) ((v - r y_i) cos d + (v_y + r x_i) sin d)
    s   = 3 m / c (1 - (1 - u)^(1/3)),  u = |X| / (m F_z)

c is the slip stiffness of the tyre per load and m the friction. The slope ds/du sets the weight of a wheel, which is
low near the limit. A braked wheel that turns more slowly slips, and a driven wheel that turns faster spins: such a
wheel is left out.

Sources:
    Kiencke and Nielsen, Automotive Control Systems, 2nd ed. 2005, section 8.2 (speed from weighted wheels).
    Tanelli, Savaresi, Cantoni, Longitudinal vehicle speed estimation for traction and braking control systems, IEEE
        CCA 2006.
    Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, section 3.2 (brush model).
"""

from __future__ import annotations

import math
from typing import Final

from activesteer.estimation.records import FRICTION, LATERAL_SPEED, SAID_PRESSURES, SAID_SPINS, YAW_RATE
from activesteer.estimation.two_track_model import forces_of
from activesteer.native.compilation import compiled, inlined

_GATE: Final = 3.0
"""Standard deviations of additional slip beyond which a wheel is left out."""
_FREE: Final = 0.02
"""Fraction of the friction below which a wheel counts as rolling freely."""
_MOST_USED: Final = 0.98
"""Fraction of the friction above which the brush model gives no slip."""
_STANDING_MPS: Final = 0.5
"""Speed below which standing wheels mean a standing car [m/s]."""
_BRAKING_NM: Final = 100.0
"""Total brake torque above which the engine is assumed to give no torque [N m]."""


@compiled
def read_wheels(known, tyres, memory, said, duration_s):
    """Compute loads, forces, moment and speeds of the wheels from the measurement at the time of the filters."""
    state, along_N = memory.state, memory.along_N
    friction, braking_Nm = state[FRICTION], 0.0
    for wheel in range(4):
        spin = said[SAID_SPINS + wheel]
        brake_Nm = known.torque_per_pressure_NmpPa[wheel] * max(said[SAID_PRESSURES + wheel], 0.0)
        spun_up_Nm = known.wheel_inertia_kgm2 * (spin - memory.last_spin_radps[wheel]) / duration_s
        along_N[wheel] = -(math.copysign(brake_Nm, spin) + spun_up_Nm) / known.rolling_radius_m[wheel]
        braking_Nm += brake_Nm
        memory.last_spin_radps[wheel] = spin
    drive_N = 0.0
    if braking_Nm < _BRAKING_NM:
        front_N, rear_N = forces_of(known, tyres, memory, state)
        drive_N = known.mass_kg * memory.ax_mps2 + known.drag_kgpm * memory.speed_mps**2
        drive_N += front_N * math.sin(memory.front_angle_rad) + rear_N * math.sin(memory.rear_angle_rad)
    memory.moment_Nm = 0.0
    for wheel in range(4):
        front, side = wheel < 2, math.copysign(1.0, known.left_m[wheel])
        angle_rad = memory.front_angle_rad if front else memory.rear_angle_rad
        if front:
            load_N = known.front_load_N - known.along_load_kg * memory.ax_mps2
            load_N -= side * known.front_load_kg * memory.loading_mps2
        else:
            load_N = known.rear_load_N + known.along_load_kg * memory.ax_mps2
            load_N -= side * known.rear_load_kg * memory.loading_mps2
        memory.load_N[wheel] = load_N
        most_N = friction * max(load_N, 0.0)
        along_N[wheel] = min(max(along_N[wheel] + known.drive_fraction[wheel] * drive_N, -most_N), most_N)
        if said[SAID_SPINS + wheel] == 0.0:
            # A locked wheel slides under a moving car, and has no force under a standing car.
            along_N[wheel] = -math.copysign(most_N, memory.speed_mps) if abs(memory.speed_mps) > _STANDING_MPS else 0.0
        memory.moment_Nm -= known.left_m[wheel] * along_N[wheel]
        across_mps = state[LATERAL_SPEED] + known.to_axle_m[wheel] * state[YAW_RATE]
        rolled_mps = known.rolling_radius_m[wheel] * said[SAID_SPINS + wheel]
        memory.by_wheel_mps[wheel] = (rolled_mps - across_mps * math.sin(angle_rad)) / math.cos(angle_rad)
        memory.by_wheel_mps[wheel] += known.left_m[wheel] * state[YAW_RATE]
    memory.front_along_N = along_N[0] + along_N[1]


@compiled
def start_speed(known, memory, speed_mps):
    """Initialise with the speed from the wheels."""
    memory.speed_mps, memory.ax_offset_mps2 = speed_mps, 0.0
    memory.speed_variance = known.wheel_variance_m2ps2 + (0.01 * speed_mps) ** 2
    memory.speed_offset_covariance, memory.offset_variance = 0.0, known.ax_offset_std_mps2**2


@compiled
def predict_speed(known, memory, rate_mps2, duration_s):
    """Predict speed and offset over an interval."""
    memory.speed_mps += duration_s * (rate_mps2 - memory.ax_offset_mps2)
    memory.speed_variance += duration_s * (duration_s * memory.offset_variance - 2.0 * memory.speed_offset_covariance)
    memory.speed_offset_covariance -= duration_s * memory.offset_variance
    memory.speed_variance += duration_s * (known.ax_density_m2ps3 + (known.ax_fraction * rate_mps2) ** 2)
    memory.offset_variance += duration_s * known.ax_offset_density_m2ps5


@inlined
def brush_slip(along_N, load_N, friction, slip_stiffness):
    """Return the slip of a wheel, its derivative with respect to the used friction fraction, and this fraction."""
    used = abs(along_N) / (friction * max(load_N, 1.0))
    root = (1.0 - min(used, _MOST_USED)) ** (1.0 / 3.0)
    slip = 3.0 * friction / slip_stiffness * (1.0 - root)
    return math.copysign(slip, along_N), friction / slip_stiffness / (root * root), min(used, 1.0)


@compiled
def correct_speed(known, memory, duration_s):
    """Process the wheel speeds after an interval, and return the number of wheels left out."""
    left_out, friction = 0, memory.state[FRICTION]
    use_std = math.hypot(known.use_std, math.sqrt(memory.covariance[FRICTION, FRICTION]) / friction)
    # An error of the slip lasts: during this time all samples count as one measurement.
    repeated = 1.0 + known.use_s / duration_s
    error_sum, weights = 0.0, 0.0
    for wheel in range(4):
        along_N = memory.along_N[wheel]
        slip, slope, used = brush_slip(along_N, memory.load_N[wheel], friction, known.slip_stiffness[wheel])
        variance = known.wheel_variance_m2ps2
        if used < _MOST_USED:
            variance += repeated * (memory.speed_mps * use_std * used * slope) ** 2
        else:
            slip = 0.0  # the smallest possible value
        error = memory.by_wheel_mps[wheel] / (1.0 + slip) - memory.speed_mps
        slips = used > _FREE and (error > 0.0) == (along_N > 0.0)
        limit = _GATE * math.sqrt(memory.speed_variance + variance)
        # Brakes slow a wheel down and the engine speeds it up; an error in the other direction is one of the estimate.
        if slips and (used >= _MOST_USED or abs(error) > limit):
            left_out += 1
            continue
        error_sum += min(max(error, -limit), limit) / variance
        weights += 1.0 / variance
    # All wheels at once, so that their order does not matter.
    expected = 1.0 + memory.speed_variance * weights
    memory.speed_mps += memory.speed_variance / expected * error_sum
    memory.ax_offset_mps2 += memory.speed_offset_covariance / expected * error_sum
    memory.offset_variance -= memory.speed_offset_covariance**2 * weights / expected
    memory.speed_offset_covariance /= expected
    memory.speed_variance /= expected
    return left_out
