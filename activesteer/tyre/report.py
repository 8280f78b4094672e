"""Key figures of a tyre over load, as numbers and in words."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from activesteer.text_table import text_table, wrapped_line
from activesteer.tyre.diagnostics import remarks
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import TyreParameters

_BAR_PA: Final = 1e5
_INCH_M: Final = 0.0254
_LOADS: Final = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0)
"""Loads of the table, over the nominal one."""
_NAMES: Final = {52: "MF 5.2", 60: "MF 6.0", 61: "MF 6.1", 62: "MF 6.2"}


def _slips(low: float, high: float) -> np.ndarray:
    return np.linspace(low, high, 1201)


def key_figures(params: TyreParameters) -> dict[str, Any]:
    """Return numbers that characterise a tyre, for a table or as JSON.

    Returns:
        Identification (`file`, `version`, `fittyp`, `side`, `size`, `nominal_load_N`, `pressure_Pa`,
        `unloaded_radius_m` ...), the ranges of validity, and under `over_load` one list per quantity, in the order of
        `over_load["load_N"]`: peak friction and the slip at the peak, stiffnesses, trail, relaxation lengths
        and radii, without camber, at the file's pressure and speed of measurement.
    """
    nominal = params["FNOMIN"]
    loads = [fraction * nominal for fraction in _LOADS if params["FZMIN"] <= fraction * nominal <= params["FZMAX"]]
    return {
        "file": str(params.source) if params.source else None,
        "version": _NAMES[params.version],
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
        "over_load": _over_load(params, np.asarray(loads or [min(max(nominal, params["FZMIN"]), params["FZMAX"])])),
        "remarks": [f"{what}: {why}" for what, why in remarks(params)],
    }


def _over_load(params: TyreParameters, loads: np.ndarray) -> dict[str, list[float]]:
    formula = MagicFormula(params)
    rolling = formula.evaluate(loads, 0.0, 0.0)
    kappa = _slips(max(params["KPUMIN"], -1.0), min(params["KPUMAX"], 1.0))
    alpha = _slips(max(params["ALPMIN"], -0.6), min(params["ALPMAX"], 0.6))
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
    """Return the size in words, such as 205/55 R16; None if the file has no dimensions of its own."""
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
    """Describe a tyre and its unusual properties as text for a terminal.

    Returns:
        Several lines, without a line break at the end.
    """
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
