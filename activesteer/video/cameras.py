"""Cameras: behind the car, above it, or beside a wheel."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, NamedTuple

import mujoco
import numpy as np

from activesteer.core.conventions import CORNERS
from activesteer.errors import ParameterError, nearest_names
from activesteer.video.track import Track

CAMERAS: Final = ("chase", "top", "wheel")
"""Names of the cameras."""
CUTAWAY: Final = 0.12
"""Opacity of a shell that lets the suspension be seen."""

_WHEELS_SEEN: Final = 0.25
"""Opacity of a shell that lets the wheels be seen from above."""


class View(NamedTuple):
    """A camera on a car."""

    aim: Callable[[mujoco.MjvCamera, float], None]  # function that aims a MuJoCo camera for an instant [s]
    shell_opacity: float  # opacity of the car's shell, 0 to 1; low for a view of the suspension
    marked: bool = True  # whether the view shows the wedges and arrows beside the car


def view(name: str, track: Track, corner: str = CORNERS[0]) -> View:
    """Return the camera of a name."""
    if name == "chase":
        return View(_chase(track), 1.0)
    if name == "top":
        return View(_top(track), _WHEELS_SEEN)
    if name == "wheel":
        return View(_wheel(track, corner), CUTAWAY, marked=False)
    raise ParameterError(f"there is no camera {name!r}; {nearest_names(name, CAMERAS)}", value=name)


def _chase(track: Track) -> Callable[[mujoco.MjvCamera, float], None]:
    """Place the camera behind and above the car, seen in its direction of motion, looking over the roof at the road.

    A car that slides turns in the picture.
    """

    def aim(camera: mujoco.MjvCamera, time_s: float) -> None:
        direction = track.direction(time_s)
        ahead = np.array([math.cos(direction), math.sin(direction), 0.0])
        camera.lookat = track.middle(time_s) + 0.9 * ahead + np.array([0.0, 0.0, 0.15])
        camera.distance, camera.elevation, camera.azimuth = 8.3, -20.0, math.degrees(direction)

    return aim


def _top(track: Track) -> Callable[[mujoco.MjvCamera, float], None]:
    """Place the camera above the car, x to the right and y up as in the plots. It does not rotate with the car."""

    def aim(camera: mujoco.MjvCamera, time_s: float) -> None:
        camera.lookat = track.middle(time_s)
        camera.distance, camera.elevation, camera.azimuth = 15.0, -90.0, 90.0

    return aim


def _wheel(track: Track, corner: str) -> Callable[[mujoco.MjvCamera, float], None]:
    """Place the camera inboard of a wheel, where its links are. It follows the chassis without roll and heave."""
    if corner not in CORNERS:
        raise ParameterError(f"there is no corner {corner!r}; {nearest_names(corner, CORNERS)}", value=corner)
    place = track.wheel_place(corner)
    side, end = (1.0 if corner[1] == "l" else -1.0), (1.0 if corner[0] == "f" else -1.0)
    # Look from the end of the car towards its middle, and outwards by 28 degrees.
    azimuth = side * (90.0 + 62.0 * end)

    def aim(camera: mujoco.MjvCamera, time_s: float) -> None:
        heading = track.heading(time_s)
        cos, sin = math.cos(heading), math.sin(heading)
        x, y, z = place
        camera.lookat = track.chassis(time_s) + np.array([cos * x - sin * y, sin * x + cos * y, z + 0.05])
        camera.distance, camera.elevation, camera.azimuth = 1.9, -10.0, math.degrees(heading) + azimuth

    return aim
