"""The force block in a model's custom numeric data, and the layout of the engine's structs.

One block of numbers per model holds everything the callbacks need: sizes, indices, tyres, dampers, drag, the areas of
the road and the dynamics of the actuators. So the compiled code is the same for every car and can be cached on disk,
and models in one process may differ. The block consists of records whose fields are float64, indices too, since the
engine stores nothing else: a `HEADER`, then the sections. A field named after an array of the engine (`act`, `qpos`,
`userdata`), or after an index of such arrays (`body`, `dof`, `tendon`), is a place in the array. The block is the last
custom numeric of the model and ends with its own start and a marker, by which the callbacks recognise our models.

A native callback receives bare pointers to mjModel and mjData. Their layout is not part of MuJoCo's Python interface
and changes between versions, so it is measured: the words of a struct are compared with the addresses of the bindings'
numpy views, and with distinctive values in a small model. A second model confirms every result.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.errors import ModelError, nearest_names
from activesteer.native.records import numbers_type
from activesteer.road.obstacles import OBSTACLE
from activesteer.road.surface import SURFACE
from activesteer.tyre.tyre_parameters import TYRE_RECORD
from activesteer.vehicle.native_contact import CAM

_WORD_BYTES: Final = 8
_MODEL_BYTES: Final = 8192
"""Bytes of mjModel to search: its members are sizes, options and pointers, a few kilobytes."""
_DATA_BYTES: Final = 262_144
"""Bytes of mjData to search: solver statistics are before the pointers (160 KB in MuJoCo 4.0)."""


class EngineLayout(NamedTuple):
    """Byte offsets in mjModel (`m_`) and mjData (`d_`), mostly of pointers to arrays."""

    m_nnumericdata: int
    m_timestep: int
    m_numeric_data: int
    d_qvel: int
    d_act: int
    d_ctrl: int
    d_userdata: int
    d_xpos: int
    d_xmat: int
    d_subtree_com: int
    d_cdof: int
    d_ten_J: int
    d_ten_velocity: int
    d_cvel: int
    d_qfrc_passive: int
    d_ten_length: int
    d_sensordata: int
    d_qpos: int
    d_time: int


_DATA_ARRAYS: Final = [name[2:] for name in EngineLayout._fields[3:-1]]


def _probe(numbers: int, timestep_s: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return a small model with every array whose offset is needed."""
    xml = f"""
    <mujoco>
      <option timestep="{timestep_s!r}"/>
      <size nuserdata="3"/>
      <custom><numeric name="probe" size="{numbers}" data="1"/></custom>
      <worldbody>
        <site name="a"/>
        <body pos="0 0 1"><joint name="j" type="slide" axis="0 0 1"/><geom size="0.1"/><site name="b"/></body>
      </worldbody>
      <tendon><spatial><site site="a"/><site site="b"/></spatial></tendon>
      <actuator><general joint="j" dyntype="user"/></actuator>
      <sensor><jointpos joint="j"/></sensor>
    </mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    return model, mujoco.MjData(model)


def _words(address: int, size_bytes: int) -> NDArray[np.uint64]:
    # A view, not a copy: _find reads it block by block and stops at the match.
    return np.ctypeslib.as_array((ctypes.c_uint64 * (size_bytes // _WORD_BYTES)).from_address(address))


def _find(address: int, wanted: int, limit_bytes: int, what: str) -> int:
    """Return the byte offset of the first word that equals `wanted`."""
    words = _words(address, limit_bytes)
    block = 256
    for start in range(0, len(words), block):
        hits = np.flatnonzero(words[start : start + block] == np.uint64(wanted))
        if hits.size:
            return (start + int(hits[0])) * _WORD_BYTES
    raise ModelError(
        f"MuJoCo {mujoco.__version__}: cannot locate {what} in its structures; this version is not supported",
        value=what,
    )


def _measure(model: mujoco.MjModel, data: mujoco.MjData, numbers: int) -> EngineLayout:
    m, d = model._address, data._address
    data.time = 7.0 / model.opt.timestep
    step_bits, time_bits = (int(np.float64(value).view(np.uint64)) for value in (model.opt.timestep, data.time))
    return EngineLayout(
        _find(m, numbers, _MODEL_BYTES, "mjModel.nnumericdata"),
        _find(m, step_bits, _MODEL_BYTES, "mjModel.opt.timestep"),
        _find(m, model.numeric_data.ctypes.data, _MODEL_BYTES, "mjModel.numeric_data"),
        *(_find(d, getattr(data, name).ctypes.data, _DATA_BYTES, f"mjData.{name}") for name in _DATA_ARRAYS),
        d_time=_find(d, time_bits, _DATA_BYTES, "mjData.time"),
    )


@functools.cache
def engine_layout() -> EngineLayout:
    """Return the struct offsets, measured once per process and confirmed on a second model."""
    first = _measure(*_probe(7919, 0.00123456789), 7919)
    second = _measure(*_probe(6421, 0.00098765432), 6421)
    if first != second:
        raise ModelError(
            f"MuJoCo {mujoco.__version__}: two models give different struct layouts ({first}, {second})",
            value=(first, second),
        )
    return first


def find(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    """Return the index of a named object."""
    index = mujoco.mj_name2id(model, kind, name)
    if index < 0:
        word = kind.name.removeprefix("mjOBJ_").lower()
        count = {
            mujoco.mjtObj.mjOBJ_BODY: model.nbody,
            mujoco.mjtObj.mjOBJ_JOINT: model.njnt,
            mujoco.mjtObj.mjOBJ_SENSOR: model.nsensor,
            mujoco.mjtObj.mjOBJ_TENDON: model.ntendon,
            mujoco.mjtObj.mjOBJ_ACTUATOR: model.nu,
        }[kind]
        names = [mujoco.mj_id2name(model, kind, number) or "" for number in range(count)]
        raise ModelError(f"the model has no {word} {name!r}; {nearest_names(name, names)}", value=name, allowed=names)
    return index


def is_there(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> bool:
    """Return whether an object has this name."""
    return mujoco.mj_name2id(model, kind, name) >= 0


def sensor_columns(model: mujoco.MjModel, name: str) -> slice:
    """Return the indices of a sensor's values in `sensordata`."""
    index = find(model, mujoco.mjtObj.mjOBJ_SENSOR, name)
    start = int(model.sensor_adr[index])
    return slice(start, start + int(model.sensor_dim[index]))


