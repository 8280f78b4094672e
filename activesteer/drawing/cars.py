"""Outlines and bodies of cars, only for drawings; `tools/make_bodies.py` creates them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import Array
from activesteer.recording import Primitive, ScenePart
from activesteer.resources import models_dir
from activesteer.road.course import Footprint

_ASPHALT: Final = np.array((88.0, 90.0, 94.0))
_ABOVE: Final = np.array((228.0, 190.0, 120.0))
_BELOW: Final = np.array((40.0, 62.0, 120.0))


def bytes_of(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue of `#rrggbb`, 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def shares_of(colour: str) -> tuple[float, float, float]:
    """Return red, green and blue of `#rrggbb`, 0 to 1."""
    red, green, blue = bytes_of(colour)
    return red / 255.0, green / 255.0, blue / 255.0


def height_colours(heights_m: Array) -> NDArray[np.uint8]:
    """Return the colours of heights: grey at 0, lighter above, darker below, up to the largest height or 20 mm."""
    share = heights_m / max(0.02, float(np.abs(heights_m).max(initial=0.0)))
    above, below = np.clip(share, 0.0, 1.0)[:, None], np.clip(-share, 0.0, 1.0)[:, None]
    colours = _ASPHALT + above * (_ABOVE - _ASPHALT) + below * (_BELOW - _ASPHALT)
    return np.round(colours).astype(np.uint8)


_HIDDEN_M: Final = 0.2
_SEEN_M: Final = 1.0


def share_seen(apart_m: Array | float) -> Array:
    """Return the opacity factor of a ghost, which fades out between 1 m and 0.2 m from the car."""
    # Two surfaces in one place would show through each other in patches.
    return np.clip((apart_m - _HIDDEN_M) / (_SEEN_M - _HIDDEN_M), 0.0, 1.0)


SLOWEST_MPS: Final = 1.0
"""Speed below which the direction is kept [m/s]. The direction of a car at rest is not defined."""
_STEADY_S: Final = 0.35
"""Standard deviation of the averaging window of a camera's direction [s]: quick motion stays visible."""


def direction_of_motion(time_s: Array, places_m: Array, heading_rad: Array) -> Array:
    """Return the smoothed, continuous direction of motion over the ground [rad], left positive, shape (k,)."""
    if len(time_s) < 2:
        return np.unwrap(heading_rad)
    velocity = np.asarray(np.gradient(places_m, time_s, axis=0))
    moves = np.hypot(*velocity.T) > SLOWEST_MPS
    last = np.maximum.accumulate(np.where(moves, np.arange(len(time_s)), -1))
    direction = np.arctan2(velocity[:, 1], velocity[:, 0])[last]
    first = int(np.argmax(moves)) if moves.any() else len(time_s)
    direction[:first] = heading_rad[:first]
    return _smooth(time_s, np.unwrap(direction))


def _smooth(time_s: Array, values: Array) -> Array:
    """Return a zero-phase Gaussian moving average, with the end values continued."""
    step = float(np.median(np.diff(time_s)))
    reach = round(4.0 * _STEADY_S / step)
    offsets = np.arange(-reach, reach + 1) * step
    weights = np.exp(-0.5 * (offsets / _STEADY_S) ** 2)
    # Poses are evenly spaced except for gaps in a damaged file.
    even = np.arange(time_s[0] - reach * step, time_s[-1] + (reach + 1) * step, step)
    averaged = np.convolve(np.interp(even, time_s, values), weights / weights.sum(), mode="same")
    return np.asarray(np.interp(time_s, even, averaged), np.float64)


