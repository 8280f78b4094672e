"""Tyre forces as arrows on the road, with one scale for the friction of all runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import CORNERS
from activesteer.recording import Recording

CHANNELS: Final = (
    "yaw_rad",
    *(
        f"{corner}_{name}"
        for corner in CORNERS
        for name in ("tyre_fx_N", "tyre_fy_N", "contact_x_m", "contact_y_m", "steer_rad")
    ),
)
"""Channels that the arrows need."""
_SCALE_NPM: Final = 1500.0
"""Force per length of an arrow on a road with a friction of 1 [N/m]."""
_MIN_MU: Final = 0.02
_ABOVE_ROAD_M: Final = 0.1


def force_scale(recordings: Sequence[Recording]) -> float:
    """Return the force per length of an arrow [N/m] in one view, proportional to the largest friction."""
    names = [f"{corner}_mu" for corner in CORNERS]
    values = [run[name] for run in recordings for name in names if name in run]
    met = [float(np.max(found[np.isfinite(found)], initial=0.0)) for found in values]
    return _SCALE_NPM * max(*met, _MIN_MU) if met else _SCALE_NPM


def force_arrows(recording: Recording, scale_NpM: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return origins and vectors of the arrows in world axes [m], each of shape (rows, 4, 3)."""
    origins = np.empty((len(recording), len(CORNERS), 3), np.float32)
    vectors = np.zeros_like(origins)
    origins[:, :, 2] = _ABOVE_ROAD_M
    for wheel, corner in enumerate(CORNERS):
        fx_m, fy_m = (recording[f"{corner}_tyre_{axis}_N"] / scale_NpM for axis in ("fx", "fy"))
        wheel_heading = recording["yaw_rad"] + recording[f"{corner}_steer_rad"]
        cos, sin = np.cos(wheel_heading), np.sin(wheel_heading)
        origins[:, wheel, 0] = recording[f"{corner}_contact_x_m"]
        origins[:, wheel, 1] = recording[f"{corner}_contact_y_m"]
        vectors[:, wheel, 0] = cos * fx_m - sin * fy_m
        vectors[:, wheel, 1] = sin * fx_m + cos * fy_m
    return origins, vectors
