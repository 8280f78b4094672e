"""Activation of faults of actuators and sensors in a car.

An actuator's fault is written into the model when it begins, and removed when it ends; the steps between cost nothing
more. Only a sensor's fault, and a delay, act in every step. A car without faults is stepped by its own `step`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.config.faults import ACTUATORS, ANGLE_SENSOR, MOTOR, SENSORS, Fault
from activesteer.core.conventions import Array
from activesteer.errors import ManeuverError
from activesteer.vehicle import force_block as fb
from activesteer.vehicle import native_faults as native
from activesteer.vehicle.car import Vehicle
from activesteer.vehicle.electric_actuators import FULL_TORQUE_NM, HEALTHY
from activesteer.vehicle.force_block import find

_NEVER: Final = 2**62
_SAVE: Final = -1


class Faults:
    """The faults of a run."""

    def __init__(self, vehicle: Vehicle, faults: Sequence[Fault] = ()) -> None:
        """Look up the faulty parts, and insert sensors for the brakes if a sensor can fail."""
        self._vehicle = vehicle
        self._acting: list[_Acting] = []
        vehicle.put_sensors_between(wanted=any(fault.part in SENSORS for fault in faults))
        for fault in faults:
            if fault.part in SENSORS:
                self._acting.append(_SensorFault(fault, vehicle))
            else:
                members = ACTUATORS[fault.part].members
                if fault.part in ("rear_left", "rear_right") and vehicle.parameters.rear_actuator.is_central:
                    problem = "is not a part of this car, whose rear_actuator.arrangement is 'central'; rear is"
                    raise ManeuverError(f"{fault.part!r} {problem}", key="part", value=fault.part, allowed=["rear"])
                kind = _MotorFault if fault.part.startswith(MOTOR) else _ActuatorFault
                self._acting += [kind(fault, name, vehicle) for name in members]
        self._records = np.zeros(len(self._acting), native.FAULT)
        for acting, record in zip(self._acting, self._records, strict=True):
            acting.bind(record)
        vehicle.act_in_every_step(self._records)

    def next_change(self, step: int) -> int:
        """Return the first step after this one when a fault begins or ends."""
        changes = (change for acting in self._acting for change in (acting.listens, acting.begins, acting.ends))
        return min((change for change in changes if change > step), default=_NEVER)

    @property
    def angle_fails(self) -> bool:
        """True if the steering angle sensor fails now."""
        return any(acting.fault.part == ANGLE_SENSOR and acting.state == native.ACTS for acting in self._acting)

    def act(self, step: int) -> None:
        """Activate the faults of a step in the model, and remove all others."""
        for acting in self._acting:
            acting.release()
            if step == acting.ends:
                acting.recover()
            acting.turn(step)
        active = [acting for acting in self._acting if acting.begins <= step < acting.ends]
        for acting in active:
            acting.engage()
        self._vehicle.note_faults(len({acting.fault for acting in active}))

    def release(self) -> None:
        """Remove all faults from the model."""
        for acting in self._acting:
            acting.release()
        self._vehicle.note_faults(0)
        self._vehicle.act_in_every_step(None)

    def take_memory_of(self, other: Faults) -> None:
        """Copy the memory of the faults that both lists start with, so that these faults continue."""
        for acting, before in zip(self._acting, other._acting, strict=False):
            acting.memory[:] = before.memory

    def save_state(self) -> list[Array]:
        """Return the memory of the faults."""
        return [acting.memory.copy() for acting in self._acting]

    def restore_state(self, state: list[Array]) -> None:
        """Restore saved memory of the faults."""
        for acting, memory in zip(self._acting, state, strict=True):
            acting.memory[:] = memory


class _Acting:
    """A fault that is active from step `begins` to `ends`, and stores demands from step `listens` on."""

    def __init__(self, fault: Fault, timestep_s: float) -> None:
        self.fault = fault
        self.begins = round(fault.start_s / timestep_s)
        self.ends = _NEVER if fault.end_s is None else max(self.begins + 1, round(fault.end_s / timestep_s))
        self._watches = fault.delay_s is not None
        self.delay = round((fault.delay_s or 0.0) / timestep_s)  # steps by which demands or readings are late
        self.listens = self.begins - self.delay
        self.memory = native.memory_of(max(1, self.delay))  # the last of them, see `native_faults.FAULT`

    @property
    def _capacity(self) -> int:
        return self.memory.size - 2

    @property
    def state(self) -> int:
        """Current state of the fault in compiled code (see `set_fault`)."""
        return int(self._own["state"])

    def bind(self, record: Any) -> None:
        """Write the fault into its record for compiled code."""
        self._own = record
        record["memory"], record["capacity"] = self.memory.ctypes.data, self._capacity

    def turn(self, step: int) -> None:
        """Set the state of the fault: idle, storing demands, or active."""
        listens = self._watches and self.listens <= step < self.ends
        self._own["state"] = (native.ACTS if self.begins <= step else native.LISTENS) if listens else native.IDLE

    def engage(self) -> None:
        """Activate the fault in the model, if it is a fault of the model."""

    def release(self) -> None:
        """Restore the original part."""

    def recover(self) -> None:
        """Let the part recover when the fault ends, for example with the lag and rate of a motor."""


class _DemandFault(_Acting):
    """A fault of a part that follows a demand."""

    _record: NDArray[Any]
    _demand: NDArray[Any]

    def bind(self, record: Any) -> None:
        """Write the fault into its record for compiled code."""
        super().bind(record)
        record["kind"] = native.DEMAND
        record["place"], record["offset"] = self._demand.ctypes.data, self._record["offset"].ctypes.data


def part_of(vehicle: Vehicle, part: str, name: str) -> NDArray[Any]:
    """Return an actuator of the part as a `PART` record for compiled code."""
    model, about, record = vehicle.model, ACTUATORS[part], np.zeros(1, native.PART)
    index = find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
    block = fb.header_of(model).ctypes.data
    screw = vehicle.actuators.screw(index)

    def place(view: NDArray[Any]) -> int:
        return (view.ctypes.data - block) // 8

    record["actuator"], record["record"] = index, place(vehicle.actuators.of(index))
    record["has_torque"] = about.has_torque
    record["act"] = model.actuator_actadr[index]
    record["qpos"] = model.jnt_qposadr[model.actuator_trnid[index, 0]]
    record["ratio"] = vehicle.parameters.steering.ratio if about.by_ratio else 1.0
    if screw:
        record["seized"] = place(screw[-1]["seized"])
    if len(screw) == 2:
        record["backlash"], record["free_m"] = place(screw[0]["backlash_m"]), 4.0 * screw[1]["stop_m"][0]
    return record


class _ActuatorFault(_DemandFault):
    """A fault of one of the engine's actuators."""

    def __init__(self, fault: Fault, name: str, vehicle: Vehicle) -> None:
        super().__init__(fault, vehicle.timestep_s)
        self._model, self._data = vehicle.model, vehicle.data
        self._part = part_of(vehicle, fault.part, name)
        index = self._part["actuator"][0]
        self._record = vehicle.actuators.of(index)
        self._demand = vehicle.data.ctrl[index : index + 1]
        self._healthy = np.zeros(native.N_HEALTH)
        self._kind = native.RUNAWAY_RIGHT if fault.side == "right" else native.KINDS[fault.kind]
        self._set(_SAVE)

    def _set(self, kind: int, offset: float = 0.0, held: float = 0.0) -> None:
        model = self._model
        native.fault_of(
            self._part.ctypes.data, fb.header_of(model).ctypes.data, model.actuator_gainprm.ctypes.data,
            model.actuator_biasprm.ctypes.data, self._healthy.ctypes.data, kind, offset, held,
        )  # fmt: skip

    def engage(self) -> None:
        """Activate the fault of the actuator in the model."""
        held = 0.0
        if self._kind == native.STUCK:
            if not self.memory[0]:
                native.keep(self.memory, self._capacity, float(self._demand[0]))
            held = native.oldest(self.memory, self._capacity)
        self._set(self._kind, self.fault.size if self.fault.kind == "offset" else 0.0, held)

    def release(self) -> None:
        """Restore the original actuator."""
        self._set(native.WORKS)

    def recover(self) -> None:
        """Let a servo return from its current angle after a fault that left it free (see `resume_part`)."""
        if self._kind == native.FLOAT:
            native.resume_of(self._part.ctypes.data, self._data.act.ctypes.data, self._data.qpos.ctypes.data)


