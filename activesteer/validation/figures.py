"""Pictures of the comparison: curves over time and against each other, with the corridor of the reference."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import numpy as np

from activesteer.plotting import new_figure, plain_axis
from activesteer.quantities import quantity_of
from activesteer.validation.kinematics import Curves
from activesteer.validation.our_runs import QUANTITIES, RMS_TOLERANCE, traces
from activesteer.validation.reference import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_OURS, _THEIRS, _CORRIDOR = "#0072b2", "#d55e00", "#f3d9c4"
_CHANNELS: Final = {"r": "yaw_rate_radps", "ay": "ay_mps2", "roll": "roll_rad", "beta": "sideslip_rad"}
"""Column of a reference -> channel."""
_SHOWN: Final = {column: (quantity_of(name).title, quantity_of(name).factor) for column, name in _CHANNELS.items()}
_CROSS: Final = (("rack", "ay"), ("ay", "r"), ("ay", "roll"), ("ay", "beta"))
"""Abscissa and ordinate of the cross-plots."""
_AXIS_NAMES: Final = _SHOWN | {"rack": ("rack [mm] (- steers left)", 1e3)}


def run_figure(run: str, ours: Table, reference: Table | None) -> Figure:
    """A run over time: yaw rate, lateral acceleration, roll, sideslip; with the reference's corridor, if any."""
    figure = new_figure(9.0, 5.2, run)
    axes = figure.subplots(2, 2, sharex=True)
    compared = {} if reference is None else {trace.quantity.column: trace for trace in traces(ours, reference)}
    for axis, quantity in zip(axes.flat, QUANTITIES, strict=True):
        label, factor = _SHOWN[quantity.column]
        trace = compared.get(quantity.column)
        if trace is not None:
            low, high = trace.corridor()
            axis.fill_between(trace.time_s, factor * low, factor * high, color=_CORRIDOR, lw=0, label="20 ms, 2 %")
            axis.plot(trace.time_s, factor * trace.reference, color=_THEIRS, lw=2.6, label="reference")
        axis.plot(ours["t"], factor * ours[quantity.column], color=_OURS, lw=1.2, ls=(0, (4, 2)), label="ours")
        axis.set_ylabel(label)
        plain_axis(axis)
    for axis in axes[1]:
        axis.set_xlabel("time [s]")
    _legend(figure, axes[0, 0])
    return figure


def cross_figure(run: str, ours: Table, reference: Table | None) -> Figure:
    """A run, one quantity against another; the corridor is 2 % of the reference's range to every side."""
    figure = new_figure(9.0, 5.2, f"{run}: cross-plots")
    axes = figure.subplots(2, 2)
    for axis, (x, y) in zip(axes.flat, _CROSS, strict=True):
        (x_label, x_factor), (y_label, y_factor) = _AXIS_NAMES[x], _AXIS_NAMES[y]
        if reference is not None:
            u, v = x_factor * reference[x], y_factor * reference[y]
            around = np.linspace(0.0, math.tau, 17)
            du, dv = RMS_TOLERANCE * np.ptp(u) * np.cos(around), RMS_TOLERANCE * np.ptp(v) * np.sin(around)
            for a, b in zip(du, dv, strict=True):
                axis.plot(u + a, v + b, color=_CORRIDOR, lw=2.0, zorder=1)
            axis.plot(u, v, color=_THEIRS, lw=2.6, label="reference")
        axis.plot(x_factor * ours[x], y_factor * ours[y], color=_OURS, lw=1.2, ls=(0, (4, 2)), label="ours")
        axis.set(xlabel=x_label, ylabel=y_label)
        plain_axis(axis)
    _legend(figure, axes[0, 0])
    return figure


def sweep_figure(curves: list[Curves]) -> Figure:
    """The sweeps of the rig: the curves above, the differences in their corridors below."""
    count = len(curves)
    figure = new_figure(2.6 * count, 4.6, "kinematics: curves above, ours less reference below, tolerance shaded")
    axes = figure.subplots(2, count, sharex="col", squeeze=False)
    for column, curve in enumerate(curves):
        above, below = axes[:, column]
        above.plot(curve.x, curve.reference, color=_THEIRS, lw=2.6, label="reference")
        above.plot(curve.x, curve.ours, color=_OURS, lw=1.2, ls=(0, (4, 2)), label="ours")
        above.set_title(f"{curve.title}: {curve.label}", fontsize="small")
        below.fill_between(curve.x, -curve.tolerance, curve.tolerance, color=_CORRIDOR, lw=0)
        below.plot(curve.x, curve.ours - curve.reference, color=_OURS, lw=1.0)
        below.set_xlabel(curve.x_label, fontsize="small")
        for axis in (above, below):
            plain_axis(axis)
            axis.tick_params(labelsize="small")
    _legend(figure, axes[0, 0])
    return figure


def _legend(figure: Figure, axis: Axes) -> None:
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False, fontsize="small")


PerRun = Callable[[str, Table, Table | None], "Figure"]
RUN_FIGURES: Final[tuple[PerRun, ...]] = (run_figure, cross_figure)
"""The pictures of every run."""
