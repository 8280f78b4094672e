"""Controllers in compiled code: any with a shared law (`shared_laws.law_of`), called by the address of its code."""

from __future__ import annotations

import functools
import inspect
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import numpy as np
from numba import carray, from_dtype, types

from activesteer.compilation import address_of, call_at, compiled_call
from activesteer.native_memory import f64_pointer, pointer_to
from activesteer.native_records import NativeBlock, record_type
from activesteer.signals import ActuatorCommand, DriverCommand, Estimate, Measurement, numbers_of, record_fields

N_STEERING: Final = 6
"""Numbers of an `ActuatorCommand` that a controller with a native law decides; the others are 0."""
N_COMMAND: Final = len(numbers_of(ActuatorCommand))
"""Numbers of an `ActuatorCommand`."""
N_HELD: Final = N_COMMAND + len(Estimate._fields) + 1
"""Numbers of a decision: those of the command, of its estimate, and 1 if there is an estimate."""
CALL: Final = (types.intp, types.intp, types.intp, types.intp)
"""Arguments of a law: addresses of its block, of the numbers of a `DriverCommand` and of a `Measurement`, and of the
`N_HELD` numbers to write."""
assert [number.name for number in numbers_of(ActuatorCommand)[:N_STEERING]] == [
    "rear_steer_demand_rad", "superposition_demand_rad", "yaw_rate_desired_radps", "prediction_rad", "correction_rad",
    "saturated",
]  # fmt: skip


call_law: Final = call_at(types.void, *CALL)
"""`call_law(address, (block, command, measurement, held))` in compiled code."""
_command_pointer: Final = pointer_to(from_dtype(np.dtype((np.record, record_fields(DriverCommand)))))
_measured_pointer: Final = pointer_to(from_dtype(np.dtype((np.record, record_fields(Measurement)))))


def law_address(controller: Any) -> int:
    """Return the address of the compiled law of a controller; 0 if it has none, or if somebody watches its `step`."""
    if not isinstance(controller, NativeBlock) or controller.is_watched:
        return 0
    kind = type(controller)
    # A class that inherits a law may change the step.
    if "compiled_in" in vars(kind):
        return import_module(vars(kind)["compiled_in"]).ADDRESS
    return _compiled(kind) if "law" in vars(kind) else 0


@functools.cache
def _compiled(kind: type[Any]) -> int:
    """Return the address of the compiled law of a kind of controller."""
    law, block_pointer = kind.law, pointer_to(from_dtype(record_type(kind)))

    @compiled_call(types.void, *CALL, about=(kind.__name__, Path(inspect.getfile(kind))))
    def decide(block, command, measurement, held):
        answer: Any = law(
            carray(block_pointer(block), (1,))[0],
            carray(_command_pointer(command), (1,))[0],
            carray(_measured_pointer(measurement), (1,))[0],
        )
        numbers = f64_pointer(held)
        numbers[0], numbers[1], numbers[2], numbers[3], numbers[4] = answer[:5]
        numbers[5] = 1.0 if answer[5] else 0.0

    return address_of(decide)
