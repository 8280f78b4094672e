"""The car in the 3D view: solids attached to the moving bodies, and the frame of the chase camera."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

from activesteer.core.conventions import CORNERS, Array, yaw_of
from activesteer.drawing.cars import (
    CHASSIS,
    SEE_THROUGH,
    BodySurface,
    bytes_of,
    direction_of_motion,
    dressed,
    share_seen,
)
from activesteer.drawing.tyre_forces import CHANNELS, force_arrows, force_scale
from activesteer.playback.runs import ReplayedRun, send, times
from activesteer.recording import Link, Primitive, ScenePart
from activesteer.road.course import Footprint, footprint_of


def rotated(quaternions: Array, point: ArrayLike) -> Array:
    """Rotate one point of a body by the orientations of that body."""
    vector = np.asarray(point, np.float64)
    w, axis = quaternions[:, :1], quaternions[:, 1:]
    cross = 2.0 * np.cross(axis, vector)
    return vector + w * cross + np.cross(axis, cross)


def about_vertical(angle_rad: Array) -> Array:
    """Return quaternions x y z w of rotations about the vertical, shape (n, 4)."""
    zero = np.zeros_like(angle_rad)
    return np.stack([zero, zero, np.sin(0.5 * angle_rad), np.cos(0.5 * angle_rad)], axis=-1)


def xyzw(quaternions: ArrayLike) -> Array:
    """Reorder quaternions w x y z to the viewer's order x y z w, shape (..., 4)."""
    return np.asarray(quaternions, np.float64)[..., [1, 2, 3, 0]]


def between(start_m: Array, end_m: Array) -> tuple[Array, Array, Array]:
    """Return length [m], centre [m] and orientation x y z w of a solid along the line between two points."""
    if end_m[0, 2] < start_m[0, 2]:  # point upwards: close to straight down, the shortest rotation has no definite axis
        start_m, end_m = end_m, start_m
    along = end_m - start_m
    length = np.linalg.norm(along, axis=1)
    x, y, z = (along / np.maximum(length, 1e-9)[:, None]).T
    turn = np.stack([-y, x, np.zeros_like(x), 1.0 + z], axis=1)
    turn[turn[:, 3] < 1e-9] = (1.0, 0.0, 0.0, 0.0)
    return length, 0.5 * (start_m + end_m), turn / np.linalg.norm(turn, axis=1, keepdims=True)


_COILS: Final = 6
_POINTS_PER_COIL: Final = 16
_WIRE_RADIUS_M: Final = 0.007


def send_links(stream: rr.RecordingStream, run: ReplayedRun) -> None:
    """Send every link of the scene whose bodies have poses: rods as cylinders, springs as coils."""
    names = run.recording.poses.names
    links = [
        part for part in run.recording.scene if isinstance(part, Link) and all(body in names for body, _ in part.points)
    ]
    springs = [link for link in links if link.kind == "spring"]
    _send_rods(stream, run, [link for link in links if link.kind != "spring"])
    for spring in springs:
        _send_spring(stream, run, spring)


def link_ends(run: ReplayedRun, link: Link) -> list[NDArray[np.float64]]:
    """Return the world position of each point of a link [m], each of shape (number of shown poses, 3)."""
    poses = run.recording.poses
    ends = []
    for body, point in link.points:
        index = poses.names.index(body)
        turned = rotated(poses.quaternions[run.poses, index], point)
        ends.append(poses.positions_m[run.poses, index] + turned)
    return ends


def _send_rods(stream: rr.RecordingStream, run: ReplayedRun, links: list[Link]) -> None:
    """Send all rods in one entity, because each of them moves at every pose."""
    parts = []
    radii: list[float] = []
    colours: list[list[int]] = []
    for link in links:
        ends = link_ends(run, link)
        for start_m, end_m in pairwise(ends):
            parts.append(between(start_m, end_m))
            radii.append(link.radius_m)
            colours.append([round(255 * value) for value in link.rgba])
    if not parts:
        return
    lengths, centres, turns = (np.stack(values, axis=1).astype(np.float32) for values in zip(*parts, strict=True))
    style = rr.Cylinders3D.from_fields(radii=radii, colors=colours, fill_mode="solid")
    columns = rr.Cylinders3D.columns(
        lengths=lengths.reshape(-1), centers=centres.reshape(-1, 3), quaternions=turns.reshape(-1, 4)
    )
    send(stream, f"{run.scene}/links", style, run.recording.poses.time_s[run.poses], columns, len(parts))


def _send_spring(stream: rr.RecordingStream, run: ReplayedRun, spring: Link) -> None:
    ends = link_ends(run, spring)
    length, centre, turn = between(ends[0], ends[-1])
    path = f"{run.scene}/springs/{spring.name}"
    colour = [round(255 * value) for value in spring.rgba[:3]]
    coil = rr.LineStrips3D([_coil(spring.radius_m)], radii=_WIRE_RADIUS_M, colors=[colour])
    stream.log(path, coil, static=True)
    scale = np.ones((len(length), 3), np.float32)
    scale[:, 2] = length
    columns = rr.Transform3D.columns(
        translation=centre.astype(np.float32), quaternion=turn.astype(np.float32), scale=scale
    )
    stream.send_columns(path, times(run.recording.poses.time_s[run.poses]), columns)


