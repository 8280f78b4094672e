"""Pictures of recordings, in degrees. matplotlib is an extra of the package and imported when a picture is made."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.source import RecordingLike
from activesteer.errors import ParameterError, RecordingError
from activesteer.pictures import new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LABELS: Final = {"none": "1 no control", "ars": "2 active rear steering", "afs": "3 active front steering"}
"""What the curves of the three systems are called, numbered as in the paper's figures."""

COLOURS: Final = ("#333333", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00")
"""Colours that colour-blind readers can tell apart (Okabe and Ito, 2008)."""


class Panel(NamedTuple):
    """One channel of every run over time.

    Attributes:
        title: What stands at the vertical axis, with the unit.
        channel: Channel name.
        factor: From the SI value to the unit of the axis.
    """

    title: str
    channel: str
    factor: float


YAW_RATE: Final = Panel("yaw rate\n[deg/s]", "yaw_rate_radps", math.degrees(1.0))
DESIRED: Final = Panel("", "yaw_rate_desired_radps", math.degrees(1.0))
FRONT: Final = Panel("steering angles\n[deg]", "front_steer_rad", math.degrees(1.0))
ADDED: Final = (
    Panel("", "rear_steer_rad", math.degrees(1.0)),
    Panel("", "superposition_rad", math.degrees(1.0)),
)
REST: Final = (
    Panel("lateral acc.\n[m/s²]", "ay_mps2", 1.0),
    Panel("sideslip angle\n[deg]", "sideslip_rad", math.degrees(1.0)),
    Panel("roll angle\n[deg]", "roll_rad", math.degrees(1.0)),
)


class Curve(NamedTuple):
    """A run as it is drawn.

    Attributes:
        recording: The run.
        label: Its name in the legend.
        colour: Its colour.
    """

    recording: RecordingLike
    label: str
    colour: str


def step_steer_figure(recordings: Mapping[str, RecordingLike], path: str | os.PathLike[str]) -> Path:
    """Draw the response to a step steer in the form of the paper's figure 11, and save it.

    From the top: yaw rate (dashed: desired, of the runs with a controller), steering angles (front wheels thin, added
    angles thick: those of the rear wheels, or the superposition at the front ones), lateral acceleration, sideslip and
    roll, over one time axis.

    Args:
        recordings: Runs by label; `none`, `ars` and `afs` get the paper's names and numbers, others keep their own.
        path: File to write; its ending says the format (.png, .pdf, .svg).

    Returns:
        The path written.

    Raises:
        ParameterError: matplotlib is not installed, or there is no run to draw.
        RecordingError: a channel is missing, or the file cannot be written.

    Source: V. Dorsch, Mecatronics-REM 2012, figure 11.
    """
    if not recordings:
        raise ParameterError("there is no recording to draw, at least one is needed")
    figure = new_figure(width_in=7.5, height_in=9.5)
    axes: list[Axes] = list(figure.subplots(2 + len(REST), 1, sharex=True))
    curves = _curves(recordings)
    for curve in curves:
        _draw(axes[0], curve, YAW_RATE, label=curve.label)
        if np.any(curve.recording[DESIRED.channel]):
            _draw(axes[0], curve, DESIRED, width=1.0, style="--")
        _draw(axes[1], curve, FRONT, width=0.8)
        for panel in ADDED:
            # What no controller asks for is the give of a hinge, not an added angle.
            if np.any(curve.recording[panel.channel.replace("_rad", "_demand_rad")]):
                _draw(axes[1], curve, panel, width=2.2)
        for axis, panel in zip(axes[2:], REST, strict=True):
            _draw(axis, curve, panel)
    for axis, panel in zip(axes, (YAW_RATE, FRONT, *REST), strict=True):
        axis.set_ylabel(panel.title)
        axis.grid(visible=True, color="#dddddd", linewidth=0.6)
        axis.spines[["top", "right"]].set_visible(False)
    _explain(axes[0], [("desired", 1.0, "--")])
    _explain(axes[1], [("front wheels", 0.8, "-"), ("added: rear wheels (2), superposition (3)", 2.2, "-")])
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(0.0, max(float(curve.recording.time_s[-1]) for curve in curves))
    figure.align_ylabels(axes)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=min(len(curves), 3), frameon=False)
    return save(figure, Path(path), RecordingError)


def figure_2(
    recording: RecordingLike,
    path: str | os.PathLike[str],
    models: Mapping[str, Mapping[str, NDArray[np.float64]]] | None = None,
) -> Path:
    """Draw yaw rate and roll angle after a step of the steering, in the form of the paper's figure 2, and save it.

    Args:
        recording: A step steer.
        path: File to write; its ending says the format (.png, .pdf, .svg).
        models: Label -> channel -> values over the time of the recording, to stand beside it: the single-track model
            (`identification.single_track_response`), which has no roll, the linear car
            (`linearisation.linear_response`).

    Returns:
        The path written.

    Raises:
        ParameterError: matplotlib is not installed.
        RecordingError: a channel is missing, or the file cannot be written.

    Source: V. Dorsch, Mecatronics-REM 2012, figure 2.
    """
    figure = new_figure(width_in=7.5, height_in=5.5)
    axes: list[Axes] = list(figure.subplots(2, 1, sharex=True))
    roll = next(panel for panel in REST if panel.channel == "roll_rad")
    for axis, panel in zip(axes, (YAW_RATE, roll), strict=True):
        _draw(axis, Curve(recording, "", COLOURS[0]), panel, label="multibody car", width=2.0)
        for (label, channels), colour in zip((models or {}).items(), COLOURS[1:], strict=False):
            if panel.channel in channels:
                values = channels[panel.channel] * panel.factor
                axis.plot(recording.time_s, values, "--", color=colour, linewidth=1.4, label=label)
        axis.set_ylabel(panel.title)
        axis.grid(visible=True, color="#dddddd", linewidth=0.6)
        axis.spines[["top", "right"]].set_visible(False)
        axis.legend(loc="lower right", frameon=False)
    axes[-1].set_xlabel("time [s]")
    axes[-1].set_xlim(0.0, float(recording.time_s[-1]))
    figure.align_ylabels(axes)
    return save(figure, Path(path), RecordingError)


def _curves(recordings: Mapping[str, RecordingLike]) -> list[Curve]:
    """The runs in the paper's order, the three systems always in the same colours."""
    known = [label for label in LABELS if label in recordings]
    others = [label for label in recordings if label not in LABELS]
    colours = dict(zip(LABELS, COLOURS, strict=False))
    spare = COLOURS[len(LABELS) :]
    colours |= {label: spare[i % len(spare)] for i, label in enumerate(others)}
    return [Curve(recordings[label], LABELS.get(label, label), colours[label]) for label in known + others]


def _draw(axis: Axes, curve: Curve, panel: Panel, label: str = "", width: float = 1.4, style: str = "-") -> None:
    values = np.asarray(curve.recording[panel.channel], dtype=np.float64) * panel.factor
    # A leading underscore keeps a line out of the legend.
    axis.plot(curve.recording.time_s, values, style, color=curve.colour, linewidth=width, label=label or "_hidden")


def _explain(axis: Axes, lines: list[tuple[str, float, str]]) -> None:
    handles = [axis.plot([], [], style, color="#777777", linewidth=width)[0] for _, width, style in lines]
    axis.legend(handles, [text for text, _, _ in lines], loc="best", fontsize="small", frameon=False)
