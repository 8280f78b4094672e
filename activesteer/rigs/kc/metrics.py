"""Metrics of the rig: static ride, wheel travel and roll, steering and compliance, and the standing car."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, NamedTuple

import mujoco
import numpy as np

from activesteer.config import Source, build, read_toml
from activesteer.core.conventions import GRAVITY_MPS2, Array
from activesteer.errors import nearest_names
from activesteer.resources import models_dir
from activesteer.rigs.kc.held_car import MOUNT_ENDINGS
from activesteer.rigs.kc.modes import NAMES, TyreStiffness
from activesteer.rigs.kc.programme import INWARDS, Measured, SteeringAxis, Sweep
from activesteer.vehicle.curve_axles import HOLDING_TENDON

AxleName = Literal["front", "rear", "car"]

DEG: Final = math.degrees(1.0)
SMALL_TRAVEL_M: Final = 0.015
_SMALL: Final = {
    "parallel": SMALL_TRAVEL_M, "opposite": SMALL_TRAVEL_M, "lateral": 1000.0, "longitudinal": 1000.0,
    "aligning": 100.0,
}  # fmt: skip
"""First word of a sweep's name -> range about static ride in which a straight line gives the slopes: travel [m], force
[N] or moment [N m]."""


class Axle(NamedTuple):
    """One axle of the measured car. Arrays of its wheels are in the order left, right."""

    name: AxleName
    measured: Measured

    @property
    def wheels(self) -> slice:
        """Columns of the per-corner arrays."""
        return {"front": slice(0, 2), "rear": slice(2, 4), "car": slice(0, 4)}[self.name]

    @property
    def axes(self) -> tuple[SteeringAxis, ...]:
        """Steering axes of both wheels."""
        return self.measured.axes[self.wheels]

    @property
    def tyre(self) -> TyreStiffness:
        """Stiffness of the tyres of this axle."""
        return self.measured.tyres[0 if self.name == "front" else 1]

    @property
    def load_N(self) -> Array:
        """Static wheel loads [N], shape (2,)."""
        return self.measured.static_load_N[self.wheels]

    @property
    def knuckles(self) -> tuple[str, str]:
        """Names of the knuckles' bodies."""
        return (f"{self.name[0]}l_knuckle", f"{self.name[0]}r_knuckle")

    def beside(self, name: AxleName) -> Axle:
        """Return another axle of the same car."""
        return Axle(name, self.measured)

    def sweep(self, name: str) -> Sweep:
        """Return a sweep of the rig."""
        return self.measured.sweeps[name]

    def slope(self, sweep: str, values: Array, over: Array | None = None) -> Array:
        """Return the slopes of the axle's wheels about static ride, within 15 mm, 1 kN or 100 N m, shape (2,)."""
        x = self.sweep(sweep).x
        near = np.abs(x) <= _SMALL[sweep.split("_", maxsplit=1)[0]] * (1.0 + 1e-9)
        rows = values[near][:, self.wheels]
        base = np.repeat(x[near, None], rows.shape[1], axis=1) if over is None else over[near][:, self.wheels]
        base = base - base.mean(axis=0)
        return np.sum(base * (rows - rows.mean(axis=0)), axis=0) / np.sum(base * base, axis=0)

    def mean_slope(self, sweep: str, quantity: str, axis: int | None = None) -> float:
        """Return the mean slope of both wheels over the variable of the sweep."""
        values = getattr(self.sweep(sweep), quantity)
        return float(self.slope(sweep, values if axis is None else values[..., axis]).mean())


Evaluate = Callable[[Axle], float]


def slope(sweep: str, quantity: str, factor: float = 1.0, axis: int | None = None) -> Evaluate:
    """Return the evaluation of `Axle.mean_slope`, times a factor."""
    return lambda axle: factor * axle.mean_slope(sweep, quantity, axis)


class Definition(NamedTuple):
    """A metric's definition.

    Attributes:
        name: Name.
        unit: Unit.
        evaluate: Function from an axle to its value.
        text: Definition, sign, source.
        axles: Axles that have the metric.
    """

    name: str
    unit: str
    evaluate: Evaluate
    text: str
    axles: tuple[AxleName, ...] = ("front", "rear")


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


