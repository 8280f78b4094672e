"""Compiled objects of an exported car: compilation and relocation.

The code comes from the same kernels as the code of a simulation, so both are bit-identical.
numba keeps the compiled module in a private interface (`_library`), which may change with a new version.

The native step finds everything by addresses in its records. Here each address becomes a `Relocation`: the place of the
word, and what it points to. A word that looks like an address but points to nothing known raises an error, so that a
new array of the native step cannot be forgotten.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np
from mujoco import _functions
from numpy.typing import NDArray

from activesteer.errors import ModelError
from activesteer.vehicle import Vehicle

PROCESSOR: Final = "x86-64-v3"
"""Processor for which code is compiled: x86-64 with AVX2 and FMA (Haswell, 2013; Zen, 2017)."""


@functools.cache
def car_code() -> dict[str, bytes]:
    """Return the object files of the functions in `entry` and of the callbacks `passive`, `act_dyn`, `sensor`."""
    # Compiles for half a minute at first use.
    from activesteer.coupling.car.entry import car_step, change, derive, fault  # noqa: PLC0415
    from activesteer.vehicle.force_block import engine_layout  # noqa: PLC0415
    from activesteer.vehicle.native_forces import _make_callbacks  # noqa: PLC0415

    passive, act_dyn, sensor = _make_callbacks(engine_layout())
    functions = {
        "step": car_step, "derive": derive, "fault": fault, "change": change, "passive": passive, "act_dyn": act_dyn,
        "sensor": sensor,
    }  # fmt: skip
    return {name: _code(name, function) for name, function in functions.items()}


def _code(name: str, function: Any) -> bytes:
    import llvmlite.binding as llvm  # noqa: PLC0415
    import numba  # noqa: PLC0415

    try:
        module = llvm.parse_assembly(str(function._library._get_module_for_linking()))
        wrapper = function._wrapper_name
        entry = module.get_function(wrapper)
    except (AttributeError, NameError, RuntimeError) as reason:
        raise ModelError(
            f"the car cannot be exported with numba {numba.__version__}, which keeps compiled code elsewhere "
            f"({type(reason).__name__}: {reason}); numba 0.61 to 0.68 work",
            value=numba.__version__,
        ) from reason
    for part in (*module.functions, *module.global_variables):
        if not part.is_declaration:
            part.linkage = "internal"
    entry.linkage = "external"
    entry.name = f"activesteer_{name}"
    machine = llvm.Target.from_triple("x86_64-unknown-linux-gnu").create_target_machine(
        cpu=PROCESSOR, opt=3, reloc="pic", codemodel="default"
    )
    return machine.emit_object(module)


_ALIGNMENT: Final = 64
_LEAST_ADDRESS: Final = 1 << 32
"""Limit above which a number in a record is an address: no size or index is so large."""
_STRUCT_BYTES: Final = {"model": 8192, "data": 262_144}

SEGMENT, FUNCTION, MODEL, MODEL_ARRAY, DATA, DATA_ARRAY = range(6)
"""Kinds of targets: memory of the car, a function, struct or array of the engine."""


class Relocation(NamedTuple):
    """Relocation of a word that holds an address."""

    place: int  # offset of the word in the memory of the car
    kind: int  # what it points to
    base: int  # place of the function in `Memory.functions`, or offset of the word in the engine's struct
    added: int  # distance from there


class Memory(NamedTuple):
    """Native memory of a car."""

    content: bytes  # its bytes, with zeros in place of addresses
    relocations: list[Relocation]
    functions: list[str]  # names of the engine's functions that are called by address
    places: dict[str, int]  # name of a part -> its offset
    # Name of an array that a recorded row is copied from -> what its address points to, and its size
    targets: dict[str, tuple[Relocation, int]]


def native_memory(vehicle: Vehicle) -> Memory:
    """Return the native memory of a car."""
    rows = vehicle.rows.live()._asdict()
    parts = vehicle.native_parts() | {f"row_{name}": array for name, array in rows.items() if not array.size}
    places, size = {}, 0
    for name, array in parts.items():
        places[name] = size
        size += -(-max(array.nbytes, 1) // _ALIGNMENT) * _ALIGNMENT
    known = _Known(vehicle, parts, places)
    content, relocations = bytearray(size), []
    for name, array in parts.items():
        raw = np.frombuffer(array.tobytes(), np.uint8).copy()
        for offset, field in _words(array):
            value = int(raw[offset : offset + 8].view(np.int64)[0])
            if (found := known.target(value)) is not None:
                relocations.append(found._replace(place=places[name] + offset))
                raw[offset : offset + 8] = 0
            elif abs(value) >= _LEAST_ADDRESS:
                raise ModelError(
                    f"the car cannot be exported: {name}.{field} of the native step points to memory that "
                    "activesteer.coupling.car does not know; Vehicle.native_parts must name it",
                    key=f"{name}.{field}",
                )
        content[places[name] : places[name] + raw.size] = raw.tobytes()
    targets = {name: (known.sure(array), array.size) for name, array in rows.items()}
    return Memory(bytes(content), relocations, known.functions, places, targets)


def _words(array: Any) -> list[tuple[int, str]]:
    """Return offset and field of every machine word of an array of records."""
    if array.dtype.names is None:
        return []
    found: list[tuple[int, str]] = []
    for record in range(array.size):
        for name in array.dtype.names:
            kind, offset = array.dtype.fields[name][:2]
            if kind.base == np.intp:
                count = kind.itemsize // 8
                start = record * array.itemsize + offset
                found += [(start + 8 * index, f"{name}[{index}]" if count > 1 else name) for index in range(count)]
    return found


class _Known:
    """Memory regions that an address may point to."""

    def __init__(self, vehicle: Vehicle, parts: Mapping[str, NDArray[Any]], places: Mapping[str, int]) -> None:
        self.functions: list[str] = []
        engine = ctypes.CDLL(_functions.__file__)
        names = [name for name in dir(_functions) if name.startswith("mj_")]
        self._functions = {
            ctypes.cast(getattr(engine, name), ctypes.c_void_p).value: name for name in names if hasattr(engine, name)
        }
        self._ranges: list[tuple[int, int, Relocation]] = [
            (array.ctypes.data, max(array.nbytes, 1), Relocation(0, SEGMENT, 0, places[name]))
            for name, array in parts.items()
        ]
        # The arrays of the engine come before its structs: mjData holds no array itself.
        for kind, owner in (("model", vehicle.model), ("data", vehicle.data)):
            self._ranges += _arrays(kind, owner)
        self._ranges += [
            (vehicle.model._address, _STRUCT_BYTES["model"], Relocation(0, MODEL, 0, 0)),
            (vehicle.data._address, _STRUCT_BYTES["data"], Relocation(0, DATA, 0, 0)),
        ]

    def target(self, address: int) -> Relocation | None:
        """Return the region and offset of an address, or None for any other number."""
        if address in self._functions:
            name = self._functions[address]
            if name not in self.functions:
                self.functions.append(name)
            return Relocation(0, FUNCTION, self.functions.index(name), 0)
        for start, size, relocation in self._ranges:
            if start <= address < start + size:
                return relocation._replace(added=relocation.added + address - start)
        return None

    def sure(self, array: NDArray[Any]) -> Relocation:
        """Return the region and offset of a known array."""
        found = self.target(array.ctypes.data)
        return Relocation(0, SEGMENT, 0, 0) if found is None or not array.size else found


def _arrays(kind: str, owner: mujoco.MjModel | mujoco.MjData) -> list[tuple[int, int, Relocation]]:
    """Return address, size and position of every array to which a struct of the engine points."""
    words = np.ctypeslib.as_array((ctypes.c_uint64 * (_STRUCT_BYTES[kind] // 8)).from_address(owner._address))
    code, found = {"model": MODEL_ARRAY, "data": DATA_ARRAY}[kind], []
    for name in dir(owner):
        if name.startswith("_"):
            continue
        array = getattr(owner, name)
        if isinstance(array, np.ndarray) and array.size and array.flags.c_contiguous:
            hits = np.flatnonzero(words == np.uint64(array.ctypes.data))
            if hits.size:
                found.append((array.ctypes.data, array.nbytes, Relocation(0, code, 8 * int(hits[0]), 0)))
    return found
