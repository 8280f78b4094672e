"""Pictures as JSON values, which a page draws: curves with fewer points and digits, in the colours of the page."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from activesteer.conventions import RUN_COLOURS
from activesteer.plotting.model import Curve, Panel, Picture

_MOST_POINTS: Final = 2000
"""Most points of a curve: twice the pixels of a chart."""
_DASHES: Final = {"-": (), "--": (4.0, 2.0), ":": (1.0, 1.6), "": None}
_GREY: Final = "#777777"


def picture_values(picture: Picture) -> dict[str, Any]:
    """Return a picture as JSON values.

    A panel without a label of its abscissa, ordinate or without a title has those of its column or row.
    """
    panels = [panel for panel in picture.panels if isinstance(panel, Panel)]
    columns = picture.columns or len(panels)
    shown = []
    for place, panel in enumerate(panels):
        column, row = panels[place % columns :: columns], panels[place - place % columns : place + 1]
        values = _panel_values(panel)
        values["x"] = next((each.x_label for each in column[place // columns :] if each.x_label), "")
        values["y"] = _one_line(next((each.y_label for each in reversed(row) if each.y_label), ""))
        values["title"] = panel.title or (column[0].title if len(panels) > columns else "")
        shown.append(values)
    return {"panels": shown, "scale": picture.scale}


def _panel_values(panel: Panel) -> dict[str, Any]:
    own = 0
    curves = []
    for curve in panel.curves:
        colour, dashes = curve.colour, curve.dashes
        if curve.shade is None and not colour:
            colour = RUN_COLOURS[own % len(RUN_COLOURS)]
            dashes = ("--" if own % 2 else "-") if dashes is None else dashes
            own += 1
        curves.append(_curve_values(curve, _colour(colour), _DASHES.get(dashes) if isinstance(dashes, str) else dashes))
    areas = [
        {
            "x": _numbers(area.x), "label": area.label, "colour": _colour(area.colour), "alpha": area.alpha,
            "low": _numbers(area.low, area.x), "high": _numbers(area.high, area.x), "edge": area.edge,
        }
        for area in panel.areas
    ]  # fmt: skip
    above = panel.above and {
        "label": panel.above[0], "first": _numbers(panel.above[1]), "second": _numbers(panel.above[2])
    }  # fmt: skip
    return {
        "curves": curves, "areas": areas, "limits": list(panel.limits), "names": list(panel.names),
        "notes": list(panel.notes), "log": panel.log, "x_range": panel.x_range, "y_range": panel.y_range,
        "zero": panel.zero, "equal": panel.equal, "legend": panel.legend, "above": above,
    }  # fmt: skip


def _curve_values(curve: Curve, colour: str, dashes: Any) -> dict[str, Any]:
    x = np.asarray(curve.x, np.float64)
    if isinstance(dashes, tuple) and len(dashes) == 2 and isinstance(dashes[1], tuple):
        dashes = dashes[1]
    elif curve.dashes is None and dashes is None:
        dashes = ()
    steps = np.diff(x[np.isfinite(x)])
    return {
        "x": _numbers(x), "y": _numbers(curve.y), "label": curve.label, "colour": colour, "dashes": dashes,
        "width": curve.width, "marker": curve.marker, "size": curve.size, "shade": curve.shade,
        "turns": bool((steps > 0.0).any() and (steps < 0.0).any()),
    }  # fmt: skip


def _colour(colour: str) -> str:
    """Return the name of a run's colour, which a page has for day and night, or the colour itself."""
    return f"run-{RUN_COLOURS.index(colour)}" if colour in RUN_COLOURS else colour if len(colour) == 7 else _GREY


def _numbers(values: ArrayLike, along: ArrayLike | None = None) -> list[float | None]:
    """Return numbers of five digits, of a line with too many points every n-th; None for one that is not finite."""
    each = np.asarray(values, np.float64)
    if along is not None:
        each = np.broadcast_to(each, np.shape(along))
    every = -(-len(each) // _MOST_POINTS) or 1
    return [float(f"{value:.5g}") if np.isfinite(value) else None for value in each[::every].tolist()]


def _one_line(label: str) -> str:
    return " ".join(label.split())
