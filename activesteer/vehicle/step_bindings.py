"""Bindings of the native step: addresses and indices, rows, wheels and actuators."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from numba import types
from numpy.typing import NDArray

from activesteer.core.conventions import CORNERS, Array
from activesteer.core.signals import ActuatorCommand, Channel, DriverCommand, Estimate, Number, WheelTorques, numbers_of
from activesteer.core.units import ESTIMATED
from activesteer.errors import ParameterError, shown
from activesteer.native.compilation import compiled_call
from activesteer.native.memory import native_type, store_numbers
from activesteer.native.records import numbers_type
from activesteer.sensors.block import SensorBlock
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.channels.native_channels import ENGINE_ARRAYS, RawRows
from activesteer.vehicle.electric_actuators import NAME, ElectricActuator, ElectricDrive, known
from activesteer.vehicle.force_block import engine_layout, find, sensor_columns
from activesteer.vehicle.parameters import VehicleParameters
from activesteer.vehicle.toe_links import SCREW, screw_records

N_SOURCES: Final = len(RawRows._fields)
"""Number of arrays that a row is copied from."""
N_WARNINGS: Final = len(mujoco.mjtWarning.__members__) - 1
_N_WHEELS: Final = len(CORNERS)
NOTHING, ENGINE, MOTOR = 0, 1, 2
"""Sources of a wheel's drive torque."""

_INPUTS: Final = {
    "steering_wheel": "steering_wheel", "superposition": "superposition", "rear_left": "rl_steer",
    "rear_right": "rr_steer",
}  # fmt: skip
"""Name in the model of each actuator of the step."""
_SENSORS: Final = {
    "velocimeter": "cg_velocimeter", "accelerometer": "cg_accelerometer",
    "steering_wheel_angle": "steering_wheel_angle", "superposition_angle": "superposition_angle",
    "rear_left_angle": "rl_steer_angle", "rear_right_angle": "rr_steer_angle", "wheel_speed": "fl_wheel_speed",
    "position": "cg_position", "velocity": "cg_velocity", "orientation": "chassis_orientation",
}  # fmt: skip
"""Name in the model of each sensor of the step, bound by its first place in `sensordata`."""
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
    """Memory for recorded steps, which a `TAPE` record points to.

    `room`: rows that still fit. `row`, `row_bytes`: address and size of the next row. `rows`, `pose_every`: rows
    recorded so far, and rows between two poses. `position`, `quaternion`: addresses of the next poses.
    """

    def __init__(self) -> None:
        """Create an empty tape."""
        self.record = np.zeros(1, TAPE)
        self.address = self.record.ctypes.data
        self.memory: Any = None


