"""Report on a tyre: key figures, remarks, and evaluation time."""

from __future__ import annotations

import math
import os
import timeit
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from activesteer.core.text_table import text_table, wrapped_line
from activesteer.native.compilation import compiled
from activesteer.plotting import Curve, Panel, Picture, save_all
from activesteer.tyre.diagnostics import remarks
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.kernels.magic_formula import magic_formula
from activesteer.tyre.tyre_parameters import TyreParameters

_BAR_PA: Final = 1e5
_INCH_M: Final = 0.0254
_LOADS: Final = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0)
"""Loads of the table, relative to the nominal load."""


def _within(params: TyreParameters, low: str, high: str, widest: float, count: int = 801) -> np.ndarray:
    """Return evenly spaced values within a range of the file, limited to `widest`."""
    return np.linspace(max(params[low], -widest), min(params[high], widest), count)


def _nominal(params: TyreParameters) -> float:
    return min(max(params["FNOMIN"], params["FZMIN"]), params["FZMAX"])


def key_figures(params: TyreParameters) -> dict[str, Any]:
    """Return the key figures of a tyre, for the report."""
    nominal = params["FNOMIN"]
    loads = [fraction * nominal for fraction in _LOADS if params["FZMIN"] <= fraction * nominal <= params["FZMAX"]]
    return {
        "file": str(params.source) if params.source else None,
        "version": f"MF {params.version / 10:.1f}",
        "fittyp": int(params["FITTYP"]),
        "side": params.side,
        "size": size(params),
        "nominal_load_N": nominal,
        "pressure_Pa": params["INFLPRES"],
        "nominal_pressure_Pa": params["NOMPRES"],
        "measurement_speed_mps": params["LONGVL"],
        "unloaded_radius_m": params["UNLOADED_RADIUS"],
        "vertical_stiffness_Npm": params["VERTICAL_STIFFNESS"],
        "ranges": {
            "load_N": [params["FZMIN"], params["FZMAX"]],
            "slip_ratio": [params["KPUMIN"], params["KPUMAX"]],
            "slip_angle_rad": [params["ALPMIN"], params["ALPMAX"]],
            "camber_rad": [params["CAMMIN"], params["CAMMAX"]],
            "pressure_Pa": [params["PRESMIN"], params["PRESMAX"]],
        },
        "over_load": _over_load(params, np.asarray(loads or [_nominal(params)])),
        "remarks": [f"{what}: {why}" for what, why in remarks(params)],
    }


def _over_load(params: TyreParameters, loads: np.ndarray) -> dict[str, list[float]]:
    formula = MagicFormula(params)
    rolling = formula.evaluate(loads, 0.0, 0.0)
    kappa = _within(params, "KPUMIN", "KPUMAX", 1.0, 1201)
    alpha = _within(params, "ALPMIN", "ALPMAX", 0.6, 1201)
    fx = formula.evaluate(loads[:, None], kappa, 0.0).fx_N / loads[:, None]
    fy = formula.evaluate(loads[:, None], 0.0, alpha).fy_N / loads[:, None]
    columns = {
        "load_N": loads,
        "cornering_stiffness_Nprad": np.abs(rolling.cornering_stiffness_Nprad),
        "lateral_friction_left": fy.max(axis=1),
        "lateral_friction_right": -fy.min(axis=1),
        "lateral_friction_at_rad": np.abs(alpha[np.abs(fy).argmax(axis=1)]),
        "slip_stiffness_N": rolling.slip_stiffness_N,
        "driving_friction": fx.max(axis=1),
        "driving_friction_at": kappa[fx.argmax(axis=1)],
        "braking_friction": -fx.min(axis=1),
        "braking_friction_at": -kappa[fx.argmin(axis=1)],
        "trail_m": rolling.trail_m,
        "relaxation_length_y_m": rolling.relaxation_length_y_m,
        "relaxation_length_x_m": rolling.relaxation_length_x_m,
        "loaded_radius_m": rolling.loaded_radius_m,
        "effective_radius_m": rolling.effective_radius_m,
        "side_force_straight_ahead_N": rolling.fy_N,
        "aligning_moment_straight_ahead_Nm": rolling.mz_Nm,
    }
    return {name: [float(value) for value in column] for name, column in columns.items()}


def size(params: TyreParameters) -> str | None:
    """Return the size designation, such as 205/55 R16, or None if the file has no dimensions."""
    if not {"WIDTH", "RIM_RADIUS", "ASPECT_RATIO"} <= params.given.keys():
        return None
    rim = 2.0 * params["RIM_RADIUS"] / _INCH_M
    return f"{1000.0 * params['WIDTH']:.0f}/{100.0 * params['ASPECT_RATIO']:.0f} R{rim:.3g}"