class _MotorFault(_DemandFault):
    """A fault of an electric motor."""

    def __init__(self, fault: Fault, name: str, vehicle: Vehicle) -> None:
        places = [place for place, _ in vehicle.parameters.motors]
        if (place := name.removeprefix(MOTOR)) not in places:
            motors = [MOTOR + each for each in places]
            problem = f"is not a part of this car, which has {', '.join(motors) or 'no electric motor ([motors])'}"
            raise ManeuverError(f"{name!r} {problem}", key="part", value=fault.part, allowed=motors)
        super().__init__(fault, vehicle.timestep_s)
        number = places.index(place)
        self._record = vehicle.electric.motors[number : number + 1]
        self._demand = vehicle.electric.states[number : number + 1]["demand_Nm"]

    def engage(self) -> None:
        """Activate the fault of the motor."""
        record, kind = self._record, self.fault.kind
        if kind == "stuck":
            record["stuck"] = 1.0
        elif kind == "offset":
            record["offset"] = self.fault.size
        else:
            record["scale"] = -1.0 if kind == "reversed" else 0.0
            record["offset"] = FULL_TORQUE_NM if kind == "runaway" else 0.0

    def release(self) -> None:
        """Restore the original motor."""
        for name, value in HEALTHY.items():
            self._record[name] = value


class _SensorFault(_Acting):
    """A fault of one signal, which does not change the car."""

    def __init__(self, fault: Fault, vehicle: Vehicle) -> None:
        super().__init__(fault, vehicle.timestep_s)
        self._watches = True
        # A stuck sensor needs its last reading.
        self.listens = self.begins - max(1, self.delay)
        self.memory = native.memory_of(self.delay + 1 if self.delay else 1)

    def bind(self, record: Any) -> None:
        """Write the fault into its record for compiled code."""
        super().bind(record)
        record["kind"], record["place"] = native.KINDS[self.fault.kind], list(SENSORS).index(self.fault.part)
        record["amount"] = self.fault.size