def bind_step(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    implicit: NDArray[Any],
    recorded: RawRows,
    wheels: WheelSet,
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
    for name, value in (*wheels.bound.items(), *values.items()):
        bindings[name] = value
    armature = model.dof_armature
    bindings["armature"] = [armature.ctypes.data + dof * armature.strides[0] for dof in wheels.spins]
    bindings["ratio"] = ratio
    bindings["timestep_s"] = model.opt.timestep
    read_through(bindings, sensors)
    record_from(bindings, recorded)
    return bindings


def record_from(bindings: NDArray[Any], recorded: RawRows) -> None:
    """Bind the arrays that a row copies."""
    bindings["sources"] = [array.ctypes.data for array in recorded]
    bindings["sizes"] = [array.size for array in recorded]


def read_through(bindings: NDArray[Any], sensors: SensorBlock | None) -> None:
    """Bind the sensors between the true values and the measurement."""
    bindings["n_sensors"] = 0
    if sensors is not None:
        bindings["n_sensors"], bindings["sensors"] = len(sensors.chains), sensors.chains.ctypes.data
        bindings["sensor_memory"], bindings["sensor_memory_size"] = sensors.memory.ctypes.data, sensors.memory.size


def command_numbers(messages: Mapping[str, type[Any]]) -> dict[str, Number]:
    """Return the numbers of a row, in the order of `write_commands`."""
    count = Counter(field for message in messages.values() for field in message._fields)
    return {
        f"{sender}_{number.name}" if count[number.field] > 1 else number.name: number
        for sender, message in messages.items()
        for number in numbers_of(message)
    }


def command_channels(numbers: Mapping[str, Number]) -> dict[Channel, int]:
    """Return the indices of the recorded numbers in a row, by channel."""
    return {
        Channel(name, number.recorded.unit, number.recorded.meaning, "control"): place
        for place, (name, number) in enumerate(numbers.items())
        if number.recorded is not None
    }


_NUMBERS: Final = command_numbers({"driver": DriverCommand, "controller": ActuatorCommand})
COMMANDS: Final = tuple(_NUMBERS)
"""Names of the numbers of a row."""
COMMAND_ROW: Final = np.dtype([(name, np.float64) for name in COMMANDS])
"""A row as compiled code reads it."""
COMMAND_CHANNELS: Final = command_channels(_NUMBERS)
"""Place of each channel in a row."""
CARRIED_OUT: Final = tuple(name for name, number in _NUMBERS.items() if number.recorded is None or number.recorded.acts)
"""Names of the numbers that the car acts on. The others are for the recording only."""
BRAKES: Final = COMMANDS.index("fl_brake_torque_demand_Nm")
"""Place of the brake torque of the first wheel in a row."""
TORQUES: Final = COMMANDS.index("fl_wheel_torque_demand_Nm")
"""Place of the additional drive torque of the first wheel in a row."""
ESTIMATE_CHANNELS: Final = tuple(
    Channel(f"{ESTIMATED}_{number.name}", about.unit, f"{about.meaning}, estimated by the controller", "control")
    for number in numbers_of(Estimate)
    if (about := number.recorded) is not None
)
"""Channels of the fields of an `Estimate`, in their order."""
write_estimate: Final = struct.Struct(f"{len(Estimate._fields)}d").pack_into
"""Write a row into the memory of an array: `write_estimate(row, 0, *estimate)`. The arguments must be numbers."""
_SIZE_DRIVER: Final = 8 * len(numbers_of(DriverCommand))
"""Bytes of a row that hold the driver's command."""


@compiled_call(types.void, types.intp, native_type(DriverCommand), others_run=False)
def _write_driver_command(address, command):
    store_numbers(address, command)


@compiled_call(types.void, types.intp, native_type(ActuatorCommand), others_run=False)
def _write_actuator_command(address, command):
    store_numbers(address, command)


_WRITERS: Final[dict[type[Any], tuple[Any, str, int]]] = {
    DriverCommand: (_write_driver_command, "driver_command", len(DriverCommand._fields)),
    ActuatorCommand: (_write_actuator_command, "actuator_command", len(ActuatorCommand._fields)),
}


def write_command(kind: type[Any], address: int, command: Any) -> None:
    """Write the numbers of a command from Python."""
    write, key, count = _WRITERS[kind]
    # Native code reads a fixed number of fields; an incomplete message would end the process.
    if type(command) is not kind or len(command) != count:
        raise ParameterError(f"is {shown(command)}; a complete {kind.__name__} is needed", key=key, value=command)
    try:
        write(address, command)
    except Exception as reason:
        raise ParameterError(f"cannot carry out {shown(command)}: {reason}", key=key, value=command) from reason


def write_commands(row: Array, driver_command: Any, actuator_command: Any) -> None:
    """Write the numbers of both commands into a row (see `write_command`)."""
    write_command(DriverCommand, row.ctypes.data, driver_command)
    write_command(ActuatorCommand, row.ctypes.data + _SIZE_DRIVER, actuator_command)


def engine_arrays(data: mujoco.MjData) -> dict[str, Array]:
    """Return the arrays of the engine, under the names of `RawRows`."""
    return {name: getattr(data, name) for name in ENGINE_ARRAYS}


class RecordedArrays:
    """Arrays of a row: engine, commands, measurement, brakes, motors, and an estimate if recorded."""

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, measured: Array, brakes: Array, electric: Array
    ) -> None:
        """Collect the arrays of a car."""
        self._model, self._data = model, data
        self._measured, self._brakes, self._electric = measured, brakes, electric
        self.commands: Array = np.zeros(len(COMMANDS))
        self.estimate: Array = np.empty(0)

    def live(self) -> RawRows:
        """Return the arrays in the order of a row."""
        return self._of(self._data, self.commands)

    def empty(self, count: int) -> RawRows:
        """Allocate rows for several steps in one block."""
        live = self.live()
        ends = np.cumsum([array.size for array in live])
        block = np.empty((count, ends[-1]))
        return RawRows(*(block[:, end - array.size : end] for array, end in zip(live, ends, strict=True)))

    def present(self, driver_command: DriverCommand, actuator_command: ActuatorCommand) -> RawRows:
        """Return one row for the current time and inputs."""
        now, commands = mujoco.MjData(self._model), np.empty_like(self.commands)
        mujoco.mj_copyData(now, self._model, self._data)
        mujoco.mj_forward(self._model, now)
        write_commands(commands, driver_command, actuator_command)
        return RawRows(*(array[np.newaxis] for array in self._of(now, commands)))

    def _of(self, data: mujoco.MjData, commands: Array) -> RawRows:
        return RawRows(
            **engine_arrays(data),
            commands=commands,
            measured=self._measured,
            brakes=self._brakes,
            electric=self._electric,
            estimate=self.estimate,
        )


