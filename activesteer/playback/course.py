"""Road, lanes, cones and path, in the 3D view and on a flat map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import rerun as rr

from activesteer.core.conventions import Array, yaw_of
from activesteer.core.limits import LIMIT_M
from activesteer.drawing.cars import CHASSIS, bytes_of, height_colours
from activesteer.playback.car import rotated
from activesteer.playback.runs import ReplayedRun, send
from activesteer.road.course import CONE_HEIGHT_M, CONE_RADIUS_M, Course, Footprint, course_of, footprint_of
from activesteer.road.drawn import surface_in
from activesteer.road.road import road_of

ROAD, COURSE, MAP = "road", "course", "map"
"""Parent entities of the road and the course in the 3D view, and of the map."""

_BESIDE_M: Final = 15.0
_BEYOND_M: Final = 60.0
"""Margins of the grid and the friction patches around cars and course [m]."""
_HORIZON_M: Final = 2000.0
"""Length of road beyond the grid [m]: its edge must not visibly move in the frame of a chase camera."""
_MAP_MARGIN_M: Final = 8.0
_TILE_M: Final = 10.0

_ASPHALT: Final = (58, 60, 64)
_MARKING: Final = (92, 95, 100)
_LANE: Final = (0, 158, 115)
_CONE: Final = (255, 120, 20)
_PATH: Final = (240, 228, 66)
_MAP_PATH: Final = (140, 132, 40)
_SLIPPERY: Final = (110, 150, 190)
_GRIPPY: Final = (44, 44, 46)
_CONE_SIDES: Final = 12


def extent(runs: Sequence[ReplayedRun]) -> tuple[float, float, float, float]:
    """Return the bounding rectangle of the cars and the course: x from and to, y from and to [m]."""
    points = [_track(run) for run in runs]
    course = _course(runs)
    if course is not None:
        points += [_path(course), course.cones_m, *(lane.outline_m() for lane in course.lanes)]
    # The path may be much longer than the drive: keep only the part of the course that is near the cars.
    reach = np.concatenate([_track(run) for run in runs])
    every = np.concatenate(points)
    low, high = reach.min(axis=0) - 20.0, reach.max(axis=0) + 20.0
    inside = every[((every >= low) & (every <= high)).all(axis=1)]
    (low_x, low_y), (high_x, high_y) = inside.min(axis=0), inside.max(axis=0)
    return float(low_x), float(high_x), float(low_y), float(high_y)


def send_road(stream: rr.RecordingStream, runs: Sequence[ReplayedRun]) -> None:
    """Send the road with its grid and its friction patches."""
    low_x, high_x, low_y, high_y = extent(runs)
    low_x = np.floor((low_x - _BEYOND_M / 2) / _TILE_M) * _TILE_M
    high_x = np.ceil((high_x + _BEYOND_M) / _TILE_M) * _TILE_M
    low_y = np.floor((low_y - _BESIDE_M) / _TILE_M) * _TILE_M
    high_y = np.ceil((high_y + _BESIDE_M) / _TILE_M) * _TILE_M
    far = (low_x - _HORIZON_M, high_x + _HORIZON_M, low_y - _HORIZON_M, high_y + _HORIZON_M)
    lowest = (
        0.0 if (drawn := surface_in(runs[0].recording.metadata)) is None else min(0.0, float(drawn.z_m.min())) - 0.02
    )
    stream.log(f"{ROAD}/surface", _plane(*far, lowest, _ASPHALT), static=True)
    across = [[(x, low_y, 0.005), (x, high_y, 0.005)] for x in np.arange(low_x, high_x + 1.0, _TILE_M)]
    along = [[(low_x, y, 0.005), (high_x, y, 0.005)] for y in np.arange(low_y, high_y + 1.0, _TILE_M)]
    stream.log(f"{ROAD}/grid", rr.LineStrips3D(across + along, colors=[_MARKING], radii=[0.03]), static=True)
    road = road_of(runs[0].recording.metadata)
    if drawn is not None:
        corners, triangles = drawn.mesh(road)
        # The wheels stand on the surface, so heights are drawn to scale; colour shows what the eye misses.
        colours = height_colours(corners[:, 2])
        mesh = rr.Mesh3D(vertex_positions=corners, triangle_indices=triangles, vertex_colors=colours)
        stream.log(f"{ROAD}/surface_heights_to_scale", mesh, static=True)
    pieces, areas = road.pieces(low_x, high_x, low_y, high_y), road.areas()
    for index in sorted({piece.area for piece in pieces}):
        quads = np.array([piece.corners_m for piece in pieces if piece.area == index])
        mu = [piece.mu for piece in pieces if piece.area == index]
        colour = _SLIPPERY if min(mu) < road.mu else _GRIPPY if max(mu) > road.mu else _ASPHALT
        surface = _quadrilaterals(quads, 0.002 + 0.0005 * index, colour)
        stream.log(f"{ROAD}/patch_{index}_mu_{round(100 * areas[index].mu)}_percent", surface, static=True)


def send_course(stream: rr.RecordingStream, runs: Sequence[ReplayedRun]) -> None:
    """Send lanes, cones and path of the manoeuvre, if it has them."""
    course = _course(runs)
    if course is None:
        return
    path = _path(course)
    line = np.column_stack([path, np.full(len(path), 0.02)])
    stream.log(f"{COURSE}/path", rr.LineStrips3D([line], colors=[_PATH], radii=[0.03]), static=True)
    edges = [lane.outline_m() for lane in course.lanes]
    stream.log(
        f"{MAP}/path",
        rr.LineStrips2D([_flat(path)], colors=[_MAP_PATH], radii=_points(1.0), draw_order=1.0),
        static=True,
    )
    if edges:
        strips = [np.column_stack([edge, np.full(len(edge), 0.015)]) for edge in edges]
        stream.log(f"{COURSE}/lanes", rr.LineStrips3D(strips, colors=[_LANE], radii=[0.05]), static=True)
        flat = [_flat(edge) for edge in edges]
        stream.log(
            f"{MAP}/lanes", rr.LineStrips2D(flat, colors=[_LANE], radii=_points(1.0), draw_order=2.0), static=True
        )
    cones = course.cones_m
    if len(cones):
        stream.log(f"{COURSE}/cones", _cones(cones), static=True)
        stream.log(
            f"{MAP}/cones", rr.Points2D(_flat(cones), colors=[_CONE], radii=_points(1.8), draw_order=3.0), static=True
        )


def send_track(stream: rr.RecordingStream, run: ReplayedRun, number: int) -> None:
    """Send the track of a car and, on the map, its moving outline with steered wheels."""
    track = _track(run)
    line = np.column_stack([track, np.full(len(track), 0.03 + 0.01 * number)])
    colour = bytes_of(run.colour)
    stream.log(f"{run.scene}/driven", rr.LineStrips3D([line], colors=[colour], radii=[0.035]), static=True)
    stream.log(
        f"{MAP}/{run.name}/driven",
        rr.LineStrips2D([_flat(track)], colors=[colour], radii=_points(0.8), draw_order=4.0),
        static=True,
    )
    strokes = _outline(run).astype(np.float32)
    style = rr.LineStrips2D.from_fields(colors=[colour], radii=_points(1.8), draw_order=5.0)
    # Sending an array of two-point strokes is a hundred times as fast as sending a list of strokes.
    columns = rr.LineStrips2D.columns(strips=strokes.reshape(-1, 2, 2))
    time_s = run.recording.poses.time_s[run.poses]
    send(stream, f"{MAP}/{run.name}/car", style, time_s, columns, strokes.shape[1])


def _outline(run: ReplayedRun) -> Array:
    """Return the lines of the car on the map, its sides and a stroke for each wheel, shape (poses, strokes, 2, 2)."""
    poses, car = run.recording.poses, footprint_of(run.recording.metadata) or Footprint()
    half, front, rear = 0.5 * car.width_m, car.front_m, car.rear_m
    chassis = poses.names.index(CHASSIS)

    def placed(body: int, points: Sequence[tuple[float, float]], *, level: bool) -> Array:
        turn, at = poses.quaternions[run.poses, body], poses.positions_m[run.poses, body]
        if level:  # the wheel spins, so use its heading alone
            axis = rotated(turn, (0.0, 1.0, 0.0))
            angle = np.arctan2(-axis[:, 0], axis[:, 1])
        else:
            angle = yaw_of(turn)
        cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
        x, y = np.array(points).T
        return _flat(np.stack([at[:, :1] + cos * x - sin * y, at[:, 1:2] + sin * x + cos * y], axis=-1))

    corners = [(front, half), (front, -half), (rear, -half), (rear, half), (front, half)]
    strips = [placed(chassis, corners[side : side + 2], level=False) for side in range(4)]
    wheels = [index for index, name in enumerate(poses.names) if name.endswith("_wheel")]
    strips += [placed(wheel, [(-0.32, 0.0), (0.32, 0.0)], level=True) for wheel in wheels]
    return np.stack(strips, axis=1)


def _track(run: ReplayedRun) -> Array:
    """Return the track of the centre of gravity, or of the chassis origin if only this is recorded."""
    poses = run.recording.poses
    at = poses.positions_m[run.poses, poses.names.index(CHASSIS), :2]
    if not run.has("x_m", "y_m"):
        return at
    track = np.stack([run.channel("x_m"), run.channel("y_m")], axis=1)
    track = track[(np.abs(track) <= LIMIT_M).all(axis=1)]
    return track if len(track) else at


def _course(runs: Sequence[ReplayedRun]) -> Course | None:
    return next((course for run in runs if (course := course_of(run.recording.metadata)) is not None), None)


def _path(course: Course) -> Array:
    return np.column_stack([course.path.x_m, course.path.y_m])


def _flat(points: Array) -> Array:
    """Convert world to map coordinates. The second axis of the map points down, so that left is up."""
    return points * (1.0, -1.0)


def map_bounds(runs: Sequence[ReplayedRun]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ranges of both map axes that contain all cars and the course [m]."""
    low_x, high_x, low_y, high_y = extent(runs)
    return (low_x - _MAP_MARGIN_M, high_x + _MAP_MARGIN_M), (-high_y - _MAP_MARGIN_M, -low_y + _MAP_MARGIN_M)


