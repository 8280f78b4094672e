"""Metrics of static ride and of wheel travel. Each docstring is the definition."""

from __future__ import annotations

import math

import numpy as np

from activesteer.conventions import GRAVITY_MPS2
from activesteer.rigs.kc.definitions import SMALL_TRAVEL_M, Axle, metric


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
    return 1e-3 * axle.mean_slope("parallel_travel", "load_N")


@metric("N/mm")
def ride_rate(axle: Axle) -> float:
    """Wheel rate in series with the vertical stiffness of the tyre under its static load (Milliken 1995, ch. 16)."""
    wheel, tyre = wheel_rate(axle), 1e-3 * axle.tyre.vertical_Npm
    return wheel * tyre / (wheel + tyre)


@metric("Hz")
def ride_frequency(axle: Axle) -> float:
    """Undamped natural frequency of the sprung mass of one axle on the ride rate.

    The sprung mass is the static load less the unsprung mass: the knuckle and all parts on it (Milliken 1995, ch. 16).
    """
    model = axle.measured.vehicle.model
    unsprung = np.mean([model.body_subtreemass[model.body(name).id] for name in axle.knuckles])
    sprung = axle.load_N.mean() / GRAVITY_MPS2 - unsprung
    return math.sqrt(1e3 * ride_rate(axle) / sprung) / (2.0 * math.pi)


@metric("deg/m")
def bump_steer(axle: Axle) -> float:
    """Change of toe angle per travel, both wheels together, within 15 mm; positive goes to toe-in in bump."""
    return math.degrees(axle.mean_slope("parallel_travel", "toe_rad"))


@metric("deg/m")
def bump_camber(axle: Axle) -> float:
    """Change of camber angle per travel, both wheels together, within 15 mm; negative leans the top in in bump."""
    return math.degrees(axle.mean_slope("parallel_travel", "camber_rad"))


@metric("mm/m")
def track_change(axle: Axle) -> float:
    """Change of track (both wheels) per travel, both wheels together, within 15 mm; positive widens in bump."""
    sweep = axle.sweep("parallel_travel")
    left, right = axle.slope("parallel_travel", sweep.contact_m[..., 1])
    return 1e3 * float(left - right)


@metric("mm/m")
def wheel_recession(axle: Axle) -> float:
    """Rearward motion of the wheel centre per travel, within 15 mm; positive gives way to an obstacle."""
    return -1e3 * axle.mean_slope("parallel_travel", "centre_m", 0)


@metric("mm/mm")
def damper_ratio(axle: Axle) -> float:
    """Shortening of the damper per travel, both wheels together, within 15 mm."""
    return -_damper_sense(axle) * axle.mean_slope("parallel_travel", "damper_m")


def _damper_sense(axle: Axle) -> float:
    """1 if a longer damper is rebound, as in every car; taken from the sweep, for the stops."""
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

    The path belongs to parallel travel within 15 mm, with loaded links and springs (ISO 8855: kinematic roll centre).
    """
    sweep = axle.sweep("parallel_travel")
    slopes = axle.slope("parallel_travel", sweep.contact_m[..., 1], over=sweep.contact_m[..., 2])
    return 1e3 * float(np.mean(slopes * sweep.contact_m[sweep.zero, axle.wheels, 1]))


@metric("mm")
def roll_centre_height_by_force(axle: Axle) -> float:
    """Height over the road at which a side force does not change the vertical forces of the pads.

    Half the track times the change of vertical force per side force in phase, at fixed wheel heights, within 1 kN: the
    part of a side force that the links carry directly (force-based roll centre: Milliken 1995, ch. 17).
    """
    sweep = axle.sweep("lateral_in_phase")
    slopes = axle.slope("lateral_in_phase", sweep.load_N)
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
    """Roll stiffness of the front axle over the roll stiffness of both axles, tyres rigid."""
    front, rear = (roll_stiffness(Axle(name, axle.measured)) for name in ("front", "rear"))
    return 100.0 * front / (front + rear)


@metric("deg/deg")
def roll_steer_outer(axle: Axle) -> float:
    """Change of toe angle of the wheel in bump per roll angle, opposite travel; positive goes to toe-in."""
    sweep = axle.sweep("opposite_travel")
    return _per_roll(axle, sweep.toe_rad[:, axle.wheels][:, 1])


@metric("deg/deg")
def roll_understeer(axle: Axle) -> float:
    """Change of the mean steer angle per roll angle, positive for understeer.

    In a left turn the body rolls to the right: positive if the front wheels then steer to the right, or the rear wheels
    to the left (Gillespie 1992, ch. 7).
    """
    sweep = axle.sweep("opposite_travel")
    steer = _per_roll(axle, sweep.steer_rad[:, axle.wheels].mean(axis=1))
    return -steer if axle.name == "front" else steer


@metric("deg/deg")
def roll_camber(axle: Axle) -> float:
    """Change of the outer wheel's camber to the body per roll angle; negative leans it into the turn.

    With -1 the wheel stays upright on the road.
    """
    sweep = axle.sweep("opposite_travel")
    return _per_roll(axle, sweep.camber_rad[:, axle.wheels][:, 1])


@metric("deg", "car")
def left_right_difference(axle: Axle) -> float:
    """Largest difference between left and right toe or camber angle in parallel travel over +-80 mm."""
    sweep = axle.sweep("parallel_travel")
    angles = np.stack([sweep.toe_rad, sweep.camber_rad])
    return math.degrees(float(np.abs(angles[..., 0::2] - angles[..., 1::2]).max()))
