"""The chassis as the rest of the whole car."""

from __future__ import annotations

import mujoco
import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ParameterError
from activesteer.vehicle.statics import mass_properties, point_mass_inertia
from activesteer.vehicle_builder.design import Car, Log, Solid


def chassis_of(car: Car, model: mujoco.MjModel, log: Log) -> Solid:
    """Return the chassis of the table, or the rest of the whole car without its other bodies.

    Raises:
        ParameterError: the rest is impossible for a body.
    """
    table, others = car.table.mass, mass_properties(model, without=["chassis"])
    base = car.wheelbase_m
    if table.chassis_kg is not None and table.chassis_cg is not None:
        inertia = table.chassis_inertia_kgm2
        if inertia is None:
            inertia = _usual_inertia(table.chassis_kg, base, car, 0.5)
            log.note("mass.chassis_inertia_kgm2", _words(inertia), _INERTIA_RULE)
        return Solid(table.chassis_kg, np.array(table.chassis_cg), np.array(inertia))
    if table.total_kg is None or table.front_fraction is None or table.cg_height_m is None:
        raise ParameterError(
            "total_kg, front_fraction and cg_height_m are needed, or chassis_kg and chassis_cg", key="mass"
        )
    mass = table.total_kg - others.mass_kg
    cg = np.array([_cg_x(car, table.front_fraction), 0.0, table.cg_height_m])
    if mass < 0.3 * table.total_kg:
        raise ParameterError(
            f"wheels, knuckles and rack weigh {others.mass_kg:.0f} kg of {table.total_kg:.0f} kg", key="mass.total_kg"
        )
    chassis_cg = (table.total_kg * cg - others.mass_kg * others.cg_m) / mass
    chassis_cg[1] = 0.0
    inertia = table.inertia_kgm2
    if inertia is None:
        inertia = _usual_inertia(table.total_kg, base, car, table.front_fraction)
        log.note("mass.inertia_kgm2", _words(inertia), _INERTIA_RULE)
    left = np.diag(np.array(inertia)).astype(float) - others.inertia_kgm2
    left -= others.mass_kg * point_mass_inertia(others.cg_m - cg) + mass * point_mass_inertia(chassis_cg - cg)
    own = np.diag(left)
    if own.min() <= 0.0 or 2.0 * own.max() > own.sum():
        raise ParameterError(
            f"of {_words(inertia)} kg m2 of the whole car {_words(own)} are left for the chassis "
            "when wheels and suspensions are taken away; no body has such an inertia (each at most both others)",
            key="mass.inertia_kgm2",
        )
    return Solid(mass, chassis_cg, own)


_INERTIA_RULE = (
    "yaw 0.91 m l_f l_r, pitch 0.95 of yaw, roll with a radius of gyration of 0.4 of the track: the compact's"
)


def _usual_inertia(mass: float, base: float, car: Car, front_fraction: float) -> tuple[float, float, float]:
    to_front = (1.0 - front_fraction) * base
    yaw = 0.915 * mass * to_front * (base - to_front)
    track = car.front.wheel_centre_m[1] + car.rear.wheel_centre_m[1]
    return round(mass * (0.4 * track) ** 2, 1), round(0.95 * yaw, 1), round(yaw, 1)


def _cg_x(car: Car, front_fraction: float) -> float:
    """Return x of the centre of gravity from the weights on the contact points, below the wheel centres."""
    rear, front = car.rear.wheel_centre_m[0], car.front.wheel_centre_m[0]
    return float(rear + front_fraction * (front - rear))


def _words(values: tuple[float, ...] | Array) -> str:
    return ", ".join(f"{value:.1f}" for value in values)