_CALIBRATED_AT_MPS: Final = 20.0
"""Speed for the rolling radii that convert wheel speeds to the speed of the car [m/s]."""


class WheelSet:
    """The wheels of a car, in the order of `CORNERS`.

    Attributes:
        bound: Fields of `STEP_BINDINGS`: places of the drive and the brake torques in `ctrl`, fraction of the driver's
            demand, `ENGINE`, `MOTOR` or `NOTHING`, degree of freedom of rotation, and inertia that each wheel carries
            beside its own with the clutch open and in a gear.
        spins: Their degrees of freedom of rotation.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, parameters: VehicleParameters) -> None:
        """Look up the wheels."""

        def found(kind: mujoco.mjtObj, ending: str) -> list[int]:
            return [find(model, kind, corner + ending) for corner in CORNERS]

        self._model, self._data, self._ctrl = model, data, data.ctrl
        driven_by = [
            MOTOR if parameters.motors.at(corner) else ENGINE if fraction > 0.0 else NOTHING
            for corner, fraction in zip(CORNERS, parameters.engine_fractions, strict=True)
        ]
        self._driven = [corner for corner, source in zip(CORNERS, driven_by, strict=True) if source != NOTHING]
        self.spins: list[int] = model.jnt_dofadr[found(mujoco.mjtObj.mjOBJ_JOINT, "_spin")].tolist()
        engine_kgm2 = parameters.powertrain.inertia_kgm2
        free_kgm2: list[float] = model.dof_armature[self.spins].tolist()
        self.bound: dict[str, Sequence[float]] = {
            "drives": found(mujoco.mjtObj.mjOBJ_ACTUATOR, "_drive"),
            "brakes": found(mujoco.mjtObj.mjOBJ_ACTUATOR, "_brake"),
            "drive_fractions": parameters.powertrain.wheel_fractions,
            "driven_by": driven_by,
            "spins": self.spins,
            "free_kgm2": free_kgm2,
            "engaged_kgm2": [
                own + engine_kgm2 * part for own, part in zip(free_kgm2, parameters.engine_fractions, strict=True)
            ],
        }
        self._bodies = found(mujoco.mjtObj.mjOBJ_BODY, "_wheel")

    def check_driven(self, torques_Nm: Sequence[float]) -> None:
        """Check that no torque is demanded of a wheel without a drive."""
        for corner, torque in zip(CORNERS, torques_Nm, strict=True):
            if torque != 0.0 and corner not in self._driven:
                raise ParameterError(
                    f"demands {torque:g} N m at {corner}, a wheel without a drive; the driven wheels are "
                    f"{', '.join(self._driven)}; [motors] in the vehicle file can drive any wheel",
                    key="wheel_torque_demand_Nm",
                    value=torque,
                )

    def apply(self, torques: WheelTorques) -> None:
        """Set the torques of individual wheels, immediately and without the limits of the engine."""
        numbers = torque_numbers(torques)
        self._ctrl[self.bound["drives"]], self._ctrl[self.bound["brakes"]] = numbers[:4], numbers[4:]

    def heights_m(self) -> Array:
        """Return the heights of the wheel centres [m], approximately the rolling radii."""
        return self._data.xpos[self._bodies, 2]

    def effective_radii_m(self, tyres: tuple[TyreParameters, TyreParameters]) -> list[float]:
        """Return the rolling radii under the current loads."""
        # While sensors are fitted, the car stands still.
        loads_N = fb.wheel_outputs(self._data, len(CORNERS))["fz_N"]
        return [
            float(MagicFormula(tyre).evaluate(load_N, 0.0, 0.0, vx_mps=_CALIBRATED_AT_MPS).effective_radius_m)
            for tyre, load_N in zip((tyres[0], tyres[0], tyres[1], tyres[1]), loads_N, strict=True)
        ]

    def inertias_kgm2(self) -> list[float]:
        """Return the inertia of each wheel and of the parts that rotate with it."""
        mass_matrix = np.zeros((self._model.nv, self._model.nv))
        mujoco.mj_fullM(self._model, self._data, mass_matrix)
        return mass_matrix.diagonal()[self.spins].tolist()


def torque_numbers(torques: WheelTorques) -> tuple[float, ...]:
    """Return the drive and brake torques of the wheels [N m]."""
    try:
        numbers = (*map(float, torques.drive_Nm), *map(float, torques.brake_Nm))
    except (AttributeError, TypeError, ValueError) as reason:
        raise ParameterError(f"are {shown(torques)}: {reason}", key="wheel_torques", value=torques) from reason
    if len(numbers) != 2 * len(CORNERS) or len(torques.drive_Nm) != len(CORNERS):
        raise ParameterError(f"are {shown(torques)}; four each are needed", key="wheel_torques", value=torques)
    return numbers


class ActuatorRecords:
    """Views of the records of a compiled car, whose changes act from the next step on."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Find the block."""
        self._model = model
        self._actuators = fb.section_of(model, "actuators")
        self._links, self._screws = fb.section_of(model, "links"), fb.section_of(model, "screws")
        self._rear = [find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name) for name in ("rl_steer", "rr_steer")]

    def of(self, actuator: int) -> NDArray[Any]:
        """Return the `ACTUATOR` record of an actuator, shape (1,)."""
        return self._actuators[actuator : actuator + 1]

    def screw(self, actuator: int) -> tuple[NDArray[Any], ...]:
        """Return the records of link and screw of an actuator, empty without a screw."""
        record = self.of(actuator)
        place = int(record["record"][0])
        if record["kind"] == fb.KIND_SCREW:
            return (self._screws[place : place + 1],)
        if record["kind"] != fb.KIND_LINK:
            return ()
        names = {self._model.actuator(index).name for index in range(self._model.nu)}
        own = self._model.actuator(actuator).name[:2] + SCREW
        screw = self._model.actuator(own if own in names else f"rear{SCREW}").id
        return self._links[place : place + 1], *self.screw(screw)

    def rear_screws(self) -> Iterator[tuple[NDArray[Any], ...]]:
        """Return the records of link and screw of every rear wheel that has a screw."""
        for actuator in self._rear:
            if records := self.screw(actuator):
                yield records

    def rear_states_at(self, angle_rad: float) -> dict[int, float]:
        """Return the activations of the rear steering actuators at rest at an angle, by address."""
        states: dict[int, float] = {}
        for actuator in self._rear:
            address = int(self._model.actuator_actadr[actuator])
            if records := self.screw(actuator):
                link, screw = records
                powers = angle_rad ** np.arange(1, fb.POWERS + 1)
                travel = float(screw["travel"][0] @ powers)
                states[int(screw["act"][0])] = travel
                states[address] = float(link["sign"][0]) * travel
            else:
                states[address] = angle_rad
        return states


