"""Contact of a wheel with an uneven road, reduced to an effective plane.

The tyre's formula needs a plane. There are three ways to find it, from the point straight below the lowest point of the
wheel:

* `SINGLE_POINT`: tangent plane of the road at that place.
* `FOUR_POINT`: plane through the middles of four points, `FOUR_POINT_AHEAD` of the free radius ahead and behind, and
  `BESIDE` of the tyre's width to the left and right.
* `ENVELOPING`: two elliptical cams roll over the road in the plane of the wheel, one behind the other. The mean of
  their heights is the height of the plane, the difference over their distance its forward slope. The difference of the
  road `BESIDE` of the width to the left and right is its sideways slope. The cam touches the road at one point, so its
  path is that of a tyre over a step: the contact begins before the step and ends after it.

The cams follow |x/a|^c + |z/b|^c = 1 with a = `ELLIPS_LENGTH` R0, b = `ELLIPS_HEIGHT` R0, c = `ELLIPS_ORDER`; their
distance is `ELLIPS_SHIFT` times the length of the contact patch at the nominal load of the tyre file.

Range: the parameters (1.471, 0.9622, 1.5174, 0.8335) are those of the tyre file of a 205/60 R15 in Pacejka's book,
whose `ELLIPS_MAX_STEP` is 25 mm. The belt's own vibration is not modelled. The distance of the cams does not follow the
load.

Sources, which were not available when this was written: Schmeitz, A semi-empirical three-dimensional model of the
pneumatic tyre rolling over arbitrarily uneven road surfaces, TU Delft 2004; Pacejka, Tire and Vehicle Dynamics, 3rd ed.
2012.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.native.compilation import compiled
from activesteer.native.records import numbers_type
from activesteer.road.obstacles import PLATEAU
from activesteer.road.surface import (
    COARSE_M,
    ENVELOPING,
    SINGLE_POINT,
    height_at,
    level_at,
    near_obstacles,
    rise_at,
)
from activesteer.tyre.kernels.vertical import contact_patch, effective_rolling_radius
from activesteer.tyre.tyre_parameters import TyreParameters

FOUR_POINT_AHEAD: Final = 0.1
BESIDE: Final = 0.3
CAM_POINTS: Final = 65
_CAM_STEP_M: Final = 0.006
"""Distance of the tabulated points of a cam [m]: 64 of them reach 0.38 m, beyond any step that a tyre survives."""
_FINE_M: Final = 0.0004
"""Distance of the last places of a cam's search for an obstacle [m]: a 25 mm step changes its height by <= 0.1 mm."""
_GRID_M: Final = 0.002
"""The same for a grid, whose slopes are a tenth of a step's [m]."""

_LEAST_RATE: Final = 1e-3
"""Sine of the least angle between a wheel's heading and the edge of a step at which it rolls over that edge."""

CAM: Final = numbers_type("distance_m", "reach_m", "beside_m", ("drop_m", CAM_POINTS))
"""Cams of a wheel: their distance, the half length of the table of `drop_m`, the height of the cam above its lowest
point in steps of `_CAM_STEP_M`, and half the width over which the sideways slope is taken."""


def cam_record(tyre: TyreParameters, pressure_Pa: float) -> NDArray[Any]:
    """Return the cams of a tyre, a `CAM` record."""
    radius = tyre["UNLOADED_RADIUS"]
    half_length, half_height, order = (
        tyre["ELLIPS_LENGTH"] * radius, tyre["ELLIPS_HEIGHT"] * radius, tyre["ELLIPS_ORDER"],
    )  # fmt: skip
    length, _ = contact_patch(tyre.record, tyre["FNOMIN"], pressure_Pa)
    x = np.minimum(_CAM_STEP_M * np.arange(CAM_POINTS), half_length)
    drop = half_height * (1.0 - (1.0 - (x / half_length) ** order) ** (1.0 / order))
    numbers = (tyre["ELLIPS_SHIFT"] * length, float(x[-1]), BESIDE * tyre["WIDTH"], drop)
    return np.array([numbers], CAM)


@compiled
def _cam_height(surface, numbers, obstacles, first, last, cam, reach, coarse, s, d, ahead_s, ahead_d):
    """Return height and forward slope of a cam at its lowest point."""
    best, at = -math.inf, 0.0
    count = math.ceil(reach / coarse)
    for index in range(-count, count + 1):
        x = index * coarse
        z = level_at(surface, numbers, obstacles, first, last, s + x * ahead_s, d + x * ahead_d) - _drop(cam, abs(x))
        if z > best:
            best, at = z, x
    for index in range(first, last):
        # A cam touches a step at its corner, which is between the places above.
        it = obstacles[index]
        rate = ahead_s + it.skew * ahead_d
        if it.shape == PLATEAU and abs(rate) > _LEAST_RATE:
            inside = it.edge_m if it.height_m > 0.0 else 0.0
            for corner in (inside, it.length_m - inside):
                x = (it.start_m + corner - s - it.skew * d) / rate
                if abs(x) <= cam.reach_m:
                    z = level_at(surface, numbers, obstacles, first, last, s + x * ahead_s, d + x * ahead_d)
                    z -= _drop(cam, abs(x))
                    if z > best:
                        best, at = z, x
    step, fine = 0.5 * coarse, _GRID_M if first >= last else _FINE_M
    while step > fine:
        middle = at
        for side in (-1.0, 1.0):
            x = middle + side * step
            z = level_at(surface, numbers, obstacles, first, last, s + x * ahead_s, d + x * ahead_d)
            z -= _drop(cam, abs(x))
            if z > best:
                best, at = z, x
        step *= 0.5
    # Where the cam touches, its slope is that of its path (envelope theorem), at a corner too.
    place = min(abs(at) / _CAM_STEP_M, CAM_POINTS - 1.000001)
    index = int(place)
    slope = (cam.drop_m[index + 1] - cam.drop_m[index]) / _CAM_STEP_M
    if index == 0:
        slope *= 1.5 * math.sqrt(place)
    return best, math.copysign(slope, at)


