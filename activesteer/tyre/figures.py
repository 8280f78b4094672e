"""Pictures of a tyre. matplotlib is an extra of the package and imported when a picture is made."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from activesteer.plotting import Curve, Panel, Picture, save_all
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import TyreParameters

_COLOURS: Final = ("#0072b2", "#009e73", "#e69f00", "#d55e00", "#cc79a7", "#333333", "#56b4e9")
"""Colours that colour-blind readers can tell apart (Okabe and Ito, 2008)."""
_LOAD_FRACTIONS: Final = (0.5, 1.0, 1.5, 2.0)
_DEGREES: Final = math.degrees(1.0)
_WIDEST_ANGLE_RAD: Final = math.radians(20.0)
_WIDEST_SLIP: Final = 0.6
_WIDEST_CAMBER_RAD: Final = math.radians(6.0)
_DIRECTIONS: Final = 180
_GRID: Final = 351
"""Number of slips and of slip angles whose forces the friction ellipse encloses."""


def draw(params: TyreParameters, folder: str | os.PathLike[str]) -> list[Path]:
    """Draw the forces of a tyre as PNG files.

    The pictures are `side_force.png` (side force and aligning moment over slip angle, for loads and for cambers),
    `longitudinal_force.png`, `friction_ellipse.png`, `combined_slip.png` and `relaxation_lengths.png`. All of them are
    at the file's pressure and speed of measurement and within its ranges of validity.

    Args:
        params: The tyre, as mounted.
        folder: Folder for the files; it is created if it does not exist.

    Returns:
        The paths written, in this order.

    Raises:
        ParameterError: matplotlib is not installed, or a file cannot be written.
    """
    formula = MagicFormula(params)
    name = params.source.name if params.source else "tyre"
    pictures: dict[str, Callable[[MagicFormula], Picture]] = {
        "side_force": _side_force,
        "longitudinal_force": _longitudinal_force,
        "friction_ellipse": _friction_ellipse,
        "combined_slip": _combined_slip,
        "relaxation_lengths": _relaxation_lengths,
    }
    return save_all({file: partial(make, formula) for file, make in pictures.items()}, folder, f"{name}: ")


def _curve(x: ArrayLike, y: ArrayLike, colour: str, label: str = "", dashes: str = "-", width: float = 1.5) -> Curve:
    return Curve(x, y, label, colour, dashes, width)


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


def _side_force(formula: MagicFormula) -> Picture:
    """Side force above, aligning moment below; loads on the left, cambers on the right."""
    params, nominal = formula.parameters, _nominal(formula.parameters)
    alpha = _angles(params)
    cambers = np.unique(
        [np.clip(value, params["CAMMIN"], params["CAMMAX"]) for value in np.linspace(-1, 1, 5) * _WIDEST_CAMBER_RAD]
    )
    families = {
        "load, no camber": [(f"{load / 1000:g} kN", load, 0.0) for load in _loads(params)],
        f"camber, {nominal / 1000:.3g} kN": [(_in_degrees(camber), nominal, camber) for camber in cambers],
    }
    # A little room, or the last number of the left panel touches the first one of the right panel.
    x_range = (1.03 * _DEGREES * alpha[0], 1.03 * _DEGREES * alpha[-1])
    above, below = [], []
    for title, family in families.items():
        forces, moments = [], []
        for (label, load, camber), colour in zip(family, _COLOURS, strict=False):
            found = formula.evaluate(load, 0.0, alpha, camber)
            forces.append(_curve(_DEGREES * alpha, found.fy_N / 1000.0, colour, label))
            moments.append(_curve(_DEGREES * alpha, found.mz_Nm, colour))
        above.append(Panel("", "side force $F_y$ [kN]", forces, title, x_range=x_range, zero=True))
        below.append(Panel("slip angle [°]", "aligning moment $M_z$ [Nm]", moments, x_range=x_range, zero=True))
    return Picture("pure side slip", above + below, width_in=10.0, height_in=7.5)


def _longitudinal_force(formula: MagicFormula) -> Picture:
    params = formula.parameters
    kappa = _slips(params)
    curves = [
        _curve(100.0 * kappa, formula.evaluate(load, kappa, 0.0).fx_N / 1000.0, colour, f"{load / 1000:g} kN")
        for load, colour in zip(_loads(params), _COLOURS, strict=False)
    ]
    x_label, y_label = "longitudinal slip [%], braking negative", "longitudinal force $F_x$ [kN]"
    panel = Panel(x_label, y_label, curves, zero=True, legend="load")
    return Picture("pure longitudinal slip", [panel], width_in=7.5, height_in=5.0)


def envelope(formula: MagicFormula, load_N: float, directions: int = _DIRECTIONS) -> tuple[np.ndarray, np.ndarray]:
    """Return the greatest horizontal force of a tyre in every direction.

    Args:
        formula: The tyre.
        load_N: Load [N].
        directions: Number of sectors of the plane; each gives its outermost point.

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


