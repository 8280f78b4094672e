"""`lqr` with its estimator in compiled code."""

from __future__ import annotations

from typing import Any, Final

from numba import carray, from_dtype, types

from activesteer.controllers.lqr import Lqr, regulated
from activesteer.core.signals import DriverCommand, Measurement, numbers_of
from activesteer.estimation.advance import advance
from activesteer.estimation.records import KNOWN, MEMORY, SAID
from activesteer.estimation.setup import GRID
from activesteer.native.compilation import address_of, compiled_call
from activesteer.native.memory import CALL, N_COMMAND, N_HELD, f64_pointer, pointer_to
from activesteer.native.records import record_type

_MEASURED: Final = [number.name for number in numbers_of(Measurement)]
_SAID, _REAR, _SUPERPOSITION, _PRESSURES = map(
    _MEASURED.index, ("yaw_rate_radps", "rear_steer_rad", "superposition_rad", "fl_brake_pressure_Pa")
)
_FRONT, _PEDAL = (
    [number.name for number in numbers_of(DriverCommand)].index(name)
    for name in ("front_steer_demand_rad", "brake_pedal")
)
# The estimator takes the numbers of a measurement as they are.
_N_MEASURED: Final = len(_MEASURED)
assert [name.replace("wheel_speed", "spin").replace("brake_", "") for name in _MEASURED[_SAID:]] == [*SAID]

_block_pointer: Final = pointer_to(from_dtype(record_type(Lqr)))
_known_pointer: Final = pointer_to(from_dtype(KNOWN))
_memory_pointer: Final = pointer_to(from_dtype(MEMORY))


@compiled_call(types.void, *CALL)
def lqr(block_address, command, measurement, held_address):
    """Write the result of `Lqr.step`, with the arguments of `native_memory.CALL`."""
    block = carray(_block_pointer(block_address), (1,))[0]
    parts = block._estimator
    memory = carray(_memory_pointer(parts._memory.address), (1,))
    measured: Any = carray(f64_pointer(measurement), (_N_MEASURED,))
    advance(
        carray(_known_pointer(parts._known.address), (1,)),
        carray(f64_pointer(parts._tyres.address), (2, GRID[0], GRID[1])),
        memory,
        measured[_SAID:],
        carray(f64_pointer(parts._line.address), (parts._line.size // len(SAID), len(SAID))),
    )
    now, held = memory[0].estimate, carray(f64_pointer(held_address), (N_HELD,))
    driver = f64_pointer(command)
    answer = regulated(
        block, now, memory[0].innovation, driver[_FRONT], driver[_PEDAL], measured[_SUPERPOSITION], measured[_REAR],
        measured[_PRESSURES:],
    )  # fmt: skip
    held[0], held[1], held[2], held[3], held[4] = answer[:5]
    held[5] = 1.0 if answer[5] else 0.0
    for index in range(len(now)):
        held[N_COMMAND + index] = now[index]
    held[N_HELD - 1] = 1.0


ADDRESS: Final = address_of(lqr)