CHASSIS: Final = "chassis"
"""Body that carries the shell and that cameras follow."""
SEE_THROUGH: Final = 0.5
"""Opacity below which a solid of a model is part of its shell."""
_SALOON_FROM_M: Final = 2.72
"""Least wheelbase of a car that is drawn as a saloon [m]. Others are hatchbacks."""
_DRAWN: Final = {"hatchback": (2.637, 1.8), "saloon": (2.85, 1.86)}
"""Wheelbase and width of the surfaces [m]."""
_COLOURS: Final = {
    "glass": (0.07, 0.09, 0.12),
    "trim": (0.06, 0.06, 0.07),
    "lamp": (0.93, 0.95, 0.98),
    "tail": (0.72, 0.04, 0.05),
    "plate": (0.94, 0.94, 0.9),
    "tyre": (0.05, 0.05, 0.055),
    "dark": (0.1, 0.1, 0.11),
    "rim": (0.75, 0.77, 0.8),
    "mark": (0.95, 0.75, 0.1),
}


class BodySurface(NamedTuple):
    """A surface of one colour, fixed in the frame of a body."""

    body: str  # name of the body
    name: str  # name of the part, such as `glass`
    vertices_m: Array  # its points in the frame of the body [m], shape (n, 3)
    normals: Array  # directions of the surface there, shape (n, 3)
    faces: NDArray[np.int32]  # corners of its triangles, counter-clockwise from outside, shape (m, 3)
    rgb: tuple[float, float, float] | None  # its colour, 0 to 1; None for the paint of the car

    @property
    def shell(self) -> bool:
        """True for a surface of the body, False for a wheel."""
        return not self.body.endswith("_wheel")


def dressed(
    parts: Sequence[ScenePart], size: Footprint | None
) -> tuple[tuple[ScenePart, ...], tuple[BodySurface, ...]]:
    """Return the solids of a car and, if its size is known, the surfaces of its body and wheels."""
    if size is None:
        return tuple(parts), ()
    solids = [part for part in parts if isinstance(part, Primitive)]
    shell = [solid for solid in solids if solid.body == CHASSIS and solid.rgba[3] < SEE_THROUGH]
    panels = list(_body(size)) if shell else []
    hidden = {id(solid) for solid in shell}
    for body in dict.fromkeys(solid.body for solid in solids if solid.body.endswith("_wheel")):
        tyre = max((solid for solid in solids if solid.body == body), key=lambda solid: solid.size_m[0])
        hidden |= {id(solid) for solid in solids if solid.body == body}
        panels += _wheel(body, 0.5 * tyre.size_m[0], tyre.size_m[2])
    return tuple(part for part in parts if id(part) not in hidden), tuple(panels)


def _body(size: Footprint) -> tuple[BodySurface, ...]:
    name = "saloon" if size.wheelbase_m > _SALOON_FROM_M else "hatchback"
    wheelbase_m, width_m = _DRAWN[name]
    panels = []
    for part, vertices, normals, faces in _surfaces(name):
        points = vertices * (1.0, size.width_m / width_m, 1.0)
        # Only the part between the axles becomes longer.
        points[:, 0] -= np.clip(-points[:, 0] / wheelbase_m, 0.0, 1.0) * (size.wheelbase_m - wheelbase_m)
        panels.append(BodySurface(CHASSIS, part, points, normals, faces, _COLOURS.get(part)))
    return tuple(panels)


def _wheel(body: str, radius_m: float, width_m: float) -> list[BodySurface]:
    return [
        BodySurface(body, part, vertices * (radius_m, width_m, radius_m), normals, faces, _COLOURS[part])
        for part, vertices, normals, faces in _surfaces("wheel")
    ]


@cache
def _surfaces(name: str) -> tuple[tuple[str, Array, Array, NDArray[np.int32]], ...]:
    with np.load(models_dir() / "bodies" / f"{name}.npz") as file:
        return tuple(
            (
                part,
                file[f"{part}_vertices"].astype(np.float64),
                file[f"{part}_normals"] / 127.0,
                file[f"{part}_faces"].astype(np.int32),
            )
            for part in (key.removesuffix("_faces") for key in file if key.endswith("_faces"))
        )
