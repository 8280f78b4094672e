"""Poses of a car over time, its traces on the road, and its wheel angle and tyre force markings."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import CORNERS, Array, yaw_of
from activesteer.drawing import tyre_forces, wheel_angles
from activesteer.drawing.cars import CHASSIS, direction_of_motion, shares_of
from activesteer.errors import PlaybackError
from activesteer.recording import Recording
from activesteer.road.course import Footprint, footprint_of

_REACH_M: Final = 90.0
"""Length of the trace behind the car that is drawn [m]."""
_PIECE_M: Final = 0.8
"""Length of one piece of a trace [m]: in a bend of 10 m its chord is 8 mm off the arc."""
_WIDTH_M: Final = 0.14
_SLIDES_FROM: Final = 0.15
"""Length of the slip vector, tangent of the slip angle and slip ratio, from which a tyre leaves a mark. Passenger car
tyres have their largest force at a slip angle of 6 to 10 deg. This is 8.5 deg."""
_LEAST_LOAD_N: Final = 100.0
_SKID_RGBA: Final = (0.13, 0.13, 0.135, 1.0)
_PATH_Z_M, _SKID_Z_M = 0.024, 0.014
_UNEVEN_Z_M: Final = 0.05
"""Heights above the road, above its painted lines and below the shadows of cars [m]."""
_ABOVE_ROAD_M: Final = 0.05
_EDGE_M: Final = 0.022
_AHEAD_RGBA: Final = (0.97, 0.97, 0.97, 1.0)
_WEDGE_OPACITY: Final = 0.75
_ARROW_RGBA: Final = (0.83, 0.05, 0.45, 1.0)
_ARROW_M: Final = 0.05
_SHOWN_RAD: Final = np.radians(0.3)
"""Least angle with a wedge [rad]: toe and elasticity turn the wheels of any car by less."""


class Track:
    """Poses of a car between the first and the last usable pose."""

    def __init__(self, recording: Recording, name: str) -> None:
        """Read the poses that can be drawn."""
        poses = recording.poses
        self.bodies = poses.names
        whole = poses.usable()
        if CHASSIS not in poses.names or not whole.any():
            raise PlaybackError(f"{name} has no poses of a car, so there is nothing to draw", value=name)
        self._time_s = poses.time_s[whole]
        self._positions_m = poses.positions_m[whole]
        self._quaternions = poses.quaternions[whole]
        self.start_s, self.end_s = float(self._time_s[0]), float(self._time_s[-1])
        self._heading_rad = np.unwrap(yaw_of(self._quaternions[:, poses.names.index(CHASSIS)]))
        self._middle_m = -0.5 * (footprint_of(recording.metadata) or Footprint()).wheelbase_m
        forward = np.column_stack([np.cos(self._heading_rad), np.sin(self._heading_rad)])
        middle_m = self._positions_m[:, poses.names.index(CHASSIS), :2] + self._middle_m * forward
        self._middles_m = np.column_stack([middle_m, self._positions_m[:, poses.names.index(CHASSIS), 2]])
        self._direction_rad = direction_of_motion(self._time_s, middle_m, self._heading_rad)

    def poses(self, time_s: float) -> tuple[Array, Array]:
        """Return positions [m] and orientations w x y z of the bodies at a time, with the end poses held."""
        last = len(self._time_s) - 1
        after = min(max(int(np.searchsorted(self._time_s, time_s, side="right")), min(1, last)), last)
        before = max(after - 1, 0)
        span = self._time_s[after] - self._time_s[before]
        fraction = min(max((time_s - self._time_s[before]) / span, 0.0), 1.0) if span > 0.0 else 0.0
        positions = (1.0 - fraction) * self._positions_m[before] + fraction * self._positions_m[after]
        # The fastest body, a wheel, rotates by less than a radian between two poses: the chord is as good as the arc.
        first, second = self._quaternions[before], self._quaternions[after]
        sign = np.where(np.einsum("ij,ij->i", first, second) < 0.0, -1.0, 1.0)[:, None]
        turned = (1.0 - fraction) * first + fraction * sign * second
        return positions, turned / np.linalg.norm(turned, axis=1, keepdims=True)

    def heading(self, time_s: float) -> float:
        """Return the continuous heading of the chassis at a time [rad], left positive."""
        return float(np.interp(time_s, self._time_s, self._heading_rad))

    def direction(self, time_s: float) -> float:
        """Return the smoothed direction of motion at a time [rad] (see `drawing.cars`)."""
        return float(np.interp(time_s, self._time_s, self._direction_rad))

    def chassis(self, time_s: float) -> Array:
        """Return the point on the road below the chassis origin [m], shape (3,)."""
        positions, _ = self.poses(time_s)
        return positions[self.bodies.index(CHASSIS)] * (1.0, 1.0, 0.0)

    def turn(self, time_s: float) -> Array:
        """Return the matrix from the axes along the heading to the world, shape (3, 3)."""
        return _turn(self.heading(time_s))

    def middle(self, time_s: float) -> Array:
        """Return the point on the road below the midpoint of the axles [m], shape (3,)."""
        return self.chassis(time_s) + self.turn(time_s) @ (self._middle_m, 0.0, 0.0)

    def path(self) -> tuple[Array, Array]:
        """Return all times [s], and the axles' midpoints at the height of the chassis [m], shape (k, 3)."""
        return self._time_s, self._middles_m

    def wheel_centre(self, corner: str, time_s: float) -> Array:
        """Return the centre of a wheel at a time [m], for a wheel that does not move relative to the chassis."""
        body = f"{corner}_wheel"
        if body not in self.bodies:
            raise PlaybackError(
                f"the recording has no body {body!r}; it has {', '.join(self.bodies)}", value=body, allowed=self.bodies
            )
        place = self.poses(self.start_s)[0][self.bodies.index(body)] - self.chassis(self.start_s)
        return self.chassis(time_s) + self.turn(time_s) @ self.turn(self.start_s).T @ place


