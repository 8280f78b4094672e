"""Plots over time: their signals, units and axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import cycle
from typing import Any, Final, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from activesteer.conventions import CORNERS
from activesteer.drawing.cars import bytes_of
from activesteer.playback.runs import Run
from activesteer.playback.timeline import times
from activesteer.units import quantity_of

_MOST_NUMBERS: Final = {1: 8.0, 2: 8.0, 3: 8.0, 4: 5.4}
"""Number of plots on a page -> number of tick labels that fit on one axis in a window of 1280 x 800."""
_CORNER_COLOURS: Final = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7")
_LINK_COLOURS: Final = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#d55e00", "#a6a6a6")
_WORDS: Final = {"fl": "front left", "fr": "front right", "rl": "rear left", "rr": "rear right"}


_MARGIN: Final = 1.02
_SLIVER: Final = 0.03
_EDGE: Final = 1.06
"""Room beyond the largest value relative to it, least part of an axis on either side of zero, and room at the edge."""


class Series(NamedTuple):
    """A line of a plot.

    Attributes:
        channel: Channel of the recording.
        name: Name in the legend, if a plot has several lines of a run.
        colour: Colour of the line if a single run is plotted; empty for the colour of the run.
        width: Width of the line.
    """

    channel: str
    name: str = ""
    colour: str = ""
    width: float = 1.5


class Plot(NamedTuple):
    """A plot over time.

    Attributes:
        title: Quantity, with its unit in brackets.
        series: The lines.
        entity: Name of the entity that holds all lines, which makes the file smaller. If empty, every line is an entity
            of its own and may appear in several plots.
    """

    title: str
    series: tuple[Series, ...]
    entity: str = ""


def _of_car(channel: str) -> Plot:
    return Plot(quantity_of(channel).title, (Series(channel),))


MOTION: Final = (
    Plot(
        quantity_of("yaw_rate_radps")._replace(label="yaw rate, desired one thin").title,
        (
            Series("yaw_rate_radps"),
            Series("yaw_rate_desired_radps", "desired", "#b39b00", 0.8),
            Series("measured_yaw_rate_radps", "measured", "#a6a6a6", 0.8),
        ),
    ),
    Plot(
        quantity_of("sideslip_rad").title,
        (Series("sideslip_rad"), Series("estimated_sideslip_rad", "estimated", "#a6a6a6", 0.8)),
    ),
    Plot(
        quantity_of("rear_steer_rad")._replace(label="added steer angles, rear thick, front thin").title,
        (
            Series("rear_steer_rad", "rear wheels", "#d55e00", 2.0),
            Series("superposition_rad", "front superposition", "#0072b2", 1.0),
        ),
    ),
)
"""Plots of the car as a whole."""
DRIVING: Final = (_of_car("steering_wheel_rad"), _of_car("speed_mps"))
"""Plots of the driver's inputs."""
BODY: Final = (
    Plot(
        quantity_of("ay_mps2").title,
        (Series("ay_mps2"), Series("measured_ay_mps2", "measured", "#a6a6a6", 0.8)),
    ),
    _of_car("roll_rad"),
    _of_car("ax_mps2"),
)
"""Plots of the accelerations and the attitude of the body."""
OF_CAR: Final = (*MOTION, *DRIVING, *BODY)

_DEMAND_OF: Final = {
    "yaw_rate_desired_radps": "yaw_rate_desired_radps",
    "rear_steer_rad": "rear_steer_demand_rad",
    "superposition_rad": "superposition_demand_rad",
    **{f"{corner}_brake_pressure_Pa": f"{corner}_brake_pressure_Pa" for corner in CORNERS},
}
"""Channel -> the demand without which it is not plotted: compliance moves a hinge even if nothing is demanded."""


def _of_wheels(channel: str, entity: str = "") -> Plot:
    lines = zip(CORNERS, _CORNER_COLOURS, strict=True)
    series = tuple(Series(f"{corner}_{channel}", _WORDS[corner], colour) for corner, colour in lines)
    return Plot(quantity_of(channel).title, series, entity)


WHEELS: Final = (
    _of_wheels("tyre_fz_N"),
    _of_wheels("friction_utilisation"),
    _of_wheels("tyre_fy_N", "tyre_fy_N"),
    _of_wheels("tyre_fx_N", "tyre_fx_N"),
    _of_wheels("brake_pressure_Pa", "brake_pressure_Pa"),
)
"""Plots of the four wheels."""


def links(run: Run) -> tuple[Plot, ...]:
    """Return plots of the axial forces of links and springs, one for each corner, from the recorded channels."""
    named = {
        corner: [
            channel.name[3:]
            for channel in run.recording.channels
            if channel.name.startswith(f"{corner}_") and channel.name.endswith("_force_N") and channel.group == "links"
        ]
        for corner in CORNERS
    }
    # A part that all corners have, such as a spring, has the same colour in all of them.
    everywhere = [name for name in named[CORNERS[0]] if all(name in names for names in named.values())]
    plots = []
    for corner, names in named.items():
        order = [*everywhere, *(name for name in names if name not in everywhere)]
        series = (
            Series(f"{corner}_{name}", name.removesuffix("_force_N").replace("_", " "), colour)
            for name, colour in zip(order, cycle(_LINK_COLOURS), strict=False)
        )
        if names:
            title = f"Link forces {_WORDS[corner]}, tension positive [N]"
            plots.append(Plot(title, tuple(series), f"{corner}_link_forces_N"))
    return tuple(plots)


