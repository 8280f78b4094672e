"""Traces of a car on the road: the path of its middle in its colour, and skid marks where its tyres slide."""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

from activesteer.conventions import CORNERS, Array
from activesteer.drawing.cars import shares_of
from activesteer.recording import Recording
from activesteer.road.course import Footprint
from activesteer.video.markings import add_geom
from activesteer.video.track import Track

_REACH_M: Final = 90.0
"""Length of the trace behind the car that is drawn [m]."""
_PIECE_M: Final = 0.8
"""Length of one piece of a trace [m]: in a bend of 10 m its chord is 8 mm off the arc."""
_WIDTH_M: Final = 0.14
_SLIDES_FROM: Final = 0.15
"""Length of the slip vector, tangent of the slip angle and slip ratio, from which a tyre leaves a mark. Passenger car
tyres have their largest force at a slip angle of 6 to 10 deg; this is 8.5 deg."""
_LEAST_LOAD_N: Final = 100.0
_SKID_RGBA: Final = (0.13, 0.13, 0.135, 1.0)
_PATH_Z_M, _SKID_Z_M = 0.024, 0.014
_UNEVEN_Z_M: Final = 0.05
"""Heights above the road, above its painted lines and below the shadows of cars [m]."""


class Traces:
    """Traces of one car."""

    def __init__(
        self, recording: Recording, track: Track, size: Footprint, colour: str, place: int = 0, *, uneven: bool = False
    ) -> None:
        """Divide the traces into pieces.

        Args:
            recording: The run.
            track: Poses of its car.
            size: Size of the car.
            colour: Colour of its system, `#rrggbb`.
            place: Place of the car among the cars of the frame; the trace of a later car lies below.
            uneven: Whether the road is uneven; the traces then lie at the height of the chassis.
        """
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
        """Add the traces up to an instant to a scene.

        Args:
            scene: The scene.
            time_s: The instant [s].
        """
        for width_m, (times, pieces), rgba in (
            (_WIDTH_M, self._path, self._rgba),
            *((width_m, made, _SKID_RGBA) for width_m, made in self._skids),
        ):
            end = int(np.searchsorted(times, time_s, side="right"))
            for start, stop in pieces[max(0, end - round(_REACH_M / _PIECE_M)) : end]:
                _strip(scene, start, stop, width_m, rgba)


def _pieces(times: Array, places: Array, drawn: np.ndarray) -> tuple[Array, Array]:
    """Divide a line into pieces.

    Args:
        times: Instants [s], shape (k,).
        places: Points [m], shape (k, 3).
        drawn: Points at which the line is drawn, shape (k,).

    Returns:
        Times at the ends of the pieces [s], shape (n,), and their two ends [m], shape (n, 2, 3).
    """
    drawn = drawn & np.isfinite(places).all(axis=1)
    places = np.nan_to_num(places)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places[:, :2], axis=0).T))])
    at = np.unique(np.searchsorted(way, np.arange(0.0, way[-1] + _PIECE_M, _PIECE_M)).clip(max=len(way) - 1))
    first, last = at[:-1], at[1:]
    kept = drawn[first] & drawn[last]
    return times[last][kept], np.stack([places[first], places[last]], axis=1)[kept]


def _strip(scene: mujoco.MjvScene, start: Array, stop: Array, width_m: float, rgba: tuple[float, ...]) -> None:
    x, y, _ = stop - start
    length = max(float(np.hypot(x, y)), 1e-6)
    cos, sin = x / length, y / length
    frame = np.array([(cos, -sin, 0.0), (sin, cos, 0.0), (0.0, 0.0, 1.0)])
    # Pieces overlap a little, so that no gap opens on the outside of a bend.
    size = np.array([0.5 * length + 0.02, 0.5 * width_m, 0.002])
    add_geom(scene, mujoco.mjtGeom.mjGEOM_BOX, size, 0.5 * (start + stop), frame, rgba)
