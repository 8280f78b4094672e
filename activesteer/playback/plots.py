"""Signals over time: which are plotted, in which unit, and in which plot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from activesteer.conventions import CORNERS
from activesteer.playback.car import rgb
from activesteer.playback.runs import Run
from activesteer.playback.timeline import times
from activesteer.quantities import quantity_of

_CORNER_COLOURS: Final = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7")
_LINK_COLOURS: Final = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#d55e00", "#a6a6a6")
_WORDS: Final = {"fl": "front left", "fr": "front right", "rl": "rear left", "rr": "rear right"}


class Series(NamedTuple):
    """One line of a plot.

    Attributes:
        channel: Channel of the recording.
        name: Name in the legend, where a plot has several of a run.
        colour: Its colour where a single run is plotted; that of the run where empty.
        width: Width of the line.
    """

    channel: str
    name: str = ""
    colour: str = ""
    width: float = 1.5


class Plot(NamedTuple):
    """A plot over time.

    Attributes:
        title: What is plotted, and its unit in brackets.
        series: The lines.
        entity: Name of the entity that holds all lines together, which makes the file smaller; where empty, every line
            is an entity of its own, and can stand in several plots.
    """

    title: str
    series: tuple[Series, ...]
    entity: str = ""


def _of_car(channel: str) -> Plot:
    return Plot(quantity_of(channel).title, (Series(channel),))


MOTION: Final = (
    _of_car("steering_wheel_rad"),
    Plot(
        quantity_of("yaw_rate_radps")._replace(label="yaw rate, desired one thin").title,
        (
            Series("yaw_rate_radps"),
            Series("yaw_rate_desired_radps", "desired", "#f0e442", 0.8),
            Series("measured_yaw_rate_radps", "measured", "#a6a6a6", 0.8),
        ),
    ),
    Plot(
        quantity_of("sideslip_rad").title,
        (Series("sideslip_rad"), Series("estimated_sideslip_rad", "estimated", "#a6a6a6", 0.8)),
    ),
    Plot(
        quantity_of("ay_mps2").title,
        (Series("ay_mps2"), Series("measured_ay_mps2", "measured", "#a6a6a6", 0.8)),
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

_DEMAND_OF: Final = {
    "yaw_rate_desired_radps": "yaw_rate_desired_radps",
    "rear_steer_rad": "rear_steer_demand_rad",
    "superposition_rad": "superposition_demand_rad",
    **{f"{corner}_brake_pressure_Pa": f"{corner}_brake_pressure_Pa" for corner in CORNERS},
}
"""Channel, and the one that is not all zero where it has something to show: a hinge gives way without being asked."""


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
    """Plots of the axial forces of the links and springs, one for each corner, from the channels that there are."""
    plots = []
    for corner in CORNERS:
        names = [
            channel.name
            for channel in run.recording.channels
            if channel.name.startswith(f"{corner}_") and channel.name.endswith("_force_N") and channel.group == "links"
        ]
        if not names:
            continue
        series = (
            Series(name, name[3:].removesuffix("_force_N").replace("_", " "), _LINK_COLOURS[index % len(_LINK_COLOURS)])
            for index, name in enumerate(names)
        )
        title = f"Link forces {_WORDS[corner]}, tension positive [N]"
        plots.append(Plot(title, tuple(series), f"{corner}_link_forces_N"))
    return tuple(plots)


def send_plots(stream: rr.RecordingStream, run: Run, *, alone: bool) -> None:
    """Sends the signals of every plot.

    Args:
        stream: Where to.
        run: The run.
        alone: Whether it is the only run: the lines of several are distinguished by the colours of the runs.
    """
    when = times(run.recording.time_s)
    for plot in (*MOTION, *WHEELS, *links(run)):
        own_colours = alone or plot not in MOTION
        for path, lines in _entities(run, plot):
            style = rr.SeriesLines(
                names=[_legend(run, line, alone=own_colours) for line in lines],
                colors=[rgb(line.colour if line.colour and own_colours else run.colour) for line in lines],
                widths=[line.width for line in lines],
            )
            stream.log(path, style, static=True)
            values = np.stack([run.channel(line.channel) * _factor(line.channel) for line in lines], axis=1)
            columns = rr.Scalars.columns(scalars=values.reshape(-1))
            stream.send_columns(path, when, columns.partition(lengths=[len(lines)] * len(run.recording)))


def _factor(channel: str) -> float:
    """From the SI value to the unit that is plotted; forces of links are plotted in N."""
    return 1.0 if channel.endswith("_force_N") else quantity_of(channel).factor


def _legend(run: Run, line: Series, *, alone: bool) -> str:
    if not line.name:
        return run.label
    return line.name if alone else f"{run.label}, {line.name}"


def _entities(run: Run, plot: Plot) -> list[tuple[str, list[Series]]]:
    """Paths, and the lines that each of them holds, of what a run has for a plot."""
    lines = [line for line in plot.series if run.has(line.channel) and _is_demanded(run, line.channel)]
    if plot.entity:
        return [(f"{run.name}/plots/{plot.entity}", lines)] if lines else []
    return [(f"{run.name}/plots/{line.channel}", [line]) for line in lines]


def _is_demanded(run: Run, channel: str) -> bool:
    demand = _DEMAND_OF.get(channel)
    return demand is None or not run.has(demand) or bool(np.any(run.recording[demand]))


def views(plots: Sequence[Plot], runs: Sequence[Run]) -> list[rrb.TimeSeriesView]:
    """A view for each plot that has something to show, with the lines of all these runs."""
    shown = []
    for plot in plots:
        entities = [entity for run in runs for entity in _entities(run, plot)]
        contents = [f"/{path}" for path, _ in entities]
        if contents:
            # The colours of several runs are the same in all plots: one legend is enough, and the plots are small.
            legend = plot is plots[0] if len(runs) > 1 else sum(len(lines) for _, lines in entities) > 1
            shown.append(_view(plot.title, contents, legend=legend))
    return shown


def views_by_corner(plot: Plot, runs: Sequence[Run]) -> list[rrb.TimeSeriesView]:
    """A view for each wheel of a plot of the wheels, where the lines of the runs are distinguished by their colours."""
    shown = []
    for line in plot.series:
        present = [run for run in runs if run.has(line.channel)]
        styles = {
            f"/{run.name}/plots/{line.channel}": rr.SeriesLines(names=[run.label], colors=[rgb(run.colour)])
            for run in present
        }
        if styles:
            head, _, unit = plot.title.rpartition(" [")
            shown.append(_view(f"{head}, {line.name} [{unit}", list(styles), styles, legend=not shown))
    return shown


def _view(
    title: str, contents: list[str], styles: dict[Any, rr.SeriesLines] | None = None, *, legend: bool
) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin="/",
        contents=contents,
        name=title,
        overrides=styles,
        # Zooming or moving one plot moves all.
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
        # At the left: a manoeuvre begins quietly.
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=legend),
    )
