"""Pictures of linear cars: Bode diagrams, and the root locus over speed. Values by python-control."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.analysis.frequency_response import OUTPUTS
from activesteer.conventions import RUN_COLOURS, Array, run_looks
from activesteer.plotting import Curve, Panel, Picture, draw, save
from activesteer.units import quantity_of

if TYPE_CHECKING:
    import control
    from matplotlib.figure import Figure

BODE_RANGE_Hz: Final = (0.1, 10.0)
"""Frequencies of a Bode diagram [Hz]."""
LOCUS_LIMIT_Hz: Final = 4.5
"""Greatest natural frequency of the poles that are shown: body modes and tyre lag, without wheel hop [Hz]."""
DAMPING_RAYS: Final = (0.2, 0.4, 0.6, 0.8)
"""Damping ratios drawn as rays into a root locus."""

_GREY: Final = "#cccccc"
_GAIN_UNITS: Final = {
    "yaw_rate_radps": "1/s", "ay_mps2": "m/s² per rad", "roll_rad": "rad/rad", "sideslip_rad": "rad/rad",
}  # fmt: skip


def draw_bode(label: str, system: control.StateSpace, path: str | os.PathLike[str]) -> Path:
    """Draw gain and phase of a linear car over frequency, from the steering wheel to its outputs, and save them."""
    frequency_Hz = np.geomspace(*BODE_RANGE_Hz, 300)
    found = system(2j * math.pi * frequency_Hz, squeeze=False)
    panels = []
    for output in OUTPUTS:
        values = found[system.output_labels.index(output), system.input_labels.index("steering_wheel_rad")]
        gain = Curve(frequency_Hz, np.abs(values), label, RUN_COLOURS[1], "-", 1.5)
        phase = Curve(frequency_Hz, _phase_deg(values), label, RUN_COLOURS[1], "-", 1.5)
        below = "frequency [Hz]" if output == OUTPUTS[-1] else ""
        y_label = f"{quantity_of(output).short}\n[{_GAIN_UNITS[output]}]"
        panels.append(Panel(below, y_label, [gain], log="xy", x_range=BODE_RANGE_Hz))
        panels.append(Panel(below, "phase [deg]", [phase], log="x", x_range=BODE_RANGE_Hz))
    picture = Picture("", panels, columns=2, width_in=7.5, height_in=9.0, shared_legend=True)
    return save(draw(picture), Path(path))


def _phase_deg(response: NDArray[np.complexfloating]) -> Array:
    return np.degrees(np.unwrap(np.angle(response)))


def driver_loops_figure(
    rows: Sequence[Mapping[str, Any]],
    frequency_radps: NDArray[np.float64],
    responses: Sequence[NDArray[np.complexfloating]],
) -> Figure:
    """Return Bode diagrams of the open loop of driver and car at the middle speed, and its damping over speed."""
    speeds = sorted({row["speed_kmh"] for row in rows})
    middle = speeds[len(speeds) // 2]
    controllers = list(dict.fromkeys(row["controller"] for row in rows))
    gain = [Curve([frequency_radps[0], 20.0], [1.0, 1.0], "", RUN_COLOURS[0], "-", 0.6)]
    phase = [Curve([frequency_radps[0], 20.0], [-180.0, -180.0], "", RUN_COLOURS[0], "-", 0.6)]
    damping = []
    for place, (controller, look) in enumerate(run_looks(controllers).items()):
        own = [row for row in rows if row["controller"] == controller]
        shown, response = next(
            (row, response)
            for row, response in zip(rows, responses, strict=True)
            if (row["controller"], row["speed_kmh"]) == (controller, middle)
        )
        crossover_radps, margin_deg = shown["crossover_rad_s"], shown["phase_margin_deg"]
        label = f"{controller}: {crossover_radps:.1f} rad/s, margin {margin_deg:.0f} deg"
        angle = _phase_deg(response)
        angle -= 360.0 * round((angle[0] + 180.0) / 360.0)
        for curves, values, text, low, high in (
            (gain, np.abs(response), label, 0.05, 50.0), (phase, angle, "", -360.0, -90.0),
        ):  # fmt: skip
            curves.append(Curve(frequency_radps, values, text, look.colour, "-", 1.5))
            curves.append(Curve([crossover_radps, crossover_radps], [low, high], "", look.colour, ":", 0.8))
        speed_kmh = [row["speed_kmh"] for row in own]
        in_runs, size = [row["damping_in_run"] for row in own], max(3.0, 9.0 - 3.0 * place)
        damping.append(Curve(speed_kmh, [row["damping"] for row in own], "", look.colour, "-", 1.5))
        damping.append(Curve(speed_kmh, in_runs, "", look.colour, "", marker="o", size=size))
    lowest = min(0.0, *(row["damping_in_run"] for row in rows))
    x_range = (frequency_radps[0], 20.0)
    panels = [
        Panel("", f"gain at {middle:.0f} km/h [-]", gain, log="xy", x_range=x_range, y_range=(0.05, 50.0)),
        Panel("frequency [rad/s]", "phase [deg]", phase, log="x", x_range=x_range, y_range=(-360.0, -90.0)),
        Panel("speed [km/h]", "damping [-]\nlines linear, dots runs", damping, y_range=(lowest, 1.1)),
    ]
    return draw(Picture("", panels, columns=1, width_in=7.5, height_in=8.0))


def draw_root_locus(
    systems: Sequence[control.StateSpace], speeds_mps: Sequence[float], path: str | os.PathLike[str]
) -> Path:
    """Draw the poles of a car over its speed, with rays of equal damping, and save the picture."""
    limit, angle = 2.0 * math.pi * LOCUS_LIMIT_Hz, np.linspace(math.pi / 2.0, math.pi, 60)
    curves, notes = [], []
    for frequency_Hz in range(1, math.ceil(LOCUS_LIMIT_Hz)):
        radius = 2.0 * math.pi * frequency_Hz
        curves.append(Curve(radius * np.cos(angle), radius * np.sin(angle), "", _GREY, "-", 0.7))
        notes.append((0.0, radius, f"{frequency_Hz} Hz"))
    for damping in DAMPING_RAYS:
        x, y = -limit * damping, limit * math.sqrt(1.0 - damping**2)
        curves.append(Curve([0.0, x], [0.0, y], "", _GREY, "-", 0.7))
        notes.append((x, y, f"{damping:g}"))
    slowest, fastest = 3.6 * min(speeds_mps), 3.6 * max(speeds_mps)
    for system, speed_mps in zip(systems, speeds_mps, strict=True):
        poles = np.array(system.poles(), dtype=np.complex128)
        poles = poles[(poles.imag >= -1e-9) & (np.abs(poles) <= limit)]
        shade = (3.6 * speed_mps - slowest) / max(fastest - slowest, 1e-9)
        curves.append(Curve(poles.real, poles.imag, dashes="", marker="o", size=3.5, shade=shade))
    panel = Panel("real part [1/s]", "imaginary part [1/s]", curves, notes=notes, y_range=(-1.0, 1.05 * limit))
    scale = ("speed [km/h]", slowest, fastest)
    return save(draw(Picture("", [panel], width_in=7.5, height_in=5.5, scale=scale)), Path(path))