def _points(radius: float) -> Any:
    """Return a radius in screen points, so that lines stay visible at any zoom of the map."""
    return rr.Radius.ui_points(radius)


def _plane(low_x: float, high_x: float, low_y: float, high_y: float, z: float, colour: tuple[int, int, int]) -> Any:
    return _quadrilaterals(np.array([[(low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)]]), z, colour)


def _quadrilaterals(corners: Array, z: float, colour: tuple[int, int, int]) -> Any:
    """Return quadrilaterals at a height as one mesh, from corners of shape (n, 4, 2)."""
    flat = corners.reshape(-1, 2)
    triangles = 4 * np.arange(len(corners))[:, None, None] + np.array([(0, 1, 2), (0, 2, 3)])
    return rr.Mesh3D(
        vertex_positions=np.column_stack([flat, np.full(len(flat), z)]),
        triangle_indices=triangles.reshape(-1, 3),
        albedo_factor=[*colour, 255],
    )


def _cones(places: Array) -> Any:
    """Return all cones as one mesh."""
    angle = np.linspace(0.0, 2.0 * np.pi, _CONE_SIDES, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_CONE_SIDES)])
    corners = np.vstack([ring * CONE_RADIUS_M, [[0.0, 0.0, CONE_HEIGHT_M]]])
    outward = np.vstack([ring + np.array((0.0, 0.0, 0.3)), [[0.0, 0.0, 1.0]]])
    sides = np.arange(_CONE_SIDES)
    faces = np.column_stack([sides, (sides + 1) % _CONE_SIDES, np.full(_CONE_SIDES, _CONE_SIDES)])
    at = np.column_stack([places, np.zeros(len(places))])
    return rr.Mesh3D(
        vertex_positions=(at[:, None] + corners).reshape(-1, 3),
        vertex_normals=np.tile(outward / np.linalg.norm(outward, axis=1, keepdims=True), (len(places), 1)),
        triangle_indices=(np.arange(len(places))[:, None, None] * len(corners) + faces).reshape(-1, 3),
        albedo_factor=[*_CONE, 255],
    )
