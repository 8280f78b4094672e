"""The road with a surface on which motion is seen, and what the driver follows on it: lanes, cones, path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import mujoco
import numpy as np

_TEXTURE: Final = "road"
_DRY: Final = (0.37, 0.375, 0.385)
_ICE: Final = (0.62, 0.7, 0.78)
_ICE_MU: Final = 0.1
_DRY_MU: Final = 0.8
_TILE_M: Final = 5.0
"""Side of a square of the road's chequered surface [m]."""

_LANE: Final = (0.95, 0.95, 0.93, 1.0)
_PATH: Final = (0.98, 0.8, 0.15, 0.9)
_CONE: Final = (1.0, 0.4, 0.05, 1.0)
_STRIPE: Final = (0.97, 0.97, 0.97, 1.0)
_BASE: Final = (0.12, 0.12, 0.13, 1.0)
_CONE_HEIGHT_M: Final = 0.5
_CONE_RADIUS_M: Final = 0.14
_LINE_M: Final = 0.12
"""Width of lines on the road [m]."""
_DASH_M: Final = 1.5
_GAP_M: Final = 2.5
_FAR_M: Final = 2000.0
"""How far a side of the road with its own friction goes [m]."""
_MOST_PATCHES: Final = 1000
"""Most patches that are drawn: beyond it a road is rather a table than a picture."""


def add_road(spec: mujoco.MjSpec, road: Mapping[str, Any]) -> None:
    """Adds the surface, the bluer the less grip there is.

    Args:
        spec: The model.
        road: The road, as in the metadata of a recording; only its friction `mu` counts here.
    """
    colour = np.array(_colour(float(road.get("mu", 1.0))))
    spec.add_texture(
        name=_TEXTURE,
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=colour * 1.04,
        rgb2=colour * 0.94,
        mark=mujoco.mjtMark.mjMARK_RANDOM,
        markrgb=colour * 1.35,
        random=0.03,
        width=512,
        height=512,
    )
    material = spec.add_material(name=_TEXTURE, texuniform=True, texrepeat=(0.5 / _TILE_M, 0.5 / _TILE_M), specular=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = _TEXTURE
    spec.worldbody.add_geom(
        name="road",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0.0, 0.0, 1.0),
        material=_TEXTURE,
        contype=0,
        conaffinity=0,
    )


def add_patches(spec: mujoco.MjSpec, road: Mapping[str, Any]) -> None:
    """Adds what of the road has a friction of its own.

    Args:
        spec: The model.
        road: `mu`, `mu_left`, `mu_right` and `patches`, as in the metadata of a recording; in the same order they
            hide each other.
    """
    sides = {"left": (0.0, _FAR_M), "right": (-_FAR_M, 0.0), "both": (-_FAR_M, _FAR_M)}
    areas = [(side, road.get(f"mu_{side}"), -_FAR_M, _FAR_M) for side in ("left", "right")]
    areas += [
        (patch["side"], patch["mu"], patch["start_m"], patch["end_m"])
        for patch in list(road.get("patches", ()))[:_MOST_PATCHES]
    ]
    height = 0.004
    for side, mu, begin, finish in areas:
        if mu is None:
            continue
        start, end = max(float(begin), -_FAR_M), min(float(finish), _FAR_M)
        if start >= end:
            continue
        right, left = sides[side]
        _box(spec, (start, end), (right, left), height, (*_colour(float(mu)), 1.0))
        height += 0.0005


def add_course(spec: mujoco.MjSpec, course: Mapping[str, Any]) -> None:
    """Adds lanes, cones and the path in dashes.

    Args:
        spec: The model.
        course: As in the metadata of a recording.
    """
    half = 0.5 * _LINE_M
    for lane in course["lanes"]:
        x = (lane["start_x_m"], lane["end_x_m"])
        y = (lane["right_y_m"], lane["left_y_m"])
        for side in y:
            _box(spec, x, (side - half, side + half), 0.012, _LANE)
        for end in x:
            _box(spec, (end - half, end + half), y, 0.012, _LANE)
    _add_path(spec, course["path"])
    cones = np.reshape(np.asarray(course["cones"], np.float64), (-1, 2))
    if len(cones):
        _add_cones(spec, cones)


def _add_path(spec: mujoco.MjSpec, path: Mapping[str, Any]) -> None:
    x, y = np.asarray(path["x_m"], np.float64), np.asarray(path["y_m"], np.float64)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    starts = np.arange(0.0, along[-1] - _DASH_M, _DASH_M + _GAP_M)
    for start in starts:
        ends = start, start + _DASH_M
        (x0, x1), (y0, y1) = np.interp(ends, along, x), np.interp(ends, along, y)
        half = 0.5 * np.arctan2(y1 - y0, x1 - x0)
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=(0.5 * float(np.hypot(x1 - x0, y1 - y0)), 0.05, 0.01),
            pos=(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0),
            quat=(np.cos(half), 0.0, 0.0, np.sin(half)),
            rgba=_PATH,
            contype=0,
            conaffinity=0,
        )


def _add_cones(spec: mujoco.MjSpec, cones: np.ndarray) -> None:
    """A cone of three rings, the middle one white, on a foot."""
    third = _CONE_HEIGHT_M / 3.0
    rings = []
    for number, colour in enumerate((_CONE, _STRIPE, _CONE)):
        below, above = (_CONE_RADIUS_M * (1.0 - 0.85 * (number + step) / 3.0) for step in (0, 1))
        mesh = spec.add_mesh(name=f"cone_{number}")
        mesh.make_cone(12, above / below)
        mesh.scale = (below, below, 0.5 * third)
        rings.append((mesh.name, 0.03 + third * number, colour))
    for x, y in cones:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=(1.25 * _CONE_RADIUS_M, 1.25 * _CONE_RADIUS_M, 0.015),
            pos=(x, y, 0.015),
            rgba=_BASE,
            contype=0,
            conaffinity=0,
        )
        for mesh, height, colour in rings:
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname=mesh,
                pos=(x, y, height),
                rgba=colour,
                contype=0,
                conaffinity=0,
            )


def _box(
    spec: mujoco.MjSpec,
    x: tuple[float, float],
    y: tuple[float, float],
    height: float,
    rgba: tuple[float, ...],
) -> None:
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0]), height),
        pos=(0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]), 0.0),
        rgba=rgba,
        contype=0,
        conaffinity=0,
    )


def _colour(mu: float) -> tuple[float, float, float]:
    grip = float(np.clip((mu - _ICE_MU) / (_DRY_MU - _ICE_MU), 0.0, 1.0))
    r, g, b = (grip * dry + (1.0 - grip) * ice for dry, ice in zip(_DRY, _ICE, strict=True))
    return r, g, b
