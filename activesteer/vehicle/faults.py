"""Activation of faults of actuators and sensors in a car.

An actuator's fault is written into the model when it begins, and removed when it ends; the steps between cost nothing
more. Only a sensor's fault, and a delay, act in every step. A car without faults is stepped by its own `step`.
"""

from __future__ import annotations

import copy
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any, Final, NamedTuple

import mujoco
from numpy.typing import NDArray

from activesteer.errors import ManeuverError
from activesteer.faults import ACTUATORS, ANGLE_SENSOR, MOTOR, SENSORS, Fault
from activesteer.signals import ActuatorCommand, DriverCommand, Measurement, Motion
from activesteer.vehicle.car import Vehicle
from activesteer.vehicle.motor_records import FULL_TORQUE_NM, HEALTHY
from activesteer.vehicle.named_parts import find

Step = Callable[[DriverCommand, ActuatorCommand], tuple[Measurement, Motion]]
_STOPS: Final = {"left": "high", "right": "low"}


class Stretch(NamedTuple):
    """Steps between which no fault begins or ends.

    Attributes:
        first: The first step.
        last: The step after the last one.
        step: Function that steps the car.
        angle_fails: True if the steering angle sensor fails.
    """

    first: int
    last: int
    step: Step
    angle_fails: bool = False


class Faults:
    """The faults of a run."""

    def __init__(self, vehicle: Vehicle, faults: Sequence[Fault] = ()) -> None:
        """Look up the faulty parts. Nothing is changed yet, except that brakes use sensors that may fail.

        Args:
            vehicle: The car.
            faults: Its faults; times count from the start of the recording.

        Raises:
            ManeuverError: this car does not have one of the parts.
        """
        self._vehicle = vehicle
        self._acting: list[_Acting] = []
        vehicle.put_sensors_between(wanted=any(fault.part in SENSORS for fault in faults))
        for fault in faults:
            if fault.part in SENSORS:
                self._acting.append(_SensorFault(fault, vehicle.timestep_s))
            else:
                members = ACTUATORS[fault.part].members
                if fault.part in ("rear_left", "rear_right") and vehicle.parameters.rear_actuator.is_central:
                    problem = "is no part of this car, whose rear_actuator.arrangement is 'central'; rear is"
                    raise ManeuverError(f"{fault.part!r} {problem}", key="part", value=fault.part, allowed=["rear"])
                kind = _MotorFault if fault.part.startswith(MOTOR) else _ActuatorFault
                self._acting += [kind(fault, name, vehicle) for name in members]

    def stretches(self, first: int, last: int) -> Iterator[Stretch]:
        """Divide a range of steps where a fault begins or ends.

        Args:
            first: First step, counted from the start of the recording.
            last: Step after the last one.

        Yields:
            The stretches; the faults of a stretch are in the model before it is yielded.
        """
        if not self._acting:
            yield Stretch(first, last, self._vehicle.step)
            return
        changes = {step for acting in self._acting for step in (acting.listens, acting.begins, acting.ends)}
        for begin, end in pairwise(sorted({first, last, *(step for step in changes if first < step < last)})):
            self.act(begin)
            watching = [a for a in self._acting if a.watches and a.listens <= begin < a.ends]
            angle_fails = any(a.fault.part == ANGLE_SENSOR and a.begins <= begin for a in watching)
            yield Stretch(begin, end, self._watched(watching, begin) if watching else self._vehicle.step, angle_fails)

    def act(self, step: int) -> None:
        """Activate the faults of a step in the model, and remove the others."""
        for acting in self._acting:
            acting.release()
            if step == acting.ends:
                acting.recover()
        active = [acting for acting in self._acting if acting.begins <= step < acting.ends]
        for acting in active:
            acting.engage()
        self._vehicle.note_faults(len({acting.fault for acting in active}))

    def release(self) -> None:
        """Remove all faults from the model."""
        for acting in self._acting:
            acting.release()
        self._vehicle.note_faults(0)

    def take_memory_of(self, other: Faults) -> None:
        """Take over the memory of faults that stand first here too, and so go on."""
        for acting, before in zip(self._acting, other._acting, strict=False):
            acting.memory = before.memory

    def save_state(self) -> list[Any]:
        """Return the memory of the faults."""
        return copy.deepcopy([acting.memory for acting in self._acting])

    def restore_state(self, state: list[Any]) -> None:
        """Restore a saved state."""
        for acting, memory in zip(self._acting, copy.deepcopy(state), strict=True):
            acting.memory = memory

    def _watched(self, watching: Sequence[_Acting], begin: int) -> Step:
        vehicle = self._vehicle
        delays = [acting for acting in watching if isinstance(acting, _DemandFault)]
        sensors = [(acting, acting.begins <= begin) for acting in watching if isinstance(acting, _SensorFault)]

        def step(driver_command: DriverCommand, actuator_command: ActuatorCommand) -> tuple[Measurement, Motion]:
            for delay in delays:
                delay.before_step()
            measurement, motion = vehicle.step(driver_command, actuator_command)
            for delay in delays:
                delay.after_step()
            for sensor, active in sensors:
                measurement = sensor.read(measurement, active=active)
            if sensors:
                vehicle.note_measurement(measurement)
            return measurement, motion

        return step


