"""The parameters of the native forces, as they lie in a model's custom numeric data.

One block of numbers per model holds everything the callbacks need: sizes, indices, tyres, dampers, drag, the areas of
the road and the dynamics of the actuators. So the compiled code is the same for every car and can be cached on disk,
and models of one process may differ. The block is the last custom numeric of the model and ends with its own start and
a marker, by which the callbacks recognise a model of ours.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

BLOCK_NAME: Final = "activesteer"
MARKER: Final = 20121121.0
"""Last number of the block; the date of the conference of the paper that this project starts from."""
TRAILER_SIZE: Final = 2

# Header.
(
    N_WHEELS, N_DAMPERS, N_DOFS, N_BODIES, N_USERDATA, N_ACTIVATIONS, N_CONTROLS, N_TENDONS, N_TENDON_JACOBIAN,
    CHASSIS_BODY, CHASSIS_ROOT, CHASSIS_N_DOFS, DRAG_Ns2pm2, AERO_X_m, AERO_Y_m, AERO_Z_m,
    WHEELS_START, DAMPERS_START, ACTUATORS_START, N_AREAS, AREAS_START, AREAS_FELT,
    ENGINE_TORQUE_Nm, ENGINE_POWER_W, ENGINE_LIMIT_radps, ENGINE_DRAG_Nm, GEAR, CHASSIS_DOFS, SCREWS_START,
    SCREW_SENSORS, N_SCREW_SENSORS, N_GUIDES, GUIDES_START, N_COORDINATES,
    HEADER_SIZE,
) = range(35)  # fmt: skip

MAX_CHAIN: Final = 32
"""Most degrees of freedom between the world and a wheel."""

# One record per wheel; the chain of degrees of freedom follows.
(
    W_BODY, W_ROOT, W_ACT_X, W_ACT_Y, W_ACT_Z, W_MU, W_PRESSURE_Pa, W_LOW_SPEED_mps, W_LOW_SPEED_DAMPING_Nspm,
    W_TYRE_START, W_SPIN, W_DRIVE_FRACTION, W_CHAIN_LENGTH, W_CHAIN,
) = range(14)  # fmt: skip
WHEEL_SIZE: Final = W_CHAIN + MAX_CHAIN

# One record per damper: a tendon, its place in the sparse tendon Jacobian, and a piecewise linear curve.
D_TENDON, D_ROW, D_LENGTH, D_POINTS, D_CHAIN = range(5)
MAX_CURVE_POINTS: Final = 12
D_VELOCITY: Final = D_CHAIN + MAX_CHAIN
D_FORCE: Final = D_VELOCITY + MAX_CURVE_POINTS
DAMPER_SIZE: Final = D_FORCE + MAX_CURVE_POINTS

# One record per actuator with user dynamics (all actuators have one; KIND_NONE where the engine does the dynamics).
# A_FIRST to A_HIGH hold what its kind needs; `loading._actuator` fills them.
# A_SCALE and A_OFFSET stand between the command and what is made of it; see `IN_ORDER`.
A_KIND, A_ACT, A_FIRST, A_SECOND, A_LOW, A_HIGH, A_SCALE, A_OFFSET = range(8)
ACTUATOR_SIZE: Final = 8
IN_ORDER: Final = (1.0, -0.0)
"""A_SCALE and A_OFFSET of an actuator without a fault; adding -0.0 changes nothing, not even the sign of a zero."""
KIND_NONE, KIND_SLIP, KIND_SERVO, KIND_BRAKE, KIND_FRICTION, KIND_DRIVE = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0
KIND_LINK, KIND_SCREW, KIND_MOTOR = 6.0, 7.0, 8.0
ALONG_JOINT, ALONG_TENDON = 0.0, 1.0

# One record per area of the road with a friction of its own: a rectangle in world axes [m]. They count while
# AREAS_FELT is 1, which `Vehicle.rebase` sets: before, the road has no origin yet.
R_START_m, R_END_m, R_RIGHT_m, R_LEFT_m, R_MU = range(5)
AREA_SIZE: Final = 5

# Screws in the toe links (`toe_link_screws`): a record for each link, with the coefficients of angle over travel ...
(
    L_TENDON, L_REST_m, L_STIFFNESS_Npm, L_BACKLASH_m, L_ACT, L_SCREW_ACT, L_SIGN, L_OUT, L_ANGLE,
) = range(9)  # fmt: skip
POWERS: Final = 5
LINK_SIZE: Final = L_ANGLE + POWERS
# ... and one for each screw: with the starts of its links' records, and the coefficients of travel over angle. The
# superposition's motor has such a record too: its travel is an angle [rad], and it has the steering column for links.
(
    S_ACT, S_MOTOR_ACT, S_COMMAND, S_LEAD_mprad, S_INERTIA_kgm2, S_POSITION_GAIN_1ps, S_SPEED_GAIN_1ps,
    S_SPEED_LIMIT_radps, S_PEAK_Nm, S_STALL_Nm, S_SLOPE_Nmsprad, S_POWER_W, S_FRICTION_Nm, S_LOAD_FRICTION, S_STOP_m,
    S_TOLERANCE_m, S_SEIZED, S_OUT, S_N_LINKS, S_LINK, S_SECOND_LINK, S_COLUMN, S_COLUMN_STIFFNESS_Npm,
    S_COLUMN_REST_m, S_COLUMN_ARM_m, S_TRAVEL,
) = range(26)  # fmt: skip
SCREW_SIZE: Final = S_TRAVEL + POWERS

# One record per wheel that curves guide (`native_guide`): addresses, sign of its side, where the tables of its curves
# begin, counted from the first record; stiffness and damping, row by row, what hardens beside them, slopes of the
# curves in the design position. Behind the records ...
(
    G_QPOS, G_DOF, G_SIDE, G_RACK, G_RACK_DOF, G_TRAVEL_TABLE, G_RACK_TABLE, G_STIFFNESS,
) = range(8)  # fmt: skip
G_DAMPING: Final = G_STIFFNESS + 25
G_SQUARE: Final = G_DAMPING + 25
G_HARDENING: Final = G_SQUARE + 2
G_TRAVEL_SLOPE: Final = G_HARDENING + 10
G_RACK_SLOPE: Final = G_TRAVEL_SLOPE + 5
GUIDE_SIZE: Final = G_RACK_SLOPE + 5
# ... stand the tables: the curves as cubics on even intervals.
T_START, T_PER_m, T_INTERVALS, T_COUNT, T_CURVES = range(5)

# What the callback writes into mjData.userdata: one record per wheel, then the force of each damper, then what the
# sensors of screws say (L_OUT, S_OUT). Behind that stands what it does not write: how many faults act.
(
    U_FX, U_FY, U_FZ, U_MX, U_MY, U_MZ, U_SLIP_RATIO, U_SLIP_ANGLE, U_INCLINATION, U_RATE_X, U_RATE_Y,
    U_RATE_Z, U_LOADED_RADIUS, U_LIMITED, U_FRICTION_UTILISATION, U_MU, U_CONTACT_X, U_CONTACT_Y,
) = range(18)  # fmt: skip
USERDATA_PER_WHEEL: Final = 18


@dataclass
class WheelEntry:
    """One wheel for the block; see the `W_` indices."""

    body: int
    root: int
    act_x: int
    act_y: int
    act_z: int
    mu: float
    pressure_Pa: float
    low_speed_mps: float
    low_speed_damping_Nspm: float
    chain: list[int]
    tyre: np.record
    spin: int = 0
    drive_fraction: float = 0.0


@dataclass
class DamperEntry:
    """One damper for the block; velocities positive in compression, forces positive where they push apart."""

    tendon: int
    row: int
    chain: list[int]
    velocity_mps: list[float]
    force_N: list[float]


@dataclass
class ForceBlock:
    """Everything the native forces need, before it becomes an array.

    Attributes:
        model: The model, compiled without the block: sizes and addresses are those that it will have with it.
        chassis_body: Index of the body that drag acts on.
        chassis_chain: Degrees of freedom between the world and it.
        drag_Ns2pm2: Drag over the square of the speed.
        aero_point_m: Where drag acts, in the body's axes.
        engine: The numbers of `powertrain.drive_limits`, and the gear at the beginning.
        wheels: The wheels.
        dampers: The dampers.
        actuators: One record per actuator, in the model's order.
        areas: Areas of the road, as in their records; the later one counts where they overlap.
        screws: Records of screws, one behind the other.
        screw_sensors: Where in `sensordata` their sensors begin, and how many numbers these have.
        guides: Records and tables of wheels that curves guide.
        n_guides: How many wheels these are.
    """

    model: mujoco.MjModel
    chassis_body: int
    chassis_chain: list[int]
    drag_Ns2pm2: float
    aero_point_m: tuple[float, float, float]
    engine: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    wheels: list[WheelEntry] = field(default_factory=list)
    dampers: list[DamperEntry] = field(default_factory=list)
    actuators: list[tuple[float, float, float, float, float, float]] = field(default_factory=list)
    areas: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    screws: list[float] = field(default_factory=list)
    screw_sensors: tuple[int, int] = (0, 0)
    guides: list[float] = field(default_factory=list)
    n_guides: int = 0

    def wheel_start(self, index: int) -> int:
        """Where the record of a wheel begins, counted from the start of the block."""
        return HEADER_SIZE + MAX_CHAIN + index * WHEEL_SIZE

    def to_array(self) -> NDArray[np.float64]:
        """The block without its trailer."""
        wheels_start = self.wheel_start(0)
        dampers_start = self.wheel_start(len(self.wheels))
        actuators_start = dampers_start + len(self.dampers) * DAMPER_SIZE
        areas_start = actuators_start + len(self.actuators) * ACTUATOR_SIZE
        screws_start = areas_start + len(self.areas) * AREA_SIZE
        guides_start = screws_start + len(self.screws)
        tyres_start = guides_start + len(self.guides)
        tyres = [np.atleast_1d(wheel.tyre).view(np.float64) for wheel in self.wheels]
        block = np.zeros(tyres_start + sum(tyre.size for tyre in tyres))
        model = self.model
        block[:CHASSIS_DOFS] = (
            len(self.wheels), len(self.dampers), model.nv, model.nbody, model.nuserdata, model.na, model.nu,
            model.ntendon, model.nJten, self.chassis_body, model.body_rootid[self.chassis_body],
            len(self.chassis_chain), self.drag_Ns2pm2, *self.aero_point_m, wheels_start, dampers_start, actuators_start,
            len(self.areas), areas_start, 0.0, *self.engine,
        )  # fmt: skip
        block[CHASSIS_DOFS:HEADER_SIZE] = (
            HEADER_SIZE,
            screws_start,
            *self.screw_sensors,
            self.n_guides,
            guides_start,
            model.nq,
        )
        block[HEADER_SIZE : HEADER_SIZE + len(self.chassis_chain)] = self.chassis_chain
        tyre_start = tyres_start
        for index, wheel in enumerate(self.wheels):
            record = block[self.wheel_start(index) : self.wheel_start(index + 1)]
            record[:W_CHAIN] = (
                wheel.body, wheel.root, wheel.act_x, wheel.act_y, wheel.act_z, wheel.mu, wheel.pressure_Pa,
                wheel.low_speed_mps, wheel.low_speed_damping_Nspm, tyre_start, wheel.spin, wheel.drive_fraction,
                len(wheel.chain),
            )  # fmt: skip
            record[W_CHAIN : W_CHAIN + len(wheel.chain)] = wheel.chain
            block[tyre_start : tyre_start + tyres[index].size] = tyres[index]
            tyre_start += tyres[index].size
        for index, damper in enumerate(self.dampers):
            start = dampers_start + index * DAMPER_SIZE
            record = block[start : start + DAMPER_SIZE]
            points = len(damper.velocity_mps)
            record[:D_CHAIN] = (damper.tendon, damper.row, len(damper.chain), points)
            record[D_CHAIN : D_CHAIN + len(damper.chain)] = damper.chain
            record[D_VELOCITY : D_VELOCITY + points] = damper.velocity_mps
            record[D_FORCE : D_FORCE + points] = damper.force_N
        if self.actuators:
            records = [(*record, *IN_ORDER) for record in self.actuators]
            block[actuators_start:areas_start] = np.asarray(records, float).ravel()
        if self.areas:
            block[areas_start:screws_start] = np.asarray(self.areas, float).ravel()
        block[screws_start:guides_start] = self.screws
        block[guides_start:tyres_start] = self.guides
        return block


def with_trailer(block: NDArray[np.float64], start: int) -> NDArray[np.float64]:
    """The block as it goes into the model, given the index at which it will start in `numeric_data`."""
    return np.concatenate([block, (float(start), MARKER)])
