"""The car in the world: solids in the frames of its bodies, which move, and the camera's frame behind it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import rerun as rr

from activesteer.bodywork import SEE_THROUGH, Panel, dressed
from activesteer.conventions import yaw_of
from activesteer.playback.geometry import about_vertical, xyzw
from activesteer.playback.runs import CHASSIS, Run
from activesteer.playback.timeline import times
from activesteer.recording import Primitive, ScenePart
from activesteer.road.footprint import footprint_of

_GHOST_LINE_M: Final = 0.012
"""Radius of the lines that draw the car of another run: solids would hide what is in the same place [m]."""
_CUTAWAY_OPACITY: Final = 0.25
"""Opacity of a body through which the suspension is to be seen."""


def send_car(stream: rr.RecordingStream, run: Run, *, cutaway: bool = False) -> None:
    """Sends bodies, their solids, and the frame `NAME/chase` that follows the car and turns with it, but stays level.

    Args:
        stream: Where to.
        run: The run.
        cutaway: Whether the body is to be seen through.
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
    turn = about_vertical(yaw_of(poses.quaternions[run.poses, chassis]))
    stream.send_columns(
        f"{run.name}/chase",
        when,
        rr.Transform3D.columns(translation=place.astype(np.float32), quaternion=turn.astype(np.float32)),
    )
    parts, panels = dressed(run.recording.scene, footprint_of(run.recording.metadata))
    for body, solids in _bodies(run, parts).items():
        _send_solids(stream, f"{body_path(run, body)}/solid", solids, [_colour(solid, run.colour) for solid in solids])
    for panel in panels:
        if panel.body in poses.names:
            _send_panel(stream, run, panel, _CUTAWAY_OPACITY if cutaway and panel.shell else 1.0)
    bodies = _bodies(run, run.recording.scene)
    for path, body in zip(ghost_paths(run), ghost_bodies(run), strict=True):
        _send_solids(stream, path, bodies[body], [(*rgb(run.colour), 255)] * len(bodies[body]), lines=True)


def body_path(run: Run, body: str) -> str:
    """Entity of a body; what stands below it moves with it."""
    return f"{run.scene}/car/{body}"


def ghost_bodies(run: Run) -> list[str]:
    """Bodies that are drawn of a car that is not the one looked at: chassis and wheels."""
    return [body for body in _bodies(run, run.recording.scene) if body == CHASSIS or body.endswith("_wheel")]


def ghost_paths(run: Run) -> list[str]:
    """Entities of the ghost; they are left out where the car itself is shown."""
    return [f"{body_path(run, body)}/ghost" for body in ghost_bodies(run)]


def rgb(colour: str) -> tuple[int, int, int]:
    """The three numbers of `#rrggbb`."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def _bodies(run: Run, parts: Sequence[ScenePart]) -> dict[str, list[Primitive]]:
    bodies: dict[str, list[Primitive]] = {}
    for part in parts:
        if isinstance(part, Primitive) and part.body in run.recording.poses.names:
            bodies.setdefault(part.body, []).append(part)
    return bodies


def _send_panel(stream: rr.RecordingStream, run: Run, panel: Panel, opacity: float) -> None:
    red, green, blue = rgb(run.colour) if panel.rgb is None else (round(255 * value) for value in panel.rgb)
    drawn = rr.Mesh3D(
        vertex_positions=panel.vertices_m.astype(np.float32),
        vertex_normals=panel.normals.astype(np.float32),
        triangle_indices=panel.faces,
        albedo_factor=(red, green, blue, round(255 * opacity)),
    )
    stream.log(f"{body_path(run, panel.body)}/solid/{panel.name}", drawn, static=True)


def _colour(solid: Primitive, tint: str) -> tuple[int, int, int, int]:
    r, g, b, a = (round(255 * value) for value in solid.rgba)
    return (*rgb(tint), a) if solid.rgba[3] < SEE_THROUGH else (r, g, b, a)


def _send_solids(
    stream: rr.RecordingStream,
    path: str,
    solids: Sequence[Primitive],
    colours: Sequence[tuple[int, int, int, int]],
    *,
    lines: bool = False,
) -> None:
    fill = rr.components.FillMode.MajorWireframe if lines else rr.components.FillMode.Solid
    for kind in ("box", "cylinder", "sphere"):
        members = [index for index, solid in enumerate(solids) if solid.kind == kind]
        if not members:
            continue
        size = np.array([solids[index].size_m for index in members])
        at = np.array([solids[index].position_m for index in members])
        turn = xyzw([solids[index].quaternion for index in members])
        style: dict[str, Any] = {
            "centers": at, "quaternions": turn, "colors": [colours[index] for index in members], "fill_mode": fill
        }  # fmt: skip
        if kind == "box":
            drawn = rr.Boxes3D(half_sizes=size / 2, radii=_GHOST_LINE_M, **style)
        elif kind == "cylinder":
            drawn = rr.Cylinders3D(lengths=size[:, 2], radii=size[:, 0] / 2, line_radii=_GHOST_LINE_M, **style)
        else:
            drawn = rr.Ellipsoids3D(half_sizes=size / 2, line_radii=_GHOST_LINE_M, **style)
        stream.log(f"{path}/{kind}", drawn, static=True)
