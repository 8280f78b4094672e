"""Metrics of static ride, of wheel travel and roll, and of the support by the links in braking and driving."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.conventions import GRAVITY_MPS2, Array
from activesteer.rigs.kc.definitions import DEG, SMALL_TRAVEL_M, Axle, Definition, slope


def _standing(axle: Axle, angle: str) -> float:
    sweep = axle.sweep("parallel_travel")
    return math.degrees(getattr(sweep, angle)[sweep.zero, axle.wheels].mean())


def _track(axle: Axle) -> float:
    sweep = axle.sweep("parallel_travel")
    left, right = sweep.contact_m[sweep.zero, axle.wheels, 1]
    return 1e3 * float(left - right)


_wheel_rate: Final = slope("parallel_travel", "load_N", 1e-3)


def _ride_rate(axle: Axle) -> float:
    wheel, tyre = _wheel_rate(axle), 1e-3 * axle.tyre.vertical_Npm
    return wheel * tyre / (wheel + tyre)


def _ride_frequency(axle: Axle) -> float:
    model = axle.measured.vehicle.model
    unsprung = np.mean([model.body_subtreemass[model.body(name).id] for name in axle.knuckles])
    sprung = axle.load_N.mean() / GRAVITY_MPS2 - unsprung
    return math.sqrt(1e3 * _ride_rate(axle) / sprung) / (2.0 * math.pi)


def _track_change(axle: Axle) -> float:
    left, right = axle.slope("parallel_travel", axle.sweep("parallel_travel").contact_m[..., 1])
    return 1e3 * float(left - right)


def _damper_ratio(axle: Axle) -> float:
    damper = axle.sweep("parallel_travel").damper_m[:, axle.wheels]
    # A longer damper is rebound, as in every car; the stops tell.
    sense = -1.0 if (damper[-1] > damper[0]).all() else 1.0
    return -sense * axle.mean_slope("parallel_travel", "damper_m")


def _contact(axle: Axle, end: int) -> float:
    """Travel at which a damper's length reaches one end of the range in which its stops are slack [mm]."""
    model = axle.measured.vehicle.model
    limit = float(model.tendon_lengthspring[model.tendon(f"{axle.name[0]}l_damper").id, end])
    sweep = axle.sweep("parallel_travel")
    length, travel = sweep.damper_m[:, axle.wheels][:, 0], sweep.travel_m[:, axle.wheels][:, 0]
    order = np.argsort(length)
    at = float(np.interp(limit, length[order], travel[order], left=math.nan, right=math.nan))
    return 1e3 * abs(at)


def _roll_centre_height(axle: Axle) -> float:
    sweep = axle.sweep("parallel_travel")
    slopes = axle.slope("parallel_travel", sweep.contact_m[..., 1], over=sweep.contact_m[..., 2])
    return 1e3 * float(np.mean(slopes * sweep.contact_m[sweep.zero, axle.wheels, 1]))


def _roll_centre_height_by_force(axle: Axle) -> float:
    sweep = axle.sweep("lateral_in_phase")
    slopes = axle.slope("lateral_in_phase", sweep.load_N)
    return -1e3 * float(np.mean(slopes * sweep.contact_m[sweep.zero, axle.wheels, 1]))


def roll_angle_rad(axle: Axle) -> Array:
    """Roll angle of the body over the wheel centres in opposite travel, positive to the right, shape (n,)."""
    sweep = axle.sweep("opposite_travel")
    centre = sweep.centre_m[:, axle.wheels]
    rise = sweep.travel_m[:, axle.wheels]
    return np.arctan2(rise[:, 1] - rise[:, 0], centre[:, 0, 1] - centre[:, 1, 1])


def _per_roll(axle: Axle, values: Array) -> float:
    """Slope of values, shape (n,), over the roll angle, within 15 mm of travel."""
    roll = roll_angle_rad(axle)
    near = np.abs(axle.sweep("opposite_travel").x) <= SMALL_TRAVEL_M * (1.0 + 1e-9)
    return float(np.polyfit(roll[near], values[near], 1)[0])


def _outer_per_roll(axle: Axle, angle: str) -> float:
    return _per_roll(axle, getattr(axle.sweep("opposite_travel"), angle)[:, axle.wheels][:, 1])


def _roll_stiffness(axle: Axle) -> float:
    sweep = axle.sweep("opposite_travel")
    load, y = sweep.load_N[:, axle.wheels], sweep.contact_m[:, axle.wheels, 1]
    return -1e-3 * _per_roll(axle, np.sum(load * y, axis=1))


