"""HTML page of margins: the Nyquist curve of each loop at all speeds, with the disk that it touches."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Final

import numpy as np

from activesteer.pages import Page, Section, Table, write_page
from activesteer.plotting import Area, Curve, Panel, Picture, as_svg, draw
from activesteer.studies.linear.margins import LoopMargins

_SHOWN: Final = (-3.2, 1.6), (-2.4, 2.4)
"""Range of the real and of the imaginary part in a picture."""
_LEAD: Final = (
    "Each curve is the loop gain L over frequency, from 0.008 to 48 Hz, with its mirror image left out. The loop is "
    "marginal where L = -1 (cross). The red disk has the smallest disk margin alpha of all speeds: the curve of that "
    "speed touches it. Gain and phase may then change together by any complex factor f with |f - 1| / |f + 1| < "
    "alpha / 2, such as gains from (2 - alpha) / (2 + alpha) to (2 + alpha) / (2 - alpha)."
)


def write_margins_page(found: Sequence[LoopMargins], vehicle: str, folder: str | os.PathLike[str]) -> Path:
    """Write `margins.html` and return its path."""
    sections = []
    for (controller, loop), rows in groupby(
        sorted(found, key=lambda each: (each.controller, each.loop)), lambda each: (each.controller, each.loop)
    ):
        loops = list(rows)
        pictures = [as_svg(draw(_picture(loops)))] if loops[0].curves else []
        sections.append(Section(f"{controller}, opened at {loop}", pictures=pictures, tables=[_table(loops)]))
    title = f"Stability margins: {vehicle}"
    lead = [_LEAD] if any(each.curves for each in found) else []
    return write_page(Page(f"activesteer linearise: {vehicle}", title, lead, sections), Path(folder) / "margins.html")


def disk(alpha: float) -> tuple[float, float]:
    """Return centre and radius of the disk that a loop gain with a disk margin does not enter.

    It holds all L with |1 + L| < alpha / 2 |1 - L|, on whose edge a factor of the size alpha makes the loop marginal.

    Args:
        alpha: Balanced disk margin, above 0 and below 2 [-]; at 2 the disk is a half-plane.

    Source: P. Seiler, A. Packard, P. Gahinet, An Introduction to Disk Margins, 2020, section IV.
    """
    half = 0.5 * alpha
    near, far = -(1.0 - half) / (1.0 + half), -(1.0 + half) / (1.0 - half)
    return 0.5 * (near + far), 0.5 * (near - far)


def _picture(loops: Sequence[LoopMargins]) -> Picture:
    speeds = [each.speed_kmh for each in loops]
    low, high = min(speeds), max(speeds)
    curves = [
        Curve(part.real, part.imag, shade=(each.speed_kmh - low) / (high - low) if high > low else 0.5)
        for each in loops
        for part in each.curves
    ]
    curves.append(Curve([-1.0], [0.0], "", "#b3261e", "", marker="x", size=7.0, width=1.6))
    alpha = min(each.margins.disk for each in loops)
    areas = []
    if 0.0 < alpha < 2.0:
        centre, radius = disk(alpha)
        angle = np.linspace(0.0, math.pi, 181)
        x, y = centre + radius * np.cos(angle), radius * np.sin(angle)
        areas.append(Area(x, -y, y, f"disk margin {alpha:.2f}", "#d9534f", 0.25, "#b3261e"))
    panel = Panel(
        "real part of L [-]", "imaginary part of L [-]", curves, areas=areas,
        x_range=_SHOWN[0], y_range=_SHOWN[1], zero=True, equal=True,
    )  # fmt: skip
    scale = ("speed [km/h]", low, high) if high > low else None
    return Picture("", [panel], scale=scale, width_in=6.4, height_in=4.8)


def _table(loops: Sequence[LoopMargins]) -> Table:
    least = min(range(len(loops)), key=lambda row: loops[row].margins.disk)
    heads = ["speed [km/h]", "gain margin [dB]", "phase margin [deg]", "delay margin [ms]", "disk margin [-]"]
    heads += ["changed"] if any(each.factors for each in loops) else []
    rows = []
    for each in loops:
        margins = each.margins
        values = (margins.gain_dB, math.degrees(margins.phase_rad), 1e3 * margins.delay_s, margins.disk)
        numbers = [f"{value:.3g}" if math.isfinite(value) else "none" for value in values]
        changed = ", ".join(f"{key} = {value}" for key, value in each.factors.items())
        rows.append([f"{each.speed_kmh:g}", *numbers, changed][: len(heads)])
    return Table("", heads, rows, frozenset([least]))