def _turn(angle_rad: float) -> Array:
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([(cos, -sin, 0.0), (sin, cos, 0.0), (0.0, 0.0, 1.0)])


class Traces:
    """Traces of one car on the road."""

    def __init__(
        self, recording: Recording, track: Track, size: Footprint, colour: str, place: int = 0, *, uneven: bool = False
    ) -> None:
        """Divide the traces into segments."""
        times, places = track.path()
        heights = places[:, 2] + _UNEVEN_Z_M if uneven else np.zeros(len(times))
        self._path = _pieces(
            times, np.column_stack([places[:, :2], heights + _PATH_Z_M - 0.0015 * place]), np.ones(len(times), bool)
        )
        self._rgba = (*shares_of(colour), 1.0)
        self._skids = []
        for corner in CORNERS:
            names = [f"{corner}_{name}" for name in ("slip_angle_rad", "slip_ratio", "tyre_fz_N")]
            names += [f"{corner}_contact_{axis}_m" for axis in "xy"]
            if any(name not in recording for name in names):
                continue
            angle_rad, ratio, load_N, x_m, y_m = (recording[name] for name in names)
            slides = (np.hypot(np.tan(angle_rad), ratio) > _SLIDES_FROM) & (load_N > _LEAST_LOAD_N)
            z_m = np.interp(recording.time_s, times, heights) + _SKID_Z_M
            width_m = size.tyre_width_m[CORNERS.index(corner) // 2]
            self._skids.append((0.8 * width_m, _pieces(recording.time_s, np.column_stack([x_m, y_m, z_m]), slides)))

    def add(self, scene: mujoco.MjvScene, time_s: float) -> None:
        """Add the traces up to a time to a scene."""
        for width_m, (times, pieces), rgba in (
            (_WIDTH_M, self._path, self._rgba),
            *((width_m, made, _SKID_RGBA) for width_m, made in self._skids),
        ):
            end = int(np.searchsorted(times, time_s, side="right"))
            for start, stop in pieces[max(0, end - round(_REACH_M / _PIECE_M)) : end]:
                _strip(scene, start, stop, width_m, rgba)


def _pieces(times: Array, places: Array, drawn: np.ndarray) -> tuple[Array, Array]:
    """Return the end times [s] of the segments of a line, and both ends of each [m], shape (n, 2, 3)."""
    drawn = drawn & np.isfinite(places).all(axis=1)
    places = np.nan_to_num(places)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places[:, :2], axis=0).T))])
    at = np.unique(np.searchsorted(way, np.arange(0.0, way[-1] + _PIECE_M, _PIECE_M)).clip(max=len(way) - 1))
    first, last = at[:-1], at[1:]
    kept = drawn[first] & drawn[last]
    return times[last][kept], np.stack([places[first], places[last]], axis=1)[kept]


