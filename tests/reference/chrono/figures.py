"""Pictures of the comparison: curves over time and against each other, with the corridor of the reference."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.core.conventions import Array
from activesteer.core.units import quantity_of
from activesteer.plotting import Area, Curve, Panel, Picture
from tests.reference.chrono.kinematics import Curves
from tests.reference.chrono.our_runs import QUANTITIES, RMS_TOLERANCE, traces
from tests.reference.chrono.reference import Table

_OURS, _THEIRS, _CORRIDOR = "#0072b2", "#d55e00", "#f3d9c4"
_DASHES: Final = (0.0, (4.0, 2.0))
_CHANNELS: Final = {"r": "yaw_rate_radps", "ay": "ay_mps2", "roll": "roll_rad", "beta": "sideslip_rad"}
"""Column of a reference -> channel."""
_SHOWN: Final = {column: (quantity_of(name).title, quantity_of(name).factor) for column, name in _CHANNELS.items()}
_UNEVEN: Final = (
    ("z", "heave [mm]", 1e3), ("pitch", "pitch [deg]", math.degrees(1.0)), ("roll", "roll [deg]", math.degrees(1.0)),
    ("r", "yaw rate [deg/s]", math.degrees(1.0)), ("Fz_FL", "load, front left [kN]", 1e-3),
    ("Fz_RR", "load, rear right [kN]", 1e-3),
)  # fmt: skip
"""Column of a reference on an uneven road, its label, and the factor to the unit there."""
_CROSS: Final = (("rack", "ay"), ("ay", "r"), ("ay", "roll"), ("ay", "beta"))
"""Abscissa and ordinate of the cross-plots."""
_AXIS_NAMES: Final = _SHOWN | {"rack": ("rack [mm] (- steers left)", 1e3)}


def _reference(x: Array, y: Array) -> Curve:
    return Curve(x, y, "reference", _THEIRS, width=2.6)


def _ours(x: Array, y: Array) -> Curve:
    return Curve(x, y, "ours", _OURS, _DASHES)


def run_picture(run: str, ours: Table, reference: Table | None) -> Picture:
    """Return a run over time: yaw rate, lateral acceleration, roll, sideslip; with the reference's corridor, if any."""
    panels = []
    compared = {} if reference is None else {trace.quantity.column: trace for trace in traces(ours, reference)}
    for quantity in QUANTITIES:
        label, factor = _SHOWN[quantity.column]
        areas, curves = [], []
        if (trace := compared.get(quantity.column)) is not None:
            low, high = trace.corridor()
            areas.append(Area(trace.time_s, factor * low, factor * high, "20 ms, 2 %", _CORRIDOR))
            curves.append(_reference(trace.time_s, factor * trace.reference))
        curves.append(_ours(ours["t"], factor * ours[quantity.column]))
        panels.append(Panel("time [s]", label, curves, areas=areas))
    return Picture(run, panels, height_in=5.2)


def uneven_picture(run: str, ours: Table, reference: Table) -> Picture:
    """Return a run over an uneven road: heave, pitch, roll, yaw rate and two wheel loads over time."""
    panels = []
    for column, label, factor in _UNEVEN:
        start = 1e3 * (ours[column][0] - reference[column][0]) if column == "z" else 0.0
        reference_y, our_y = factor * reference[column], factor * ours[column] - start
        panels.append(Panel("time [s]", label, [_reference(reference["t"], reference_y), _ours(ours["t"], our_y)]))
    return Picture(run, panels, height_in=7.5)


def cross_picture(run: str, ours: Table, reference: Table | None) -> Picture:
    """Return cross-plots of a run; the corridor is 2 % of the reference's range in every direction."""
    panels = []
    for x, y in _CROSS:
        (x_label, x_factor), (y_label, y_factor) = _AXIS_NAMES[x], _AXIS_NAMES[y]
        curves = []
        if reference is not None:
            u, v = x_factor * reference[x], y_factor * reference[y]
            around = np.linspace(0.0, math.tau, 17)
            du, dv = RMS_TOLERANCE * np.ptp(u) * np.cos(around), RMS_TOLERANCE * np.ptp(v) * np.sin(around)
            curves += [Curve(u + a, v + b, "", _CORRIDOR, width=2.0) for a, b in zip(du, dv, strict=True)]
            curves.append(_reference(u, v))
        curves.append(_ours(x_factor * ours[x], y_factor * ours[y]))
        panels.append(Panel(x_label, y_label, curves))
    return Picture(f"{run}: cross-plots", panels, height_in=5.2)


def sweep_picture(curves: list[Curves]) -> Picture:
    """Return the sweeps of the rig: curves above, differences within their corridors below."""
    above = [
        Panel(
            "", "",
            [_reference(curve.x, curve.reference), _ours(curve.x, curve.ours)],
            f"{curve.title}: {curve.label}",
        )
        for curve in curves
    ]  # fmt: skip
    below = [
        Panel(
            curve.x_label, "", [Curve(curve.x, curve.ours - curve.reference, "", _OURS, width=1.0)],
            areas=[Area(curve.x, -curve.tolerance, curve.tolerance, "", _CORRIDOR)],
        )
        for curve in curves
    ]  # fmt: skip
    title = "kinematics: curves (top), difference ours - reference with tolerance (bottom)"
    return Picture(title, above + below, columns=len(curves), width_in=2.6 * len(curves), height_in=4.6)
