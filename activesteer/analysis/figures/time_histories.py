"""The paper's figures over time: 12 and 13 (sine with dwell), 16, 17, 20, 21, 23, 24 (along a path)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from activesteer.analysis import sine_with_dwell
from activesteer.analysis.figures import style, time_panels
from activesteer.analysis.figures.style import ADDED, LATERAL, ROLL, SIDESLIP, SPEED, STEERING_WHEEL, YAW_RATE
from activesteer.analysis.source import RecordingLike
from activesteer.errors import RecordingError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Recordings = Mapping[str, RecordingLike]


def figure_12(recordings: Recordings) -> Figure:
    """Draw the steering wheel angle of the sine with dwell; the curves coincide in open loop."""
    figure = time_panels.time_figure(recordings, (STEERING_WHEEL,))
    _mark_instants(figure, recordings)
    return figure


def figure_13(recordings: Recordings) -> Figure:
    """Draw the response to the sine with dwell, with the instants at which the yaw rate is judged."""
    figure = time_panels.time_figure(recordings, (YAW_RATE, ADDED, LATERAL, SIDESLIP))
    _mark_instants(figure, recordings)
    return figure


def sine_with_dwell_figure(recordings: Recordings) -> Figure:
    """Draw figures 12 and 13 in one."""
    figure = time_panels.time_figure(recordings, (STEERING_WHEEL, YAW_RATE, ADDED, LATERAL, SIDESLIP))
    _mark_instants(figure, recordings)
    return figure


def steering_and_yaw_rate(recordings: Recordings) -> Figure:
    """Draw figures 16 and 20: steering wheel angle and yaw rate."""
    return time_panels.time_figure(recordings, (STEERING_WHEEL, YAW_RATE))


def lateral_response(recordings: Recordings) -> Figure:
    """Draw figures 17 and 21: lateral acceleration, added angles, sideslip."""
    return time_panels.time_figure(recordings, (LATERAL, ADDED, SIDESLIP))


def figure_23(recordings: Recordings) -> Figure:
    """Draw all channels but the sideslip on a slippery road."""
    return time_panels.time_figure(recordings, (STEERING_WHEEL, YAW_RATE, LATERAL, ADDED))


def figure_24(recordings: Recordings) -> Figure:
    """Draw the sideslip on a slippery road."""
    return time_panels.time_figure(recordings, (SIDESLIP,))


def general(recordings: Recordings) -> Figure:
    """Draw the main channels of any manoeuvre."""
    return time_panels.time_figure(recordings, (STEERING_WHEEL, YAW_RATE, ADDED, LATERAL, SIDESLIP, ROLL, SPEED))


def _mark_instants(figure: Figure, recordings: Recordings) -> None:
    """Draw vertical lines at the completion of steer and at the two instants after it."""
    try:
        completion_s = sine_with_dwell.steering(next(iter(recordings.values()))).completion_s
    except RecordingError:
        # An incomplete run has no such instants, but it can be drawn.
        return
    axes = figure.get_axes()
    instants = (("end of steer", 0.0), *((f"+{s:.2f} s", s) for s in sine_with_dwell.INSTANTS_S))
    left, right = axes[0].get_xlim()
    # Room for the last text.
    axes[0].set_xlim(left, max(right, completion_s + max(sine_with_dwell.INSTANTS_S) + 0.12 * (right - left)))
    for text, later_s in instants:
        for axis in axes:
            axis.axvline(completion_s + later_s, color="#999999", linewidth=0.9, linestyle=":", zorder=1)
        # Only the last text stands right of its line, so that the texts do not overlap.
        before = later_s < max(sine_with_dwell.INSTANTS_S)
        axes[0].annotate(
            text, (completion_s + later_s, 1.0), (-2 if before else 2, -1), xycoords=("data", "axes fraction"),
            textcoords="offset points", va="top", ha="right" if before else "left",
            fontsize=style.TEXT_PT, color="#555555",
        )  # fmt: skip
