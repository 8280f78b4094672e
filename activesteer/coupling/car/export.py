"""Export of a car as an FMU or as a C library."""

from __future__ import annotations

import csv
import hashlib
import io
import os
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np

from activesteer.config.faults import ACTUATORS
from activesteer.core.files import atomic_write
from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement, Motion, numbers_in, numbers_of
from activesteer.core.version import __version__
from activesteer.coupling.car.objects import Memory, car_code, native_memory
from activesteer.coupling.car.variables import (
    INPUT,
    MOTION,
    OUTPUT,
    PARAMETER,
    PLACES,
    SEEDS,
    Variable,
    faulty_parts,
    inputs_of,
    model_description,
    outputs_of,
    parameters_of,
)  # fmt: skip
from activesteer.errors import ModelError, ParameterError
from activesteer.scenario import Scenario
from activesteer.sensors.block import CHAIN
from activesteer.simulation.closed_loop import ClosedLoop
from activesteer.simulation.preparation import with_amplitude_found
from activesteer.tyre.tyre_parameters import TYRE_RECORD
from activesteer.vehicle import force_block as fb
from activesteer.vehicle.channels.corners import design_heights_m
from activesteer.vehicle.channels.native_channels import Actuator, AxialForce
from activesteer.vehicle.faults import part_of
from activesteer.vehicle.force_block import sensor_columns
from activesteer.vehicle.native_faults import N_HEALTH
from activesteer.vehicle.step_bindings import BRAKES, CARRIED_OUT, COMMANDS

_SOURCES: Final = Path(__file__).parent / "c"
_STATE: Final = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_SETTLING_S: Final = 3.0
"""Time in which a car with changed parameters settles [s]."""
_KEPT: Final = ("electric_state", "sensor_memory")
"""Parts of the memory that change in a step, in addition to the arrays of a recorded row."""
_OPTIONS: Final = (
    "-std=gnu11", "-O2", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off", "-march=x86-64-v3", "-Wall",
    "-Wno-unused-parameter",
)  # fmt: skip
_LINKING: Final = (
    "-shared", "-Wl,-rpath,$ORIGIN", "-Wl,-Bsymbolic", "-Wl,-z,defs", "-Wl,-z,nodelete", "-Wl,--gc-sections",
)  # fmt: skip

_LICENSES: Final = (
    "activesteer and MuJoCo are under the Apache License 2.0, https://www.apache.org/licenses/LICENSE-2.0.\n"
    "MuJoCo: Copyright DeepMind Technologies Limited. Its library is included under another name.\n"
)


class Export(NamedTuple):
    """Exported car: its variables, its compiled library, and the library of the engine."""

    name: str  # of the vehicle
    variables: list[Variable]  # its variables; the value reference is the place
    token: str  # digest of everything that decides its behaviour
    library: bytes
    engine: tuple[str, bytes]  # the engine's library next to it, and its name
    timestep_s: float  # length of a step [s]


def export_fmu(scenario: Scenario, path: Path, version: int = 2) -> Export:
    """Write a car as an FMU for co-simulation."""
    export = _export(scenario)
    folder = "binaries/linux64" if version == 2 else "binaries/x86_64-linux"
    name = _identifier(export.name)
    with atomic_write(path, ParameterError) as target, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        description = model_description(export.variables, name, export.token, version, export.timestep_s)
        archive.writestr("modelDescription.xml", description)
        archive.writestr(f"{folder}/{name}.so", export.library)
        archive.writestr(f"{folder}/{export.engine[0]}", export.engine[1])
        archive.writestr("documentation/licenses/license.txt", _LICENSES)
    return export


def export_library(scenario: Scenario, folder: Path) -> Export:
    """Write a car as a shared library with a C header and a table of its variables."""
    export = _export(scenario)
    table = io.StringIO()
    rows = csv.writer(table, lineterminator="\n")
    rows.writerow(("number", "name", "causality", "unit", "start", "low", "high", "meaning"))
    for number, v in enumerate(export.variables):
        rows.writerow((number, v.name, v.causality, v.unit, repr(v.start), v.low, v.high, v.meaning))
    files = {
        "libactivesteer_car.so": export.library,
        export.engine[0]: export.engine[1],
        "activesteer_car.h": (_SOURCES / "activesteer_car.h").read_bytes(),
        "variables.csv": table.getvalue().encode(),
        "license.txt": _LICENSES.encode(),
    }
    for name, content in files.items():
        with atomic_write(folder / name, ParameterError) as target:
            target.write_bytes(content)
    return export