def _coil(radius_m: float) -> NDArray[np.float64]:
    """Return a helix about z of unit length, centred at the origin."""
    turn = np.linspace(0.0, 2.0 * np.pi * _COILS, _COILS * _POINTS_PER_COIL + 1)
    height = np.linspace(-0.5, 0.5, len(turn))
    return np.stack([radius_m * np.cos(turn), radius_m * np.sin(turn), height], axis=1)


_ARROW_RADIUS_M: Final = 0.045
_ARROW_COLOUR: Final = (255, 45, 150)
_DISC_RADIUS_M: Final = 0.3

_USE: Final = (0.0, 0.6, 0.9, 1.1)
_USE_COLOURS: Final = ((0, 158, 115), (240, 228, 66), (230, 120, 0), (220, 20, 20))
"""Colours at these utilisations: green, yellow, orange, red."""

_USED: Final = tuple(f"{corner}_friction_utilisation" for corner in CORNERS)


def send_tyre_forces(stream: rr.RecordingStream, run: ReplayedRun, runs: Sequence[ReplayedRun]) -> None:
    """Send an arrow and a disc for each tyre, if the recording has their channels."""
    if not run.has(*_USED, *CHANNELS):
        return
    origins, vectors = force_arrows(run.recording, force_scale([other.recording for other in runs]))
    colours = use_colours(np.stack([run.channel(name) for name in _USED], axis=1))
    # A run that diverged ends with values that cannot be drawn.
    good = np.isfinite(origins).all(axis=(1, 2)) & np.isfinite(vectors).all(axis=(1, 2))
    time_s, painted = run.recording.time_s[good], colours[good].reshape(-1)
    style = rr.Arrows3D.from_fields(radii=[_ARROW_RADIUS_M], colors=[_ARROW_COLOUR])
    arrows = rr.Arrows3D.columns(origins=origins[good].reshape(-1, 3), vectors=vectors[good].reshape(-1, 3))
    send(stream, f"{run.scene}/tyres/force", style, time_s, arrows, len(CORNERS))
    size = rr.Cylinders3D.from_fields(radii=[_DISC_RADIUS_M], lengths=[0.02], fill_mode="solid")
    flat = origins[good] * np.array((1.0, 1.0, 0.0), np.float32)
    discs = rr.Cylinders3D.columns(centers=flat.reshape(-1, 3), colors=painted)
    send(stream, f"{run.scene}/tyres/friction_utilisation", size, time_s, discs, len(CORNERS))


def use_colours(friction_utilisation: NDArray[np.float64]) -> NDArray[np.uint32]:
    """Return the colours of used fractions of the friction."""
    red, green, blue = (
        np.interp(np.nan_to_num(friction_utilisation, nan=0.0), _USE, [colour[part] for colour in _USE_COLOURS])
        .round()
        .astype(np.uint32)
        for part in range(3)
    )
    return ((red << 24) | (green << 16) | (blue << 8) | 255).astype(np.uint32)


_GHOST_OPACITY: Final = 0.4
_GHOST_EVERY: Final = 5
"""Number of poses for each new opacity, which changes slowly."""
_CUTAWAY_OPACITY: Final = 0.25
"""Opacity of a body in a cutaway view."""


def send_car(stream: rr.RecordingStream, run: ReplayedRun, *, cutaway: bool = False) -> None:
    """Send the bodies with their solids, and two level frames that move with the car."""
    # `NAME/car_frame` has the heading of the car, and `NAME/chase`, the frame of the camera, the direction of motion.
    poses = run.recording.poses
    when = times(poses.time_s[run.poses])
    for index, body in enumerate(poses.names):
        moved = rr.Transform3D.columns(
            translation=poses.positions_m[run.poses, index].astype(np.float32),
            quaternion=xyzw(poses.quaternions[run.poses, index]).astype(np.float32),
        )
        stream.send_columns(body_path(run, body), when, moved)
    chassis = poses.names.index(CHASSIS)
    place = poses.positions_m[run.poses, chassis] * (1.0, 1.0, 0.0)
    size = footprint_of(run.recording.metadata)
    heading = yaw_of(poses.quaternions[run.poses, chassis])
    back = 0.5 * (size or Footprint()).wheelbase_m
    middle = place[:, :2] - back * np.column_stack([np.cos(heading), np.sin(heading)])
    direction = direction_of_motion(poses.time_s[run.poses], middle, heading)
    for frame, angle in (("car_frame", heading), ("chase", direction)):
        moved = rr.Transform3D.columns(
            translation=place.astype(np.float32), quaternion=about_vertical(angle).astype(np.float32)
        )
        stream.send_columns(f"{run.name}/{frame}", when, moved)
    parts, panels = dressed(run.recording.scene, size)
    for body, solids in _bodies(run, parts).items():
        _send_solids(stream, f"{body_path(run, body)}/solid", solids, [_colour(solid, run.colour) for solid in solids])
    for panel in panels:
        if panel.body in poses.names:
            opacity = _CUTAWAY_OPACITY if cutaway and panel.shell else 1.0
            _send_panel(stream, run, panel, opacity, f"{body_path(run, panel.body)}/solid/{panel.name}")


