"""Metrics of steering and compliance, and of the linearised standing car on its tyres."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import mujoco
import numpy as np

from activesteer.conventions import GRAVITY_MPS2, Array
from activesteer.rigs.kc.definitions import DEG, Axle, AxleName, Definition, Evaluate, slope
from activesteer.rigs.kc.held_car import MOUNT_ENDINGS
from activesteer.rigs.kc.metrics_travel import TRAVEL_METRICS, wheelbase_mm
from activesteer.rigs.kc.modes import NAMES
from activesteer.rigs.kc.sweep import INWARDS
from activesteer.vehicle.curve_axles import HOLDING_TENDON

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
    """Stiffness of one of two equal bushes in series in each link, unloaded; nan for an axle without links [N/mm]."""
    model = axle.measured.vehicle.model
    rates = []
    for index in range(model.ntendon):
        name = model.tendon(index).name
        if name.startswith(f"{axle.name[0]}l_") and not name.endswith(_NOT_LINKS):
            rates.append(2e-3 * float(model.tendon_stiffness[index]))
    return np.array(rates or [np.nan])


def _top_mount_Npmm(axle: Axle, direction: str) -> float:
    """Stiffness of the left top mount; nan for a rigid one [N/mm]."""
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
