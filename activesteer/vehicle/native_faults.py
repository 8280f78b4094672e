"""Compiled faults of actuators, delayed demands, and faulty readings of sensors."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np
from numba import carray, from_dtype, types

from activesteer.native.compilation import compiled_call, inlined, inlined_by_llvm
from activesteer.native.memory import f64_pointer, pointer_to
from activesteer.native.records import numbers_type
from activesteer.native.shared_laws import shared
from activesteer.vehicle import force_block as fb

IDLE, LISTENS, ACTS = range(3)
"""States of a fault: idle, storing the numbers that it will need, active."""
WORKS, STUCK, RUNAWAY, RUNAWAY_RIGHT, FLOAT, REVERSED, DROPOUT, OFFSET, DELAYED, DEMAND = range(10)
"""Kinds of a fault. An exported car accepts the kinds up to `DROPOUT`. `RUNAWAY` is to the left, or to the strength of
a brake; `DEMAND` is the part of an actuator's fault that acts in every step."""
KINDS: Final = {
    "stuck": STUCK, "runaway": RUNAWAY, "float": FLOAT, "offset": OFFSET, "reversed": REVERSED, "delayed": DELAYED,
    "dropout": DROPOUT,
}  # fmt: skip
"""Numbers of the kinds of fault in files."""
FAULT: Final = numbers_type("amount", words=("state", "kind", "place", "offset", "memory", "capacity"))
"""A fault. `place` is the address of the demand, or the place of the reading among the outputs of the sensors. `offset`
the address that a late demand is written to. `memory` the address of the count of kept numbers, the place of the next
one, and the numbers, of which there is room for `capacity`."""
_pointer: Final = pointer_to(from_dtype(FAULT))


def memory_of(capacity: int) -> np.ndarray:
    """Return an empty memory for a number of values."""
    return np.zeros(2 + capacity)


@shared
def oldest(memory, capacity):
    """Return the oldest stored number."""
    return memory[2 + (int(memory[1]) if memory[0] == capacity else 0)]


@shared
def keep(memory, capacity, value):
    """Store a number, which replaces the oldest one in a full memory."""
    place = int(memory[1])
    memory[2 + place], memory[1] = value, (place + 1) % capacity
    memory[0] = min(memory[0] + 1.0, float(capacity))


@inlined
def give_late(address, count):
    """Apply the delayed demand of each part with a delay fault, before a step."""
    for index in range(count):
        fault = carray(_pointer(address), (count,))[index]
        if fault.kind == DEMAND and fault.state == ACTS:
            memory = f64_pointer(fault.memory)
            late = oldest(memory, fault.capacity) if memory[0] > 0.0 else f64_pointer(fault.place)[0]
            f64_pointer(fault.offset)[0] = late


@inlined
def keep_demands(address, count):
    """Store the demands of parts whose demands are delayed, after a step."""
    for index in range(count):
        fault = carray(_pointer(address), (count,))[index]
        if fault.kind == DEMAND and fault.state != IDLE:
            keep(f64_pointer(fault.memory), fault.capacity, f64_pointer(fault.place)[0])


@inlined
def misread(address, count, outputs):
    """Change the outputs of the faulty sensors, in the order of the faults."""
    for index in range(count):
        fault = carray(_pointer(address), (count,))[index]
        if fault.kind == DEMAND or fault.state == IDLE:
            continue
        memory, good = f64_pointer(fault.memory), outputs[fault.place]
        acts = fault.state == ACTS
        if not (acts and fault.kind == STUCK and memory[0] > 0.0):
            keep(memory, fault.capacity, good)
        if acts:
            reading = 0.0
            if fault.kind in (STUCK, DELAYED):
                reading = oldest(memory, fault.capacity)
            elif fault.kind == OFFSET:
                reading = good + fault.amount
            elif fault.kind == RUNAWAY:
                reading = fault.amount
            elif fault.kind == REVERSED:
                reading = -good
            outputs[fault.place] = reading


PART: Final = numbers_type(
    "ratio", "free_m", words=("variable", "actuator", "record", "has_torque", "act", "qpos", "seized", "backlash")
)
"""An actuator that can fail: place of its input in an exported car, places in the engine of the actuator, of its
activation and of its joint, and places in the force block of its record, of the flag of a seized screw and of its play,
or 0 without a screw. `ratio`: its angle over that of the road wheel; `free_m`: play of a nut off its thread."""
N_HEALTH: Final = 5 + mujoco.mjNGAIN + mujoco.mjNBIAS
"""Numbers of an actuator that faults change."""
_SCALE, _OFFSET, _RATE, _LOW, _HIGH = (
    fb.ACTUATOR.fields[name][1] // 8  # type: ignore[index]
    for name in ("scale", "offset", "rate_limit", "low", "high")
)
_part_pointer: Final = pointer_to(from_dtype(PART))
_N_GAIN, _N_BIAS = mujoco.mjNGAIN, mujoco.mjNBIAS