def _strip(scene: mujoco.MjvScene, start: Array, stop: Array, width_m: float, rgba: tuple[float, ...]) -> None:
    x, y, _ = stop - start
    # Pieces overlap a little, so that no gap opens on the outside of a bend.
    size = np.array([0.5 * float(np.hypot(x, y)) + 0.02, 0.5 * width_m, 0.002])
    add_geom(scene, mujoco.mjtGeom.mjGEOM_BOX, size, 0.5 * (start + stop), _turn(np.arctan2(y, x)), rgba)


class Markings:
    """Wheel angle and tyre force markings of one car."""

    def __init__(self, recording: Recording, track: Track, colour: str, shown_with: Sequence[Recording]) -> None:
        """Prepare the markings."""
        self._recording, self._track, self._rgb = recording, track, shares_of(colour)
        self._tips = wheel_angles.tips_beside(footprint_of(recording.metadata) or Footprint())
        self._factors = wheel_angles.factors(shown_with)
        front, rear = self._factors[0], self._factors[-1]
        self.notes = [f"wheel angles x {front}" if front == rear else f"wheel angles front x {front}, rear x {rear}"]
        self._arrows = None
        if all(name in recording for name in tyre_forces.CHANNELS):
            scale_NpM = tyre_forces.force_scale(shown_with)
            self._arrows = tyre_forces.force_arrows(recording, scale_NpM)
            self.notes.append(f"force arrows: 1 m = {scale_NpM / 1000.0:.2g} kN")

    def add(self, scene: mujoco.MjvScene, time_s: float) -> None:
        """Add the markings at a time [s] to a scene."""
        if wheel_angles.CHANNELS[0] in self._recording:
            angles = wheel_angles.angles_at(self._recording, time_s)
            origin, turn = self._track.chassis(time_s), self._track.turn(time_s)
            for angle, factor, tip in zip(angles, self._factors, self._tips, strict=True):
                if abs(angle) >= _SHOWN_RAD:
                    self._add_wedge(scene, origin + turn @ (*tip, _ABOVE_ROAD_M), turn, float(angle), factor)
        if self._arrows is not None:
            row = min(int(np.searchsorted(self._recording.time_s, time_s)), len(self._recording) - 1)
            for origin, vector in zip(self._arrows[0][row], self._arrows[1][row], strict=True):
                if np.isfinite([origin, vector]).all() and np.linalg.norm(vector) > 2.0 * _ARROW_M:
                    _connect(scene, mujoco.mjtGeom.mjGEOM_ARROW, _ARROW_M, origin, origin + vector, _ARROW_RGBA)

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


def add_geom(
    scene: mujoco.MjvScene,
    kind: mujoco.mjtGeom,
    size: NDArray[np.float64],
    at: Array,
    frame: Array,
    rgba: tuple[float, ...],
) -> mujoco.MjvGeom:
    """Add a solid to a scene that is being drawn."""
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, kind, size, at, frame.ravel(), np.array(rgba, np.float32))
    scene.ngeom += 1
    return geom


def _connect(
    scene: mujoco.MjvScene, kind: mujoco.mjtGeom, width: float, start: Array, end: Array, rgba: tuple[float, ...]
) -> None:
    geom = add_geom(scene, kind, np.ones(3), start, np.eye(3), rgba)
    mujoco.mjv_connector(geom, kind, width, np.asarray(start, np.float64), np.asarray(end, np.float64))