def _friction_ellipse(formula: MagicFormula) -> Picture:
    curves, maximum = [], 0.0
    for load, colour in zip(_loads(formula.parameters), _COLOURS, strict=False):
        fx, fy = envelope(formula, load)
        curves.append(_curve(fy / load, fx / load, colour, f"{load / 1000:g} kN"))
        maximum = max(maximum, float(np.abs([fx, fy]).max()) / load)
    circle = np.linspace(0.0, 2.0 * math.pi, 181)
    curves.append(_curve(np.sin(circle), np.cos(circle), "#999999", "friction 1", "--", 0.9))
    limit = 1.08 * max(maximum, 1.0)
    panel = Panel(
        "side force over load $F_y / F_z$, to the left positive", "longitudinal force over load $F_x / F_z$", curves,
        x_range=(limit, -limit), y_range=(-limit, limit), zero=True, equal=True, legend="load",
    )  # fmt: skip
    return Picture("greatest forces at combined slip, over the load", [panel], width_in=6.5, height_in=6.5)


def _combined_slip(formula: MagicFormula) -> Picture:
    """Forces over slip for slip angles, and forces against each other."""
    params = formula.parameters
    nominal, kappa = _nominal(params), _slips(params)
    angles = [math.radians(value) for value in (0, 2, 4, 8, 12)]
    angles = [value for value in angles if params["ALPMIN"] <= -value <= params["ALPMAX"]]
    along, aside, both = [], [], []
    for angle, colour in zip(angles, _COLOURS, strict=False):
        # In a left turn slip angles are negative and forces positive.
        forces = formula.evaluate(nominal, kappa, -angle)
        fx, fy = forces.fx_N / 1000.0, forces.fy_N / 1000.0
        along.append(_curve(100.0 * kappa, fx, colour, _in_degrees(-angle)))
        aside.append(_curve(100.0 * kappa, fy, colour))
        both.append(_curve(fy, fx, colour))
    panels = [
        Panel("longitudinal slip [%]", "longitudinal force $F_x$ [kN]", along, zero=True, legend="slip angle"),
        Panel("longitudinal slip [%]", "side force $F_y$ [kN]", aside, zero=True),
        Panel("side force $F_y$ [kN]", "longitudinal force $F_x$ [kN]", both, zero=True, equal=True),
    ]
    title = f"combined slip at {nominal / 1000:.3g} kN"
    return Picture(title, panels, width_in=11.0, height_in=4.4, widths=(3.0, 3.0, 2.0))


def _relaxation_lengths(formula: MagicFormula) -> Picture:
    params = formula.parameters
    loads = np.linspace(params["FZMIN"], min(params["FZMAX"], 2.5 * params["FNOMIN"]), 301)
    at = formula.evaluate(loads, 0.0, 0.0)
    longest = 1.05 * float(np.max([at.relaxation_length_y_m, at.relaxation_length_x_m, at.contact_length_m]))
    nominal = params["FNOMIN"] / 1000.0
    curves = [
        _curve(loads / 1000.0, at.relaxation_length_y_m, _COLOURS[0], "lateral"),
        _curve(loads / 1000.0, at.relaxation_length_x_m, _COLOURS[3], "longitudinal"),
        _curve(loads / 1000.0, at.contact_length_m, _COLOURS[5], "contact length", ":"),
        _curve([nominal, nominal], [0.0, longest], "#999999", "nominal load", "--", 0.9),
    ]
    panel = Panel("load [kN]", "length [m]", curves, x_range=(0.0, None), y_range=(0.0, longest), zero=True)
    return Picture("relaxation lengths", [panel], width_in=7.5, height_in=4.5)
