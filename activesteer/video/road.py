"""Road with a chequered surface, which shows motion, and lanes, cones and path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np

from activesteer.core.conventions import Array
from activesteer.core.path import Path
from activesteer.drawing.cars import height_colours
from activesteer.road.course import CONE_HEIGHT_M, CONE_RADIUS_M, Course
from activesteer.road.drawn import DrawnSurface
from activesteer.road.road import Road

_TEXTURE: Final = "road"
_SURFACE: Final = "uneven_road"
_BANDS: Final = 8
_LEAST_BAND_M: Final = 0.004
"""Colours above and below the plane, and least height of the band of one colour [m]."""
_SURFACE_TILE_M: Final = 1.0
"""Side length of a square on an uneven surface [m], whose shape smaller squares show."""
_DRY: Final = (0.37, 0.375, 0.385)
_ICE: Final = (0.62, 0.7, 0.78)
_ICE_MU: Final = 0.1
_DRY_MU: Final = 0.8
_TILE_M: Final = 5.0
"""Side length of a square of the chequered surface [m]."""

_LANE: Final = (0.95, 0.95, 0.93, 1.0)
_PATH: Final = (0.98, 0.8, 0.15, 0.9)
_CONE: Final = (1.0, 0.4, 0.05, 1.0)
_STRIPE: Final = (0.97, 0.97, 0.97, 1.0)
_BASE: Final = (0.12, 0.12, 0.13, 1.0)
_LINE_M: Final = 0.12
"""Width of lines on the road [m]."""
_DASH_M: Final = 1.5
_GAP_M: Final = 2.5
_FAR_M: Final = 2000.0
"""Distance from the origin up to which patches of other friction are drawn [m]."""
_LEAST_HALF_WIDTH_M, _MOST_HALF_WIDTH_M = 3.75, 25.0
"""Half widths of a road without a course [m]. A run that needs more is on an open surface."""
_BESIDE_CAR_M, _BEYOND_M = 2.5, 60.0
"""Room between the middle of a car and the edge, and length of the edges ahead and behind [m]."""
_MARKS_M, _POSTS_M, _POST_M, _POST_HEIGHT_M = 10.0, 50.0, 0.6, 0.9
"""Spacing of marks and of posts, length of a mark and distance of a post from its edge, and its height [m]."""
_MAX_PIECES, _MAX_LANES, _MAX_CONES, _MAX_DASHES = 1000, 1000, 1000, 5000
"""Largest numbers of pieces of patches, lanes, cones and dashes drawn: a scene holds a limited number of solids."""


def add_road(spec: mujoco.MjSpec, road: Road, drawn: DrawnSurface | None = None) -> None:
    """Add the surface, bluer for lower friction."""
    colour = np.array(_colour(road.mu))
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
        pos=(0.0, 0.0, 0.0 if drawn is None else drawn.plane_below_m),
    )
    if drawn is not None:
        _add_surface(spec, *drawn.mesh(road))


def _add_surface(spec: mujoco.MjSpec, corners: np.ndarray, triangles: np.ndarray) -> None:
    """Add a surface in height bands of different colours, because shading hardly shows small slopes."""
    heights = corners[triangles, 2].mean(axis=1)
    width = max(_LEAST_BAND_M, float(np.abs(heights).max()) / _BANDS)
    bands = np.round(heights / width).astype(int)
    paint = spec.add_material(name=_SURFACE, specular=0.1)
    paint.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = _TEXTURE
    colours = height_colours(width * np.arange(-_BANDS, _BANDS + 1, dtype=np.float64)) / 255.0
    for band in np.unique(bands):
        inside = triangles[bands == band]
        kept, faces = np.unique(inside, return_inverse=True)
        mesh = spec.add_mesh(name=f"{_SURFACE}_{band}", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
        mesh.uservert, mesh.userface = corners[kept].ravel(), faces.ravel()
        mesh.usertexcoord = (0.5 / _SURFACE_TILE_M * corners[kept, :2]).ravel()
        mesh.userfacetexcoord = faces.ravel()
        geom = spec.worldbody.add_geom(name=mesh.name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name)
        if band == 0:
            geom.material = _SURFACE
        else:
            geom.rgba = (*colours[min(max(band, -_BANDS), _BANDS) + _BANDS], 1.0)


def add_areas(spec: mujoco.MjSpec, road: Road) -> None:
    """Add the patches with a different friction, later ones on top of earlier ones."""
    for piece in road.pieces(-_FAR_M, _FAR_M, -_FAR_M, _FAR_M)[:_MAX_PIECES]:
        right, left = piece.corners_m[[0, 1]], piece.corners_m[[3, 2]]
        width, middle = np.linalg.norm(left.mean(axis=0) - right.mean(axis=0)), 0.5 * (left + right)
        # On a bend the longer edge counts, so that no gap opens on the outside.
        longer = max(np.linalg.norm(edge[1] - edge[0]) for edge in (left, right))
        along = 0.5 * longer * (middle[1] - middle[0]) / np.linalg.norm(middle[1] - middle[0])
        start, end = middle.mean(axis=0) - along, middle.mean(axis=0) + along
        height = 0.004 + 0.0005 * piece.area
        _beam(spec, (*start, *end), float(width), height, (*_colour(piece.mu), 1.0))


def add_course(spec: mujoco.MjSpec, course: Course) -> None:
    """Add lanes, cones and the dashed path."""
    half = 0.5 * _LINE_M
    for _, start, end, right, left in course.lanes[:_MAX_LANES]:
        for side in (right, left):
            _box(spec, (start, end), (side - half, side + half), 0.012, _LANE)
        for across in (start, end):
            _box(spec, (across - half, across + half), (right, left), 0.012, _LANE)
    _add_path(spec, course.path)
    if len(course.cones_m):
        _add_cones(spec, course.cones_m[:_MAX_CONES])


def add_edges(spec: mujoco.MjSpec, paths: Sequence[Array]) -> None:
    """Add edges along the cars' paths, with a mark every 10 m and a post every 50 m."""
    x_m, y_m = np.concatenate([path[:, :2] for path in paths]).T
    half_m = max(_LEAST_HALF_WIDTH_M, float(np.abs(y_m).max()) + _BESIDE_CAR_M)
    if half_m > _MOST_HALF_WIDTH_M:
        return
    start, end = float(x_m.min()) - _BEYOND_M, float(x_m.max()) + _BEYOND_M
    half = 0.5 * _LINE_M
    marks, posts = (
        np.arange(np.ceil(start / every_m), np.floor(end / every_m) + 1.0)[:_MAX_LANES] * every_m
        for every_m in (_MARKS_M, _POSTS_M)
    )
    for side in (-1.0, 1.0):
        y, beside = side * half_m, side * (half_m + _POST_M)
        _box(spec, (start, end), (y - half, y + half), 0.012, _LANE)
        for x in marks:
            _box(spec, (x - half, x + half), (min(y, y - side * _POST_M), max(y, y - side * _POST_M)), 0.012, _LANE)
        for x in posts:
            _box(spec, (x - half, x + half), (beside - half, beside + half), _POST_HEIGHT_M, _LANE)


