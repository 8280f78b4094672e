"""Metrics of static ride and of wheel travel. The docstring of each is its definition."""

from __future__ import annotations

import math

import numpy as np

from activesteer.conventions import GRAVITY_MPS2
from activesteer.rigs.kc.definitions import SMALL_FORCE_N, SMALL_TRAVEL_M, Axle, metric
from activesteer.rigs.kc.sweep import INWARDS


@metric("N")
def wheel_load(axle: Axle) -> float:
    """Vertical force of one tyre of the standing car, driver included."""
    return float(axle.load_N.mean())


@metric("mm")
def track(axle: Axle) -> float:
    """Distance between the contact points of the standing car (ISO 8855)."""
    sweep = axle.sweep("parallel_travel")
    left, right = sweep.contact_m[sweep.zero, axle.wheels, 1]
    return 1e3 * float(left - right)


@metric("deg")
def static_toe(axle: Axle) -> float:
    """Toe angle of one wheel of the standing car, positive toe-in (ISO 8855: mean of both wheels)."""
    sweep = axle.sweep("parallel_travel")
    return math.degrees(sweep.toe_rad[sweep.zero, axle.wheels].mean())


@metric("deg")
def static_camber(axle: Axle) -> float:
    """Camber angle of the standing car, negative with the top of the wheel towards the middle (ISO 8855)."""
    sweep = axle.sweep("parallel_travel")
    return math.degrees(sweep.camber_rad[sweep.zero, axle.wheels].mean())


@metric("N/mm")
def wheel_rate(axle: Axle) -> float:
    """Change of wheel load per travel of the wheel centre, both wheels together, within 15 mm (ISO 8855)."""
    sweep = axle.sweep("parallel_travel")
    return 1e-3 * float(axle.slope("parallel_travel", sweep.load_N, SMALL_TRAVEL_M).mean())


@metric("N/mm")
def ride_rate(axle: Axle) -> float:
    """Wheel rate in series with the vertical stiffness of the tyre under its static load (Milliken 1995, ch. 16)."""
    wheel, tyre = wheel_rate(axle), 1e-3 * axle.tyre.vertical_Npm
    return wheel * tyre / (wheel + tyre)


@metric("Hz")
def ride_frequency(axle: Axle) -> float:
    """Undamped natural frequency of the static load less the unsprung mass on the ride rate, each axle by itself.

    Unsprung are the knuckle and everything on it (Milliken 1995, ch. 16).
    """
    model = axle.measured.vehicle.model
    unsprung = np.mean([model.body_subtreemass[model.body(name).id] for name in axle.knuckles])
    sprung = axle.load_N.mean() / GRAVITY_MPS2 - unsprung
    return math.sqrt(1e3 * ride_rate(axle) / sprung) / (2.0 * math.pi)


@metric("deg/m")
def bump_steer(axle: Axle) -> float:
    """Change of toe angle per travel, both wheels together, within 15 mm; positive goes to toe-in in bump."""
    sweep = axle.sweep("parallel_travel")
    return math.degrees(axle.slope("parallel_travel", sweep.toe_rad, SMALL_TRAVEL_M).mean())


@metric("deg/m")
def bump_camber(axle: Axle) -> float:
    """Change of camber angle per travel, both wheels together, within 15 mm; negative leans the top in in bump."""
    sweep = axle.sweep("parallel_travel")
    return math.degrees(axle.slope("parallel_travel", sweep.camber_rad, SMALL_TRAVEL_M).mean())


@metric("mm/m")
def track_change(axle: Axle) -> float:
    """Change of track (both wheels) per travel, both wheels together, within 15 mm; positive widens in bump."""
    sweep = axle.sweep("parallel_travel")
    left, right = axle.slope("parallel_travel", sweep.contact_m[..., 1], SMALL_TRAVEL_M)
    return 1e3 * float(left - right)


@metric("mm/m")
def wheel_recession(axle: Axle) -> float:
    """Rearward motion of the wheel centre per travel, within 15 mm; positive gives way to an obstacle."""
    sweep = axle.sweep("parallel_travel")
    return -1e3 * float(axle.slope("parallel_travel", sweep.centre_m[..., 0], SMALL_TRAVEL_M).mean())


@metric("mm/mm")
def damper_ratio(axle: Axle) -> float:
    """Shortening of the damper per travel, both wheels together, within 15 mm."""
    sweep = axle.sweep("parallel_travel")
    sense = _damper_sense(axle)
    return float(-sense * axle.slope("parallel_travel", sweep.damper_m, SMALL_TRAVEL_M).mean())


def _damper_sense(axle: Axle) -> float:
    """1 where a longer damper is rebound, as in every car; checked against the sweep, for the stops."""
    damper = axle.sweep("parallel_travel").damper_m[:, axle.wheels]
    return -1.0 if (damper[-1] > damper[0]).all() else 1.0


