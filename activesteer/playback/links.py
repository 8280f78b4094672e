"""Suspension links, springs and dampers, drawn between the bodies that they connect."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from activesteer.playback.geometry import between, rotated
from activesteer.playback.runs import Run
from activesteer.playback.timeline import times
from activesteer.recording import Link

_COILS: Final = 6
_POINTS_PER_COIL: Final = 16
_WIRE_RADIUS_M: Final = 0.007


def send_links(stream: rr.RecordingStream, run: Run) -> None:
    """Send every link of the scene whose bodies have poses: rods as cylinders, springs as coils.

    Recordings made before links were recorded show none.
    """
    names = run.recording.poses.names
    links = [
        part for part in run.recording.scene if isinstance(part, Link) and all(body in names for body, _ in part.points)
    ]
    springs = [link for link in links if link.kind == "spring"]
    _send_rods(stream, run, [link for link in links if link.kind != "spring"])
    for spring in springs:
        _send_spring(stream, run, spring)


def link_ends(run: Run, link: Link) -> list[NDArray[np.float64]]:
    """Return the world position of each point of a link [m], each of shape (number of shown poses, 3)."""
    poses = run.recording.poses
    ends = []
    for body, point in link.points:
        index = poses.names.index(body)
        turned = rotated(poses.quaternions[run.poses, index], point)
        ends.append(poses.positions_m[run.poses, index] + turned)
    return ends


def _send_rods(stream: rr.RecordingStream, run: Run, links: list[Link]) -> None:
    """Send all springs in one entity, because there are many and each changes at every pose."""
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
    path = f"{run.scene}/links"
    stream.log(path, rr.Cylinders3D.from_fields(radii=radii, colors=colours, fill_mode="solid"), static=True)
    columns = rr.Cylinders3D.columns(
        lengths=lengths.reshape(-1), centers=centres.reshape(-1, 3), quaternions=turns.reshape(-1, 4)
    )
    when = times(run.recording.poses.time_s[run.poses])
    stream.send_columns(path, when, columns.partition(lengths=[len(parts)] * len(run.poses)))


def _send_spring(stream: rr.RecordingStream, run: Run, spring: Link) -> None:
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
    """Return a helix about z of length one, with its middle at the origin."""
    turn = np.linspace(0.0, 2.0 * np.pi * _COILS, _COILS * _POINTS_PER_COIL + 1)
    height = np.linspace(-0.5, 0.5, len(turn))
    return np.stack([radius_m * np.cos(turn), radius_m * np.sin(turn), height], axis=1)
