"""The parameters of the native forces, in a model's custom numeric data.

One block of numbers per model holds everything the callbacks need: sizes, indices, tyres, dampers, drag, the areas of
the road and the dynamics of the actuators. So the compiled code is the same for every car and can be cached on disk,
and models in one process may differ. The block consists of records whose fields are float64, indices too, since the
engine stores nothing else: a `HEADER`, then the sections. A field named after an array of the engine (`act`, `qpos`,
`userdata`), or after an index of such arrays (`body`, `dof`, `tendon`), is a place in the array. The block is the last
custom numeric of the model and ends with its own start and a marker, by which the callbacks recognise our models.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.native_records import numbers_type
from activesteer.road.obstacles import OBSTACLE
from activesteer.road.surface import SURFACE
from activesteer.tyre.tyre_parameters import TYRE_RECORD
from activesteer.vehicle.native_contact import CAM

BLOCK_NAME: Final = "activesteer"
MARKER: Final = 20121121.0
"""Last number of the block. The date of the conference of the paper that this project starts from."""
TRAILER_SIZE: Final = 2
MAX_CHAIN: Final = 32
"""Largest number of degrees of freedom between the world and a wheel."""
MAX_CURVE_POINTS: Final = 12
POWERS: Final = 5
"""Coefficients of a polynomial without a constant term."""

WHEEL: Final = numbers_type(
    "body", "root", "act_x", "act_y", "act_z", "mu", "pressure_Pa", "low_speed_mps", "low_speed_damping_Nspm",
    "spin_dof", "drive_fraction", "chain_length", ("chain", MAX_CHAIN),
)  # fmt: skip
"""A wheel, with the degrees of freedom between the world and it. Its tyre has the same place in its section."""

DAMPER: Final = numbers_type(
    "tendon", "row", "length", "points", ("chain", MAX_CHAIN), ("velocity_mps", MAX_CURVE_POINTS),
    ("force_N", MAX_CURVE_POINTS),
)  # fmt: skip
"""A damper: a tendon, its place in the sparse tendon Jacobian, and a piecewise linear curve, velocities positive in
compression, forces positive when they push apart."""

ACTUATOR: Final = numbers_type(
    "kind", "act", "low", "high", "scale", "offset", "lag_s", "rate_limit", "userdata", "stiffness", "drive_fraction",
    "dof", "tendon", "vibration", "wound_limit", "record", "motor",
)  # fmt: skip
"""An actuator, in the model's order: its `KIND`, and the fields of that kind. `low` and `high` bound its command.
`scale` and `offset` change the command, see `IN_ORDER`. The callback writes the rate of a tyre's state to `userdata`. A
brake or friction acts on `dof` or `tendon`, the other one is negative. `record` is the place among `links` or
`screws`. `motor` is 1 for the drive of a wheel that has a motor."""
KIND_NONE, KIND_SLIP, KIND_SERVO, KIND_BRAKE, KIND_FRICTION, KIND_DRIVE = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0
"""Kinds of actuators. `KIND_NONE` has no dynamics of ours."""
KIND_LINK, KIND_SCREW, KIND_MOTOR = 6.0, 7.0, 8.0
IN_ORDER: Final = {"scale": 1.0, "offset": -0.0}
"""Values for an actuator without a fault. Adding -0.0 changes nothing, not even the sign of a zero."""

AREA: Final = numbers_type("start_m", "end_m", "right_m", "left_m", "mu", "slope_1pm")
"""An area of the road with its own friction (`activesteer.road.road.Area`): a rectangle in world axes, or along the
path where there is one. Where areas overlap, the later one counts. Areas count while the header's `areas_felt` is 1,
which `Vehicle.rebase` sets, since the road has no origin before."""

PATH_GRID: Final = numbers_type("x0_m", "y0_m", "cell_m", "columns", "rows", "spacing_m")
"""Head of the grid of the path that the friction follows (`PathGrid`). Points and cells have sections of their own."""

LINK: Final = numbers_type(
    "tendon", "rest_m", "stiffness_Npm", "backlash_m", "act", "screw_act", "sign", "userdata",
    ("angle", POWERS),
)  # fmt: skip
"""A toe link with a screw in it (`toe_links`), with the coefficients of angle over travel. `act` is its change of
length, `screw_act` the position of its screw. The callback writes its angle to `userdata` for its sensor."""

SCREW: Final = numbers_type(
    "act", "motor_act", "command", "lead_mprad", "inertia_kgm2", "position_gain_1ps", "speed_gain_1ps",
    "speed_limit_radps", "peak_Nm", "stall_Nm", "slope_Nmsprad", "power_W", "friction_Nm", "load_friction", "stop_m",
    "tolerance_m", "seized", "userdata", "n_links", ("links", 2), "column", "column_stiffness_Npm", "column_rest_m",
    "column_arm_m", ("travel", POWERS),
)  # fmt: skip
"""A screw and its motor, with the places of its links and the coefficients of travel over angle. The superposition's
motor
has such a record too: its travel is an angle [rad], and its link is the steering column. The callback writes torque and
limit flag to `userdata` for its sensor. `command` is the actuator whose command it follows."""

CURVE_AXLE_WHEEL: Final = numbers_type(
    "qpos", "dof", "side", "rack", "rack_dof", "travel_table", "rack_table", ("stiffness", 25), ("damping", 25),
    ("held_stiffness", 25), ("held_damping", 25), ("square", 2), ("hardening", 10), ("travel_slope", 5),
    ("rack_slope", 5),
)  # fmt: skip
"""A wheel of a curve axle (`curve_axles`): addresses, sign of its side, start of its tables among `curves`;
stiffness and damping, row by row, and the part of them in the engine's tendons; hardening springs, and slopes of the
curves in the design position."""

CURVE_TABLE: Final = numbers_type("start_m", "per_m", "intervals", "count")
"""Head of a table of curves. The curves follow as cubics on even intervals."""

_SECTIONS: Final[Mapping[str, Any]] = {
    "wheels": WHEEL, "tyres": TYRE_RECORD, "dampers": DAMPER, "actuators": ACTUATOR, "areas": AREA,
    "path_grids": PATH_GRID, "path_points": np.float64, "path_cells": np.float64, "links": LINK, "screws": SCREW,
    "curve_axle_wheels": CURVE_AXLE_WHEEL, "curves": np.float64, "surfaces": SURFACE, "obstacles": OBSTACLE,
    "cams": CAM, "heights": np.float64,
}  # fmt: skip
HEADER: Final = numbers_type(
    "n_dofs", "n_bodies", "n_userdata", "n_activations", "n_controls", "n_tendons", "n_tendon_jacobian",
    "n_coordinates", "chassis_body", "chassis_root", "n_chassis_dofs", ("chassis_dofs", MAX_CHAIN), "drag_Ns2pm2",
    ("aero_point_m", 3), "engine_torque_Nm", "engine_power_W", "engine_limit_radps", "engine_drag_Nm", "gear",
    "areas_felt", "screw_sensors", "n_screw_sensors", *_SECTIONS, *(f"n_{name}" for name in _SECTIONS),
)  # fmt: skip
"""Sizes of the engine's arrays, the chassis and the point where drag acts on it, the arguments of
`parameters.drive_limits`, the first place of the screws' sensors in `sensordata`, and start and number of each section,
counted in numbers from the block's start."""