class SteeringRates(NamedTuple):
    """Rates of rear steering and superposition at the road wheels [rad/s], or infinite without such an actuator."""

    rear: float
    superposition: float


def steering_rates(model: mujoco.MjModel, parameters: VehicleParameters) -> SteeringRates:
    """Return the unloaded rates of the actuators, near the middle of their travel."""
    rear, superposition = parameters.rear_actuator, parameters.superposition_actuator
    present = {model.actuator(index).name for index in range(model.nu)}
    front_radps = rear_radps = math.inf
    if rear.has_motor:
        kind = rear.resolved()
        # The travel of a screw over the angle of its wheel, near the middle.
        rear_radps = min(
            _speed_radps(kind) * float(screw["lead_mprad"][0]) / abs(float(screw["travel"][0][0]))
            for screw in screw_records(model, kind)[1]
        )
    elif "rl_steer" in present:
        rear_radps = float(model.actuator("rl_steer").dynprm[1])
    if superposition.has_motor:
        front_radps = _speed_radps(superposition.resolved()) / known(superposition.resolved().gear)
    elif NAME in present:
        front_radps = float(model.actuator(NAME).dynprm[1])
    return SteeringRates(rear_radps, front_radps / parameters.steering.ratio)


def _speed_radps(actuator: ElectricActuator) -> float:
    return min(known(actuator.speed_limit_radps), known(actuator.no_load_speed_radps) * actuator.voltage_ratio)
