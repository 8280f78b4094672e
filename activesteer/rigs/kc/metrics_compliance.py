"""Metrics of compliance: what forces and moments do at fixed wheel heights. The docstring of each is its definition."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.rigs.kc.definitions import SMALL_FORCE_N, SMALL_MOMENT_NM, Axle, metric
from activesteer.rigs.kc.metrics_kinematics import outer_sign
from activesteer.vehicle.guide_model import GUIDE

_TRAIL_M: Final = 0.03


def _per_side_force(axle: Axle, values: np.ndarray) -> float:
    """Slope over a side force in phase that points inwards at the wheel that is read, within 1 kN."""
    return float(np.mean(outer_sign(axle) * axle.slope("lateral_in_phase", values, SMALL_FORCE_N)))


@metric("mm/kN")
def lateral_compliance_centre(axle: Axle) -> float:
    """Motion of the wheel centre with a side force at the contact points, in phase, within 1 kN."""
    return 1e6 * float(
        axle.slope("lateral_in_phase", axle.sweep("lateral_in_phase").centre_m[..., 1], SMALL_FORCE_N).mean()
    )


@metric("mm/kN")
def lateral_compliance_patch(axle: Axle) -> float:
    """Motion of the contact point with a side force there, in phase, within 1 kN."""
    return 1e6 * float(
        axle.slope("lateral_in_phase", axle.sweep("lateral_in_phase").contact_m[..., 1], SMALL_FORCE_N).mean()
    )


@metric("deg/kN")
def side_force_toe(axle: Axle) -> float:
    """Change of the outer wheel's toe angle per side force, in phase, within 1 kN; positive goes to toe-in.

    The force acts at the contact point, towards the middle of the car, on the other wheel the same way.
    """
    return 1e3 * math.degrees(_per_side_force(axle, axle.sweep("lateral_in_phase").toe_rad))


@metric("deg/kN")
def side_force_toe_with_trail(axle: Axle) -> float:
    """The same with the force 30 mm behind the contact point, about the pneumatic trail of a tyre."""
    moment = axle.slope("aligning_in_phase", axle.sweep("aligning_in_phase").steer_rad, SMALL_MOMENT_NM).mean()
    # A force to the right on the left wheel, behind it, turns it to the left: toe-out.
    return side_force_toe(axle) - 1e3 * _TRAIL_M * math.degrees(float(moment))


@metric("deg/kN")
def side_force_toe_opposed(axle: Axle) -> float:
    """Change of toe angle per side force towards the middle of the car on both wheels, within 1 kN."""
    return 1e3 * math.degrees(
        axle.slope("lateral_opposed", axle.sweep("lateral_opposed").toe_rad, SMALL_FORCE_N).mean()
    )


@metric("deg/kN")
def side_force_camber(axle: Axle) -> float:
    """Change of the outer wheel's camber angle per side force, in phase, within 1 kN; positive leans its top out."""
    return 1e3 * math.degrees(_per_side_force(axle, axle.sweep("lateral_in_phase").camber_rad))


@metric("mm/kN")
def longitudinal_compliance_centre(axle: Axle) -> float:
    """Motion of the wheel centre with a longitudinal force at the wheel centres, within 1 kN."""
    sweep = axle.sweep("longitudinal_centre")
    return 1e6 * float(axle.slope("longitudinal_centre", sweep.centre_m[..., 0], SMALL_FORCE_N).mean())


@metric("mm/kN")
def longitudinal_compliance_braking(axle: Axle) -> float:
    """Motion of the wheel centre with a longitudinal force at the contact points, wheels locked, within 1 kN."""
    sweep = axle.sweep("longitudinal_patch")
    return 1e6 * float(axle.slope("longitudinal_patch", sweep.centre_m[..., 0], SMALL_FORCE_N).mean())


@metric("mm")
def braking_recession(axle: Axle) -> float:
    """Rearward motion of the wheel centre under 5 kN of braking at each contact point."""
    sweep = axle.sweep("longitudinal_patch")
    return 1e3 * float((sweep.centre_m[sweep.zero, axle.wheels, 0] - sweep.centre_m[0, axle.wheels, 0]).mean())


@metric("deg/kN")
def braking_toe(axle: Axle) -> float:
    """Change of toe angle per braking force at the contact points, wheels locked, within 1 kN; positive is toe-in."""
    sweep = axle.sweep("longitudinal_patch")
    return -1e3 * math.degrees(axle.slope("longitudinal_patch", sweep.toe_rad, SMALL_FORCE_N).mean())


@metric("deg/kN")
def braking_wind_up(axle: Axle) -> float:
    """Rotation of the knuckle per braking force at the contact points, within 1 kN, positive as the wheels roll."""
    sweep = axle.sweep("longitudinal_patch")
    return -1e3 * math.degrees(axle.slope("longitudinal_patch", sweep.wind_up_rad, SMALL_FORCE_N).mean())


@metric("deg/kN")
def driving_toe(axle: Axle) -> float:
    """Change of toe angle per driving force at the wheel centres, within 1 kN; positive is toe-in."""
    sweep = axle.sweep("longitudinal_centre")
    return 1e3 * math.degrees(axle.slope("longitudinal_centre", sweep.toe_rad, SMALL_FORCE_N).mean())


@metric("deg/100Nm")
def aligning_steer(axle: Axle) -> float:
    """Change of steer angle per aligning moment in phase, within 100 N m, positive with the moment."""
    sweep = axle.sweep("aligning_in_phase")
    return 100.0 * math.degrees(axle.slope("aligning_in_phase", sweep.steer_rad, SMALL_MOMENT_NM).mean())


@metric("deg/100Nm")
def aligning_toe_opposed(axle: Axle) -> float:
    """Change of toe angle per moment towards toe-in on both wheels, within 100 N m."""
    sweep = axle.sweep("aligning_opposed")
    return 100.0 * math.degrees(axle.slope("aligning_opposed", sweep.toe_rad, SMALL_MOMENT_NM).mean())


@metric("deg/100Nm")
def aligning_camber(axle: Axle) -> float:
    """Change of camber angle per moment towards toe-in on both wheels, within 100 N m."""
    sweep = axle.sweep("aligning_opposed")
    return 100.0 * math.degrees(axle.slope("aligning_opposed", sweep.camber_rad, SMALL_MOMENT_NM).mean())


def _bushes_Npmm(axle: Axle) -> np.ndarray:
    """Stiffness of one bush of each link [N/mm], both alike and in series, unloaded; nan of an axle without links."""
    model = axle.measured.vehicle.model
    rates = []
    for index in range(model.ntendon):
        name = model.tendon(index).name
        if name.startswith(f"{axle.name[0]}l_") and not name.endswith(("_spring", "_damper", GUIDE)):
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
