"""Markings beside a car: enlarged wheel angles and tyre forces."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array
from activesteer.drawing import tyre_forces, wheel_angles
from activesteer.drawing.cars import shares_of
from activesteer.recording import Recording
from activesteer.road.course import Footprint
from activesteer.video.track import Track

_ABOVE_ROAD_M: Final = 0.05
_EDGE_M: Final = 0.022
_AHEAD_RGBA: Final = (0.97, 0.97, 0.97, 1.0)
_WEDGE_OPACITY: Final = 0.75
_ARROW_RGBA: Final = (0.83, 0.05, 0.45, 1.0)
_ARROW_M: Final = 0.05
_LABEL_M: Final = 0.9, 0.9
"""Distance of a label from the tip of its wedge, ahead and to the outside [m]."""
_SHOWN_RAD: Final = np.radians(0.3)
"""Least angle with a wedge [rad]: toe and elasticity turn the wheels of any car by less."""
_ROOF_M: Final = 1.4
"""Height of a car's roof, usual for the class, to find what the car hides [m]."""


class Label(NamedTuple):
    """A text at a place in the world.

    Attributes:
        text: The text.
        place_m: Start of the text [m], shape (3,).
        outside_m: A point such that the text runs from `place_m` away from the car [m], shape (3,).
        leads_to_m: The place that a line connects with the text [m], shape (3,); None for no line.
        far_m: Distance from the camera up to which the text is written [m].
    """

    text: str
    place_m: Array
    outside_m: Array
    leads_to_m: Array | None = None
    far_m: float = np.inf


class Markings:
    """The markings of one car.

    Attributes:
        note: Scale of the arrows in words; empty if there are no arrows.
    """

    def __init__(
        self, recording: Recording, track: Track, size: Footprint, colour: str, shown_with: Sequence[Recording]
    ) -> None:
        """Prepare the markings.

        Args:
            recording: The run.
            track: Poses of its car.
            size: The size of the car.
            colour: The colour of its system, `#rrggbb`.
            shown_with: All runs of the frame; they share their scales.
        """
        self._track, self._rgb = track, shares_of(colour)
        self._low = np.array([size.rear_m, -0.5 * size.width_m, 0.2])
        self._high = np.array([size.front_m, 0.5 * size.width_m, _ROOF_M])
        self._tips = wheel_angles.tips_beside(size)
        self._factors = wheel_angles.factors(shown_with)
        self._recording = recording
        self._arrows, self.note = None, ""
        if all(name in recording for name in tyre_forces.CHANNELS):
            scale_NpM = tyre_forces.force_scale(shown_with)
            self._arrows = tyre_forces.force_arrows(recording, scale_NpM)
            self.note = f"force arrows: 1 m = {scale_NpM / 1000.0:.2g} kN"

    def add(self, scene: mujoco.MjvScene, time_s: float) -> list[Label]:
        """Add the markings to a scene.

        Args:
            scene: The scene.
            time_s: The instant [s].

        Returns:
            Labels to draw over the frame.
        """
        labels = []
        if wheel_angles.CHANNELS[0] in self._recording:
            angles = wheel_angles.angles_at(self._recording, time_s)
            origin, heading = self._track.chassis(time_s), self._track.heading(time_s)
            cos, sin = np.cos(heading), np.sin(heading)
            turn = np.array([(cos, -sin, 0.0), (sin, cos, 0.0), (0.0, 0.0, 1.0)])
            eye = turn.T @ (0.5 * (scene.camera[0].pos + scene.camera[1].pos) - origin)
            for angle, factor, tip in zip(angles, self._factors, self._tips, strict=True):
                if not abs(angle) >= _SHOWN_RAD:
                    continue
                at = origin + turn @ (*tip, _ABOVE_ROAD_M)
                self._add_wedge(scene, at, turn, float(angle), factor)
                outside = np.sign(tip[1])
                if _hides(self._low, self._high, eye, np.array([*tip, _ABOVE_ROAD_M])):
                    continue
                place = at + turn @ (_LABEL_M[0], outside * _LABEL_M[1], 0.0)
                text = f"{wheel_angles.words(float(angle))}, x{factor}"
                pointed = at + turn @ (0.6 * wheel_angles.RADIUS_M, 0.0, 0.0)
                labels.append(Label(text, place, place + turn @ (0.0, outside, 0.0), pointed))
        if self._arrows is not None:
            row = min(int(np.searchsorted(self._recording.time_s, time_s)), len(self._recording) - 1)
            for origin, vector in zip(self._arrows[0][row], self._arrows[1][row], strict=True):
                if np.isfinite([origin, vector]).all() and np.linalg.norm(vector) > 2.0 * _ARROW_M:
                    _connect(scene, mujoco.mjtGeom.mjGEOM_ARROW, _ARROW_M, origin, origin + vector, _ARROW_RGBA)
        return labels

    def _add_wedge(self, scene: mujoco.MjvScene, at: Array, turn: Array, angle_rad: float, factor: int) -> None:
        points = wheel_angles.wedges(np.array([angle_rad]), (factor,))[0]
        world = at + np.column_stack([points, np.zeros(len(points))]) @ turn.T
        tip, arc = world[0], world[1:]
        for first, second in pairwise(arc):
            # The sides of the triangle lie along the axes of its frame, which need not be at right angles.
            frame = np.column_stack([first - tip, second - tip, (0.0, 0.0, 1.0)])
            add_geom(scene, mujoco.mjtGeom.mjGEOM_TRIANGLE, np.ones(3), tip, frame, (*self._rgb, _WEDGE_OPACITY))
        for end, rgba in ((arc[0], _AHEAD_RGBA), (arc[-1], (*self._rgb, 1.0))):
            _connect(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, _EDGE_M, tip, end, rgba)


def _hides(low: Array, high: Array, eye: Array, place: Array) -> bool:
    """Return whether a box stands between the eye and a place [m]; both lie outside the box."""
    way = place - eye
    way = np.where(np.abs(way) < 1e-9, 1e-9, way)
    first, second = (low - eye) / way, (high - eye) / way
    enters, leaves = np.minimum(first, second).max(), np.maximum(first, second).min()
    return bool(enters < leaves and 0.0 < enters < 1.0)


def add_geom(
    scene: mujoco.MjvScene,
    kind: mujoco.mjtGeom,
    size: NDArray[np.float64],
    at: Array,
    frame: Array,
    rgba: tuple[float, ...],
) -> mujoco.MjvGeom:
    """Add a solid to a scene that is being drawn.

    Args:
        scene: The scene.
        kind: Kind of the solid.
        size: Its half sizes [m], shape (3,).
        at: Its centre [m], shape (3,).
        frame: Its axes as columns, shape (3, 3).
        rgba: Its colour and opacity, 0 to 1.
    """
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, kind, size, at, frame.ravel(), np.array(rgba, np.float32))
    scene.ngeom += 1
    return geom


def _connect(
    scene: mujoco.MjvScene, kind: mujoco.mjtGeom, width: float, start: Array, end: Array, rgba: tuple[float, ...]
) -> None:
    geom = add_geom(scene, kind, np.ones(3), start, np.eye(3), rgba)
    mujoco.mjv_connector(geom, kind, width, np.asarray(start, np.float64), np.asarray(end, np.float64))