class _Acting:
    """A fault in a car.

    Attributes:
        fault: The fault.
        begins: Step at which it begins; `ends`: step from which the part works again.
        delay: Steps by which it delays demands or readings.
        listens: Step from which on it must know the demands.
        watches: Whether it acts in every step.
        memory: The last demands for a delay, or the demand at which a brake sticks.
    """

    def __init__(self, fault: Fault, timestep_s: float) -> None:
        self.fault = fault
        self.begins, never = round(fault.start_s / timestep_s), 2**62
        self.ends = never if fault.end_s is None else max(self.begins + 1, round(fault.end_s / timestep_s))
        self.watches = fault.delay_s is not None
        self.delay = round((fault.delay_s or 0.0) / timestep_s)
        self.listens = self.begins - self.delay
        self.memory: deque[float] = deque(maxlen=max(1, self.delay))

    def engage(self) -> None:
        """Activate the fault in the model, if it acts there."""

    def release(self) -> None:
        """Restore the part as built."""

    def recover(self) -> None:
        """Do what the part needs when the fault ends; a motor returns to its demand with its lag and rate."""


class _DemandFault(_Acting):
    """A fault of a part that follows a demand."""

    _record: NDArray[Any]

    def _demand(self) -> float:
        raise NotImplementedError

    def before_step(self) -> None:
        """Give the part the delayed demand."""
        if self._record["scale"] == 0.0:
            self._record["offset"] = self.memory[0] if self.memory else self._demand()

    def after_step(self) -> None:
        """Keep the demand."""
        self.memory.append(self._demand())


