"""All that the native step needs to know of a car: addresses and indices in one record, `STEP_PLAN`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import CORNERS
from activesteer.sensors.block import SensorBlock
from activesteer.vehicle.channels.raw_rows import RawRows
from activesteer.vehicle.engine_layout import engine_layout
from activesteer.vehicle.named_parts import find, sensor_columns

N_SOURCES: Final = len(RawRows._fields)
"""Arrays that a row is copied from."""
N_WARNINGS: Final = len(mujoco.mjtWarning.__members__) - 1
_N_WHEELS: Final = len(CORNERS)


class Wheels(NamedTuple):
    """How torques come to the four wheels, order of `CORNERS`."""

    drives: Sequence[int]
    """Controls of the drive."""
    brakes: Sequence[int]
    """Controls of the brakes."""
    drive_fractions: Sequence[float]
    """What each gets of the drive torque."""


_INPUTS: Final = {
    "steering_wheel": "steering_wheel", "superposition": "superposition", "rear_left": "rl_steer",
    "rear_right": "rr_steer",
}  # fmt: skip
"""Actuator, as the step calls it -> as the model does."""
_SENSORS: Final = {
    "velocimeter": "cg_velocimeter", "accelerometer": "cg_accelerometer",
    "steering_wheel_angle": "steering_wheel_angle", "superposition_angle": "superposition_angle",
    "rear_left_angle": "rl_steer_angle", "rear_right_angle": "rr_steer_angle", "wheel_speed": "fl_wheel_speed",
    "position": "cg_position", "velocity": "cg_velocity", "orientation": "chassis_orientation",
}  # fmt: skip
"""The same of sensors; their first place in `sensordata` counts."""
_ADDRESSES: Final = (
    "implicit", "time", "warnings", "qvel", "n_dofs", "ctrl", "sensordata", "positions", "quaternions",
    "n_bodies", "brake_setup", "brake_state",
)  # fmt: skip
STEP_PLAN: Final = np.dtype(
    (
        np.record,
        [
            *((name, np.intp) for name in (*_ADDRESSES, *_INPUTS, *_SENSORS)),
            ("ratio", np.float64),
            *((name, np.intp, (_N_WHEELS,)) for name in ("drives", "brakes")),
            ("drive_fractions", np.float64, (_N_WHEELS,)),
            *((name, np.intp) for name in ("n_sensors", "sensors", "sensor_memory", "sensor_memory_size")),
            ("timestep_s", np.float64),
            ("wheel_radii_m", np.float64, (_N_WHEELS,)),
            ("sources", np.intp, (N_SOURCES,)),
            ("sizes", np.intp, (N_SOURCES,)),
        ],
    )
)
TAPE: Final = np.dtype(
    (
        np.record,
        [(name, np.intp) for name in ("room", "row", "row_bytes", "rows", "pose_every", "position", "quaternion")],
    )
)
"""Where steps are recorded: for how many rows there is room, the address of the next row and how far it is to the one
behind it, how many rows were taken, after how many the bodies' poses are taken too, and where the next ones go."""


def step_plan(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    implicit: NDArray[Any],
    recorded: RawRows,
    wheels: Wheels,
    ratio: float,
    sensors: SensorBlock | None,
    brakes: tuple[NDArray[Any], NDArray[Any]],
) -> NDArray[Any]:
    """Looks up all addresses.

    Args:
        model: The car.
        data: Its state; both must outlive the plan.
        implicit: `IMPLICIT_PLAN` of the car, shape (1,); must outlive the plan.
        recorded: The arrays that a row is copied from.
        wheels: How torques come to the wheels.
        ratio: Overall steering ratio.
        sensors: What is between the truth and the measurement; must outlive the plan. None where nothing is.
        brakes: `BRAKE_SETUP` and `BRAKE_STATE`; must outlive the plan too.

    Returns:
        The plan, shape (1,), at an address that stays.

    Raises:
        ModelError: the model lacks an actuator or a sensor.
    """
    plan = np.zeros(1, STEP_PLAN)
    values: Mapping[str, int] = {
        "implicit": implicit.ctypes.data,
        "time": data._address + engine_layout().d_time,
        "warnings": data.warning.number.ctypes.data,
        "qvel": data.qvel.ctypes.data,
        "n_dofs": model.nv,
        "ctrl": data.ctrl.ctypes.data,
        "sensordata": data.sensordata.ctypes.data,
        # Without the world, which is the engine's body 0.
        "positions": data.xpos[1:].ctypes.data,
        "quaternions": data.xquat[1:].ctypes.data,
        "n_bodies": model.nbody - 1,
        "brake_setup": brakes[0].ctypes.data,
        "brake_state": brakes[1].ctypes.data,
        **{name: find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator) for name, actuator in _INPUTS.items()},
        **{name: sensor_columns(model, sensor).start for name, sensor in _SENSORS.items()},
    }
    for name, value in wheels._asdict().items():
        plan[name] = value
    for name, value in values.items():
        plan[name] = value
    plan["ratio"] = ratio
    plan["timestep_s"] = model.opt.timestep
    read_through(plan, sensors)
    record_from(plan, recorded)
    return plan


def record_from(plan: NDArray[Any], recorded: RawRows) -> None:
    """Has rows copied from these arrays.

    Args:
        plan: A `STEP_PLAN`; changed.
        recorded: As for `step_plan`; they must outlive the plan.
    """
    plan["sources"] = [array.ctypes.data for array in recorded]
    plan["sizes"] = [array.size for array in recorded]


def read_through(plan: NDArray[Any], sensors: SensorBlock | None) -> None:
    """Puts other sensors between the truth and the measurement.

    Args:
        plan: A `STEP_PLAN`, shape (1,).
        sensors: The sensors; must outlive the plan. None for none.
    """
    plan["n_sensors"] = 0
    if sensors is not None:
        plan["n_sensors"], plan["sensors"] = len(sensors.chains), sensors.chains.ctypes.data
        plan["sensor_memory"], plan["sensor_memory_size"] = sensors.memory.ctypes.data, sensors.memory.size
