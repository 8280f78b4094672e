"""Tyre forces as arrows on the road, and a disc below each tyre coloured by its friction utilisation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from activesteer.conventions import CORNERS
from activesteer.drawing.tyre_forces import CHANNELS, force_arrows, force_scale
from activesteer.playback.runs import Run
from activesteer.playback.timeline import times

_ARROW_RADIUS_M: Final = 0.045
_ARROW_COLOUR: Final = (255, 45, 150)
_DISC_RADIUS_M: Final = 0.3

_USE: Final = (0.0, 0.6, 0.9, 1.1)
_USE_COLOURS: Final = ((0, 158, 115), (240, 228, 66), (230, 120, 0), (220, 20, 20))
"""Colours at these utilisations: green, yellow, orange, red."""

_USED: Final = tuple(f"{corner}_friction_utilisation" for corner in CORNERS)


def send_tyre_forces(stream: rr.RecordingStream, run: Run, runs: Sequence[Run]) -> None:
    """Send an arrow and a disc for each tyre, unless the recording lacks a channel that they need.

    Args:
        stream: Target of the data.
        run: The run.
        runs: All runs that are shown together; their arrows share one scale.
    """
    if not run.has(*_USED, *CHANNELS):
        return
    origins, vectors = force_arrows(run.recording, force_scale([other.recording for other in runs]))
    colours = use_colours(np.stack([run.channel(name) for name in _USED], axis=1))
    # A run that diverged ends with values that cannot be drawn.
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


def use_colours(friction_utilisation: NDArray[np.float64]) -> NDArray[np.uint32]:
    """Return colours 0xrrggbbff for fractions of the available friction."""
    red, green, blue = (
        np.interp(np.nan_to_num(friction_utilisation, nan=0.0), _USE, [colour[part] for colour in _USE_COLOURS])
        .round()
        .astype(np.uint32)
        for part in range(3)
    )
    return ((red << 24) | (green << 16) | (blue << 8) | 255).astype(np.uint32)