@inlined
def _exchange(healthy, index, numbers, place, save):
    if save:
        healthy[index] = numbers[place]
    else:
        numbers[place] = healthy[index]


@inlined_by_llvm
def exchange_health(part, block, gain, bias, healthy, save):
    """Save the numbers of a part that faults change, or restore them."""
    places = (part.record + _SCALE, part.record + _OFFSET, part.record + _RATE, part.seized, part.backlash)
    for index in range(len(places)):
        _exchange(healthy, index, block, places[index], save)
    for number in range(_N_GAIN):
        _exchange(healthy, 5 + number, gain, part.actuator * _N_GAIN + number, save)
    for number in range(_N_BIAS):
        _exchange(healthy, 5 + _N_GAIN + number, bias, part.actuator * _N_BIAS + number, save)


@inlined_by_llvm
def fail_part(part, block, gain, bias, healthy, kind, offset, held):
    """Write a fault of an actuator into the model, and replace an earlier fault."""
    exchange_health(part, block, gain, bias, healthy, False)
    record = part.record
    if kind in (WORKS, OFFSET):  # an exported car that works can have an offset
        if offset != 0.0:
            block[record + _OFFSET] = offset * part.ratio
    elif kind == STUCK:
        if part.seized != 0:
            block[part.seized] = 1.0
        elif part.has_torque != 0:
            block[record + _SCALE], block[record + _OFFSET] = 0.0, held
        else:
            # Without a rate the servo holds its present angle, with its stiffness and its strength.
            block[record + _RATE] = 0.0
    elif kind == FLOAT and part.backlash != 0:
        # The nut is off its thread and moves freely between the end stops.
        block[part.backlash] = part.free_m
    elif kind == FLOAT:
        for number in range(_N_GAIN):
            gain[part.actuator * _N_GAIN + number] = 0.0
        for number in range(_N_BIAS):
            bias[part.actuator * _N_BIAS + number] = 0.0
    elif kind == REVERSED:
        block[record + _SCALE] = -1.0
    else:
        # A demand that is delayed is written in every step.
        stop = block[record + (_HIGH if kind == RUNAWAY else _LOW)]
        block[record + _SCALE], block[record + _OFFSET] = 0.0, stop if kind in (RUNAWAY, RUNAWAY_RIGHT) else 0.0


@inlined_by_llvm
def set_fault(part, block, gain, bias, healthy, kind, offset, held):
    """Call `fail_part` by addresses, or save the original numbers if the kind is negative."""
    own = carray(_part_pointer(part), (1,))[0]
    numbers = f64_pointer(block), f64_pointer(gain), f64_pointer(bias), f64_pointer(healthy)
    if kind < 0:
        exchange_health(own, numbers[0], numbers[1], numbers[2], numbers[3], True)
    else:
        fail_part(own, numbers[0], numbers[1], numbers[2], numbers[3], kind, offset, held)


@inlined
def resume_part(part, act, qpos):
    """Release a servo from its current angle, to return with its own lag and rate."""
    if part.seized == 0:
        act[part.act] = qpos[part.qpos]


@inlined
def change_fault(part, block, gain, bias, healthy, acting, kind, offset, ctrl, act, qpos):
    """Change the fault of a part: kind, offset, and demand of a stuck brake."""
    own, before = carray(_part_pointer(part), (1,))[0], f64_pointer(acting)
    if before[0] == FLOAT and kind != FLOAT:
        resume_part(own, f64_pointer(act), f64_pointer(qpos))
    if kind == STUCK and before[0] != STUCK:
        before[2] = f64_pointer(ctrl)[own.actuator]
    before[0], before[1] = kind, offset
    fail_part(
        own, f64_pointer(block), f64_pointer(gain), f64_pointer(bias), f64_pointer(healthy), kind, offset, before[2]
    )


@compiled_call(types.void, types.intp, types.intp, types.intp)
def resume_of(part, act, qpos):
    """Call `resume_part` from Python, by addresses."""
    resume_part(carray(_part_pointer(part), (1,))[0], f64_pointer(act), f64_pointer(qpos))


SET_FAULT: Final = (*(types.intp,) * 6, types.float64, types.float64)
"""Arguments of `set_fault`."""
CHANGE_FAULT: Final = (*(types.intp,) * 6, types.float64, types.float64, *(types.intp,) * 3)
"""Arguments of `change_fault`."""


@compiled_call(types.void, *SET_FAULT)
def fault_of(part, block, gain, bias, healthy, kind, offset, held):
    """Call `set_fault` from Python, by addresses."""
    set_fault(part, block, gain, bias, healthy, kind, offset, held)
