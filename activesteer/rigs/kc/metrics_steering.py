"""Metrics of steering axes and steering system. Each docstring is the definition."""

from __future__ import annotations

import math

import numpy as np

from activesteer.rigs.kc.definitions import Axle, metric
from activesteer.rigs.kc.metrics_support import wheelbase

_ON_CENTRE_RAD = math.radians(20.0)


@metric("deg")
def caster(axle: Axle) -> float:
    """Angle of the steering axis to the vertical in side view, positive with the top to the rear (ISO 8855).

    Front axle: the axis about which the wheel turns at a fixed damper length. Rear axle: the axis of the steering
    hinge.
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


def mean_steer_rad(axle: Axle, sweep: str = "steering_rolling") -> np.ndarray:
    """Mean steer angle of the front wheels, shape (n,)."""
    return axle.sweep(sweep).steer_rad[:, :2].mean(axis=1)


def ratio_curve(axle: Axle) -> tuple[np.ndarray, np.ndarray]:
    """Mean steer angle [rad] and the local overall steering ratio there: steering wheel angle over steer angle."""
    mean = mean_steer_rad(axle)
    return mean, np.gradient(axle.sweep("steering_rolling").x, mean, edge_order=2)


@metric("-", "front")
def steering_ratio(axle: Axle) -> float:
    """Steering wheel angle over mean steer angle of the front wheels, slope within 20 deg, without load (ISO 8855)."""
    wheel = axle.sweep("steering_rolling").x
    near = np.abs(wheel) <= _ON_CENTRE_RAD * (1.0 + 1e-9)
    return 1.0 / float(np.polyfit(wheel[near], mean_steer_rad(axle)[near], 1)[0])


def _ratio_at(axle: Axle, steer_deg: float) -> float:
    """Total steering wheel angle over total mean steer angle, at a given mean steer angle."""
    mean = mean_steer_rad(axle)
    sides = [np.interp(sign * math.radians(steer_deg), mean, axle.sweep("steering_rolling").x) for sign in (1.0, -1.0)]
    return math.degrees(float(sides[0] - sides[1]) / 2.0) / steer_deg


@metric("-", "front")
def steering_ratio_10deg(axle: Axle) -> float:
    """Steering wheel angle over mean steer angle, at a mean steer angle of 10 deg."""
    return _ratio_at(axle, 10.0)


@metric("-", "front")
def steering_ratio_25deg(axle: Axle) -> float:
    """Steering wheel angle over mean steer angle, at a mean steer angle of 25 deg."""
    return _ratio_at(axle, 25.0)


@metric("mm/rev", "front")
def rack_travel(axle: Axle) -> float:
    """Travel of the rack per turn of the steering wheel, within 20 deg."""
    sweep = axle.sweep("steering_rolling")
    near = np.abs(sweep.x) <= _ON_CENTRE_RAD * (1.0 + 1e-9)
    return 2e3 * math.pi * float(np.polyfit(sweep.steering_wheel_rad[near], sweep.rack_m[near], 1)[0])


@metric("deg", "front")
def greatest_inner_angle(axle: Axle) -> float:
    """Steer angle of the inner wheel at full lock, from straight ahead, without load."""
    return _at_lock(axle)[0]


@metric("deg", "front")
def greatest_outer_angle(axle: Axle) -> float:
    """Steer angle of the outer wheel at full lock, from straight ahead, without load."""
    return _at_lock(axle)[1]


def _at_lock(axle: Axle) -> tuple[float, float]:
    steer = _from_straight(axle)
    return math.degrees(steer[-1, 0]), math.degrees(steer[-1, 1])


def _from_straight(axle: Axle) -> np.ndarray:
    """Steer angles of both front wheels relative to straight ahead [rad], shape (n, 2)."""
    sweep = axle.sweep("steering_rolling")
    steer = sweep.steer_rad[:, :2]
    return steer - steer[sweep.zero]


@metric("%", "front")
def ackermann(axle: Axle) -> float:
    """Difference of inner and outer steer angle over the ideal difference, at 20 deg of the inner wheel.

    Ideal difference: cot(outer) - cot(inner) = distance of the steering axes on the ground / wheelbase. Angles from
    straight ahead; 0 is parallel steering, 100 pure rolling at walking pace (Milliken 1995, ch. 19).
    """
    steer = _from_straight(axle)
    inner = math.radians(20.0)
    if steer[-1, 0] < inner:
        return math.nan
    left_turn = steer[:, 0] > 0.0
    outer = float(np.interp(inner, steer[left_turn, 0], steer[left_turn, 1]))
    left, right = (axis.point_m[1] for axis in axle.axes)
    base = 1e-3 * wheelbase(Axle("car", axle.measured))
    ideal = math.atan(1.0 / (1.0 / math.tan(inner) + (left - right) / base))
    return 100.0 * (inner - outer) / (inner - ideal)


@metric("m", "front")
def turning_circle(axle: Axle) -> float:
    """Diameter of the kerb circle at full lock and walking pace: path of the outer front tyre's outer edge.

    The car turns about the point beside its rear axle at which the normals of both front wheels meet on average (mean
    cotangent).
    """
    inner, outer = (math.radians(angle) for angle in _at_lock(axle))
    sweep = axle.sweep("steering_rolling")
    contact = sweep.contact_m[-1]
    base = float(contact[:2, 0].mean() - contact[2:, 0].mean())
    radius = base * 0.5 * (1.0 / math.tan(inner) + 1.0 / math.tan(outer))
    reach = math.hypot(radius + abs(float(contact[1, 1])), base)
    return 2.0 * (reach + 0.5 * axle.tyre.width_m)


@metric("deg", "front")
def parking_lost_angle(axle: Axle) -> float:
    """Steering wheel angle lost in the compliance when the standing car is steered on a dry road.

    Half the width of the loop at straight ahead, 0.9 of friction (moment of each tyre: Gough 1956).
    """
    left, right = (axle.sweep(f"steering_at_rest_{side}") for side in ("left", "right"))
    angles = [
        float(np.interp(0.0, mean_steer_rad(axle, f"steering_at_rest_{side}"), sweep.x))
        for side, sweep in (("left", left), ("right", right))
    ]
    return math.degrees(angles[0] - angles[1]) / 2.0


@metric("deg", "rear")
def rear_steer_range(axle: Axle) -> float:
    """Greatest steer angle of a rear wheel by the rear steering actuators, from straight ahead."""
    sweep = axle.sweep("rear_steering")
    steer = sweep.steer_rad[:, 2:]
    return math.degrees(float(np.abs(steer - steer[sweep.zero]).max()))