def _identifier(name: str) -> str:
    return "".join(sign if sign.isalnum() and sign.isascii() else "_" for sign in name) or "car"


def _export(scenario: Scenario) -> Export:
    """Build the car, let it settle, and compile it into a library."""
    if scenario.maneuver.fault:
        raise ParameterError("an exported car cannot have the faults of a manoeuvre; leave them out", key="fault")
    scenario = with_amplitude_found(scenario)
    loop = ClosedLoop(scenario)
    sensors = scenario.car.config.sensors
    inputs = inputs_of(loop, scenario.maneuver.road.mu)
    outputs, forces, limits = outputs_of(loop, {variable.name for variable in inputs})
    parameters = parameters_of(scenario.maneuver.speed_mps, sensors.seed or 0)
    variables = [*inputs, *parameters, *outputs]
    memory = native_memory(loop.vehicle)
    files = {
        "model.mjb": _model(loop.vehicle.model),
        "memory.bin": memory.content,
        "state.bin": _state(loop, memory, variables).tobytes(),
        "seeds.bin": _seeds(loop),
        "data.h": _data(loop, memory, variables, forces, limits).encode(),
    }
    sources = {path.name: path.read_bytes() for path in sorted(_SOURCES.iterdir())}
    objects = {f"{name}.o": content for name, content in car_code().items()}
    engine_path = Path(mujoco.__file__).parent / f"libmujoco.so.{mujoco.__version__}"
    everything = {**files, **sources, **objects}
    digest = hashlib.sha256(b"".join(name.encode() + content for name, content in sorted(everything.items())))
    digest.update(f"{__version__} {mujoco.__version__}".encode())
    token = digest.hexdigest()[:32]
    files["data.h"] += f"static const uint64_t FINGERPRINT = 0x{token[:16]}u;\n".encode()
    engine = _renamed_engine(engine_path, token)
    library = _compiled({**files, **sources, **objects}, engine, token)
    return Export(scenario.car.name, variables, token, library, engine, loop.vehicle.timestep_s)


def _model(model: mujoco.MjModel) -> bytes:
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def _state(loop: ClosedLoop, memory: Memory, variables: Sequence[Variable]) -> np.ndarray[Any, Any]:
    """Return the initial state in the format of `exchange` in car.c."""
    vehicle = loop.vehicle
    engine = np.empty(mujoco.mj_stateSize(vehicle.model, _STATE))
    mujoco.mj_getState(vehicle.model, vehicle.data, engine, _STATE)
    parts = vehicle.native_parts()
    return np.concatenate(
        [
            engine,
            [variable.start for variable in variables],
            [1.0, *numbers_in(loop.measurement), *numbers_in(loop.motion)],
            np.zeros(3 * len(_parts(loop, [variable.name for variable in variables]))),
            *vehicle.rows.live(),
            *(parts[name] for name in _KEPT if name in parts),
            [0.0, 0.0],
        ]
    )


def _parts(loop: ClosedLoop, names: Sequence[str]) -> list[tuple[int | float, ...]]:
    """Return the actuators that can fail, in the format of car.c."""
    rows: list[tuple[int | float, ...]] = []
    for part in faulty_parts(loop):
        for name in ACTUATORS[part].members:
            record = part_of(loop.vehicle, part, name)
            record["variable"] = names.index(f"{part}_fault")
            rows.append(record[0].item())
    return rows


def _seeds(loop: ClosedLoop) -> bytes:
    """Return the random offset and the noise key of each seed and sensor."""
    block = loop.vehicle.sensors
    if block is None:
        return bytes(8)
    table = np.zeros((SEEDS, len(block.chains)), [("normal", np.float64), ("key", np.uint64)])
    for seed in range(SEEDS):
        for index in range(len(block.chains)):
            stream = np.random.SeedSequence((seed, index))
            normal = np.random.default_rng(stream).standard_normal()
            table[seed, index] = normal, stream.generate_state(1, np.uint64)[0]
    return table.tobytes()


def _numbers(values: Any) -> str:
    return ", ".join(str(int(value)) if isinstance(value, int) else _real(float(value)) for value in values)


def _real(value: float) -> str:
    return "INFINITY" if value == np.inf else "-INFINITY" if value == -np.inf else repr(value)


