"""Pictures of linear cars: Bode diagrams, and the root locus over speed. Values by python-control."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.frequency_response import OUTPUTS, frequency_response
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import RUN_COLOURS, run_looks
from activesteer.errors import ParameterError
from activesteer.plotting import new_figure, plain_axis, save
from activesteer.quantities import quantity_of

if TYPE_CHECKING:
    import control
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BODE_RANGE_Hz: Final = (0.1, 10.0)
"""Frequencies of a Bode diagram [Hz]."""
LOCUS_LIMIT_Hz: Final = 4.5
"""Natural frequency up to which poles are shown: body modes and tyre lag, without wheel hop [Hz]."""
DAMPING_RAYS: Final = (0.2, 0.4, 0.6, 0.8)
"""Damping ratios drawn as rays into a root locus."""

_GAIN_UNITS: Final = {
    "yaw_rate_radps": "1/s", "ay_mps2": "m/s² per rad", "roll_rad": "rad/rad", "sideslip_rad": "rad/rad",
}  # fmt: skip


def draw_bode(
    systems: Mapping[str, control.StateSpace],
    path: str | os.PathLike[str],
    input_name: str = "steering_wheel_rad",
    recording: RecordingLike | None = None,
) -> Path:
    """Draw gain and phase of yaw rate, lateral acceleration, roll and sideslip over frequency, and save them.

    Args:
        systems: Linear cars by label, with the outputs of a linearised car, or fewer of them.
        path: File to write; its ending says the format (.png, .pdf, .svg).
        input_name: Input that the responses belong to.
        recording: A sine sweep of the full car, drawn as dots where it reaches.

    Returns:
        The path written.

    Raises:
        ParameterError: matplotlib is not installed, there is no system, or a system has no such input.
        RecordingError: the recording is no sweep.
    """
    if not systems:
        raise ParameterError("there is no linear car to draw, at least one is needed")
    figure = new_figure(width_in=7.5, height_in=9.0)
    axes = figure.subplots(len(OUTPUTS), 2, sharex=True)
    frequency_Hz = np.geomspace(*BODE_RANGE_Hz, 300)
    for (label, system), colour in zip(systems.items(), RUN_COLOURS[1:] * len(systems), strict=False):
        if input_name not in system.input_labels:
            raise ParameterError(
                f"{label}: there is no input {input_name!r}; its inputs are {system.input_labels}",
                value=input_name,
                allowed=system.input_labels,
            )
        response = system(2j * math.pi * frequency_Hz, squeeze=False)
        for row, output in enumerate(OUTPUTS):
            if output not in system.output_labels:
                continue
            values = response[system.output_labels.index(output), system.input_labels.index(input_name)]
            axes[row, 0].loglog(frequency_Hz, np.abs(values), color=colour, label=label)
            axes[row, 1].semilogx(frequency_Hz, np.degrees(np.unwrap(np.angle(values))), color=colour)
    if recording is not None:
        points = np.geomspace(0.2, 4.0, 25)
        for row, output in enumerate(OUTPUTS):
            found = frequency_response(recording, output, points)
            axes[row, 0].loglog(
                found.frequency_Hz, np.abs(found.response), "o", ms=3.5, c=RUN_COLOURS[0], label="sweep"
            )
            phase = np.degrees(np.unwrap(np.angle(found.response)))
            axes[row, 1].semilogx(found.frequency_Hz, phase, "o", ms=3.5, c=RUN_COLOURS[0])
    for row, output in enumerate(OUTPUTS):
        axes[row, 0].set_ylabel(f"{quantity_of(output).short}\n[{_GAIN_UNITS[output]}]")
        axes[row, 1].set_ylabel("phase [deg]")
    for axis in axes.flat:
        plain_axis(axis)
    for axis in axes[-1]:
        axis.set_xlabel("frequency [Hz]")
        axis.set_xlim(*BODE_RANGE_Hz)
    figure.align_ylabels(axes)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=min(len(labels), 4), frameon=False)
    return save(figure, Path(path))


def driver_loops_figure(
    rows: Sequence[Mapping[str, Any]],
    frequency_radps: NDArray[np.float64],
    responses: Sequence[NDArray[np.complexfloating]],
) -> Figure:
    """Bode diagrams of the opened loop of driver and car, and its damping over speed.

    The diagrams are those of the speed in the middle.

    Args:
        rows: Figures of each loop: `speed_kmh`, `controller`, `damping`, `damping_in_run`, `phase_margin_deg`,
            `crossover_rad_s`.
        frequency_radps: Frequencies [rad/s].
        responses: What comes back of a decision, one row for each loop.

    Raises:
        ParameterError: matplotlib is not installed.
    """
    figure = new_figure(width_in=7.5, height_in=8.0)
    gain, phase, damping = axes = figure.subplots(3, 1, height_ratios=(1.2, 1.0, 1.0))
    speeds = sorted({row["speed_kmh"] for row in rows})
    middle = speeds[len(speeds) // 2]
    controllers = list(dict.fromkeys(row["controller"] for row in rows))
    for place, (controller, look) in enumerate(run_looks(controllers).items()):
        colour = look.colour
        own = [row for row in rows if row["controller"] == controller]
        shown, response = next(
            (row, response)
            for row, response in zip(rows, responses, strict=True)
            if (row["controller"], row["speed_kmh"]) == (controller, middle)
        )
        crossover_radps, margin_deg = shown["crossover_rad_s"], shown["phase_margin_deg"]
        label = f"{controller}: {crossover_radps:.1f} rad/s, margin {margin_deg:.0f} deg"
        gain.loglog(frequency_radps, np.abs(response), color=colour, label=label)
        angle = np.degrees(np.unwrap(np.angle(response)))
        phase.semilogx(frequency_radps, angle - 360.0 * round((angle[0] + 180.0) / 360.0), color=colour)
        for axis in (gain, phase):
            axis.axvline(crossover_radps, color=colour, lw=0.8, ls=":")
        speed_kmh = [row["speed_kmh"] for row in own]
        damping.plot(speed_kmh, [row["damping"] for row in own], color=colour)
        damping.plot(
            speed_kmh, [row["damping_in_run"] for row in own], "o", color=colour, ms=max(3.0, 9.0 - 3.0 * place)
        )
    gain.axhline(1.0, color=RUN_COLOURS[0], lw=0.6)
    gain.set_ylim(0.05, 50.0)
    gain.set_ylabel(f"gain at {middle:.0f} km/h [-]")
    gain.legend(frameon=False)
    phase.axhline(-180.0, color=RUN_COLOURS[0], lw=0.6)
    phase.set_ylim(-360.0, -90.0)
    phase.set_yticks(range(-360, -89, 90))
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel("frequency [rad/s]")
    for axis in (gain, phase):
        axis.set_xlim(frequency_radps[0], 20.0)
    damping.set_ylim(min(0.0, *(row["damping_in_run"] for row in rows)), 1.1)
    damping.set_ylabel("damping [-]\nlines linear, dots runs")
    damping.set_xlabel("speed [km/h]")
    for axis in axes:
        plain_axis(axis)
    figure.align_ylabels(axes)
    return figure


def draw_root_locus(
    systems: Sequence[control.StateSpace], speeds_mps: Sequence[float], path: str | os.PathLike[str]
) -> Path:
    """Draw how the poles of a car move with its speed, with rays of equal damping, and save it.

    Args:
        systems: The car linearised at every speed.
        speeds_mps: The speeds [m/s].
        path: File to write; its ending says the format (.png, .pdf, .svg).

    Returns:
        The path written.

    Raises:
        ParameterError: matplotlib is not installed, or there are not as many systems as speeds.
    """
    if not systems or len(systems) != len(speeds_mps):
        raise ParameterError(
            f"{len(systems)} linear cars and {len(speeds_mps)} speeds given; as many of each are needed",
            value=(len(systems), len(speeds_mps)),
        )
    figure = new_figure(width_in=7.5, height_in=5.5)
    axis: Axes = figure.subplots()
    limit = 2.0 * math.pi * LOCUS_LIMIT_Hz
    angle = np.linspace(math.pi / 2.0, math.pi, 60)
    for frequency_Hz in range(1, math.ceil(LOCUS_LIMIT_Hz)):
        radius = 2.0 * math.pi * frequency_Hz
        axis.plot(radius * np.cos(angle), radius * np.sin(angle), color="#dddddd", linewidth=0.7)
        axis.annotate(f"{frequency_Hz} Hz", (0.0, radius), (4, 0), textcoords="offset points", color="#777777")
    for damping in DAMPING_RAYS:
        x, y = -limit * damping, limit * math.sqrt(1.0 - damping**2)
        axis.plot([0.0, x], [0.0, y], color="#dddddd", linewidth=0.7)
        axis.annotate(f"{damping:g}", (x, y), color="#777777")
    poles = [np.array(system.poles(), dtype=np.complex128) for system in systems]
    shown = [values[(values.imag >= -1e-9) & (np.abs(values) <= limit)] for values in poles]
    points: NDArray[np.complex128] = np.concatenate(shown)
    speeds_kmh = np.repeat(3.6 * np.asarray(speeds_mps, dtype=np.float64), [len(values) for values in shown])
    dots = axis.scatter(points.real, points.imag, c=speeds_kmh, cmap="viridis", s=18, zorder=3)
    figure.colorbar(dots, ax=axis, label="speed [km/h]")
    axis.set_xlabel("real part [1/s]")
    axis.set_ylabel("imaginary part [1/s]")
    axis.set_ylim(bottom=-1.0)
    axis.spines[["top", "right"]].set_visible(False)
    return save(figure, Path(path))
