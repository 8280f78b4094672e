"""Metrics of the support by the links in braking and driving, with the values of the whole car that they need."""

from __future__ import annotations

import math

from activesteer.rigs.kc.definitions import Axle, metric


def _support(axle: Axle, point: str) -> float:
    """Slope of the path of a point in side view, forwards per upwards, in parallel travel without springs."""
    sweep = axle.sweep("parallel_kinematic")
    return float(axle.slope("parallel_kinematic", getattr(sweep, point)[..., 0], over=sweep.centre_m[..., 2]).mean())


def _wheelbase_over_height(axle: Axle) -> float:
    """Wheelbase over height of the whole car's centre of gravity [-]."""
    return wheelbase(Axle("car", axle.measured)) / cg_height(Axle("car", axle.measured))


@metric("%", "front")
def anti_dive(axle: Axle) -> float:
    """Fraction of the dive that the front links prevent: brake fraction x l/h x slope of the locked wheel's patch.

    Positive if the contact point of the wheel, locked to its knuckle, moves forwards in bump. Links unloaded, brake
    distribution at full pedal (Gillespie 1992, ch. 7; Milliken 1995, ch. 17).
    """
    return 100.0 * _brake_fraction(axle) * _wheelbase_over_height(axle) * _support(axle, "patch_m")


@metric("%", "rear")
def anti_lift(axle: Axle) -> float:
    """Fraction of the rear lift in braking that the rear links prevent: anti-dive with the sign of a rear axle.

    Positive if the contact point of the wheel, locked to its knuckle, moves rearwards in bump.
    """
    return -100.0 * _brake_fraction(axle) * _wheelbase_over_height(axle) * _support(axle, "patch_m")


@metric("%", "front")
def anti_lift_drive(axle: Axle) -> float:
    """Fraction of the front lift in acceleration that the front links prevent, if only half-shafts drive this axle.

    l/h x slope of the wheel centre's path, positive if the wheel centre moves forwards in bump.
    """
    return 100.0 * _wheelbase_over_height(axle) * _support(axle, "centre_m")


@metric("%", "rear")
def anti_squat(axle: Axle) -> float:
    """Fraction of the squat in acceleration that the rear links prevent, if only half-shafts drive this axle.

    l/h x slope of the wheel centre's path, positive if it moves rearwards in bump (Gillespie 1992, ch. 7).
    """
    return -100.0 * _wheelbase_over_height(axle) * _support(axle, "centre_m")


def _brake_fraction(axle: Axle) -> float:
    brakes = axle.measured.parameters.brakes
    torque = brakes.front_torque_Nm if axle.name == "front" else brakes.rear_torque_Nm
    total = brakes.front_torque_Nm + brakes.rear_torque_Nm
    return torque / total if total > 0.0 else math.nan


@metric("mm", "car")
def wheelbase(axle: Axle) -> float:
    """Distance of the contact points of front and rear axle along the standing car (ISO 8855)."""
    sweep = axle.sweep("parallel_travel")
    x = sweep.contact_m[sweep.zero, :, 0]
    return 1e3 * float(x[:2].mean() - x[2:].mean())


@metric("mm", "car")
def cg_height(axle: Axle) -> float:
    """Height of the whole car's centre of gravity over the road, driver included."""
    return 1e3 * float(axle.measured.vehicle.data.subtree_com[0, 2])


@metric("kg", "car")
def mass(axle: Axle) -> float:
    """Mass of the whole car, driver included."""
    return float(axle.measured.vehicle.model.body_subtreemass[0])


@metric("%", "car")
def front_load_fraction(axle: Axle) -> float:
    """Fraction of the weight on the front axle of the standing car."""
    load = axle.load_N
    return 100.0 * float(load[:2].sum() / load.sum())