def _front_roll_stiffness_fraction(axle: Axle) -> float:
    front, rear = (_roll_stiffness(axle.beside(name)) for name in ("front", "rear"))
    return 100.0 * front / (front + rear)


def _roll_understeer(axle: Axle) -> float:
    """Roll understeer: positive if the front wheels steer out of the turn, or the rear wheels into it."""
    steer = _per_roll(axle, axle.sweep("opposite_travel").steer_rad[:, axle.wheels].mean(axis=1))
    return -steer if axle.name == "front" else steer


def _left_right_difference(axle: Axle) -> float:
    sweep = axle.sweep("parallel_travel")
    angles = np.stack([sweep.toe_rad, sweep.camber_rad])
    return math.degrees(float(np.abs(angles[..., 0::2] - angles[..., 1::2]).max()))


def _support(axle: Axle, point: str) -> float:
    """l/h times the slope of the path of a point in side view, forwards per upwards, without springs [%]."""
    sweep = axle.sweep("parallel_kinematic")
    slopes = axle.slope("parallel_kinematic", getattr(sweep, point)[..., 0], over=sweep.centre_m[..., 2])
    return 100.0 * wheelbase_mm(axle) / _cg_height(axle) * float(slopes.mean())


def _brake_fraction(axle: Axle) -> float:
    brakes = axle.measured.parameters.brakes
    torque = brakes.front_torque_Nm if axle.name == "front" else brakes.rear_torque_Nm
    total = brakes.front_torque_Nm + brakes.rear_torque_Nm
    return torque / total if total > 0.0 else math.nan


def wheelbase_mm(axle: Axle) -> float:
    """Distance of the contact points of front and rear axle along the standing car [mm]."""
    sweep = axle.sweep("parallel_travel")
    x = sweep.contact_m[sweep.zero, :, 0]
    return 1e3 * float(x[:2].mean() - x[2:].mean())


def _cg_height(axle: Axle) -> float:
    return 1e3 * float(axle.measured.vehicle.data.subtree_com[0, 2])