def body_path(run: ReplayedRun, body: str) -> str:
    """Return the entity of a body, the parent of all entities of the body."""
    return f"{run.scene}/car/{body}"


def send_ghost(stream: rr.RecordingStream, run: ReplayedRun, beside: ReplayedRun) -> None:
    """Send a car as a ghost for the view of another run, more transparent near the other car."""
    poses = run.recording.poses
    time_s = poses.time_s[run.poses][::_GHOST_EVERY]
    alpha = np.rint(255.0 * _GHOST_OPACITY * share_seen(_apart(run, beside, time_s))).astype(np.uint32)
    _, panels = dressed(run.recording.scene, footprint_of(run.recording.metadata))
    for panel in panels:
        if panel.shell and panel.body in poses.names:
            path = f"{ghost_path(run, beside)}/{panel.name}"
            _send_panel(stream, run, panel, 0.0, path)
            red, green, blue = _paint(run, panel)
            painted = (red << 24 | green << 16 | blue << 8) | alpha
            stream.send_columns(path, times(time_s), rr.Mesh3D.columns(albedo_factor=painted))


def ghost_path(run: ReplayedRun, beside: ReplayedRun) -> str:
    """Return the entity of the ghost of a car in the view of another run."""
    return f"{body_path(run, CHASSIS)}/ghost/{beside.name}"


def _apart(run: ReplayedRun, other: ReplayedRun, time_s: Array) -> Array:
    """Return the distance between the chassis of two runs [m], with the last position held after the end of a run."""
    at = []
    for each in (run, other):
        poses = each.recording.poses
        places = poses.positions_m[each.poses, poses.names.index(CHASSIS)]
        at.append(np.stack([np.interp(time_s, poses.time_s[each.poses], axis) for axis in places.T], axis=1))
    return np.linalg.norm(at[0] - at[1], axis=1)


def _bodies(run: ReplayedRun, parts: Sequence[ScenePart]) -> dict[str, list[Primitive]]:
    bodies: dict[str, list[Primitive]] = {}
    for part in parts:
        if isinstance(part, Primitive) and part.body in run.recording.poses.names:
            bodies.setdefault(part.body, []).append(part)
    return bodies


def _send_panel(stream: rr.RecordingStream, run: ReplayedRun, panel: BodySurface, opacity: float, path: str) -> None:
    drawn = rr.Mesh3D.from_fields(
        vertex_positions=panel.vertices_m.astype(np.float32),
        vertex_normals=panel.normals.astype(np.float32),
        triangle_indices=panel.faces,
        albedo_factor=(*_paint(run, panel), round(255 * opacity)) if opacity > 0.0 else None,
    )
    stream.log(path, drawn, static=True)


def _paint(run: ReplayedRun, panel: BodySurface) -> tuple[int, int, int]:
    red, green, blue = bytes_of(run.colour) if panel.rgb is None else (round(255 * value) for value in panel.rgb)
    return red, green, blue


def _colour(solid: Primitive, tint: str) -> tuple[int, int, int, int]:
    r, g, b, a = (round(255 * value) for value in solid.rgba)
    return (*bytes_of(tint), a) if solid.rgba[3] < SEE_THROUGH else (r, g, b, a)


def _send_solids(
    stream: rr.RecordingStream, path: str, solids: Sequence[Primitive], colours: Sequence[tuple[int, int, int, int]]
) -> None:
    for kind in ("box", "cylinder", "sphere"):
        members = [index for index, solid in enumerate(solids) if solid.kind == kind]
        if not members:
            continue
        size = np.array([solids[index].size_m for index in members])
        style: dict[str, Any] = {
            "centers": np.array([solids[index].position_m for index in members]),
            "quaternions": xyzw([solids[index].quaternion for index in members]),
            "colors": [colours[index] for index in members],
            "fill_mode": rr.components.FillMode.Solid,
        }
        if kind == "box":
            drawn = rr.Boxes3D(half_sizes=size / 2, **style)
        elif kind == "cylinder":
            drawn = rr.Cylinders3D(lengths=size[:, 2], radii=size[:, 0] / 2, **style)
        else:
            drawn = rr.Ellipsoids3D(half_sizes=size / 2, **style)
        stream.log(f"{path}/{kind}", drawn, static=True)
