"""Enlarged steer angles of the wheels: wedges next to the car in the 3D view, and a plan view of all cars."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from activesteer.core.conventions import CORNERS, Array
from activesteer.drawing.cars import bytes_of
from activesteer.drawing.wheel_angles import (
    CHANNELS,
    SLICES,
    angles_at,
    factors,
    plan,
    tips_beside,
    wedges,
    wheel_centres,
    words,
)  # fmt: skip
from activesteer.playback.runs import ReplayedRun, send
from activesteer.road.course import Footprint, footprint_of

PLAN: Final = "plan"
"""Parent entity of the plan."""
_EVERY: Final = 2
"""Number of poses per shown pose: 50 are shown per second."""
_ABOVE_ROAD_M: Final = 0.05
_AHEAD: Final = (245, 245, 245)
_APART_M: Final = 4.2
"""Distance between the centre lines of neighbouring cars in the plan [m]."""
_RAYS: Final = range(1, SLICES + 2, 2)
"""Points of the arc that the plan joins to the tip by lines, because a 2D view cannot fill areas."""


def send_wheel_angles(stream: rr.RecordingStream, run: ReplayedRun, runs: Sequence[ReplayedRun]) -> None:
    """Send the wedges and the plan view of a run, if the recording has the wheel angles."""
    if not run.has(*CHANNELS):
        return
    recording, size = run.recording, footprint_of(run.recording.metadata) or Footprint()
    time_s = recording.poses.time_s[run.poses][::_EVERY]
    angles = angles_at(recording, time_s)
    factor = factors([other.recording for other in runs])
    texts = [words(float(angle)) for row in angles for angle in row]
    enlarged = [f"{text}, x{larger}" if text else "" for text, larger in zip(texts, cycle(factor), strict=False)]
    _send_wedges(stream, run, time_s, wedges(angles, factor), enlarged, size)
    _send_plan(stream, run, runs.index(run), time_s, (angles, factor), texts, size)


def wedges_path(run: ReplayedRun) -> str:
    """Return the entity of the wedges next to the car of a run."""
    return f"{run.name}/car_frame/wheel_angles"


def plan_view(runs: Sequence[ReplayedRun]) -> rrb.Spatial2DView:
    """Return the view with the plan drawings of these runs."""
    found = [footprint_of(run.recording.metadata) or Footprint() for run in runs]
    front = max(size.front_m for size in found) + 1.9
    rear = min(size.rear_m for size in found) - 1.2
    at_front, _, at_rear, _ = factors([run.recording for run in runs])
    scale = f"x{at_front}" if at_front == at_rear else f"front x{at_front}, rear x{at_rear}"
    return rrb.Spatial2DView(
        origin=f"/{PLAN}",
        contents=[f"+ /{PLAN}/{run.name}/**" for run in runs],
        name=f"Wheels, {scale}",
        visual_bounds=rrb.VisualBounds2D(
            x_range=(-0.5 * _APART_M, (len(runs) - 0.5) * _APART_M), y_range=(-front, -rear)
        ),
    )


def _send_wedges(
    stream: rr.RecordingStream,
    run: ReplayedRun,
    time_s: Array,
    shapes: Array,
    texts: list[str],
    size: Footprint,
) -> None:
    tips, corners = tips_beside(size), len(CORNERS)
    placed = np.full((*shapes.shape[:-1], 3), _ABOVE_ROAD_M, np.float32)
    placed[..., :2] = shapes + tips[:, None]
    path, colour = wedges_path(run), bytes_of(run.colour)
    per_wedge = shapes.shape[2]
    fan = np.array([(0, slice_ + 1, slice_ + 2) for slice_ in range(SLICES)])
    faces = (np.arange(corners)[:, None, None] * per_wedge + fan).reshape(-1, 3)
    fans = rr.Mesh3D.from_fields(triangle_indices=faces, albedo_factor=colour)
    columns = rr.Mesh3D.columns(vertex_positions=placed.reshape(-1, 3))
    send(stream, f"{path}/wedge", fans, time_s, columns, corners * per_wedge)
    lines = rr.LineStrips3D.columns(strips=placed[:, :, [0, -1]].reshape(-1, 2, 3))
    send(stream, f"{path}/wheel", rr.LineStrips3D.from_fields(colors=[colour], radii=[0.02]), time_s, lines, corners)
    ahead = rr.LineStrips3D(placed[0][:, [0, 1]], colors=[_AHEAD], radii=[0.015])
    stream.log(f"{path}/ahead", ahead, static=True)
    beside = np.column_stack([tips * (1.0, 2.5), np.full(corners, _ABOVE_ROAD_M)])
    label = rr.Points3D.from_fields(positions=beside, colors=[colour], radii=[0.02], show_labels=True)
    send(stream, f"{path}/angle", label, time_s, rr.Points3D.columns(labels=texts), corners)


def _send_plan(
    stream: rr.RecordingStream,
    run: ReplayedRun,
    number: int,
    time_s: Array,
    angles: tuple[Array, Sequence[int]],
    texts: list[str],
    size: Footprint,
) -> None:
    def placed(points_m: Array) -> Any:
        """Convert to view coordinates: front of the car up, second axis of the view down."""
        flat = np.stack([number * _APART_M - points_m[..., 1], -points_m[..., 0]], axis=-1)
        return flat.astype(np.float32)

    drawn, path, colour = plan(size, *angles), f"{PLAN}/{run.name}", bytes_of(run.colour)
    rows = len(drawn.wedges)
    body = placed(np.vstack([drawn.body, drawn.body[:1]]))
    name = rr.Points2D(
        [placed(np.array([-0.5 * size.wheelbase_m, 0.0]))], labels=[run.short], colors=[colour], radii=[0.01]
    )
    stream.log(f"{path}/body", rr.LineStrips2D([body], colors=[colour], radii=[0.05]), static=True)
    stream.log(f"{path}/name", name, static=True)
    outline = np.concatenate([drawn.wheels, drawn.wheels[..., :1, :]], axis=-2)
    sides = np.stack([outline[..., :-1, :], outline[..., 1:, :]], axis=-2)
    tips = np.broadcast_to(drawn.wedges[..., :1, :], drawn.wedges[..., _RAYS, :].shape)
    rays = np.stack([tips, drawn.wedges[..., _RAYS, :]], axis=-2)
    for part, strokes, paint in (("wheels", sides, _AHEAD), ("wedges", rays, colour)):
        flat = placed(strokes).reshape(rows, -1, 2, 2)
        style, columns = rr.LineStrips2D.from_fields(colors=[paint], radii=[0.04]), flat.reshape(-1, 2, 2)
        send(stream, f"{path}/{part}", style, time_s, rr.LineStrips2D.columns(strips=columns), flat.shape[1])
    # There is room for one number per axle: the angle of the left wheel.
    at = placed(wheel_centres(size)[[0, 2]] * (1.0, 0.0) + [(2.3, 0.0), (-1.2, 0.0)])
    label = rr.Points2D.from_fields(positions=at, colors=[colour], radii=[0.01], show_labels=True)
    shown = [text for row in range(rows) for text in (texts[4 * row], texts[4 * row + 2])]
    send(stream, f"{path}/angle", label, time_s, rr.Points2D.columns(labels=shown), 2)
