"""Rates with which the actuators of a car turn its wheels."""

from __future__ import annotations

import math
from typing import NamedTuple

import mujoco

from activesteer.vehicle.electric_actuators import NAME, ElectricActuator, known
from activesteer.vehicle.parameters import VehicleParameters
from activesteer.vehicle.toe_links import screw_records


class SteeringRates(NamedTuple):
    """Rates at the road wheels [rad/s]; infinite without such an actuator.

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