def tendon_arms(model: mujoco.MjModel, name: str) -> dict[str, float]:
    """Return a fixed tendon's coefficients by joint, m/rad for a hinge, 1 for a slide; empty without a tendon."""
    tendon = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, name)
    if tendon < 0:
        return {}
    parts = range(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
    return {model.joint(int(model.wrap_objid[part])).name: float(model.wrap_prm[part]) for part in parts}


BLOCK_NAME: Final = "activesteer"
MARKER: Final = 20121121.0
"""Last number of the block: the date of the conference of the paper that this project starts from."""
TRAILER_SIZE: Final = 2
MAX_CHAIN: Final = 32
"""Largest number of degrees of freedom between the world and a wheel."""
MAX_CURVE_POINTS: Final = 12
POWERS: Final = 5
"""Number of coefficients of a polynomial without a constant term."""

WHEEL: Final = numbers_type(
    "body", "root", "act_x", "act_y", "act_z", "mu", "pressure_Pa", "low_speed_mps", "low_speed_damping_Nspm",
    "spin_dof", "drive_fraction", "chain_length", ("chain", MAX_CHAIN),
)  # fmt: skip
"""A wheel, with the degrees of freedom between the world and the wheel. Its tyre has the same place in its section."""

DAMPER: Final = numbers_type(
    "tendon", "row", "length", "points", ("chain", MAX_CHAIN), ("velocity_mps", MAX_CURVE_POINTS),
    ("force_N", MAX_CURVE_POINTS),
)  # fmt: skip
"""A damper's tendon, place in the tendon Jacobian, and curve; velocity in compression and force apart are positive."""

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
"""Head of the grid of the path that the friction follows (`PathGrid`). Points and cells have separate sections."""

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
"""Outputs of the callback for each wheel, at the start of mjData.userdata. After them come the force of each damper
and the readings of screws and motors, and last, not written by the callback, the number of active faults."""
USERDATA_PER_WHEEL: Final = WHEEL_OUTPUT.itemsize // 8


def output_slot(wheel: int, name: str) -> int:
    """Return the index in `userdata` of a field of a wheel's `WHEEL_OUTPUT`."""
    assert WHEEL_OUTPUT.names is not None
    return wheel * USERDATA_PER_WHEEL + WHEEL_OUTPUT.names.index(name)


def wheel_outputs(data: mujoco.MjData, count: int) -> NDArray[Any]:
    """Return a view of the callback's outputs, one `WHEEL_OUTPUT` record for each wheel."""
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
    """Return a record with given values, and 0 for missing numbers."""
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
    """Return the block with its trailer, for its start index in `numeric_data`."""
    return np.concatenate([block, (float(start), MARKER)])


def header_of(model: mujoco.MjModel) -> NDArray[Any]:
    """Return the header of a model of this package, a view whose changes act from the next step on."""
    return _view(model, 0, HEADER, 1)


def section_of(model: mujoco.MjModel, name: str) -> NDArray[Any]:
    """Return a view of the records of a section in a model of this package."""
    header = header_of(model)[0]
    return _view(model, int(header[name]), np.dtype(_SECTIONS[name]), int(header[f"n_{name}"]))


def _view(model: mujoco.MjModel, start: int, kind: np.dtype[Any], count: int) -> NDArray[Any]:
    first = int(model.numeric_data[-TRAILER_SIZE]) + start
    return model.numeric_data[first : first + count * kind.itemsize // 8].view(kind)


def sensor_range(model: mujoco.MjModel) -> tuple[int, int]:
    """Return first index and number of the callback's sensor values, which with the faults end `userdata`."""
    ours = np.flatnonzero(model.sensor_type == int(mujoco.mjtSensor.mjSENS_USER))
    return (int(model.sensor_adr[ours[0]]), int(model.sensor_dim[ours].sum())) if ours.size else (0, 0)
