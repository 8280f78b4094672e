"""Steering of the front wheels by the rack, from the points of the front axle or from its measurements."""

from __future__ import annotations

import math

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ParameterError
from activesteer.vehicle_builder.design import Axle


def _steering_axis(front: Axle) -> tuple[Array, Array]:
    """Return lower and upper point of the front steering axis, without elasticity."""
    upper = front.points["strut_top" if front.kind.strut else "uca_outer"]
    return front.points["lca_outer"], upper


def rack_sign(front: Axle) -> float:
    """Return the sign of the rack's y when the left wheel steers left; default: that of tie rods behind the axle."""
    if front.kind.guided:
        return -1.0
    return math.copysign(1.0, _rack_per_steer(_steering_axis(front), *_tie_rod(front)))


def _tie_rod(front: Axle) -> tuple[Array, Array]:
    return front.points["tie_rod_inner"], front.points["tie_rod_outer"]


def _rack_per_steer(axis: tuple[Array, Array], inner: Array, outer: Array) -> float:
    """Return the rack travel to the left per steer angle of the left wheel, rigid links [m/rad]."""
    along = (axis[1] - axis[0]) / np.linalg.norm(axis[1] - axis[0])
    rod = outer - inner
    if abs(rod[1]) < 1e-3:
        raise ParameterError(
            "the tie rod does not run across the car: tie_rod_inner and tie_rod_outer have the same y", key="front"
        )
    moved = np.cross(along, outer - axis[0])
    per_steer = float(rod @ moved / rod[1])
    if abs(per_steer) < 0.02:
        raise ParameterError(
            f"the tie rod passes the steering axis at {1e3 * abs(per_steer):.0f} mm and cannot steer the wheel; "
            "tie_rod_outer has to lie ahead of or behind the line through the upper and the lower joint",
            key="front",
        )
    return per_steer


def rack_per_steer_m(front: Axle) -> float:
    """Return the rack travel per steer angle about straight ahead, positive, rigid links [m/rad]."""
    if front.measured is not None:
        rack, steer = front.measured.curves.rack_m, front.measured.curves.rack_steer_rad
        near = np.argsort(np.abs(rack))[:5]
        return 1.0 / float(np.polyfit(np.array(rack)[near], np.array(steer)[near], 1)[0])
    return abs(_rack_per_steer(_steering_axis(front), *_tie_rod(front)))


def rack_limit_m(front: Axle) -> float:
    """Return the travel of the rack to its stops: the measured range, or 36 deg of steer angle [m]."""
    if front.measured is not None:
        return min(-front.measured.curves.rack_m[0], front.measured.curves.rack_m[-1])
    return round(0.92 * rack_per_steer_m(front) * math.sin(math.radians(36.0)), 4)