_TABLE: Final = (
    ("load [N]", "load_N", 1.0, ".0f"),
    ("cornering stiffness [kN/deg]", "cornering_stiffness_Nprad", math.radians(1.0) / 1000.0, ".3f"),
    ("peak friction, left turn", "lateral_friction_left", 1.0, ".3f"),
    ("peak friction, right turn", "lateral_friction_right", 1.0, ".3f"),
    ("  at slip angle [deg]", "lateral_friction_at_rad", math.degrees(1.0), ".1f"),
    ("slip stiffness [kN]", "slip_stiffness_N", 1e-3, ".1f"),
    ("peak friction, braking", "braking_friction", 1.0, ".3f"),
    ("  at slip [%]", "braking_friction_at", 100.0, ".1f"),
    ("peak friction, driving", "driving_friction", 1.0, ".3f"),
    ("  at slip [%]", "driving_friction_at", 100.0, ".1f"),
    ("pneumatic trail [mm]", "trail_m", 1000.0, ".1f"),
    ("relaxation length, lateral [m]", "relaxation_length_y_m", 1.0, ".3f"),
    ("relaxation length, longitudinal [m]", "relaxation_length_x_m", 1.0, ".3f"),
    ("loaded radius [mm]", "loaded_radius_m", 1000.0, ".1f"),
    ("effective rolling radius [mm]", "effective_radius_m", 1000.0, ".1f"),
    ("side force straight ahead [N]", "side_force_straight_ahead_N", 1.0, ".0f"),
)


def describe(params: TyreParameters) -> str:
    """Describe a tyre and its unusual properties for a terminal."""
    figures = key_figures(params)
    ranges = figures["ranges"]
    name = params.source.name if params.source else "tyre"

    def degrees(key: str) -> str:
        low, high = (math.degrees(value) for value in ranges[key])
        return f"{low:.3g} to {high:.3g} deg"

    lines = [
        f"{name}: {figures['size'] or 'size not stated'}, {figures['version']} (FITTYP {figures['fittyp']}), "
        f"file for the {params.side.lower()} side",
        f"  nominal load {figures['nominal_load_N']:g} N, pressure {figures['pressure_Pa'] / _BAR_PA:.2f} bar "
        f"(measured at {figures['nominal_pressure_Pa'] / _BAR_PA:.2f} bar and {figures['measurement_speed_mps']:.3g} "
        "m/s)",
        f"  free radius {1000 * figures['unloaded_radius_m']:.1f} mm, vertical stiffness "
        f"{figures['vertical_stiffness_Npm'] / 1000:.0f} N/mm",
        f"  valid for {ranges['load_N'][0]:g} to {ranges['load_N'][1]:g} N, slip {ranges['slip_ratio'][0]:g} to "
        f"{ranges['slip_ratio'][1]:g}, slip angle {degrees('slip_angle_rad')}, camber {degrees('camber_rad')}, "
        f"{ranges['pressure_Pa'][0] / _BAR_PA:g} to {ranges['pressure_Pa'][1] / _BAR_PA:g} bar",
        "",
        "  Without camber, at the file's pressure and the speed of measurement:",
    ]
    over = figures["over_load"]
    rows = [[title, *(f"{factor * value:{form}}" for value in over[key])] for title, key, factor, form in _TABLE]
    lines = [part for line in lines for part in wrapped_line(line)]
    lines += [*text_table(rows, repeat=1, least=7, marks=["  "] * len(rows)), ""]
    unusual = remarks(params)
    if not unusual:
        return "\n".join([*lines, "  Nothing unusual."])
    lines.append("  Unusual:")
    lines += [part for what, why in unusual for part in wrapped_line(f"  - {what}: {why}.")]
    return "\n".join(lines)


_COLOURS: Final = ("#0072b2", "#009e73", "#e69f00", "#d55e00", "#cc79a7", "#333333", "#56b4e9")
"""Colours that colour-blind readers can distinguish (Okabe and Ito, 2008)."""
_LOAD_FRACTIONS: Final = (0.5, 1.0, 1.5, 2.0)
_DEGREES: Final = math.degrees(1.0)
_WIDEST_ANGLE_RAD: Final = math.radians(20.0)
_WIDEST_SLIP: Final = 0.6
_WIDEST_CAMBER_RAD: Final = math.radians(6.0)
_DIRECTIONS: Final = 180
_GRID: Final = 351
"""Number of slips and of slip angles whose forces the friction ellipse encloses."""


