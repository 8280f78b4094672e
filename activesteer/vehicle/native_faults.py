"""Faults that act in every step, in compiled code: demands that come late, and wrong readings of sensors."""

from __future__ import annotations

from typing import Final

import numpy as np
from numba import carray, from_dtype

from activesteer.compilation import inlined
from activesteer.native_memory import f64_pointer, pointer_to
from activesteer.native_records import numbers_type

IDLE, LISTENS, ACTS = range(3)
"""States of a fault: nothing to do; it keeps what it will need; it acts."""
DEMAND, STUCK, DELAYED, OFFSET, RUNAWAY, REVERSED, DROPOUT = range(7)
"""Kinds: a demand that comes late, and the faults of a sensor."""
FAULT: Final = numbers_type("amount", words=("state", "kind", "place", "offset", "memory", "capacity"))
"""A fault. `place` is the address of the demand, or the place of the reading among the outputs of the sensors; `offset`
the address that a late demand is written to; `memory` the address of the count of kept numbers, the place of the next
one, and the numbers, of which there is room for `capacity`."""
_pointer: Final = pointer_to(from_dtype(FAULT))


def memory_of(capacity: int) -> np.ndarray:
    """Return an empty memory."""
    return np.zeros(2 + capacity)


def oldest(memory, capacity):
    """Return the oldest kept number."""
    return memory[2 + (int(memory[1]) if memory[0] == capacity else 0)]


def keep(memory, capacity, value):
    """Keep a number, instead of the oldest one if the memory is full."""
    place = int(memory[1])
    memory[2 + place], memory[1] = value, (place + 1) % capacity
    memory[0] = min(memory[0] + 1.0, float(capacity))


_oldest, _keep = inlined(oldest), inlined(keep)


@inlined
def give_late(address, count):
    """Give each part whose demands come late its demand, before a step."""
    for index in range(count):
        fault = carray(_pointer(address), (count,))[index]
        if fault.kind == DEMAND and fault.state == ACTS:
            memory = f64_pointer(fault.memory)
            late = _oldest(memory, fault.capacity) if memory[0] > 0.0 else f64_pointer(fault.place)[0]
            f64_pointer(fault.offset)[0] = late


@inlined
def keep_demands(address, count):
    """Keep the demands that come late, after a step."""
    for index in range(count):
        fault = carray(_pointer(address), (count,))[index]
        if fault.kind == DEMAND and fault.state != IDLE:
            _keep(f64_pointer(fault.memory), fault.capacity, f64_pointer(fault.place)[0])


@inlined
def misread(address, count, outputs):
    """Change the outputs of the sensors, in the order of the faults."""
    for index in range(count):
        fault = carray(_pointer(address), (count,))[index]
        if fault.kind == DEMAND or fault.state == IDLE:
            continue
        memory, good = f64_pointer(fault.memory), outputs[fault.place]
        acts = fault.state == ACTS
        if not (acts and fault.kind == STUCK and memory[0] > 0.0):
            _keep(memory, fault.capacity, good)
        if acts:
            reading = 0.0
            if fault.kind in (STUCK, DELAYED):
                reading = _oldest(memory, fault.capacity)
            elif fault.kind == OFFSET:
                reading = good + fault.amount
            elif fault.kind == RUNAWAY:
                reading = fault.amount
            elif fault.kind == REVERSED:
                reading = -good
            outputs[fault.place] = reading
