"""Pictures of a tyre. matplotlib is an extra of the package and imported when a picture is made."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from activesteer.plotting import new_figure, plain_axis, save_all, zero_line
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import TyreParameters

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS: Final = ("#0072b2", "#009e73", "#e69f00", "#d55e00", "#cc79a7", "#333333", "#56b4e9")
"""Colours that colour-blind readers can tell apart (Okabe and Ito, 2008)."""
_LOAD_FRACTIONS: Final = (0.5, 1.0, 1.5, 2.0)
_DEGREES: Final = math.degrees(1.0)
_WIDEST_ANGLE_RAD: Final = math.radians(20.0)
_WIDEST_SLIP: Final = 0.6
_WIDEST_CAMBER_RAD: Final = math.radians(6.0)
_DIRECTIONS: Final = 180
_GRID: Final = 351
"""Slips and slip angles each, of which the friction ellipse is the outline."""


def draw(params: TyreParameters, folder: str | os.PathLike[str]) -> list[Path]:
    """Draw what a tyre does, as PNG files.

    The pictures: `side_force.png` (side force and aligning moment over slip angle, for loads and for cambers),
    `longitudinal_force.png`, `friction_ellipse.png`, `combined_slip.png`, `relaxation_lengths.png`. All at the file's
    pressure and speed of measurement, within its ranges of validity.

    Args:
        params: The tyre, as mounted.
        folder: Directory for the files; created where it does not exist.

    Returns:
        The paths written, in this order.

    Raises:
        ParameterError: matplotlib is not installed, or a file cannot be written.
    """
    formula = MagicFormula(params)
    pictures: dict[str, Callable[[MagicFormula], Figure]] = {
        "side_force": _side_force,
        "longitudinal_force": _longitudinal_force,
        "friction_ellipse": _friction_ellipse,
        "combined_slip": _combined_slip,
        "relaxation_lengths": _relaxation_lengths,
    }
    return save_all(pictures, formula, folder)


def _new_figure(params: TyreParameters, title: str, width_in: float, height_in: float) -> Figure:
    name = params.source.name if params.source else "tyre"
    return new_figure(width_in, height_in, f"{name}: {title}")


def _style(axis: Axes, x: str, y: str) -> None:
    axis.set_xlabel(x)
    axis.set_ylabel(y)
    plain_axis(axis)
    zero_line(axis.axhline)
    zero_line(axis.axvline)
    axis.margins(x=0.0)


def _legend(axis: Axes, title: str | None = None) -> None:
    axis.legend(title=title, loc="best", fontsize="small", title_fontsize="small", frameon=False)


def _in_degrees(angle_rad: float) -> str:
    text = f"{_DEGREES * angle_rad:.3g}°".replace("-", "\N{MINUS SIGN}")
    return text if angle_rad else "0°"


def _loads(params: TyreParameters) -> list[float]:
    """Loads of the curves [N], rounded to 100 N, within the range of the file."""
    low, high = params["FZMIN"], params["FZMAX"]
    loads = [max(round(fraction * params["FNOMIN"] / 100.0) * 100.0, 100.0) for fraction in _LOAD_FRACTIONS]
    return [load for load in loads if low <= load <= high] or [min(max(params["FNOMIN"], low), high)]


def _nominal(params: TyreParameters) -> float:
    return min(max(params["FNOMIN"], params["FZMIN"]), params["FZMAX"])


def _within(params: TyreParameters, low: str, high: str, widest: float, count: int = 801) -> np.ndarray:
    return np.linspace(max(params[low], -widest), min(params[high], widest), count)


def _angles(params: TyreParameters) -> np.ndarray:
    return _within(params, "ALPMIN", "ALPMAX", _WIDEST_ANGLE_RAD)


def _slips(params: TyreParameters) -> np.ndarray:
    return _within(params, "KPUMIN", "KPUMAX", _WIDEST_SLIP)


def _side_force(formula: MagicFormula) -> Figure:
    """Side force above, aligning moment below; loads on the left, cambers on the right."""
    params = formula.parameters
    figure = _new_figure(params, "pure side slip", 10.0, 7.5)
    axes = figure.subplots(2, 2, sharex=True, sharey="row")
    alpha = _angles(params)
    nominal = _nominal(params)
    cambers = np.unique(
        [np.clip(value, params["CAMMIN"], params["CAMMAX"]) for value in np.linspace(-1, 1, 5) * _WIDEST_CAMBER_RAD]
    )
    families = [
        [(f"{load / 1000:g} kN", load, 0.0) for load in _loads(params)],
        [(_in_degrees(camber), nominal, camber) for camber in cambers],
    ]
    for column, family in enumerate(families):
        for (label, load, camber), colour in zip(family, _COLOURS, strict=False):
            forces = formula.evaluate(load, 0.0, alpha, camber)
            axes[0, column].plot(_DEGREES * alpha, forces.fy_N / 1000.0, color=colour, label=label)
            axes[1, column].plot(_DEGREES * alpha, forces.mz_Nm, color=colour, label=label)
    for axis in axes.flat:
        _style(axis, "", "")
    for axis in axes[1]:
        axis.set_xlabel("slip angle [°]")
        # A little room, or the last number of the left panel touches the first of the right one.
        axis.set_xlim(1.03 * _DEGREES * alpha[0], 1.03 * _DEGREES * alpha[-1])
    axes[0, 0].set_ylabel("side force $F_y$ [kN]")
    axes[1, 0].set_ylabel("aligning moment $M_z$ [Nm]")
    axes[0, 0].set_title("load, no camber", fontsize="small")
    axes[0, 1].set_title(f"camber, {nominal / 1000:.3g} kN", fontsize="small")
    for axis in axes[0]:
        _legend(axis)
    return figure


def _longitudinal_force(formula: MagicFormula) -> Figure:
    params = formula.parameters
    figure = _new_figure(params, "pure longitudinal slip", 7.5, 5.0)
    axis = figure.subplots()
    kappa = _slips(params)
    for load, colour in zip(_loads(params), _COLOURS, strict=False):
        fx = formula.evaluate(load, kappa, 0.0).fx_N
        axis.plot(100.0 * kappa, fx / 1000.0, color=colour, label=f"{load / 1000:g} kN")
    _style(axis, "longitudinal slip [%], braking negative", "longitudinal force $F_x$ [kN]")
    _legend(axis, "load")
    return figure


def envelope(formula: MagicFormula, load_N: float, directions: int = _DIRECTIONS) -> tuple[np.ndarray, np.ndarray]:
    """The greatest horizontal force of a tyre in every direction.

    Args:
        formula: The tyre.
        load_N: Load [N].
        directions: Number of sectors of the plane; each gives the outermost of its points.

    Returns:
        F_x and F_y [N] at the outermost of all combinations of slips within the ranges of the file, around the plane
        from the left over the front, closed; shape (directions + 1,), less where a sector is empty.
    """
    params = formula.parameters
    # Closer together near zero, where the forces change fastest.
    fraction = np.linspace(-1.0, 1.0, _GRID)
    fraction = np.sign(fraction) * np.abs(fraction) ** 2.5
    kappa = np.where(fraction < 0.0, -params["KPUMIN"], params["KPUMAX"]).clip(max=1.0) * fraction
    alpha = np.where(fraction < 0.0, -params["ALPMIN"], params["ALPMAX"]).clip(max=1.4) * fraction
    forces = formula.evaluate(load_N, kappa[:, None], alpha)
    fx, fy = forces.fx_N.ravel(), forces.fy_N.ravel()
    sector = ((np.arctan2(-fx, -fy) / (2.0 * math.pi) + 0.5) * directions).astype(int) % directions
    # Sorted by sector, then outwards: the last of each sector is its outermost point.
    order = np.lexsort((np.hypot(fx, fy), sector))
    last = np.flatnonzero(np.diff(sector[order], append=directions))
    outermost = order[np.append(last, last[0])]
    return fx[outermost], fy[outermost]


def _friction_ellipse(formula: MagicFormula) -> Figure:
    params = formula.parameters
    figure = _new_figure(params, "greatest forces at combined slip, over the load", 7.0, 6.0)
    axis = figure.subplots()
    maximum = 0.0
    for load, colour in zip(_loads(params), _COLOURS, strict=False):
        fx, fy = envelope(formula, load)
        axis.plot(fy / load, fx / load, color=colour, label=f"{load / 1000:g} kN")
        maximum = max(maximum, float(np.abs([fx, fy]).max()) / load)
    circle = np.linspace(0.0, 2.0 * math.pi, 181)
    axis.plot(np.sin(circle), np.cos(circle), "--", color="#999999", linewidth=0.9, label="friction 1")
    _style(axis, "side force over load $F_y / F_z$, to the left positive", "longitudinal force over load $F_x / F_z$")
    limit = 1.08 * max(maximum, 1.0)
    axis.set(xlim=(limit, -limit), ylim=(-limit, limit), aspect="equal")
    axis.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), title="load", fontsize="small", frameon=False)
    return figure


def _combined_slip(formula: MagicFormula) -> Figure:
    """Forces over slip for slip angles, over the slip angle for slips, and against each other."""
    params = formula.parameters
    figure = _new_figure(params, f"combined slip at {_nominal(params) / 1000:.3g} kN", 11.0, 4.4)
    axes = figure.subplots(1, 3, width_ratios=(3.0, 3.0, 2.0))
    nominal, kappa = _nominal(params), _slips(params)
    angles = [math.radians(value) for value in (0, 2, 4, 8, 12)]
    angles = [value for value in angles if params["ALPMIN"] <= -value <= params["ALPMAX"]]
    for angle, colour in zip(angles, _COLOURS, strict=False):
        # Turning left: slip angles are negative, forces positive.
        forces = formula.evaluate(nominal, kappa, -angle)
        label = _in_degrees(-angle)
        axes[0].plot(100.0 * kappa, forces.fx_N / 1000.0, color=colour, label=label)
        axes[1].plot(100.0 * kappa, forces.fy_N / 1000.0, color=colour, label=label)
        axes[2].plot(forces.fy_N / 1000.0, forces.fx_N / 1000.0, color=colour, label=label)
    _style(axes[0], "longitudinal slip [%]", "longitudinal force $F_x$ [kN]")
    _style(axes[1], "longitudinal slip [%]", "side force $F_y$ [kN]")
    _style(axes[2], "side force $F_y$ [kN]", "longitudinal force $F_x$ [kN]")
    axes[2].set_aspect("equal")
    axes[2].margins(0.05)
    _legend(axes[0], "slip angle")
    return figure


def _relaxation_lengths(formula: MagicFormula) -> Figure:
    params = formula.parameters
    figure = _new_figure(params, "relaxation lengths", 7.5, 4.5)
    axis = figure.subplots()
    loads = np.linspace(params["FZMIN"], min(params["FZMAX"], 2.5 * params["FNOMIN"]), 301)
    at = formula.evaluate(loads, 0.0, 0.0)
    axis.plot(loads / 1000.0, at.relaxation_length_y_m, color=_COLOURS[0], label="lateral")
    axis.plot(loads / 1000.0, at.relaxation_length_x_m, color=_COLOURS[3], label="longitudinal")
    axis.plot(loads / 1000.0, at.contact_length_m, ":", color=_COLOURS[5], label="contact length")
    _style(axis, "load [kN]", "length [m]")
    axis.axvline(params["FNOMIN"] / 1000.0, color="#999999", linewidth=0.9, linestyle="--", label="nominal load")
    axis.set(xlim=(0.0, None), ylim=(0.0, None))
    _legend(axis)
    return figure
