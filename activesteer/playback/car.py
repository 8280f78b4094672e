"""The car in the 3D view: solids attached to the moving bodies, and the frame of the chase camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import rerun as rr

from activesteer.conventions import Array, yaw_of
from activesteer.drawing.bodywork import CHASSIS, SEE_THROUGH, Panel, dressed
from activesteer.drawing.cars import bytes_of, direction_of_motion, share_seen
from activesteer.playback.geometry import about_vertical, xyzw
from activesteer.playback.runs import Run
from activesteer.playback.timeline import times
from activesteer.recording import Primitive, ScenePart
from activesteer.road.course import Footprint, footprint_of

_GHOST_OPACITY: Final = 0.4
_GHOST_EVERY: Final = 5
"""Every fifth pose gets a new opacity, because the opacity changes slowly."""
_CUTAWAY_OPACITY: Final = 0.25
"""Opacity of a body in a cutaway view."""


def send_car(stream: rr.RecordingStream, run: Run, *, cutaway: bool = False) -> None:
    """Send bodies, their solids, and two level frames that move with the car.

    `NAME/car_frame` has the heading of the car, and `NAME/chase`, the frame of the camera, the direction of motion.

    Args:
        stream: Target of the data.
        run: The run.
        cutaway: Whether the body is transparent.
    """
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


def body_path(run: Run, body: str) -> str:
    """Return the entity of a body; entities below it move with the body."""
    return f"{run.scene}/car/{body}"


def send_ghost(stream: rr.RecordingStream, run: Run, beside: Run) -> None:
    """Send the body of a car as the view of another run shows it: transparent, and fainter the nearer the two cars are.

    Args:
        stream: Target of the data.
        run: The run whose car is drawn.
        beside: The run whose view shows the car.
    """
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


def ghost_path(run: Run, beside: Run) -> str:
    """Return the entity of the ghost of a car in the view of another run."""
    return f"{body_path(run, CHASSIS)}/ghost/{beside.name}"


def _apart(run: Run, other: Run, time_s: Array) -> Array:
    """Return the distance between the chassis of two runs [m]; a run that has ended keeps its last position."""
    at = []
    for each in (run, other):
        poses = each.recording.poses
        places = poses.positions_m[each.poses, poses.names.index(CHASSIS)]
        at.append(np.stack([np.interp(time_s, poses.time_s[each.poses], axis) for axis in places.T], axis=1))
    return np.linalg.norm(at[0] - at[1], axis=1)


def _bodies(run: Run, parts: Sequence[ScenePart]) -> dict[str, list[Primitive]]:
    bodies: dict[str, list[Primitive]] = {}
    for part in parts:
        if isinstance(part, Primitive) and part.body in run.recording.poses.names:
            bodies.setdefault(part.body, []).append(part)
    return bodies


def _send_panel(stream: rr.RecordingStream, run: Run, panel: Panel, opacity: float, path: str) -> None:
    drawn = rr.Mesh3D.from_fields(
        vertex_positions=panel.vertices_m.astype(np.float32),
        vertex_normals=panel.normals.astype(np.float32),
        triangle_indices=panel.faces,
        albedo_factor=(*_paint(run, panel), round(255 * opacity)) if opacity > 0.0 else None,
    )
    stream.log(path, drawn, static=True)


def _paint(run: Run, panel: Panel) -> tuple[int, int, int]:
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
