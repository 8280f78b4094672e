"""The figures of the step steer: 2 (the car beside its linear models) and 11 (the three systems)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from activesteer.analysis.figures import style, time_panels
from activesteer.analysis.figures.style import DESIRED, LATERAL, ROLL, SIDESLIP, YAW_RATE, DrawnRun
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import RUN_COLOURS, RUN_DASHES, Array, RunLook
from activesteer.errors import RecordingError
from activesteer.plotting import new_figure, save
from activesteer.units import quantity_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FRONT = quantity_of("front_steer_rad")._replace(short="steering angles")


def figure_11(recordings: Mapping[str, RecordingLike]) -> Figure:
    """Draw the response to a step steer.

    From the top, over one time axis: yaw rate (dotted: desired by the controller), steering angles (front wheels thin,
    added angles of rear wheels or front superposition thick), lateral acceleration, sideslip and roll.

    Args:
        recordings: Runs by label; `none`, `ars` and `afs` get the paper's names and numbers, others keep their own.

    Source: V. Dorsch, Mecatronics-REM 2012, figure 11.
    """
    curves = style.curves(recordings)
    figure = new_figure(width_in=style.COLUMN_IN, height_in=1.1 + 5 * time_panels.PANEL_IN)
    axes: list[Axes] = list(figure.subplots(5, 1, sharex=True))
    for curve in curves:
        style.draw(axes[0], curve, YAW_RATE, label=curve.look.label)
        if np.any(curve.recording[DESIRED.channel]):
            style.draw(axes[0], curve, DESIRED, width=1.0, style=style.DOTTED)
        style.draw(axes[1], curve, FRONT, width=0.8)
        style.draw_added(axes[1], curve, width=2.2)
    style.plain(axes[0], YAW_RATE.axis_title)
    style.plain(axes[1], FRONT.axis_title)
    time_panels.fill_panels(axes[2:], curves, (LATERAL, SIDESLIP, ROLL))
    time_panels.shade_friction(axes, curves)
    figure.align_ylabels(axes)
    style.name_curves(
        figure, axes[0], [("desired", 1.0, style.DOTTED), ("front wheels", 0.8, "-"), ("added by a system", 2.2, "-")]
    )
    return figure


def figure_2(
    recording: RecordingLike,
    path: str | os.PathLike[str],
    models: Mapping[str, Mapping[str, Array]] | None = None,
) -> Path:
    """Draw yaw rate and roll angle after a step of the steering, in the form of the paper's figure 2, and save it.

    Args:
        recording: A step steer.
        path: File to write; its ending gives the format (.png, .pdf, .svg).
        models: Label -> channel -> values over the time of the recording, drawn beside it: the single-track model
            (`identification.single_track_response`), which has no roll, and the linear car
            (`linearisation.linear_response`).

    Source: V. Dorsch, Mecatronics-REM 2012, figure 2.
    """
    figure = new_figure(width_in=style.COLUMN_IN, height_in=3.6)
    axes: list[Axes] = list(figure.subplots(2, 1, sharex=True))
    car = DrawnRun(recording, RunLook("multibody car", 0, ()))
    for axis, panel in zip(axes, (YAW_RATE, ROLL), strict=True):
        style.draw(axis, car, panel, label=car.look.label, width=2.0)
        for place, (label, channels) in enumerate((models or {}).items(), start=1):
            if panel.channel in channels:
                axis.plot(
                    recording.time_s, channels[panel.channel] * panel.factor, color=RUN_COLOURS[place], linewidth=1.2,
                    linestyle=(0.0, RUN_DASHES[place]), label=label,
                )  # fmt: skip
        style.plain(axis, panel.axis_title)
    time_panels.finish_time(axes, [car])
    figure.align_ylabels(axes)
    style.name_curves(figure, axes[0])
    return save(figure, Path(path), RecordingError)