TRAVEL_METRICS: Final = (
    Definition("wheel_load", "N", lambda axle: float(axle.load_N.mean()),
        "Vertical force of one tyre of the standing car, driver included."),
    Definition("track", "mm", _track,
        "Distance between the contact points of the standing car (ISO 8855)."),
    Definition("static_toe", "deg", lambda axle: _standing(axle, "toe_rad"),
        "Toe angle of one wheel of the standing car, positive toe-in (ISO 8855: mean of both wheels)."),
    Definition("static_camber", "deg", lambda axle: _standing(axle, "camber_rad"),
        "Camber angle of the standing car, negative with the top of the wheel towards the middle (ISO 8855)."),
    Definition("wheel_rate", "N/mm", _wheel_rate,
        "Change of wheel load per travel of the wheel centre, both wheels together, within 15 mm (ISO 8855)."),
    Definition("ride_rate", "N/mm", _ride_rate,
        "Wheel rate in series with the vertical stiffness of the tyre under its static load (Milliken 1995, ch. 16)."),
    Definition("ride_frequency", "Hz", _ride_frequency,
        "Undamped natural frequency of the sprung mass of one axle on the ride rate. The sprung mass is the static load"
        " less the unsprung mass: the knuckle and all parts on it (Milliken 1995, ch. 16)."),
    Definition("bump_steer", "deg/m", slope("parallel_travel", "toe_rad", DEG),
        "Change of toe angle per travel, both wheels together, within 15 mm; positive goes to toe-in in bump."),
    Definition("bump_camber", "deg/m", slope("parallel_travel", "camber_rad", DEG),
        "Change of camber angle per travel, both wheels together, within 15 mm; negative leans the top in in bump."),
    Definition("track_change", "mm/m", _track_change,
        "Change of track (both wheels) per travel, both wheels together, within 15 mm; positive widens in bump."),
    Definition("wheel_recession", "mm/m", slope("parallel_travel", "centre_m", -1e3, 0),
        "Rearward motion of the wheel centre per travel, within 15 mm; positive gives way to an obstacle."),
    Definition("damper_ratio", "mm/mm", _damper_ratio,
        "Shortening of the damper per travel, both wheels together, within 15 mm."),
    Definition("bump_stop_contact", "mm", lambda axle: _contact(axle, 0),
        "Bump travel at which the bump stop takes up its first load, both wheels together; nan beyond 80 mm."),
    Definition("rebound_stop_contact", "mm", lambda axle: _contact(axle, 1),
        "Rebound travel at which the rebound stop takes up its first load, both wheels together; nan beyond 80 mm."),
    Definition("roll_centre_height", "mm", _roll_centre_height,
        "Height over the road at which the normal to the contact point's path meets the middle of the car. The path "
        "belongs to parallel travel within 15 mm, with loaded links and springs (ISO 8855: kinematic roll centre)."),
    Definition("roll_centre_height_by_force", "mm", _roll_centre_height_by_force,
        "Height over the road at which a side force does not change the vertical forces of the pads. Half the track "
        "times the change of vertical force per side force in phase, at fixed wheel heights, within 1 kN: the part of a"
        " side force that the links carry directly (force-based roll centre: Milliken 1995, ch. 17)."),
    Definition("roll_stiffness", "kNm/rad", _roll_stiffness,
        "Moment of the pads about the x axis per roll angle of the body, tyres rigid, within 15 mm of opposite "
        "travel."),
    Definition("front_roll_stiffness_fraction", "%", _front_roll_stiffness_fraction,
        "Roll stiffness of the front axle over the roll stiffness of both axles, tyres rigid.", ("car",)),
    Definition("roll_steer_outer", "deg/deg", lambda axle: _outer_per_roll(axle, "toe_rad"),
        "Change of toe angle of the wheel in bump per roll angle, opposite travel; positive goes to toe-in."),
    Definition("roll_understeer", "deg/deg", _roll_understeer,
        "Change of the mean steer angle per roll angle, positive for understeer. In a left turn the body rolls to the "
        "right: positive if the front wheels then steer to the right, or the rear wheels to the left (Gillespie 1992, "
        "ch. 7)."),
    Definition("roll_camber", "deg/deg", lambda axle: _outer_per_roll(axle, "camber_rad"),
        "Change of the outer wheel's camber to the body per roll angle; negative leans it into the turn. With -1 the "
        "wheel stays upright on the road."),
    Definition("left_right_difference", "deg", _left_right_difference,
        "Largest difference between left and right toe or camber angle in parallel travel over +-80 mm.", ("car",)),
    Definition("anti_dive", "%", lambda axle: _brake_fraction(axle) * _support(axle, "patch_m"),
        "Fraction of the dive that the front links prevent: brake fraction x l/h x slope of the locked wheel's patch. "
        "Positive if the contact point of the wheel, locked to its knuckle, moves forwards in bump. Links unloaded, "
        "brake distribution at full pedal (Gillespie 1992, ch. 7; Milliken 1995, ch. 17).", ("front",)),
    Definition("anti_lift", "%", lambda axle: -_brake_fraction(axle) * _support(axle, "patch_m"),
        "Fraction of the rear lift in braking that the rear links prevent: anti-dive with the sign of a rear axle. "
        "Positive if the contact point of the wheel, locked to its knuckle, moves rearwards in bump.", ("rear",)),
    Definition("anti_lift_drive", "%", lambda axle: _support(axle, "centre_m"),
        "Fraction of the front lift in acceleration that the front links prevent, if only half-shafts drive this axle. "
        "l/h x slope of the wheel centre's path, positive if the wheel centre moves forwards in bump.", ("front",)),
    Definition("anti_squat", "%", lambda axle: -_support(axle, "centre_m"),
        "Fraction of the squat in acceleration that the rear links prevent, if only half-shafts drive this axle. l/h x "
        "slope of the wheel centre's path, positive if it moves rearwards in bump (Gillespie 1992, ch. 7).", ("rear",)),
    Definition("wheelbase", "mm", wheelbase_mm,
        "Distance of the contact points of front and rear axle along the standing car (ISO 8855).", ("car",)),
    Definition("cg_height", "mm", _cg_height,
        "Height of the whole car's centre of gravity over the road, driver included.", ("car",)),
    Definition("mass", "kg", lambda axle: float(axle.measured.vehicle.model.body_subtreemass[0]),
        "Mass of the whole car, driver included.", ("car",)),
    Definition("front_load_fraction", "%", lambda axle: 100.0 * float(axle.load_N[:2].sum() / axle.load_N.sum()),
        "Fraction of the weight on the front axle of the standing car.", ("car",)),
)  # fmt: skip
"""Metrics in the order of the table."""
