"""Tyre forces as arrows on the road, and below each tyre a disc in the colour of how much friction it uses."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from activesteer.conventions import CORNERS
from activesteer.playback.runs import Run
from activesteer.playback.timeline import times

FORCE_SCALE_NPM: Final = 1500.0
"""Force that an arrow of one metre stands for [N/m]."""
_ABOVE_ROAD_M: Final = 0.1
_ARROW_RADIUS_M: Final = 0.045
_ARROW_COLOUR: Final = (255, 255, 255)
_DISC_RADIUS_M: Final = 0.3

_USE: Final = (0.0, 0.6, 0.9, 1.1)
_USE_COLOURS: Final = ((0, 158, 115), (240, 228, 66), (230, 120, 0), (220, 20, 20))
"""Green, yellow, orange, red."""

CHANNELS: Final = tuple(
    f"{corner}_{name}"
    for corner in CORNERS
    for name in ("tyre_fx_N", "tyre_fy_N", "contact_x_m", "contact_y_m", "steer_rad", "friction_utilisation")
)


def send_tyre_forces(stream: rr.RecordingStream, run: Run) -> None:
    """Sends an arrow and a disc for each tyre; nothing where the recording lacks one of `CHANNELS` or `yaw_rad`."""
    if not run.has("yaw_rad", *CHANNELS):
        return
    origins, vectors = force_arrows(run)
    colours = use_colours(np.stack([run.channel(f"{corner}_friction_utilisation") for corner in CORNERS], axis=1))
    # A run that diverged ends with numbers that cannot be drawn.
    good = np.isfinite(origins).all(axis=(1, 2)) & np.isfinite(vectors).all(axis=(1, 2))
    when, four = times(run.recording.time_s[good]), [len(CORNERS)] * int(good.sum())
    painted = colours[good].reshape(-1)
    arrows = f"{run.scene}/tyres/force"
    stream.log(arrows, rr.Arrows3D.from_fields(radii=[_ARROW_RADIUS_M], colors=[_ARROW_COLOUR]), static=True)
    stream.send_columns(
        arrows,
        when,
        rr.Arrows3D.columns(origins=origins[good].reshape(-1, 3), vectors=vectors[good].reshape(-1, 3)).partition(
            lengths=four
        ),
    )
    discs = f"{run.scene}/tyres/friction_utilisation"
    size = rr.Cylinders3D.from_fields(radii=[_DISC_RADIUS_M], lengths=[0.02], fill_mode="solid")
    stream.log(discs, size, static=True)
    flat = origins[good] * np.array((1.0, 1.0, 0.0), np.float32)
    stream.send_columns(
        discs, when, rr.Cylinders3D.columns(centers=flat.reshape(-1, 3), colors=painted).partition(lengths=four)
    )


def force_arrows(run: Run) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Where the arrows begin, and what they are, in the world.

    Returns:
        Origins and vectors [m], each of shape (number of shown rows, 4, 3).
    """
    origins = np.empty((len(run.recording), len(CORNERS), 3), np.float32)
    vectors = np.zeros_like(origins)
    origins[:, :, 2] = _ABOVE_ROAD_M
    for wheel, corner in enumerate(CORNERS):
        fx_m, fy_m = (run.channel(f"{corner}_tyre_{axis}_N") / FORCE_SCALE_NPM for axis in ("fx", "fy"))
        wheel_heading = run.channel("yaw_rad") + run.channel(f"{corner}_steer_rad")
        cos, sin = np.cos(wheel_heading), np.sin(wheel_heading)
        origins[:, wheel, 0] = run.channel(f"{corner}_contact_x_m")
        origins[:, wheel, 1] = run.channel(f"{corner}_contact_y_m")
        vectors[:, wheel, 0] = cos * fx_m - sin * fy_m
        vectors[:, wheel, 1] = sin * fx_m + cos * fy_m
    return origins, vectors


def use_colours(friction_utilisation: NDArray[np.float64]) -> NDArray[np.uint32]:
    """Colours 0xrrggbbff for fractions of the available friction."""
    red, green, blue = (
        np.interp(np.nan_to_num(friction_utilisation, nan=0.0), _USE, [colour[part] for colour in _USE_COLOURS])
        .round()
        .astype(np.uint32)
        for part in range(3)
    )
    return ((red << 24) | (green << 16) | (blue << 8) | 255).astype(np.uint32)
