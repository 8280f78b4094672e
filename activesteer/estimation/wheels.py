"""Loads and longitudinal forces of the wheels from the sensors, and the speed of the car by each wheel; compiled.

    F_z = load at rest -+ fraction of the longitudinal acceleration -+ fraction of the lateral one
    X   = (drive - brake - J w') / R

The brake torque follows from the pressure. There is no measurement of the engine: while no brake works, the drive force
is the force that accelerates the car plus its drag and the drag of steered wheels in a turn, F sin d, distributed by
the fractions of the driven wheels.
"""

from __future__ import annotations

import math
from typing import Final

from activesteer.estimation.records import (
    FRICTION,
    LATERAL_SPEED,
    SAID_PRESSURES,
    SAID_SPINS,
    YAW_RATE,
)
from activesteer.estimation.two_track_model import forces_of
from activesteer.native.compilation import compiled

STANDING_MPS: Final = 0.5
"""Below this speed, standing wheels mean a standing car [m/s]."""
_BRAKING_NM: Final = 100.0
"""Total brake torque above which the engine is assumed to give no torque [N m]."""


@compiled
def read_wheels(known, tyres, memory, said, duration_s):
    """Compute loads, forces and speeds of the wheels.

    Args:
        known: Record of `known_of`.
        tyres: Grids of front and rear tyres' lateral force [N].
        memory: Record of `MEMORY`; its values of the wheels, their forces and moment are changed.
        said: Measurement at the time of the filters.
        duration_s: Time since the last call [s].
    """
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
            along_N[wheel] = -math.copysign(most_N, memory.speed_mps) if abs(memory.speed_mps) > STANDING_MPS else 0.0
        memory.moment_Nm -= known.left_m[wheel] * along_N[wheel]
        across_mps = state[LATERAL_SPEED] + known.to_axle_m[wheel] * state[YAW_RATE]
        rolled_mps = known.rolling_radius_m[wheel] * said[SAID_SPINS + wheel]
        memory.by_wheel_mps[wheel] = (rolled_mps - across_mps * math.sin(angle_rad)) / math.cos(angle_rad)
        memory.by_wheel_mps[wheel] += known.left_m[wheel] * state[YAW_RATE]
    memory.front_along_N = along_N[0] + along_N[1]