@compiled
def _drop(cam, x):
    """Return the height of a cam above its lowest point at a distance [m]."""
    place = x / _CAM_STEP_M
    index = int(place)
    if index >= CAM_POINTS - 1:
        return cam.drop_m[CAM_POINTS - 1] + 10.0 * (x - cam.reach_m)
    part = place - index
    if index == 0:
        # Near its lowest point a cam is as flat as x^1.5, the nearest simple power to the ellipses of tyres.
        part *= math.sqrt(part)
    return cam.drop_m[index] + part * (cam.drop_m[index + 1] - cam.drop_m[index])


@compiled
def contact_plane(
    surface, numbers, obstacles, cam, along, across, cos, sin, stretch, heading_x, heading_y, free_radius
):
    """Return the effective plane of a tyre: height, slopes, and change of the forward slope [1/m]."""
    first, last, highest = near_obstacles(obstacles, along, across)
    if first >= last and surface.rows == 0.0 and surface.slopes == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    ahead_s = (heading_x * cos + heading_y * sin) * stretch
    ahead_d = heading_y * cos - heading_x * sin
    left_s = -ahead_d * stretch
    left_d = heading_x * cos + heading_y * sin
    if surface.contact == SINGLE_POINT:
        z, z_s, z_d = height_at(surface, numbers, obstacles, first, last, along, across)
        return z, z_s * ahead_s + z_d * ahead_d, z_s * left_s + z_d * left_d, 0.0
    beside = cam.beside_m
    left = level_at(surface, numbers, obstacles, first, last, along + beside * left_s, across + beside * left_d)
    right = level_at(surface, numbers, obstacles, first, last, along - beside * left_s, across - beside * left_d)
    sideways = (left - right) / (2.0 * beside)
    if surface.contact != ENVELOPING:
        ahead = FOUR_POINT_AHEAD * free_radius
        front = height_at(surface, numbers, obstacles, first, last, along + ahead * ahead_s, across + ahead * ahead_d)[
            0
        ]
        rear = level_at(surface, numbers, obstacles, first, last, along - ahead * ahead_s, across - ahead * ahead_d)
        return 0.25 * (left + right + front + rear), (front - rear) / (2.0 * ahead), sideways, 0.0
    rise = rise_at(surface, numbers, along) + highest
    coarse = surface.coarse_m if first >= last else COARSE_M
    reach = coarse
    while reach < cam.reach_m and _drop(cam, reach) < rise:
        reach += coarse
    half = 0.5 * cam.distance_m
    front, front_slope = _cam_height(
        surface, numbers, obstacles, first, last, cam, reach, coarse, along + half * ahead_s, across + half * ahead_d,
        ahead_s, ahead_d,
    )  # fmt: skip
    rear, rear_slope = _cam_height(
        surface, numbers, obstacles, first, last, cam, reach, coarse, along - half * ahead_s, across - half * ahead_d,
        ahead_s, ahead_d,
    )  # fmt: skip
    return 0.5 * (front + rear), (front - rear) / cam.distance_m, sideways, (front_slope - rear_slope) / cam.distance_m


@compiled
def plane_axes(forward, sideways, heading_x, heading_y):
    """Return normal and axes of a plane in world axes, with the first axis above world x."""
    slope_x = forward * heading_x - sideways * heading_y
    slope_y = forward * heading_y + sideways * heading_x
    nz = 1.0 / math.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    nx, ny = -slope_x * nz, -slope_y * nz
    level = 1.0 / math.sqrt(1.0 + slope_x * slope_x)
    ax, az = level, slope_x * level
    # n x a, with a in the plane of x and z.
    return nx, ny, nz, ax, 0.0, az, ny * az, nz * ax - nx * az, -ny * ax


@compiled
def spin_on_bend(p, spin, speed, bend, loaded_radius, pressure_Pa):
    """Return the spin of a tyre on a road that bends along its heading [rad/s]."""
    # The tread rolls on the road relative to the normal of the plane, which turns with the speed times the bend. The
    # contact point lags behind the centre by the loaded radius times that rate.
    rolling = effective_rolling_radius(p, p.FNOMIN, spin, pressure_Pa)
    return spin - (loaded_radius - rolling) / rolling * bend * speed