def draw(params: TyreParameters, folder: str | os.PathLike[str]) -> list[Path]:
    """Draw forces and relaxation lengths as PNG files, at the file's pressure and speed and within its ranges."""
    formula = MagicFormula(params)
    name = params.source.name if params.source else "tyre"
    pictures = {
        "side_force": _side_force(formula),
        "longitudinal_force": _longitudinal_force(formula),
        "friction_ellipse": _friction_ellipse(formula),
        "combined_slip": _combined_slip(formula),
        "relaxation_lengths": _relaxation_lengths(formula),
    }
    return save_all(pictures, folder, f"{name}: ")


def _curve(x: ArrayLike, y: ArrayLike, colour: str, label: str = "", dashes: str = "-", width: float = 1.5) -> Curve:
    return Curve(x, y, label, colour, dashes, width)


def _in_degrees(angle_rad: float) -> str:
    text = f"{_DEGREES * angle_rad:.3g}°".replace("-", "\N{MINUS SIGN}")
    return text if angle_rad else "0°"


def _loads(params: TyreParameters) -> list[float]:
    """Return the loads of the curves [N], rounded to 100 N, within the range of the file."""
    low, high = params["FZMIN"], params["FZMAX"]
    loads = [max(round(fraction * params["FNOMIN"] / 100.0) * 100.0, 100.0) for fraction in _LOAD_FRACTIONS]
    return [load for load in loads if low <= load <= high] or [_nominal(params)]


def _side_force(formula: MagicFormula) -> Picture:
    """Draw side force (above) and aligning moment (below) for several loads (left) and cambers (right)."""
    params, nominal = formula.parameters, _nominal(formula.parameters)
    alpha = _within(params, "ALPMIN", "ALPMAX", _WIDEST_ANGLE_RAD)
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
    kappa = _within(params, "KPUMIN", "KPUMAX", _WIDEST_SLIP)
    curves = [
        _curve(100.0 * kappa, formula.evaluate(load, kappa, 0.0).fx_N / 1000.0, colour, f"{load / 1000:g} kN")
        for load, colour in zip(_loads(params), _COLOURS, strict=False)
    ]
    x_label, y_label = "longitudinal slip [%], braking negative", "longitudinal force $F_x$ [kN]"
    panel = Panel(x_label, y_label, curves, zero=True, legend="load")
    return Picture("pure longitudinal slip", [panel], width_in=7.5, height_in=5.0)


def envelope(formula: MagicFormula, load_N: float, directions: int = _DIRECTIONS) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest horizontal force of a tyre in each direction."""
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
    return Picture("largest forces at combined slip, over the load", [panel], width_in=6.5, height_in=6.5)


def _combined_slip(formula: MagicFormula) -> Picture:
    """Draw the forces versus slip for several slip angles, and lateral versus longitudinal force."""
    params = formula.parameters
    nominal, kappa = _nominal(params), _within(params, "KPUMIN", "KPUMAX", _WIDEST_SLIP)
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


_CALLS: Final = 100_000
_ROUNDS: Final = 5
"""Number of rounds, of which each figure takes the best, since disturbances only slow a machine down."""


@compiled
def _scalar_calls(tyre, count, pressure_Pa):
    """Evaluate a tyre `count` times with different inputs, and return the sum of all outputs."""
    p, total = tyre[0], 0.0
    for index in range(count):
        # Small changes, so that the compiler cannot omit a call or move it out of the loop.
        fraction = (index % 1000) * 0.001
        fx, fy, mx, my, mz = magic_formula(
            p, 3000.0 + 2000.0 * fraction, 0.1 * fraction - 0.05, 0.08 - 0.16 * fraction, 0.02, pressure_Pa, 20.0, 0.9
        )
        total += fx + fy + mx + my + mz
    return total


def bench(params: TyreParameters, rounds: int = _ROUNDS) -> dict[str, float]:
    """Measure the time of the full evaluation of a tyre on one core."""
    record, pressure = np.atleast_1d(params.record), params["INFLPRES"]
    rng = np.random.default_rng(0)
    rows = [rng.uniform(low, high, _CALLS) for low, high in ((500, 8000), (-0.2, 0.2), (-0.2, 0.2), (-0.05, 0.05))]
    formula = MagicFormula(params)
    single_calls = _CALLS // 100
    return {
        "scalar_us": _best_us(lambda: _scalar_calls(record, _CALLS, pressure), _CALLS, rounds),
        "vectorised_us_per_row": _best_us(lambda: formula.evaluate(*rows), _CALLS, rounds),
        "python_call_us": _best_us(
            lambda: formula.evaluate(4000.0, 0.05, 0.04, 0.02), single_calls, rounds, calls=single_calls
        ),
    }


def _best_us(function: Callable[[], object], count: int, rounds: int, calls: int = 1) -> float:
    function()
    return min(timeit.repeat(function, number=calls, repeat=rounds)) / count * 1e6
