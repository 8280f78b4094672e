"""Access to the actuators' records in the block of the native forces, and the rates of the actuators."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.vehicle import force_block as fb
from activesteer.vehicle.electric_actuators import NAME, ElectricActuator, known
from activesteer.vehicle.engine_layout import find
from activesteer.vehicle.parameters import VehicleParameters
from activesteer.vehicle.toe_links import SCREW, screw_records


class ActuatorRecords:
    """Views of the records of a compiled car. A change acts from the next step on."""

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
        """Return the records of link and screw of an actuator, of its motor alone if no link follows, or nothing."""
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
        """Return activations of the rear steering actuators at rest at an angle [rad], by their addresses."""
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
    """Rates at the road wheels [rad/s], or infinite without such an actuator.

    Attributes:
        rear: Rear steering.
        superposition: Front superposition.
    """

    rear: float
    superposition: float


def steering_rates(model: mujoco.MjModel, parameters: VehicleParameters) -> SteeringRates:
    """Return the rates of the actuators without load, near the middle of their travel."""
    rear, superposition = parameters.rear_actuator, parameters.superposition_actuator
    present = {model.actuator(index).name for index in range(model.nu)}
    front_radps = rear_radps = math.inf
    if rear.is_screw:
        kind = rear.resolved()
        # The travel of a screw over the angle of its wheel, near the middle.
        rear_radps = min(
            _speed_radps(kind) * float(screw["lead_mprad"][0]) / abs(float(screw["travel"][0][0]))
            for screw in screw_records(model, kind).screws
        )
    elif "rl_steer" in present:
        rear_radps = float(model.actuator("rl_steer").dynprm[1])
    if superposition.is_geared:
        front_radps = _speed_radps(superposition.resolved()) / known(superposition.resolved().gear)
    elif NAME in present:
        front_radps = float(model.actuator(NAME).dynprm[1])
    return SteeringRates(rear_radps, front_radps / parameters.steering.ratio)


def _speed_radps(actuator: ElectricActuator) -> float:
    return min(known(actuator.speed_limit_radps), known(actuator.no_load_speed_radps) * actuator.voltage_ratio)
