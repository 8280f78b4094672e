"""Plots over time: their signals, units and axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from activesteer.core.conventions import CORNERS
from activesteer.drawing.cars import bytes_of
from activesteer.drawing.panels import BODY, DRIVING, MOTION, WHEELS, Line, Panel, drawn_values, link_panels, panels_in
from activesteer.playback.runs import ReplayedRun, send

_MOST_NUMBERS: Final = {1: 8.0, 2: 8.0, 3: 8.0, 4: 5.4}
"""Number of tick labels that fit on one axis in a window of 1280 x 800, by number of plots on the page."""


_MARGIN: Final = 1.02
_SLIVER: Final = 0.03
_EDGE: Final = 1.06
"""Room beyond the largest value relative to it, least part of an axis on either side of zero, and room at the edge."""


OF_CAR: Final = tuple(panel for page in (MOTION, DRIVING, BODY) for panel in panels_in(page))
"""Panels of the car as a whole: the lines of several runs have the colours of their runs."""


def links(run: ReplayedRun) -> tuple[Panel, ...]:
    """Return the panels of the axial forces of links and springs, one for each corner."""
    channels = (channel.name for channel in run.recording.channels if channel.group == "links")
    return link_panels([name for name in channels if name.endswith("_force_N")])


def send_plots(stream: rr.RecordingStream, run: ReplayedRun, *, alone: bool) -> None:
    """Send the signals of every plot."""
    for plot in (*OF_CAR, *panels_in(WHEELS), *links(run)):
        own_colours = alone or plot not in OF_CAR
        for path, lines in _entities(run, plot):
            style = rr.SeriesLines(
                names=[_name(run, line, alone=own_colours) for line in lines],
                colors=[bytes_of(_paint(run, line, alone=own_colours)) for line in lines],
                widths=[line.width for line in lines],
            )
            values = np.stack(
                [drawn_values(run.recording, line.channel) * plot.quantity.factor for line in lines], axis=1
            )
            columns = rr.Scalars.columns(scalars=values.reshape(-1))
            send(stream, path, style, run.recording.time_s, columns, len(lines))


def _name(run: ReplayedRun, line: Line, *, alone: bool) -> str:
    if not line.name:
        return run.label
    return line.name if alone else f"{run.label}, {line.name}"


def _paint(run: ReplayedRun, line: Line, *, alone: bool) -> str:
    return line.colour if line.colour and alone else run.colour


def _entities(run: ReplayedRun, plot: Panel) -> list[tuple[str, list[Line]]]:
    """Return the entities of a plot and their lines, for the channels of a run."""
    lines = [line for line in plot.lines_in(MOTION) if run.has(line.channel) and line.of(run.recording) is not None]
    if plot.joined:
        return [(f"{run.name}/plots/{_entity(plot)}", lines)] if lines else []
    return [(f"{run.name}/plots/{line.channel}", [line]) for line in lines]


def _entity(plot: Panel) -> str:
    """Return the entity name of all lines of a plot."""
    channel = plot.lines[0].channel
    return f"{channel[:2]}_link_forces_N" if channel.endswith("_force_N") else channel[3:]


def pages(run: ReplayedRun) -> dict[str, tuple[Panel, ...]]:
    """Return the plots of a run by page name."""
    return {page: panels_in(page) for page in (MOTION, DRIVING, BODY, WHEELS)} | {"Links": links(run)}


def curves(plots: Sequence[Panel], run: ReplayedRun, *, alone: bool) -> dict[str, str]:
    """Return the legend of the lines of a run: names and colours."""
    found = {}
    for plot in plots:
        own = alone or plot not in OF_CAR
        lines = [line for _, lines in _entities(run, plot) for line in lines]
        found |= {_name(run, line, alone=own): _paint(run, line, alone=own) for line in lines}
    return found


def views(plots: Sequence[Panel], runs: Sequence[ReplayedRun]) -> list[rrb.TimeSeriesView]:
    """Return a view for each plot that has data, with the lines of all runs."""
    shown = []
    found = [(plot, [entity for run in runs for entity in _entities(run, plot)]) for plot in plots]
    filled = [(plot, entities) for plot, entities in found if entities]
    for plot, entities in filled:
        limits = _range(plot, runs, len(filled))
        shown.append(_view(plot.title_with_unit, [f"/{path}" for path, _ in entities], limits))
    return shown


def _range(plot: Panel, runs: Sequence[ReplayedRun], beside: int) -> tuple[float, float]:
    """Return an axis range from a few fixed ranges, so that most runs share it."""
    values = [
        run.channel(line.channel) * plot.quantity.factor
        for run in runs
        for line in plot.lines_in(MOTION)
        if run.has(line.channel)
    ]
    finite = [found[np.isfinite(found)] for found in values]
    low = min((float(found.min(initial=0.0)) for found in finite), default=0.0)
    high = max((float(found.max(initial=0.0)) for found in finite), default=0.0)
    return axis_range(low, high, plot.quantity.min_span, _MOST_NUMBERS.get(beside, 4.3))


def axis_range(low: float, high: float, least: float, most: float) -> tuple[float, float]:
    """Return an axis range with zero and at least three tick labels in the viewer."""
    # The viewer labels multiples of one power of ten if they are at least 22 points apart.
    if high - low < least:
        low, high = min(low, -0.5 * least), max(high, 0.5 * least)
    reach = max(high, -low)
    sides = [side if side > _SLIVER * reach else _SLIVER * reach for side in (-_MARGIN * low, _MARGIN * high)]
    power = 10.0 ** (math.floor(math.log10(reach)) - 1)
    while True:
        # Coarse limits first, so that similar runs have the same.
        for grid in (1.0, 0.5, 0.1):
            below, above = (
                math.ceil(side / (grid * power) - 1e-9) * grid if side > _SLIVER * reach else 0.0 for side in sides
            )
            missing = max(0, 2 - math.floor(below + 1e-9) - math.floor(above + 1e-9))
            below, above = (below, above + missing) if above >= below else (below + missing, above)
            below, above = (max(side, _SLIVER * max(below, above)) for side in (below, above))
            if below + above <= most:
                # A label on the edge would be cut.
                room = min(_EDGE, most / (below + above))
                return -room * below * power, room * above * power
        power *= 10.0


def views_by_corner(plot: Panel, runs: Sequence[ReplayedRun]) -> list[rrb.TimeSeriesView]:
    """Return a view for each wheel of a plot, with each run in its own colour."""
    shown = []
    for line in plot.lines:
        present = [run for run in runs if run.has(line.channel)]
        styles = {
            f"/{run.name}/plots/{line.channel}": rr.SeriesLines(names=[run.label], colors=[bytes_of(run.colour)])
            for run in present
        }
        if styles:
            head, _, unit = plot.title_with_unit.rpartition(" [")
            shown.append(_view(f"{head}, {line.name} [{unit}", list(styles), _range(plot, runs, len(CORNERS)), styles))
    return shown


def _view(
    title: str,
    contents: list[str],
    limits: tuple[float, float],
    styles: dict[Any, rr.SeriesLines] | None = None,
) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin="/",
        contents=contents,
        name=title,
        overrides=styles,
        # Zooming or panning one plot does the same to all.
        axis_y=rrb.ScalarAxis(range=limits),
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
        plot_legend=rrb.PlotLegend(visible=False),
    )