_ON_CENTRE_RAD: Final = math.radians(20.0)
_TRAIL_M: Final = 0.03
_NOT_LINKS: Final = ("_spring", "_damper", HOLDING_TENDON, *MOUNT_ENDINGS)
_MODE_WORDS: Final = {
    "body_bounce": "the body going up and down",
    "body_pitch": "the body pitching",
    "body_roll": "the body rolling, tyres holding the road sideways",
    "wheel_hop_front": "both front wheels going up and down together",
    "wheel_hop_rear": "both rear wheels going up and down together",
    "tramp_front": "the front wheels going up and down against each other",
    "tramp_rear": "the rear wheels going up and down against each other",
}


def _axis(quantity: str, factor: float) -> Evaluate:
    """Return the mean of a quantity of the steering axes of both wheels, times a factor."""
    return lambda axle: factor * float(np.mean([getattr(axis, quantity) for axis in axle.axes]))


def mean_steer_rad(axle: Axle, sweep: str = "steering_rolling") -> Array:
    """Mean steer angle of the front wheels, shape (n,)."""
    return axle.sweep(sweep).steer_rad[:, :2].mean(axis=1)


def ratio_curve(axle: Axle) -> tuple[Array, Array]:
    """Mean steer angle [rad] and the local overall steering ratio there: steering wheel angle over steer angle."""
    mean = mean_steer_rad(axle)
    return mean, np.gradient(axle.sweep("steering_rolling").x, mean, edge_order=2)


def _steering_ratio(axle: Axle) -> float:
    wheel = axle.sweep("steering_rolling").x
    near = np.abs(wheel) <= _ON_CENTRE_RAD * (1.0 + 1e-9)
    return 1.0 / float(np.polyfit(wheel[near], mean_steer_rad(axle)[near], 1)[0])


def _ratio_at(axle: Axle, steer_deg: float) -> float:
    """Total steering wheel angle over total mean steer angle, at a given mean steer angle."""
    mean = mean_steer_rad(axle)
    sides = [np.interp(sign * math.radians(steer_deg), mean, axle.sweep("steering_rolling").x) for sign in (1.0, -1.0)]
    return math.degrees(float(sides[0] - sides[1]) / 2.0) / steer_deg


def _rack_travel(axle: Axle) -> float:
    sweep = axle.sweep("steering_rolling")
    near = np.abs(sweep.x) <= _ON_CENTRE_RAD * (1.0 + 1e-9)
    return 2e3 * math.pi * float(np.polyfit(sweep.steering_wheel_rad[near], sweep.rack_m[near], 1)[0])


def _from_straight(axle: Axle) -> Array:
    """Steer angles of both front wheels relative to straight ahead [rad], shape (n, 2)."""
    sweep = axle.sweep("steering_rolling")
    steer = sweep.steer_rad[:, :2]
    return steer - steer[sweep.zero]


def _at_lock(axle: Axle) -> tuple[float, float]:
    steer = _from_straight(axle)
    return math.degrees(steer[-1, 0]), math.degrees(steer[-1, 1])


def _ackermann(axle: Axle) -> float:
    steer = _from_straight(axle)
    inner = math.radians(20.0)
    if steer[-1, 0] < inner:
        return math.nan
    left_turn = steer[:, 0] > 0.0
    outer = float(np.interp(inner, steer[left_turn, 0], steer[left_turn, 1]))
    left, right = (axis.point_m[1] for axis in axle.axes)
    base = 1e-3 * wheelbase_mm(axle)
    ideal = math.atan(1.0 / (1.0 / math.tan(inner) + (left - right) / base))
    return 100.0 * (inner - outer) / (inner - ideal)


def _turning_circle(axle: Axle) -> float:
    inner, outer = (math.radians(angle) for angle in _at_lock(axle))
    contact = axle.sweep("steering_rolling").contact_m[-1]
    base = float(contact[:2, 0].mean() - contact[2:, 0].mean())
    radius = base * 0.5 * (1.0 / math.tan(inner) + 1.0 / math.tan(outer))
    reach = math.hypot(radius + abs(float(contact[1, 1])), base)
    return 2.0 * (reach + 0.5 * axle.tyre.width_m)


def _parking_lost_angle(axle: Axle) -> float:
    names = ("steering_at_rest_left", "steering_at_rest_right")
    left, right = (float(np.interp(0.0, mean_steer_rad(axle, name), axle.sweep(name).x)) for name in names)
    return math.degrees(left - right) / 2.0


def _rear_steer_range(axle: Axle) -> float:
    sweep = axle.sweep("rear_steering")
    steer = sweep.steer_rad[:, 2:]
    return math.degrees(float(np.abs(steer - steer[sweep.zero]).max()))


