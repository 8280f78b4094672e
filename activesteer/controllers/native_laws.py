"""Controllers whose law compiled code can carry out: their records, and a call of any of them."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numba import types
from numpy.typing import NDArray

from activesteer.compilation import call_at, inlined
from activesteer.controllers.front_superposition import FrontSuperposition, front_superposition
from activesteer.controllers.law_interface import CALL
from activesteer.controllers.lqr import Lqr
from activesteer.controllers.no_control import NoControl, no_control
from activesteer.controllers.rear_steer import RearSteer, rear_steer
from activesteer.native_blocks import record_type, take, values
from activesteer.native_memory import f64_pointer
from activesteer.signals import Measurement, numbers_of

LAWS: Final[tuple[type[Any] | None, ...]] = (None, NoControl, RearSteer, FrontSuperposition, Lqr)
"""Controllers whose law compiled code can carry out, by their number; 0 is no such controller."""
CALLED: Final = LAWS.index(Lqr)
"""Laws from this number on are called by their address, and compiled when they are needed."""
UNIT: Final = [
    *((name, np.intp) for name in ("called", "block")),
    *((f"law_{index}", record_type(kind)) for index, kind in enumerate(LAWS[:CALLED]) if kind is not None),
]
"""Fields of a record with a controller: address of its law and of its block if it is called, otherwise its block."""
_call: Final = call_at(types.void, *CALL)
_MEASURED: Final = [number.name for number in numbers_of(Measurement)]
_SPEED, _YAW_RATE = map(_MEASURED.index, ("speed_mps", "yaw_rate_radps"))
_ARS, _AFS = LAWS.index(RearSteer), LAWS.index(FrontSuperposition)


def put(records: NDArray[Any], index: int, law: int, controller: Any) -> NDArray[Any] | None:
    """Copy the attributes of a controller into a record with the fields of `UNIT`.

    Args:
        records: The records.
        index: Number of the record.
        law: Number of the controller in `LAWS`.
        controller: The controller, which owns the memory of its arrays.

    Returns:
        The block of a called law, which must outlive the record; otherwise None.
    """
    if law < CALLED:
        records[f"law_{law}"][index] = values(controller)
        return None
    from activesteer.controllers.native_lqr import ADDRESS  # noqa: PLC0415 - compiled when it is needed

    block = np.array([values(controller)], record_type(type(controller)))
    records["called"][index], records["block"][index] = ADDRESS, block.ctypes.data
    return block


def fetch(records: NDArray[Any], index: int, law: int, controller: Any, block: NDArray[Any] | None) -> None:
    """Copy a record back into a controller; arguments as in `put`, with its result."""
    take(controller, (records[f"law_{law}"][index] if block is None else block[0]).item())


@inlined
def decide(unit, law, measurement, front_rad, brake_pedal, held):
    """Write the numbers that a controller decides.

    Args:
        unit: Record with the fields of `UNIT`; changed.
        law: Number of the controller in `LAWS`.
        measurement: Address of the numbers of a `Measurement`.
        front_rad: The driver's angle at the road wheel [rad].
        brake_pedal: Brake pedal position, 0 to 1.
        held: Address of the numbers, `N_STEERING`, or `N_HELD` of a called law.
    """
    if law >= CALLED:
        _call(unit.called, (unit.block, measurement, front_rad, brake_pedal, held))
    else:
        measured, numbers = f64_pointer(measurement), f64_pointer(held)
        speed, yaw_rate = measured[_SPEED], measured[_YAW_RATE]
        if law == _ARS:
            answer = rear_steer(unit.law_2, front_rad, speed, yaw_rate)
        elif law == _AFS:
            answer = front_superposition(unit.law_3, front_rad, speed, yaw_rate)
        else:
            answer = no_control(unit.law_1, front_rad, speed, yaw_rate)
        numbers[0], numbers[1], numbers[2], numbers[3], numbers[4] = answer[:5]
        numbers[5] = 1.0 if answer[5] else 0.0
