"""Legends beside the plots: the viewer's own legend would hide curves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import rerun as rr
import rerun.blueprint as rrb

from activesteer.drawing.cars import bytes_of

LEGEND: Final = "legend"
"""Parent entity of the legends."""
LEGEND_OF_RUNS: Final = f"{LEGEND}/runs"
"""Entity of the legend of the runs, which have the same colours in all plots."""
_WIDTH: Final = 500.0
"""Width of a legend, for a window of 1280 x 800 [screen points]."""
_ROW: Final = 26.0
_LETTER: Final = 6.6
_GAP: Final = 26.0
_BELOW: Final = 12.0
"""Distance from a marker to the middle of its text."""


def legend(path: str, curves: Mapping[str, str]) -> rrb.Spatial2DView:
    """Return the view of a legend.

    Args:
        path: Entity of the legend.
        curves: Names and colours, `#rrggbb`.
    """
    return rrb.Spatial2DView(
        origin=f"/{path}",
        name=f"Curves: {path.removeprefix(LEGEND)[1:]}",
        titlebar=False,
        visual_bounds=rrb.VisualBounds2D(x_range=(0.0, _WIDTH), y_range=(0.0, height(curves))),
    )


def height(curves: Mapping[str, str]) -> float:
    """Return the height of the legend of some curves."""
    return _ROW * (1 + max((row for row, _ in _places(curves)), default=0))


def send_legend(stream: rr.RecordingStream, path: str, curves: Mapping[str, str]) -> None:
    """Send a legend.

    Args:
        stream: Target of the data.
        path: Entity of the legend.
        curves: Names and colours, `#rrggbb`.
    """
    points = rr.Points2D(
        [(middle, (row + 0.5) * _ROW - _BELOW) for row, middle in _places(curves)],
        labels=list(curves),
        show_labels=True,
        colors=[bytes_of(colour) for colour in curves.values()],
        radii=0.0,
    )
    stream.log(path, points, static=True)


def _places(curves: Mapping[str, str]) -> list[tuple[int, float]]:
    """Return the row and the middle of each name."""
    places, row, at = [], 0, 0.0
    for name in curves:
        wide = _LETTER * len(name) + _GAP
        if at > 0.0 and at + wide > _WIDTH:
            row, at = row + 1, 0.0
        places.append((row, at + 0.5 * wide))
        at += wide
    return places