def _per_side_force(axle: Axle, angle: str) -> float:
    """Slope of an angle over a side force in phase that points inwards at the evaluated wheel, within 1 kN."""
    slopes = axle.slope("lateral_in_phase", getattr(axle.sweep("lateral_in_phase"), angle))
    return 1e3 * math.degrees(float(np.mean(INWARDS[axle.wheels] * slopes)))


def _side_force_toe_with_trail(axle: Axle) -> float:
    moment = axle.mean_slope("aligning_in_phase", "steer_rad")
    # A force to the right, behind the left wheel's contact point, turns the wheel to the left: toe-out.
    return _per_side_force(axle, "toe_rad") - 1e3 * _TRAIL_M * math.degrees(moment)


def _braking_recession(axle: Axle) -> float:
    sweep = axle.sweep("longitudinal_patch")
    return 1e3 * float((sweep.centre_m[sweep.zero, axle.wheels, 0] - sweep.centre_m[0, axle.wheels, 0]).mean())


def _bushes_Npmm(axle: Axle) -> Array:
    """Stiffness of one of two equal bushes in series in each link, unloaded, or nan without links [N/mm]."""
    model = axle.measured.vehicle.model
    rates = []
    for index in range(model.ntendon):
        name = model.tendon(index).name
        if name.startswith(f"{axle.name[0]}l_") and not name.endswith(_NOT_LINKS):
            rates.append(2e-3 * float(model.tendon_stiffness[index]))
    return np.array(rates or [np.nan])


def _top_mount_Npmm(axle: Axle, direction: str) -> float:
    """Stiffness of the left top mount, or nan for a rigid one [N/mm]."""
    model = axle.measured.vehicle.model
    tendon = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, f"{axle.name[0]}l_mount_{direction}")
    return 1e-3 * float(model.tendon_stiffness[tendon]) if tendon >= 0 else math.nan


def _damper_asymmetry(axle: Axle) -> float:
    dampers = axle.measured.parameters.dampers
    curve = dampers.front if axle.name == "front" else dampers.rear
    bump, rebound = (abs(float(np.interp(speed, curve.velocity_mps, curve.force_N))) for speed in (0.3, -0.3))
    return rebound / bump if bump > 0.0 else math.inf


def _per_g(gradient_radps2pm: float) -> float:
    return math.degrees(gradient_radps2pm) * GRAVITY_MPS2


def _modes() -> Iterator[Definition]:
    """Yield frequency and damping of each mode."""
    for name in NAMES:
        axle: AxleName = "front" if name.endswith("_front") else "rear" if name.endswith("_rear") else "car"
        short = name.removesuffix("_front").removesuffix("_rear")
        text = f"Eigenvalue of the linearised standing car on its tyres: {_MODE_WORDS[name]}."
        for what, unit, quantity, words in (
            ("frequency", "Hz", "frequency_Hz", "Magnitude over 2 pi."),
            ("damping", "-", "damping_ratio", "Damping ratio."),
        ):  # fmt: skip
            yield Definition(f"{short}_{what}", unit, _of_mode(name, quantity), f"{words} {text}", (axle,))


def _of_mode(name: str, quantity: str) -> Evaluate:
    return lambda axle: getattr(axle.measured.modes.by_name[name], quantity)