@metric("mm")
def bump_stop_contact(axle: Axle) -> float:
    """Bump travel at which the bump stop takes up its first load, both wheels together; nan beyond 80 mm."""
    return _contact(axle, 0)


@metric("mm")
def rebound_stop_contact(axle: Axle) -> float:
    """Rebound travel at which the rebound stop takes up its first load, both wheels together; nan beyond 80 mm."""
    return _contact(axle, 1)


def _contact(axle: Axle, end: int) -> float:
    """Travel at which a damper's length reaches one end of the range in which its stops are slack [mm]."""
    model = axle.measured.vehicle.model
    limit = float(model.tendon_lengthspring[model.tendon(f"{axle.name[0]}l_damper").id, end])
    sweep = axle.sweep("parallel_travel")
    length, travel = sweep.damper_m[:, axle.wheels][:, 0], sweep.travel_m[:, axle.wheels][:, 0]
    order = np.argsort(length)
    at = float(np.interp(limit, length[order], travel[order], left=math.nan, right=math.nan))
    return 1e3 * abs(at)


@metric("mm")
def roll_centre_height(axle: Axle) -> float:
    """Height over the road at which the normal to the contact point's path meets the middle of the car.

    The path is that of parallel travel within 15 mm, links and springs loaded (ISO 8855: kinematic roll centre).
    """
    sweep = axle.sweep("parallel_travel")
    slopes = axle.slope("parallel_travel", sweep.contact_m[..., 1], SMALL_TRAVEL_M, over=sweep.contact_m[..., 2])
    return 1e3 * float(np.mean(slopes * sweep.contact_m[sweep.zero, axle.wheels, 1]))


@metric("mm")
def roll_centre_height_by_force(axle: Axle) -> float:
    """Height over the road at which a side force would have to act in order not to change the pads' vertical forces.

    Half the track times the change of vertical force per side force in phase, at fixed wheel heights, within 1 kN: how
    much of a side force the links carry directly (force-based roll centre: Milliken 1995, ch. 17).
    """
    sweep = axle.sweep("lateral_in_phase")
    slopes = axle.slope("lateral_in_phase", sweep.load_N, SMALL_FORCE_N)
    return -1e3 * float(np.mean(slopes * sweep.contact_m[sweep.zero, axle.wheels, 1]))


def roll_angle_rad(axle: Axle) -> np.ndarray:
    """Roll angle of the body over the wheel centres in opposite travel, positive to the right, shape (n,)."""
    sweep = axle.sweep("opposite_travel")
    centre = sweep.centre_m[:, axle.wheels]
    rise = sweep.travel_m[:, axle.wheels]
    return np.arctan2(rise[:, 1] - rise[:, 0], centre[:, 0, 1] - centre[:, 1, 1])


def _per_roll(axle: Axle, values: np.ndarray) -> float:
    """Slope of values, shape (n,), over the roll angle, within 15 mm of travel."""
    roll = roll_angle_rad(axle)
    near = np.abs(axle.sweep("opposite_travel").x) <= SMALL_TRAVEL_M * (1.0 + 1e-9)
    return float(np.polyfit(roll[near], values[near], 1)[0])


@metric("kNm/rad")
def roll_stiffness(axle: Axle) -> float:
    """Moment of the pads about the x axis per roll angle of the body, tyres rigid, within 15 mm of opposite travel."""
    sweep = axle.sweep("opposite_travel")
    load, y = sweep.load_N[:, axle.wheels], sweep.contact_m[:, axle.wheels, 1]
    return -1e-3 * _per_roll(axle, np.sum(load * y, axis=1))


@metric("%", "car")
def front_roll_stiffness_fraction(axle: Axle) -> float:
    """Roll stiffness of the front axle over that of both, tyres rigid."""
    front, rear = (roll_stiffness(Axle(name, axle.measured)) for name in ("front", "rear"))
    return 100.0 * front / (front + rear)


@metric("deg/deg")
def roll_steer_outer(axle: Axle) -> float:
    """Change of toe angle of the wheel in bump per roll angle, opposite travel; positive goes to toe-in."""
    sweep = axle.sweep("opposite_travel")
    return _per_roll(axle, sweep.toe_rad[:, axle.wheels][:, 1])


@metric("deg/deg")
def roll_understeer(axle: Axle) -> float:
    """Change of the mean steer angle per roll angle, positive where it makes the car understeer.

    In a left turn the body rolls to the right: positive where the front wheels then steer right, the rear ones left
    (Gillespie 1992, ch. 7).
    """
    sweep = axle.sweep("opposite_travel")
    steer = _per_roll(axle, sweep.steer_rad[:, axle.wheels].mean(axis=1))
    return -steer if axle.name == "front" else steer