class _ActuatorFault(_DemandFault):
    """A fault of one of the engine's actuators."""

    def __init__(self, fault: Fault, name: str, vehicle: Vehicle) -> None:
        super().__init__(fault, vehicle.timestep_s)
        model = self._model = vehicle.model
        self._index = find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        self._record = vehicle.actuators.of(self._index)
        parts = self._record, model.actuator_gainprm[self._index], model.actuator_biasprm[self._index]
        self._healthy = tuple(part.copy() for part in parts)
        self._screw = vehicle.actuators.screw(self._index)
        self._healthy_screw = tuple(part.copy() for part in self._screw)
        self._data = vehicle.data
        self._ctrl = vehicle.data.ctrl
        ratio = vehicle.parameters.steering.ratio if ACTUATORS[fault.part].by_ratio else 1.0
        self._offset = fault.size * ratio

    def _demand(self) -> float:
        return float(self._ctrl[self._index])

    def engage(self) -> None:
        """Activate the fault."""
        record, kind = self._record, self.fault.kind
        if self._screw and kind == "stuck":
            self._screw[-1]["seized"] = 1.0
        elif len(self._screw) == 2 and kind == "float":
            # The nut is off its thread and moves freely between the end stops.
            self._screw[0]["backlash_m"] = 4.0 * self._screw[1]["stop_m"]
        elif kind == "stuck" and ACTUATORS[self.fault.part].has_torque:
            if not self.memory:
                self.memory.append(self._demand())
            record["scale"], record["offset"] = 0.0, self.memory[0]
        elif kind == "stuck":
            # Without a rate the servo holds its present angle, with its stiffness and its strength.
            record["rate_limit"] = 0.0
        elif kind == "float":
            self._model.actuator_gainprm[self._index] = self._model.actuator_biasprm[self._index] = 0.0
        elif kind == "reversed":
            record["scale"] = -1.0
        elif kind == "offset":
            record["offset"] = self._offset
        else:
            stop = record[_STOPS[self.fault.side or "left"]]
            record["scale"], record["offset"] = 0.0, stop if kind == "runaway" else 0.0

    def release(self) -> None:
        """Restore the actuator as built."""
        index = self._index
        self._record[:], self._model.actuator_gainprm[index], self._model.actuator_biasprm[index] = self._healthy
        for part, healthy in zip(self._screw, self._healthy_screw, strict=True):
            part[:] = healthy

    def recover(self) -> None:
        """Start a servo that was free at its present angle; it returns to its demand with its own lag and rate."""
        if self.fault.kind == "float" and not self._screw:
            angle = self._data.qpos[self._model.jnt_qposadr[self._model.actuator_trnid[self._index, 0]]]
            self._data.act[self._model.actuator_actadr[self._index]] = angle


class _MotorFault(_DemandFault):
    """A fault of an electric motor."""

    def __init__(self, fault: Fault, name: str, vehicle: Vehicle) -> None:
        places = [place for place, _ in vehicle.parameters.motors]
        if (place := name.removeprefix(MOTOR)) not in places:
            motors = [MOTOR + each for each in places]
            problem = f"is no part of this car, which has {', '.join(motors) or 'no electric motor ([motors])'}"
            raise ManeuverError(f"{name!r} {problem}", key="part", value=fault.part, allowed=motors)
        super().__init__(fault, vehicle.timestep_s)
        number = places.index(place)
        self._record = vehicle.electric.motors[number : number + 1]
        self._state = vehicle.electric.states[number : number + 1]

    def _demand(self) -> float:
        return float(self._state["demand_Nm"][0])

    def engage(self) -> None:
        """Activate the fault."""
        record, kind = self._record, self.fault.kind
        if kind == "stuck":
            record["stuck"] = 1.0
        elif kind == "offset":
            record["offset"] = self.fault.size
        else:
            record["scale"] = -1.0 if kind == "reversed" else 0.0
            record["offset"] = FULL_TORQUE_NM if kind == "runaway" else 0.0

    def release(self) -> None:
        """Restore the motor as built."""
        for name, value in HEALTHY.items():
            self._record[name] = value


class _SensorFault(_Acting):
    """A fault of one signal, which changes nothing in the car."""

    def __init__(self, fault: Fault, timestep_s: float) -> None:
        super().__init__(fault, timestep_s)
        self.watches = True
        self._sensor = SENSORS[fault.part]
        self._place = Measurement._fields.index(self._sensor.field)
        # A stuck sensor needs its last reading.
        self.listens = self.begins - max(1, self.delay)
        self.memory = deque(maxlen=self.delay + 1 if self.delay else 1)

    def read(self, measurement: Measurement, *, active: bool) -> Measurement:
        """Return the faulty reading for a true one."""
        whole: Any = measurement[self._place]
        index = self._sensor.wheel
        good = whole if index is None else whole[index]
        if not (active and self.fault.kind == "stuck" and self.memory):
            self.memory.append(good)
        if not active:
            return measurement
        read = self._reading(good)
        if index is not None:
            read = (*whole[:index], read, *whole[index + 1 :])
        return measurement._replace(**{self._sensor.field: read})

    def _reading(self, good: float) -> float:
        kind = self.fault.kind
        if kind in ("stuck", "delayed"):
            return self.memory[0]
        if kind == "offset":
            return good + self.fault.size
        if kind == "runaway":
            return self.fault.size
        return -good if kind == "reversed" else 0.0