def _add_path(spec: mujoco.MjSpec, path: Path) -> None:
    x, y, along = path.x_m, path.y_m, path.s_m
    starts = np.arange(0.0, min(along[-1] - _DASH_M, _MAX_DASHES * (_DASH_M + _GAP_M)), _DASH_M + _GAP_M)
    for start in starts:
        ends = start, start + _DASH_M
        (x0, x1), (y0, y1) = np.interp(ends, along, x), np.interp(ends, along, y)
        _beam(spec, (x0, y0, x1, y1), 0.1, 0.01, _PATH)


def _add_cones(spec: mujoco.MjSpec, cones: np.ndarray) -> None:
    """Add a cone of three rings, the middle one white, on a base."""
    third = CONE_HEIGHT_M / 3.0
    rings = []
    for number, colour in enumerate((_CONE, _STRIPE, _CONE)):
        below, above = (CONE_RADIUS_M * (1.0 - 0.85 * (number + step) / 3.0) for step in (0, 1))
        mesh = spec.add_mesh(name=f"cone_{number}")
        mesh.make_cone(12, above / below)
        mesh.scale = (below, below, 0.5 * third)
        rings.append((mesh.name, 0.03 + third * number, colour))
    for x, y in cones:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=(1.25 * CONE_RADIUS_M, 1.25 * CONE_RADIUS_M, 0.015),
            pos=(x, y, 0.015),
            rgba=_BASE,
        )
        for mesh, height, colour in rings:
            spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh, pos=(x, y, height), rgba=colour)


def _box(
    spec: mujoco.MjSpec, x: tuple[float, float], y: tuple[float, float], height: float, rgba: tuple[float, ...]
) -> None:
    middle = 0.5 * (y[0] + y[1])
    _beam(spec, (x[0], middle, x[1], middle), y[1] - y[0], height, rgba)


def _beam(
    spec: mujoco.MjSpec, ends: tuple[float, float, float, float], width: float, height: float, rgba: tuple[float, ...]
) -> None:
    """Add a flat box between two positions on the road."""
    x0, y0, x1, y1 = ends
    half = 0.5 * np.arctan2(y1 - y0, x1 - x0)
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(0.5 * float(np.hypot(x1 - x0, y1 - y0)), 0.5 * width, height),
        pos=(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.0),
        quat=(np.cos(half), 0.0, 0.0, np.sin(half)),
        rgba=rgba,
    )


def _colour(mu: float) -> tuple[float, float, float]:
    grip = float(np.clip((mu - _ICE_MU) / (_DRY_MU - _ICE_MU), 0.0, 1.0))
    r, g, b = (grip * dry + (1.0 - grip) * ice for dry, ice in zip(_DRY, _ICE, strict=True))
    return r, g, b
