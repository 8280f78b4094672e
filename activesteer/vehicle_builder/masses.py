"""The chassis as what is left of the whole car, and the whole car as the sum of its bodies."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.errors import ParameterError
from activesteer.vehicle_builder.design import Car, Log, Solid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Whole:
    """Mass, centre of gravity and inertia tensor about it [kg, m, kg m2]."""

    mass_kg: float
    cg_m: Array
    inertia_kgm2: Array


def whole(model: mujoco.MjModel, *, without_chassis: bool = False) -> Whole:
    """Mass properties of a car in its design position.

    Args:
        model: The car.
        without_chassis: Leave its body out.
    """
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    left_out = {0, model.body("chassis").id} if without_chassis else {0}
    bodies = [body for body in range(model.nbody) if body not in left_out]
    mass = float(sum(model.body_mass[body] for body in bodies))
    cg = np.sum([model.body_mass[body] * data.xipos[body] for body in bodies], axis=0) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        axes = data.ximat[body].reshape(3, 3)
        inertia += axes @ np.diag(model.body_inertia[body]) @ axes.T
        inertia += float(model.body_mass[body]) * _steiner(data.xipos[body] - cg)
    return Whole(mass, cg, inertia)


def _steiner(offset: Array) -> Array:
    return np.asarray(offset @ offset * np.eye(3) - np.outer(offset, offset))


def chassis_of(car: Car, model: mujoco.MjModel, log: Log) -> Solid:
    """The chassis: as the table gives it, or what is left of the whole car.

    Args:
        car: The car.
        model: It, with any chassis.
        log: Where assumptions go.

    Raises:
        ParameterError: nothing possible is left.
    """
    table, others = car.table.mass, whole(model, without_chassis=True)
    base = car.wheelbase_m
    if table.chassis_kg is not None and table.chassis_cg is not None:
        inertia = table.chassis_inertia_kgm2
        if inertia is None:
            inertia = _usual_inertia(table.chassis_kg, base, car, 0.5)
            log.note("mass.chassis_inertia_kgm2", _words(inertia), _INERTIA_RULE)
        return Solid(table.chassis_kg, np.array(table.chassis_cg), np.array(inertia))
    if table.total_kg is None or table.front_share is None or table.cg_height_m is None:
        msg = "mass: total_kg, front_share and cg_height_m are needed, or chassis_kg and chassis_cg"
        raise ParameterError(msg)
    mass = table.total_kg - others.mass_kg
    cg = np.array([_cg_x(car, table.front_share), 0.0, table.cg_height_m])
    if mass < 0.3 * table.total_kg:
        msg = f"mass.total_kg: wheels, knuckles and rack weigh {others.mass_kg:.0f} kg of {table.total_kg:.0f} kg"
        raise ParameterError(msg)
    chassis_cg = (table.total_kg * cg - others.mass_kg * others.cg_m) / mass
    chassis_cg[1] = 0.0
    inertia = table.inertia_kgm2
    if inertia is None:
        inertia = _usual_inertia(table.total_kg, base, car, table.front_share)
        log.note("mass.inertia_kgm2", _words(inertia), _INERTIA_RULE)
    left = np.diag(np.array(inertia)).astype(float) - others.inertia_kgm2
    left -= others.mass_kg * _steiner(others.cg_m - cg) + mass * _steiner(chassis_cg - cg)
    own = np.diag(left)
    if own.min() <= 0.0 or 2.0 * own.max() > own.sum():
        msg = (
            f"mass.inertia_kgm2: of {_words(inertia)} kg m2 of the whole car {_words(own)} are left for the chassis "
            "when wheels and suspensions are taken away; no body has such an inertia (each at most both others)"
        )
        raise ParameterError(msg)
    return Solid(mass, chassis_cg, own)


_INERTIA_RULE = (
    "yaw 0.91 m l_f l_r, pitch 0.95 of yaw, roll with a radius of gyration of 0.4 of the track: the compact's"
)


def _usual_inertia(mass: float, base: float, car: Car, front_share: float) -> tuple[float, float, float]:
    to_front = (1.0 - front_share) * base
    yaw = 0.915 * mass * to_front * (base - to_front)
    track = car.front.wheel_centre_m[1] + car.rear.wheel_centre_m[1]
    return round(mass * (0.4 * track) ** 2, 1), round(0.95 * yaw, 1), round(yaw, 1)


def _cg_x(car: Car, front_share: float) -> float:
    """From the weights on the contact points, which lie below the wheel centres but for camber."""
    rear, front = car.rear.wheel_centre_m[0], car.front.wheel_centre_m[0]
    return float(rear + front_share * (front - rear))


def _words(values: tuple[float, ...] | Array) -> str:
    return ", ".join(f"{value:.1f}" for value in values)
