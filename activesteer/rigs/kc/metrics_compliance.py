"""Metrics of compliance: effects of forces and moments at fixed wheel heights. Each docstring is the definition."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.rigs.kc.definitions import Axle, metric
from activesteer.rigs.kc.sweep import INWARDS
from activesteer.vehicle.curve_axle_model import HOLDING_TENDON

_TRAIL_M: Final = 0.03


def _deg_per_side_force(axle: Axle, angle: str) -> float:
    """Slope of an angle over a side force in phase that points inwards at the evaluated wheel, within 1 kN."""
    slopes = axle.slope("lateral_in_phase", getattr(axle.sweep("lateral_in_phase"), angle))
    return 1e3 * math.degrees(float(np.mean(INWARDS[axle.wheels] * slopes)))


@metric("mm/kN")
def lateral_compliance_centre(axle: Axle) -> float:
    """Motion of the wheel centre with a side force at the contact points, in phase, within 1 kN."""
    return 1e6 * axle.mean_slope("lateral_in_phase", "centre_m", 1)


@metric("mm/kN")
def lateral_compliance_patch(axle: Axle) -> float:
    """Motion of the contact point with a side force at the contact points, in phase, within 1 kN."""
    return 1e6 * axle.mean_slope("lateral_in_phase", "contact_m", 1)


@metric("deg/kN")
def side_force_toe(axle: Axle) -> float:
    """Change of the outer wheel's toe angle per side force, in phase, within 1 kN; positive goes to toe-in.

    The force acts at the contact points, on both wheels in the same direction, at the outer wheel towards the middle of
    the car.
    """
    return _deg_per_side_force(axle, "toe_rad")


@metric("deg/kN")
def side_force_toe_with_trail(axle: Axle) -> float:
    """`side_force_toe` with the force 30 mm behind the contact point, about the pneumatic trail of a tyre."""
    moment = axle.mean_slope("aligning_in_phase", "steer_rad")
    # A force to the right, behind the left wheel's contact point, turns the wheel to the left: toe-out.
    return side_force_toe(axle) - 1e3 * _TRAIL_M * math.degrees(moment)


@metric("deg/kN")
def side_force_toe_opposed(axle: Axle) -> float:
    """Change of toe angle per side force towards the middle of the car on both wheels, within 1 kN."""
    return 1e3 * math.degrees(axle.mean_slope("lateral_opposed", "toe_rad"))


@metric("deg/kN")
def side_force_camber(axle: Axle) -> float:
    """Change of the outer wheel's camber angle per side force, in phase, within 1 kN; positive leans its top out."""
    return _deg_per_side_force(axle, "camber_rad")


@metric("mm/kN")
def longitudinal_compliance_centre(axle: Axle) -> float:
    """Motion of the wheel centre with a longitudinal force at the wheel centres, within 1 kN."""
    return 1e6 * axle.mean_slope("longitudinal_centre", "centre_m", 0)


@metric("mm/kN")
def longitudinal_compliance_braking(axle: Axle) -> float:
    """Motion of the wheel centre with a longitudinal force at the contact points, wheels locked, within 1 kN."""
    return 1e6 * axle.mean_slope("longitudinal_patch", "centre_m", 0)


@metric("mm")
def braking_recession(axle: Axle) -> float:
    """Rearward motion of the wheel centre under 5 kN of braking at each contact point."""
    sweep = axle.sweep("longitudinal_patch")
    return 1e3 * float((sweep.centre_m[sweep.zero, axle.wheels, 0] - sweep.centre_m[0, axle.wheels, 0]).mean())


@metric("deg/kN")
def braking_toe(axle: Axle) -> float:
    """Change of toe angle per braking force at the contact points, wheels locked, within 1 kN; positive is toe-in."""
    return -1e3 * math.degrees(axle.mean_slope("longitudinal_patch", "toe_rad"))


@metric("deg/kN")
def braking_wind_up(axle: Axle) -> float:
    """Rotation of the knuckle per braking force at the contact points, within 1 kN, positive as the wheels roll."""
    return -1e3 * math.degrees(axle.mean_slope("longitudinal_patch", "wind_up_rad"))


@metric("deg/kN")
def driving_toe(axle: Axle) -> float:
    """Change of toe angle per driving force at the wheel centres, within 1 kN; positive is toe-in."""
    return 1e3 * math.degrees(axle.mean_slope("longitudinal_centre", "toe_rad"))


@metric("deg/100Nm")
def aligning_steer(axle: Axle) -> float:
    """Change of steer angle per aligning moment in phase, within 100 N m, positive with the moment."""
    return 100.0 * math.degrees(axle.mean_slope("aligning_in_phase", "steer_rad"))


@metric("deg/100Nm")
def aligning_toe_opposed(axle: Axle) -> float:
    """Change of toe angle per moment towards toe-in on both wheels, within 100 N m."""
    return 100.0 * math.degrees(axle.mean_slope("aligning_opposed", "toe_rad"))


@metric("deg/100Nm")
def aligning_camber(axle: Axle) -> float:
    """Change of camber angle per moment towards toe-in on both wheels, within 100 N m."""
    return 100.0 * math.degrees(axle.mean_slope("aligning_opposed", "camber_rad"))


def _bushes_Npmm(axle: Axle) -> np.ndarray:
    """Stiffness of one of two equal bushes in series in each link, unloaded; nan for an axle without links [N/mm]."""
    model = axle.measured.vehicle.model
    rates = []
    for index in range(model.ntendon):
        name = model.tendon(index).name
        if name.startswith(f"{axle.name[0]}l_") and not name.endswith(("_spring", "_damper", HOLDING_TENDON)):
            rates.append(2e-3 * float(model.tendon_stiffness[index]))
    return np.array(rates or [np.nan])


@metric("kN/mm")
def softest_bush(axle: Axle) -> float:
    """Twice the axial stiffness of the softest link, unloaded: one of its two bushes, if both were alike."""
    return 1e-3 * float(_bushes_Npmm(axle).min())


@metric("kN/mm")
def stiffest_bush(axle: Axle) -> float:
    """Twice the axial stiffness of the stiffest link, unloaded: one of its two bushes, if both were alike."""
    return 1e-3 * float(_bushes_Npmm(axle).max())