def _data(
    loop: ClosedLoop, memory: Memory, variables: Sequence[Variable], forces: list[AxialForce], limits: list[Actuator]
) -> str:
    """Return the tables of car.c."""
    vehicle, model = loop.vehicle, loop.vehicle.model
    header = fb.header_of(model)[0]
    block = int(model.numeric_data[-fb.TRAILER_SIZE])
    names = [variable.name for variable in variables]
    setup, chassis = vehicle.brakes[0][0], model.body("chassis").id
    torques = vehicle.wheels.bound
    place = {name: index for index, name in enumerate(names)}
    wheels, tyres = int(header["wheels"]), int(header["tyres"])
    result = ["sane", *(n.name for n in numbers_of(Measurement)), *(n.name for n in numbers_of(Motion))]
    n_measurement = 1 + len(numbers_of(Measurement))
    sensors = vehicle.sensors

    def offset(record: Any, field: str) -> int:
        return record.fields[field][1]

    parts_that_fail = _parts(loop, names)
    constants: dict[str, Any] = {
        "TIMESTEP_S": vehicle.timestep_s, "STEERING_RATIO": vehicle.parameters.steering.ratio,
        "ENGINE_VERSION": mujoco.mj_version(), "STATE_SIZE": mujoco.mj_stateSize(model, _STATE),
        "N_VARIABLES": len(variables), "N_RESULT": len(result) - 1, "N_FORCES": len(forces),
        "N_LIMITS": len(limits), "N_MOTION": len(MOTION), "N_TARGETS": len(memory.targets),
        "N_RELOCATIONS": len(memory.relocations), "N_COMMANDS": len(COMMANDS), "N_COMMAND_INPUTS": len(CARRIED_OUT),
        "MOTION_SPEED": n_measurement + Motion._fields.index("speed_mps"), "RESULT_X": n_measurement,
        "IN_GEAR": place["gear"], "IN_DRIVE": place["drive_torque_demand_Nm"], "IN_ROAD_MU": place["road_mu"],
        "IN_TORQUES_SET": place["wheel_torques_set"], "IN_DRIVES": place["fl_drive_torque_Nm"],
        "IN_BRAKES": place["fl_brake_torque_Nm"], "IN_PRESSURES": place["fl_brake_pressure_request_Pa"],
        "IN_PARAMETERS": place["start_speed_mps"],
        "PARAMETER_FACTORS": place["tyre_friction_factor"] - place["start_speed_mps"],
        "PARAMETER_SEED": place["sensor_seed"] - place["start_speed_mps"],
        "COMMAND_FRONT_STEER": COMMANDS.index("front_steer_demand_rad"),
        "COMMAND_STEERING_WHEEL": COMMANDS.index("steering_wheel_demand_rad"), "COMMAND_BRAKES": BRAKES,
        "BLOCK_START": block, "HEADER_GEAR": offset(fb.HEADER, "gear") // 8,
        "HEADER_AREAS_FELT": offset(fb.HEADER, "areas_felt") // 8,
        "PLACE_BINDINGS": memory.places["bindings"], "PLACE_SENSORS": memory.places.get("sensors", 0),
        "N_SENSORS": 0 if sensors is None else len(sensors.chains), "SENSOR_BYTES": CHAIN.itemsize,
        "SENSOR_BIAS": offset(CHAIN, "bias"), "SENSOR_KEY": offset(CHAIN, "key"),
        "N_PARTS": len(parts_that_fail), "N_HEALTH": N_HEALTH,
        **{f"TYRE_{name}": offset(TYRE_RECORD, name) // 8 for name in ("LMUX", "LMUY", "LKY", "LKX")},
        "CHASSIS": chassis, "CG_SITE": model.site("cg").id, "SETTLING_STEPS": round(_SETTLING_S / vehicle.timestep_s),
    }  # fmt: skip
    base = dict(zip(COMMANDS, (*numbers_in(DriverCommand()), *numbers_in(ActuatorCommand())), strict=True))
    base["front_steer_demand_rad"] = 0.0
    stride = fb.WHEEL.itemsize // 8
    places = [sensor_columns(model, name).start + (2 if name.endswith("_position") else 0) for name in PLACES]
    arrays: dict[str, tuple[str, Any]] = {
        "COMMANDS": ("double", base.values()),
        "COMMAND_INPUTS": ("int", [COMMANDS.index(name) for name in CARRIED_OUT]),
        "SPIN_DOFS": ("int", torques["spins"]), "DRIVE_CONTROLS": ("int", torques["drives"]),
        "BRAKE_CONTROLS": ("int", torques["brakes"]),
        "WHEEL_MU": ("int", [wheels + wheel * stride + offset(fb.WHEEL, "mu") // 8 for wheel in range(4)]),
        "TYRES": ("int", [tyres + wheel * (TYRE_RECORD.itemsize // 8) for wheel in range(4)]),
        "TORQUE_PER_PRESSURE": ("double", setup["torque_per_pressure_NmpPa"]),
        "RADIUS_M": ("double", setup["rolling_radius_m"]),
        "SENSOR_PLACES": ("int64_t", places),
        "DESIGN": ("double", [*design_heights_m(model), vehicle.parameters.steering.ratio]),
        "BIAS_RMS": ("double", [0.0] if sensors is None else sensors.bias_rms),
    }  # fmt: skip
    lines = [f"#define {name} {value if isinstance(value, int) else _real(value)}" for name, value in constants.items()]
    for name, (kind, values) in arrays.items():
        lines.append(f"static const {kind} {name}[] = {{{_numbers(_plain(values))}}};")
    parts = vehicle.native_parts()
    kept = [(0, 0, memory.places[name], parts[name].size) for name in _KEPT if name in parts]
    causes = {INPUT: "INPUT", OUTPUT: "OUTPUT", PARAMETER: "PARAMETER"}
    tables = {
        "Relocation RELOCATIONS": [tuple(relocation) for relocation in memory.relocations],
        "Target TARGETS": [(t.kind, t.base, t.added, size) for t, size in memory.targets.values()],
        "Target KEPT": kept,
        "Part PARTS": parts_that_fail,
        "Force FORCES": [tuple(force) for force in forces],
        "Limit LIMITS": [tuple(limit) for limit in limits],
    }
    for name, entries in tables.items():
        words = ", ".join(f"{{{_numbers(_plain(entry))}}}" for entry in entries)
        lines.append(f"static const {name}[] = {{{words or '{0}'}}};")
    rows_of = (
        f'{{"{v.name}", {causes[v.causality]}, {_numbers((v.source, v.column, v.start, v.low, v.high))}}}'
        for v in variables
    )
    lines.append(f"static const Variable VARIABLES[] = {{{', '.join(rows_of)}}};")
    lines.append(f"static void *const FUNCTIONS[] = {{{', '.join(f'(void *){name}' for name in memory.functions)}}};")
    return "\n".join(lines) + "\n"


def _plain(values: Any) -> list[int | float]:
    """Convert the numbers of NumPy, and bool, to numbers of Python."""
    return [value.item() if isinstance(value, np.generic) else value for value in values]


def _renamed_engine(path: Path, token: str) -> tuple[str, bytes]:
    """Return the engine's library under a unique name."""
    # MuJoCo has its callbacks once per loaded library. Under its own name, the engine of an exported car is a separate
    # library from the engine of another exported car, or of a program that uses MuJoCo itself.
    before = path.name
    after = f"lib{token}"[: len(before) - 3] + ".so"
    return after, path.read_bytes().replace(before.encode() + b"\0", after.encode() + b"\0")


def _compiled(files: Mapping[str, bytes], engine: tuple[str, bytes], token: str) -> bytes:
    """Compile the C code of a car with its objects, and return the shared library."""
    compiler = os.environ.get("CC", "cc")
    if shutil.which(compiler) is None:
        raise ModelError(
            f"the export of a car needs a C compiler, and there is no {compiler!r}: install gcc or clang, or set CC",
            value=compiler,
        )
    with tempfile.TemporaryDirectory(prefix="activesteer-export-") as name:
        folder = Path(name)
        for file, content in {**files, engine[0]: engine[1]}.items():
            (folder / file).write_bytes(content)
        include = Path(mujoco.__file__).parent / "include"
        c_files, objects = (sorted(file for file in files if file.endswith(ending)) for ending in (".c", ".o"))
        command = [
            compiler, *_OPTIONS, f"-I{include}", f'-DTOKEN="{token}"', *c_files, *objects, engine[0], *_LINKING, "-lm",
            "-o", "car.so",
        ]  # fmt: skip
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            errors = [line for line in done.stderr.splitlines() if "error" in line or "undefined" in line]
            raise ModelError(f"{compiler} cannot build the car: {' '.join(errors[:3]) or done.stderr[:300]}")
        return (folder / "car.so").read_bytes()