WHEEL_OUTPUT: Final = numbers_type(
    "fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm", "slip_ratio", "slip_angle_rad", "inclination_rad",
    "deflection_x_rate_mps", "deflection_y_rate_mps", "deflection_z_rate_radps", "loaded_radius_m", "limited",
    "friction_utilisation", "mu", "contact_x_m", "contact_y_m", "road_z_m", "road_slope_x", "road_slope_y",
)  # fmt: skip
"""Outputs of the callback for each wheel, at the beginning of mjData.userdata. After them come the force of each damper
and the readings of screws and motors, and last, not written by the callback, the number of active faults."""
USERDATA_PER_WHEEL: Final = WHEEL_OUTPUT.itemsize // 8


def output_slot(wheel: int, name: str) -> int:
    """Return the place in `userdata` of a field of a wheel's `WHEEL_OUTPUT`."""
    assert WHEEL_OUTPUT.names is not None
    return wheel * USERDATA_PER_WHEEL + WHEEL_OUTPUT.names.index(name)


def wheel_outputs(data: mujoco.MjData, count: int) -> NDArray[Any]:
    """Return the callback's outputs for a number of wheels, a view of `WHEEL_OUTPUT` records."""
    return data.userdata[: count * USERDATA_PER_WHEEL].view(WHEEL_OUTPUT)


def new_header(model: mujoco.MjModel, chassis: int, chassis_dofs: list[int]) -> NDArray[Any]:
    """Return a header with the sizes of a model."""
    return filled(
        HEADER, n_dofs=model.nv, n_bodies=model.nbody, n_userdata=model.nuserdata, n_activations=model.na,
        n_controls=model.nu, n_tendons=model.ntendon, n_tendon_jacobian=model.nJten, n_coordinates=model.nq,
        chassis_body=chassis, chassis_root=model.body_rootid[chassis], n_chassis_dofs=len(chassis_dofs),
        chassis_dofs=chassis_dofs,
    )  # fmt: skip


def filled(record_type: np.dtype[Any], /, **values: Any) -> NDArray[Any]:
    """Return one record, shape (1,), 0 where nothing is given. A row may be shorter than its field."""
    record = np.zeros(1, record_type)
    for name, value in values.items():
        if record[name].ndim > 1:
            record[name][0, : len(value)] = value
        else:
            record[name] = value
    return record


def pack(header: NDArray[Any], sections: Mapping[str, list[NDArray[Any]]]) -> NDArray[np.float64]:
    """Return the block without its trailer."""
    parts = [header.view(np.float64)]
    start = parts[0].size
    for name, kind in _SECTIONS.items():
        pieces = sections.get(name, [])
        numbers = [np.ascontiguousarray(piece, kind).view(np.float64) for piece in pieces]
        header[name], header[f"n_{name}"] = start, sum(piece.size for piece in pieces)
        start += sum(piece.size for piece in numbers)
        parts += numbers
    return np.concatenate(parts)


def with_trailer(block: NDArray[np.float64], start: int) -> NDArray[np.float64]:
    """Return the block as it goes into the model, for the index of its start in `numeric_data`."""
    return np.concatenate([block, (float(start), MARKER)])


def header_of(model: mujoco.MjModel) -> NDArray[Any]:
    """Return the header of one of our models, shape (1,): a view. A change acts from the next step on."""
    return _view(model, 0, HEADER, 1)


def section_of(model: mujoco.MjModel, name: str) -> NDArray[Any]:
    """Return the records of a section of one of our models, a view too."""
    header = header_of(model)[0]
    return _view(model, int(header[name]), np.dtype(_SECTIONS[name]), int(header[f"n_{name}"]))


def _view(model: mujoco.MjModel, start: int, kind: np.dtype[Any], count: int) -> NDArray[Any]:
    first = int(model.numeric_data[-TRAILER_SIZE]) + start
    return model.numeric_data[first : first + count * kind.itemsize // 8].view(kind)
