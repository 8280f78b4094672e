"""Addresses and indices of a car that the native step needs, in one record: `STEP_BINDINGS`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import CORNERS
from activesteer.native_records import numbers_type
from activesteer.sensors.block import SensorBlock
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.channels.raw_rows import RawRows
from activesteer.vehicle.electric_drive import ElectricDrive
from activesteer.vehicle.engine_layout import engine_layout
from activesteer.vehicle.named_parts import find, sensor_columns

N_SOURCES: Final = len(RawRows._fields)
"""Number of arrays that a row is copied from."""
N_WARNINGS: Final = len(mujoco.mjtWarning.__members__) - 1
_N_WHEELS: Final = len(CORNERS)
NOTHING, ENGINE, MOTOR = 0, 1, 2
"""Sources of a wheel's drive torque."""


class Wheels(NamedTuple):
    """Actuators of the four wheels, order of `CORNERS`.

    Attributes:
        drives: Places of the drive torques in `ctrl`.
        brakes: Places of the brake torques in `ctrl`.
        drive_fractions: Fraction of the driver's demand that each wheel gets.
        driven_by: `ENGINE`, `MOTOR` or `NOTHING` for each wheel.
        spins: Their degrees of freedom of rotation.
        free_kgm2: Inertia that each wheel carries beside its own with the clutch open.
        engaged_kgm2: The same in a gear.
    """

    drives: Sequence[int]
    brakes: Sequence[int]
    drive_fractions: Sequence[float]
    driven_by: Sequence[int]
    spins: Sequence[int]
    free_kgm2: Sequence[float]
    engaged_kgm2: Sequence[float]


_INPUTS: Final = {
    "steering_wheel": "steering_wheel", "superposition": "superposition", "rear_left": "rl_steer",
    "rear_right": "rr_steer",
}  # fmt: skip
"""Name of an actuator in the step -> its name in the model."""
_SENSORS: Final = {
    "velocimeter": "cg_velocimeter", "accelerometer": "cg_accelerometer",
    "steering_wheel_angle": "steering_wheel_angle", "superposition_angle": "superposition_angle",
    "rear_left_angle": "rl_steer_angle", "rear_right_angle": "rr_steer_angle", "wheel_speed": "fl_wheel_speed",
    "position": "cg_position", "velocity": "cg_velocity", "orientation": "chassis_orientation",
}  # fmt: skip
"""Name of a sensor in the step -> its name in the model; bound by its first place in `sensordata`."""
_ADDRESSES: Final = (
    "implicit", "time", "warnings", "qvel", "n_dofs", "ctrl", "sensordata", "positions", "quaternions",
    "n_bodies", "brake_setup", "brake_state", "tape", "n_motors", "motors", "battery", "electric_state", "gear",
    "n_faults", "faults",
)  # fmt: skip
STEP_BINDINGS: Final = np.dtype(
    (
        np.record,
        [
            *((name, np.intp) for name in (*_ADDRESSES, *_INPUTS, *_SENSORS)),
            ("ratio", np.float64),
            *((name, np.intp, (_N_WHEELS,)) for name in ("drives", "brakes", "driven_by", "spins", "armature")),
            *((name, np.float64, (_N_WHEELS,)) for name in ("drive_fractions", "free_kgm2", "engaged_kgm2")),
            *((name, np.intp) for name in ("n_sensors", "sensors", "sensor_memory", "sensor_memory_size")),
            ("timestep_s", np.float64),
            ("wheel_radii_m", np.float64, (_N_WHEELS,)),
            ("sources", np.intp, (N_SOURCES,)),
            ("sizes", np.intp, (N_SOURCES,)),
        ],
    )
)
TAPE: Final = numbers_type(words=("room", "row", "row_bytes", "rows", "pose_every", "position", "quaternion"))


class Tape:
    """Memory that steps are recorded in.

    Attributes:
        record: A `TAPE`, shape (1,). `room`: rows that still fit. `row`, `row_bytes`: address and size of the next row.
            `rows`, `pose_every`: rows recorded so far, and rows between two poses. `position`, `quaternion`: addresses
            of the next poses.
        address: Address of the record.
        memory: Owner of the memory that the addresses point to.
    """

    def __init__(self) -> None:
        """Create a tape without room."""
        self.record = np.zeros(1, TAPE)
        self.address = self.record.ctypes.data
        self.memory: Any = None


def bind_step(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    implicit: NDArray[Any],
    recorded: RawRows,
    wheels: Wheels,
    ratio: float,
    sensors: SensorBlock | None,
    brakes: tuple[NDArray[Any], NDArray[Any]],
    electric: ElectricDrive,
) -> NDArray[Any]:
    """Look up all addresses and indices."""
    bindings = np.zeros(1, STEP_BINDINGS)
    values: Mapping[str, int] = {
        "implicit": implicit.ctypes.data,
        "time": data._address + engine_layout().d_time,
        "warnings": data.warning.number.ctypes.data,
        "qvel": data.qvel.ctypes.data,
        "n_dofs": model.nv,
        "ctrl": data.ctrl.ctypes.data,
        "sensordata": data.sensordata.ctypes.data,
        # Body 0 of the engine is the world, which is not recorded.
        "positions": data.xpos[1:].ctypes.data,
        "quaternions": data.xquat[1:].ctypes.data,
        "n_bodies": model.nbody - 1,
        "brake_setup": brakes[0].ctypes.data,
        "brake_state": brakes[1].ctypes.data,
        "n_motors": len(electric.motors),
        "motors": electric.motors.ctypes.data,
        "battery": electric.battery.ctypes.data,
        "electric_state": electric.state.ctypes.data,
        "gear": fb.header_of(model)["gear"].ctypes.data,
        **{name: find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator) for name, actuator in _INPUTS.items()},
        **{name: sensor_columns(model, sensor).start for name, sensor in _SENSORS.items()},
    }
    for name, value in wheels._asdict().items():
        bindings[name] = value
    for name, value in values.items():
        bindings[name] = value
    armature = model.dof_armature
    bindings["armature"] = [armature.ctypes.data + dof * armature.strides[0] for dof in wheels.spins]
    bindings["ratio"] = ratio
    bindings["timestep_s"] = model.opt.timestep
    read_through(bindings, sensors)
    record_from(bindings, recorded)
    return bindings


def record_from(bindings: NDArray[Any], recorded: RawRows) -> None:
    """Bind the arrays that rows are copied from."""
    bindings["sources"] = [array.ctypes.data for array in recorded]
    bindings["sizes"] = [array.size for array in recorded]


def read_through(bindings: NDArray[Any], sensors: SensorBlock | None) -> None:
    """Bind the sensors between the truth and the measurement."""
    bindings["n_sensors"] = 0
    if sensors is not None:
        bindings["n_sensors"], bindings["sensors"] = len(sensors.chains), sensors.chains.ctypes.data
        bindings["sensor_memory"], bindings["sensor_memory_size"] = sensors.memory.ctypes.data, sensors.memory.size