def send_plots(stream: rr.RecordingStream, run: Run, *, alone: bool) -> None:
    """Send the signals of every plot.

    Args:
        stream: Target of the data.
        run: The run.
        alone: Whether this is the only run. The lines of several runs have the colours of their runs.
    """
    when = times(run.recording.time_s)
    for plot in (*OF_CAR, *WHEELS, *links(run)):
        own_colours = alone or plot not in OF_CAR
        for path, lines in _entities(run, plot):
            style = rr.SeriesLines(
                names=[_name(run, line, alone=own_colours) for line in lines],
                colors=[bytes_of(_paint(run, line, alone=own_colours)) for line in lines],
                widths=[line.width for line in lines],
            )
            stream.log(path, style, static=True)
            values = np.stack([run.channel(line.channel) * _factor(line.channel) for line in lines], axis=1)
            columns = rr.Scalars.columns(scalars=values.reshape(-1))
            stream.send_columns(path, when, columns.partition(lengths=[len(lines)] * len(run.recording)))


def _factor(channel: str) -> float:
    """Return the factor from SI to the unit of the plot; forces of links are plotted in N."""
    return 1.0 if channel.endswith("_force_N") else quantity_of(channel).factor


def _name(run: Run, line: Series, *, alone: bool) -> str:
    if not line.name:
        return run.label
    return line.name if alone else f"{run.label}, {line.name}"


def _paint(run: Run, line: Series, *, alone: bool) -> str:
    return line.colour if line.colour and alone else run.colour


def _entities(run: Run, plot: Plot) -> list[tuple[str, list[Series]]]:
    """Return the entities of a plot and the lines in each, for the channels that a run has."""
    lines = [line for line in plot.series if run.has(line.channel) and _is_demanded(run, line.channel)]
    if plot.entity:
        return [(f"{run.name}/plots/{plot.entity}", lines)] if lines else []
    return [(f"{run.name}/plots/{line.channel}", [line]) for line in lines]


def _is_demanded(run: Run, channel: str) -> bool:
    demand = _DEMAND_OF.get(channel)
    return demand is None or not run.has(demand) or bool(np.any(run.recording[demand]))


def pages(run: Run) -> dict[str, tuple[Plot, ...]]:
    """Return the plots of a run by page name."""
    return {"Motion": MOTION, "Driving": DRIVING, "Body": BODY, "Wheels": WHEELS, "Links": links(run)}


def curves(plots: Sequence[Plot], run: Run, *, alone: bool) -> dict[str, str]:
    """Return the names and colours of the lines of a run.

    Args:
        plots: The plots.
        run: The run.
        alone: Whether this is the only run; see `send_plots`.
    """
    found = {}
    for plot in plots:
        own = alone or plot not in OF_CAR
        lines = [line for _, lines in _entities(run, plot) for line in lines]
        found |= {_name(run, line, alone=own): _paint(run, line, alone=own) for line in lines}
    return found


def views(plots: Sequence[Plot], runs: Sequence[Run]) -> list[rrb.TimeSeriesView]:
    """Return a view for each plot that has data, with the lines of all these runs."""
    shown = []
    found = [(plot, [entity for run in runs for entity in _entities(run, plot)]) for plot in plots]
    filled = [(plot, entities) for plot, entities in found if entities]
    for plot, entities in filled:
        limits = _range(plot, runs, len(filled))
        shown.append(_view(plot.title, [f"/{path}" for path, _ in entities], limits))
    return shown


def _range(plot: Plot, runs: Sequence[Run], beside: int) -> tuple[float, float]:
    """Return the range of an axis, chosen from a few so that different runs mostly share it.

    Args:
        plot: The plot.
        runs: The runs.
        beside: Number of plots on the page.
    """
    values = [
        run.channel(line.channel) * _factor(line.channel)
        for run in runs
        for line in plot.series
        if run.has(line.channel)
    ]
    finite = [found[np.isfinite(found)] for found in values]
    low = min((float(found.min(initial=0.0)) for found in finite), default=0.0)
    high = max((float(found.max(initial=0.0)) for found in finite), default=0.0)
    return axis_range(low, high, _least_span(plot.series[0].channel), _MOST_NUMBERS.get(beside, 4.3))


def axis_range(low: float, high: float, least: float, most: float) -> tuple[float, float]:
    """Return a range that contains zero and in which the viewer draws at least three tick labels.

    The viewer labels multiples of one power of ten if they are at least 22 points apart.

    Args:
        low: Smallest value, at most 0.
        high: Largest value, at least 0.
        least: Smallest height of the range.
        most: Largest height at which the labels are that far apart, in units of that power; at least 2.1.
    """
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


def _least_span(channel: str) -> float:
    return 100.0 if channel.endswith("_force_N") else quantity_of(channel).min_span


def views_by_corner(plot: Plot, runs: Sequence[Run]) -> list[rrb.TimeSeriesView]:
    """Return a view for each wheel of a wheel plot; each run's lines have the colour of the run."""
    shown = []
    for line in plot.series:
        present = [run for run in runs if run.has(line.channel)]
        styles = {
            f"/{run.name}/plots/{line.channel}": rr.SeriesLines(names=[run.label], colors=[bytes_of(run.colour)])
            for run in present
        }
        if styles:
            head, _, unit = plot.title.rpartition(" [")
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
