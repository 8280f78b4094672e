"""Signals over time: which are plotted, in which unit, and in which plot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from activesteer.conventions import CORNERS
from activesteer.playback.car import rgb
from activesteer.playback.runs import Run
from activesteer.playback.timeline import times

_DEGREES: Final = math.degrees(1.0)
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
        factor: From the SI value to the unit of the title.
    """

    title: str
    series: tuple[Series, ...]
    factor: float = 1.0


MOTION: Final = (
    Plot("Steering wheel angle [deg]", (Series("steering_wheel_rad"),), _DEGREES),
    Plot(
        "Yaw rate, desired one thin [deg/s]",
        (Series("yaw_rate_radps"), Series("yaw_rate_desired_radps", "desired", "#f0e442", 0.8)),
        _DEGREES,
    ),
    Plot("Sideslip angle [deg]", (Series("sideslip_rad"),), _DEGREES),
    Plot("Lateral acceleration [m/s²]", (Series("ay_mps2"),)),
    Plot(
        "Added steer angles, rear thick, front thin [deg]",
        (
            Series("rear_steer_rad", "rear wheels", "#d55e00", 2.0),
            Series("superposition_rad", "front superposition", "#0072b2", 1.0),
        ),
        _DEGREES,
    ),
)
"""Plots of the car as a whole."""

DESIRED: Final = "yaw_rate_desired_radps"
"""Steered for by a controller only; without one it is zero and says nothing."""


def _of_wheels(title: str, channel: str) -> Plot:
    lines = zip(CORNERS, _CORNER_COLOURS, strict=True)
    return Plot(title, tuple(Series(f"{corner}_{channel}", _WORDS[corner], colour) for corner, colour in lines))


WHEELS: Final = (
    _of_wheels("Wheel loads [N]", "tyre_fz_N"),
    _of_wheels("Friction use of the tyres [1]", "friction_use"),
    _of_wheels("Lateral tyre forces [N]", "tyre_fy_N"),
    _of_wheels("Longitudinal tyre forces [N]", "tyre_fx_N"),
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
        plots.append(Plot(f"Link forces {_WORDS[corner]}, tension positive [N]", tuple(series)))
    return tuple(plots)


def send_plots(stream: rr.RecordingStream, run: Run, *, alone: bool) -> None:
    """Sends every signal of every plot, each an entity of its own.

    Args:
        stream: Where to.
        run: The run.
        alone: Whether it is the only run, so that the lines of one plot need not be told from those of others.
    """
    when = times(run.recording.time_s[run.rows])
    for plot in (*MOTION, *WHEELS, *links(run)):
        for line in _present(run, plot):
            path = series_path(run, line)
            colour = line.colour if alone or plot not in MOTION else ""
            name = line.name or run.label
            if not alone and plot in MOTION:
                name = f"{run.label}, {line.name}" if line.name else run.label
            look = rr.SeriesLines(names=[name], colors=[rgb(colour or run.colour)], widths=[line.width])
            stream.log(path, look, static=True)
            values = run.channel(line.channel) * plot.factor
            stream.send_columns(path, when, rr.Scalars.columns(scalars=values))


def series_path(run: Run, line: Series) -> str:
    """Entity of a line."""
    return f"{run.name}/plots/{line.channel}"


def views(plots: Sequence[Plot], runs: Sequence[Run]) -> list[rrb.TimeSeriesView]:
    """A view for each plot that has something to show, with the lines of all these runs."""
    shown = []
    for plot in plots:
        contents = [f"/{series_path(run, line)}" for run in runs for line in _present(run, plot)]
        if contents:
            shown.append(_view(plot.title, contents))
    return shown


def views_by_corner(plot: Plot, runs: Sequence[Run]) -> list[rrb.TimeSeriesView]:
    """A view for each wheel of a plot of the wheels, where the lines of the runs are told apart by their colours."""
    shown = []
    for line in plot.series:
        present = [run for run in runs if line in _present(run, plot)]
        looks = {
            f"/{series_path(run, line)}": rr.SeriesLines(names=[run.label], colors=[rgb(run.colour)]) for run in present
        }
        if looks:
            head, _, unit = plot.title.rpartition(" [")
            shown.append(_view(f"{head}, {line.name} [{unit}", list(looks), looks))
    return shown


def _view(title: str, contents: list[str], looks: dict[str, rr.SeriesLines] | None = None) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin="/",
        contents=contents,
        name=title,
        overrides=looks,
        # Zooming or moving one plot moves all.
        axis_x=rrb.TimeAxis(link="LinkToGlobal"),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=len(contents) > 1),
    )


def _present(run: Run, plot: Plot) -> list[Series]:
    lines = [line for line in plot.series if run.has(line.channel)]
    return [line for line in lines if line.channel != DESIRED or np.any(run.recording[DESIRED])]