DEFINITIONS: Final = (
    *TRAVEL_METRICS,
    Definition("caster", "deg", _axis("caster_rad", DEG),
        "Angle of the steering axis to the vertical in side view, positive with the top to the rear (ISO 8855). Front "
        "axle: the axis about which the wheel turns at a fixed damper length. Rear axle: the axis of the steering "
        "hinge."),
    Definition("kingpin_inclination", "deg", _axis("inclination_rad", DEG),
        "Angle of the steering axis to the vertical in front view, positive with the top inwards (ISO 8855)."),
    Definition("scrub_radius", "mm", _axis("scrub_radius_m", 1e3),
        "Steering-axis offset at the ground: positive where the axis meets the road inside the contact (ISO 8855)."),
    Definition("caster_trail", "mm", _axis("trail_m", 1e3),
        "Castor offset at the ground: positive where the axis meets the road ahead of the contact point (ISO 8855)."),
    Definition("spindle_offset", "mm", _axis("centre_offset_m", 1e3),
        "Steering-axis offset at the wheel centre, positive where the axis passes inside (ISO 8855)."),
    Definition("centre_trail", "mm", _axis("centre_trail_m", 1e3),
        "Castor offset at the wheel centre, positive where the axis passes ahead of it (ISO 8855)."),
    Definition("steering_ratio", "-", _steering_ratio,
        "Steering wheel angle over mean steer angle of the front wheels, slope within 20 deg, without load (ISO 8855).",
        ("front",)),
    Definition("steering_ratio_10deg", "-", lambda axle: _ratio_at(axle, 10.0),
        "Steering wheel angle over mean steer angle, at a mean steer angle of 10 deg.", ("front",)),
    Definition("steering_ratio_25deg", "-", lambda axle: _ratio_at(axle, 25.0),
        "Steering wheel angle over mean steer angle, at a mean steer angle of 25 deg.", ("front",)),
    Definition("rack_travel", "mm/rev", _rack_travel,
        "Travel of the rack per turn of the steering wheel, within 20 deg.", ("front",)),
    Definition("greatest_inner_angle", "deg", lambda axle: _at_lock(axle)[0],
        "Steer angle of the inner wheel at full lock, from straight ahead, without load.", ("front",)),
    Definition("greatest_outer_angle", "deg", lambda axle: _at_lock(axle)[1],
        "Steer angle of the outer wheel at full lock, from straight ahead, without load.", ("front",)),
    Definition("ackermann", "%", _ackermann,
        "Difference of inner and outer steer angle over the ideal difference, at 20 deg of the inner wheel. Ideal "
        "difference: cot(outer) - cot(inner) = distance of the steering axes on the ground / wheelbase. Angles from "
        "straight ahead; 0 is parallel steering, 100 pure rolling at walking pace (Milliken 1995, ch. 19).",
        ("front",)),
    Definition("turning_circle", "m", _turning_circle,
        "Diameter of the kerb circle at full lock and walking pace: path of the outer front tyre's outer edge. The car "
        "turns about the point beside its rear axle at which the normals of both front wheels meet on average (mean "
        "cotangent).", ("front",)),
    Definition("parking_lost_angle", "deg", _parking_lost_angle,
        "Steering wheel angle lost in the compliance when the standing car is steered on a dry road. Half the width of "
        "the loop at straight ahead, 0.9 of friction (moment of each tyre: Gough 1956).", ("front",)),
    Definition("rear_steer_range", "deg", _rear_steer_range,
        "Greatest steer angle of a rear wheel by the rear steering actuators, from straight ahead.", ("rear",)),
    Definition("lateral_compliance_centre", "mm/kN", slope("lateral_in_phase", "centre_m", 1e6, 1),
        "Motion of the wheel centre with a side force at the contact points, in phase, within 1 kN."),
    Definition("lateral_compliance_patch", "mm/kN", slope("lateral_in_phase", "contact_m", 1e6, 1),
        "Motion of the contact point with a side force at the contact points, in phase, within 1 kN."),
    Definition("side_force_toe", "deg/kN", lambda axle: _per_side_force(axle, "toe_rad"),
        "Change of the outer wheel's toe angle per side force, in phase, within 1 kN; positive goes to toe-in. The "
        "force acts at the contact points, on both wheels in the same direction, at the outer wheel towards the middle "
        "of the car."),
    Definition("side_force_toe_with_trail", "deg/kN", _side_force_toe_with_trail,
        "`side_force_toe` with the force 30 mm behind the contact point, about the pneumatic trail of a tyre."),
    Definition("side_force_toe_opposed", "deg/kN", slope("lateral_opposed", "toe_rad", 1e3 * DEG),
        "Change of toe angle per side force towards the middle of the car on both wheels, within 1 kN."),
    Definition("side_force_camber", "deg/kN", lambda axle: _per_side_force(axle, "camber_rad"),
        "Change of the outer wheel's camber angle per side force, in phase, within 1 kN; positive leans its top out."),
    Definition("longitudinal_compliance_centre", "mm/kN", slope("longitudinal_centre", "centre_m", 1e6, 0),
        "Motion of the wheel centre with a longitudinal force at the wheel centres, within 1 kN."),
    Definition("longitudinal_compliance_braking", "mm/kN", slope("longitudinal_patch", "centre_m", 1e6, 0),
        "Motion of the wheel centre with a longitudinal force at the contact points, wheels locked, within 1 kN."),
    Definition("braking_recession", "mm", _braking_recession,
        "Rearward motion of the wheel centre under 5 kN of braking at each contact point."),
    Definition("braking_toe", "deg/kN", slope("longitudinal_patch", "toe_rad", -1e3 * DEG),
        "Change of toe angle per braking force at the contact points, wheels locked, within 1 kN; positive is toe-in."),
    Definition("braking_wind_up", "deg/kN", slope("longitudinal_patch", "wind_up_rad", -1e3 * DEG),
        "Rotation of the knuckle per braking force at the contact points, within 1 kN, positive as the wheels roll."),
    Definition("driving_toe", "deg/kN", slope("longitudinal_centre", "toe_rad", 1e3 * DEG),
        "Change of toe angle per driving force at the wheel centres, within 1 kN; positive is toe-in."),
    Definition("aligning_steer", "deg/100Nm", slope("aligning_in_phase", "steer_rad", 100.0 * DEG),
        "Change of steer angle per aligning moment in phase, within 100 N m, positive with the moment."),
    Definition("aligning_toe_opposed", "deg/100Nm", slope("aligning_opposed", "toe_rad", 100.0 * DEG),
        "Change of toe angle per moment towards toe-in on both wheels, within 100 N m."),
    Definition("aligning_camber", "deg/100Nm", slope("aligning_opposed", "camber_rad", 100.0 * DEG),
        "Change of camber angle per moment towards toe-in on both wheels, within 100 N m."),
    Definition("softest_bush", "kN/mm", lambda axle: 1e-3 * float(_bushes_Npmm(axle).min()),
        "Twice the axial stiffness of the softest link, unloaded: one of its two bushes, if both were alike."),
    Definition("stiffest_bush", "kN/mm", lambda axle: 1e-3 * float(_bushes_Npmm(axle).max()),
        "Twice the axial stiffness of the stiffest link, unloaded: one of its two bushes, if both were alike."),
    Definition("top_mount_radial_stiffness", "N/mm", lambda axle: _top_mount_Npmm(axle, "y"),
        "Stiffness of a strut's top mount across its axis: bushing, bent rod and strut tower; none if rigid.",
        ("front",)),
    Definition("top_mount_axial_stiffness", "N/mm", lambda axle: _top_mount_Npmm(axle, "z"),
        "Stiffness of the top mount along the strut or damper; none if rigid."),
    *_modes(),
    Definition("body_roll_frequency_sliding", "Hz", lambda axle: axle.measured.modes.body_roll_sliding.frequency_Hz,
        "Natural frequency of body roll with tyres that slide sideways without resistance, as on air bearings.",
        ("car",)),
    Definition("roll_gradient", "deg/g", lambda axle: _per_g(axle.measured.modes.roll_gradient_radps2pm),
        "Roll angle per lateral acceleration of the standing car on its tyres, linearised (ISO 4138 drives).",
        ("car",)),
    Definition("braking_pitch_gradient", "deg/g", lambda axle: _per_g(axle.measured.modes.pitch_gradient_radps2pm),
        "Pitch angle per deceleration, positive nose down, linearised, with the brake distribution at full pedal.",
        ("car",)),
    Definition("damper_asymmetry", "-", _damper_asymmetry,
        "Force of the damper in rebound over the force in bump, at 0.3 m/s."),
)  # fmt: skip
"""All metrics, in the order of the table."""