@metric("deg/deg")
def roll_camber(axle: Axle) -> float:
    """Change of the outer wheel's camber to the body per roll angle; negative leans it into the turn.

    -1 would keep it upright on the road.
    """
    sweep = axle.sweep("opposite_travel")
    return _per_roll(axle, sweep.camber_rad[:, axle.wheels][:, 1])


@metric("deg", "car")
def left_right_difference(axle: Axle) -> float:
    """Largest difference between left and right toe or camber angle in parallel travel over +-80 mm."""
    sweep = axle.sweep("parallel_travel")
    angles = np.stack([sweep.toe_rad, sweep.camber_rad])
    return math.degrees(float(np.abs(angles[..., 0::2] - angles[..., 1::2]).max()))


def _support(axle: Axle, path: np.ndarray) -> float:
    """Slope of a path in side view, forwards per upwards, within 15 mm of parallel travel without springs."""
    centre = axle.sweep("parallel_kinematic").centre_m
    return float(axle.slope("parallel_kinematic", path[..., 0], SMALL_TRAVEL_M, over=centre[..., 2]).mean())


def wheelbase_over_height(axle: Axle) -> float:
    """Wheelbase over height of the whole car's centre of gravity [-]."""
    return wheelbase(Axle("car", axle.measured)) / cg_height(Axle("car", axle.measured))


@metric("%", "front")
def anti_dive(axle: Axle) -> float:
    """Fraction of the dive that the front links prevent: brake fraction x l/h x slope of the locked wheel's patch.

    Positive where the contact point of the wheel, locked to its knuckle, moves forwards in bump. Links unloaded, brakes
    as distributed at full pedal (Gillespie 1992, ch. 7; Milliken 1995, ch. 17).
    """
    return 100.0 * _brake_fraction(axle) * wheelbase_over_height(axle) * _support(axle, _patch(axle))


@metric("%", "rear")
def anti_lift(axle: Axle) -> float:
    """Fraction of the rear's lift in braking that its links prevent: as anti-dive, with the sign of a rear axle.

    Positive where the contact point of the wheel, locked to its knuckle, moves rearwards in bump.
    """
    return -100.0 * _brake_fraction(axle) * wheelbase_over_height(axle) * _support(axle, _patch(axle))


@metric("%", "front")
def anti_lift_drive(axle: Axle) -> float:
    """Fraction of the front's lift in acceleration that its links prevent, were it driven alone by half-shafts.

    l/h x slope of the wheel centre's path, positive where the wheel centre moves forwards in bump.
    """
    return 100.0 * wheelbase_over_height(axle) * _support(axle, axle.sweep("parallel_kinematic").centre_m)


@metric("%", "rear")
def anti_squat(axle: Axle) -> float:
    """Fraction of squat in acceleration that the rear links would prevent, were the rear driven alone by half-shafts.

    l/h x slope of the wheel centre's path, positive where it moves rearwards in bump (Gillespie 1992, ch. 7).
    """
    return -100.0 * wheelbase_over_height(axle) * _support(axle, axle.sweep("parallel_kinematic").centre_m)


def _patch(axle: Axle) -> np.ndarray:
    return axle.sweep("parallel_kinematic").patch_m


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


@metric("deg")
def caster(axle: Axle) -> float:
    """Angle of the steering axis to the vertical in side view, positive with the top to the rear (ISO 8855).

    In front the axis about which the wheel turns with its damper's length fixed; at the rear the steering hinge's.
    """
    return math.degrees(np.mean([axis.caster_rad for axis in axle.axes]))


@metric("deg")
def kingpin_inclination(axle: Axle) -> float:
    """Angle of the steering axis to the vertical in front view, positive with the top inwards (ISO 8855)."""
    return math.degrees(np.mean([axis.inclination_rad for axis in axle.axes]))


@metric("mm")
def scrub_radius(axle: Axle) -> float:
    """Steering-axis offset at the ground: positive where the axis meets the road inside the contact (ISO 8855)."""
    return 1e3 * float(np.mean([axis.scrub_radius_m for axis in axle.axes]))


@metric("mm")
def caster_trail(axle: Axle) -> float:
    """Castor offset at the ground: positive where the axis meets the road ahead of the contact point (ISO 8855)."""
    return 1e3 * float(np.mean([axis.trail_m for axis in axle.axes]))


@metric("mm")
def spindle_offset(axle: Axle) -> float:
    """Steering-axis offset at the wheel centre, positive where the axis passes inside (ISO 8855)."""
    return 1e3 * float(np.mean([axis.centre_offset_m for axis in axle.axes]))


@metric("mm")
def centre_trail(axle: Axle) -> float:
    """Castor offset at the wheel centre, positive where the axis passes ahead of it (ISO 8855)."""
    return 1e3 * float(np.mean([axis.centre_trail_m for axis in axle.axes]))


def outer_sign(axle: Axle) -> np.ndarray:
    """Sign of a force to the left that points towards the middle of the car, by wheel."""
    return INWARDS[axle.wheels]