@dataclass(frozen=True)
class Target:
    """Target band of a metric."""

    band: tuple[float, ...]
    """Lowest and highest value, in the metric's unit."""
    source: str
    """Source of the band."""
    remark: str = ""
    """Remark about a value outside the band."""


Targets = dict[tuple[str, str], Target]
"""Targets by axle and metric."""


def load_targets(vehicle: str, path: str | os.PathLike[str] | None = None) -> Targets:
    """Read the target bands of a vehicle."""
    file = Path(path) if path is not None else models_dir() / "targets" / f"{vehicle}_kc.toml"
    if path is None and not file.is_file():
        return {}
    table, source = read_toml(file)
    known = {(axle, definition.name) for definition in DEFINITIONS for axle in definition.axles}
    targets = {}
    for axle, metrics in table.items():
        if not isinstance(metrics, dict):
            raise source.fail([axle], "a table [axle.metric] is needed")
        for name, entry in metrics.items():
            if (axle, name) not in known:
                words = nearest_names(f"{axle}.{name}", [".".join(pair) for pair in known])
                raise source.fail([axle, name], f"there is no such metric; {words}")
            targets[axle, name] = _target(entry, source, (axle, name))
    return targets


def _target(entry: object, source: Source, path: tuple[str, str]) -> Target:
    if not isinstance(entry, dict):
        raise source.fail(path, "a table with band and source is needed")
    target = build(Target, entry, source, path)
    if len(target.band) != 2 or not target.band[0] <= target.band[1]:
        raise source.fail([*path, "band"], f"{list(target.band)} given; a lowest and a highest value are needed")
    return target
