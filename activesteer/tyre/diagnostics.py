"""Remarks on unusual values of a tyre, with reasons."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.file.syntax import COEFFICIENTS
from activesteer.tyre.tyre_parameters import TyreParameters

_BAR_PA: Final = 1e5
FRICTION_RANGE: Final = (0.6, 1.6)
"""Peak friction of road tyres on a test drum. Between ice and a slick on a dry road the range is wider."""
CORNERING_RANGE_PRAD: Final = (8.0, 25.0)
"""Cornering stiffness over load of passenger, light truck and sports car tyres at the nominal load [1/rad]."""
SLIP_RANGE: Final = (8.0, 60.0)
"""Slip stiffness over load at the nominal load."""
TRAIL_RANGE_M: Final = (0.005, 0.08)
"""Pneumatic trail at the nominal load: a sixth of a contact patch of 0.1 to 0.25 m, and some room."""
RELAXATION_RANGE_M: Final = (0.1, 1.5)
"""Lateral relaxation length at the nominal load: one to three contact lengths."""
STRAIGHT_AHEAD_FRACTION: Final = 0.05
"""Lateral force straight ahead, over the load, from which a car on four such tyres clearly pulls."""
NOMINAL_LOAD_N: Final = (1000.0, 12_000.0)
"""Nominal loads of car tyres; loads of motorcycles and trucks are outside."""
STATIC_DEFLECTION: Final = (0.03, 0.15)
"""Deflection under the nominal load, over the free radius."""
_BOOKKEEPING: Final = (
    "N_TIRE_STATES", "USER_SUB_ID", "USE_MODE", "ROAD_INCREMENT", "ROAD_DIRECTION", "HMAX_LOCAL", "TIME_SWITCH_INTEG",
    "SWITCH_INTEG", "FE_METHOD", "FUNCTION_NAME", "FILE_VERSION",
)  # fmt: skip
"""Keys that control another program and do not describe the tyre."""
_SECTIONS: Final = {
    "LONGITUDINAL_COEFFICIENTS": (("RBX1", "RCX1"), "combined slip does not reduce the longitudinal force"),
    "LATERAL_COEFFICIENTS": (("RBY1", "RCY1"), "combined slip does not reduce the lateral force"),
    "ALIGNING_COEFFICIENTS": (("QBZ1", "QDZ1"), "there is no pneumatic trail, so the aligning moment is about zero"),
    "OVERTURNING_COEFFICIENTS": (("QSX1", "QSX2", "QSX3"), "there is no overturning moment"),
    "ROLLING_COEFFICIENTS": (("QSY1",), "there is no rolling resistance"),
}


def remarks(params: TyreParameters) -> list[tuple[str, str]]:
    """Return remarks on the unusual properties of a tyre, empty for an ordinary tyre."""
    parts = (_missing, _scales, _frame, _ranges, _levels, _curvatures, _asymmetry)
    return [remark for part in parts for remark in part(params)]


def _missing(params: TyreParameters) -> Iterator[tuple[str, str]]:
    for section, (keys, consequence) in _SECTIONS.items():
        if not any(params[key] != 0.0 for key in keys):
            yield f"[{section}] gives none of {', '.join(keys)}", consequence
    stand_ins = {
        "INFLPRES": "bar", "NOMPRES": "bar", "FZMAX": "N", "RIM_RADIUS": "m", "LONGITUDINAL_STIFFNESS": "N/m",
        "LATERAL_STIFFNESS": "N/m", "LONGVL": "m/s", "WIDTH": "m",
    }  # fmt: skip
    relaxation = {"LONGITUDINAL_STIFFNESS": "PTX1", "LATERAL_STIFFNESS": "PTY1"}
    defaults = [
        f"{key} = {params[key] / (_BAR_PA if unit == 'bar' else 1.0):g} {unit}"
        for key, unit in stand_ins.items()
        if key not in params.given and not (params.version == 52 and relaxation.get(key, "") in params.given)
    ]
    if defaults:
        yield f"not in the file: {', '.join(defaults)}", "these default values are used"
    unknown = sorted(key for section, key in params.unused if section != "MDI_HEADER" and key not in _BOOKKEEPING)
    if unknown:
        names = ", ".join(unknown)
        yield f"no formula here uses {names}", "the file has a feature that is not modelled, or a misspelt key"
    motorcycle = [key for key in ("MC_CONTOUR_A", "MC_CONTOUR_B") if params[key] != 0.0]
    if motorcycle:
        yield (
            f"{' and '.join(motorcycle)} given",
            "the contour of a motorcycle tyre is not modelled, so results at large camber are wrong",
        )


def _scales(params: TyreParameters) -> Iterator[tuple[str, str]]:
    scaled = [
        f"{item.name} = {params[item.name]:g}"
        for item in COEFFICIENTS
        if item.section == "SCALING_COEFFICIENTS" and params[item.name] != 1.0
    ]
    if scaled:
        friction = any(name.startswith(("LMUX ", "LMUY ")) for name in scaled)
        reason = "the file scales what was measured"
        if friction:
            reason += "; friction scaled here and a road's mu multiply"
        yield ", ".join(scaled), reason


def _frame(params: TyreParameters) -> Iterator[tuple[str, str]]:
    nominal, radius = params["FNOMIN"], params["UNLOADED_RADIUS"]
    if not NOMINAL_LOAD_N[0] <= nominal <= NOMINAL_LOAD_N[1]:
        yield f"FNOMIN = {nominal:g} N", f"car tyres have {NOMINAL_LOAD_N[0]:g} to {NOMINAL_LOAD_N[1]:g} N"
    deflection = nominal / params["VERTICAL_STIFFNESS"] / radius
    if not STATIC_DEFLECTION[0] <= deflection <= STATIC_DEFLECTION[1]:
        yield (
            f"the nominal load deflects the tyre by {100 * deflection:.1f} % of its radius",
            "3 to 15 % are usual: check VERTICAL_STIFFNESS, FNOMIN and their units",
        )
    dimensions = {"WIDTH", "RIM_RADIUS", "ASPECT_RATIO"} <= params.given.keys()
    built = params["RIM_RADIUS"] + params["WIDTH"] * params["ASPECT_RATIO"]
    if dimensions and abs(built / radius - 1.0) > 0.04:
        yield (
            f"UNLOADED_RADIUS = {radius:g} m, but rim and side wall make {built:.3f} m",
            "width, aspect ratio and rim do not match this radius",
        )
    if params["VXLOW"] > 3.0 or params["VXLOW"] < 0.1:
        yield f"VXLOW = {params['VXLOW']:g} m/s", "shifts and trail fade out below it; 1 to 2 m/s is usual"
    ratio = params["INFLPRES"] / params["NOMPRES"]
    if "INFLPRES" in params.given and abs(ratio - 1.0) > 0.2:
        yield (
            f"INFLPRES is {100 * ratio:.0f} % of NOMPRES",
            "the tyre runs far from the pressure of its measurement"
            if any(params[key] != 0.0 for key in ("PPX1", "PPY1", "PPZ1", "PFZ1"))
            else "and no pressure coefficient is given, so that it changes nothing",
        )


def _ranges(params: TyreParameters) -> Iterator[tuple[str, str]]:
    consequence = "beyond it the tyre is evaluated at the limit, and `tyre_limited` is recorded"
    nominal = params["FNOMIN"]
    if params["FZMAX"] < 1.5 * nominal:
        yield f"FZMAX = {params['FZMAX']:g} N is {params['FZMAX'] / nominal:.2f} of the nominal load", consequence
    if params["FZMIN"] > 0.3 * nominal:
        yield f"FZMIN = {params['FZMIN']:g} N is {params['FZMIN'] / nominal:.2f} of the nominal load", consequence
    for low, high, minimum, unit, factor in (
        ("KPUMIN", "KPUMAX", 0.99, "", 1.0),
        ("ALPMIN", "ALPMAX", math.radians(15.0), " deg", math.degrees(1.0)),
        ("CAMMIN", "CAMMAX", math.radians(5.0), " deg", math.degrees(1.0)),
    ):
        if -params[low] < minimum or params[high] < minimum:
            span = f"{factor * params[low]:.3g} to {factor * params[high]:.3g}{unit}"
            yield f"{low}, {high} allow {span} only", consequence


def _levels(params: TyreParameters) -> Iterator[tuple[str, str]]:
    nominal = params["FNOMIN"]
    at = MagicFormula(params).evaluate(nominal, 0.0, 0.0)
    for axis, key, value in (("x", "PDX1", float(at.friction_x)), ("y", "PDY1", float(at.friction_y))):
        if params[key] <= 0.0:
            yield (
                f"{key} = {params[key]:g} is negative",
                "some published sets store the sign here; the sign of the stiffness sets the direction of the force",
            )
        if not FRICTION_RANGE[0] <= abs(value) <= FRICTION_RANGE[1]:
            yield (
                f"peak friction mu_{axis} = {value:.2f} at the nominal load",
                f"road tyres reach {FRICTION_RANGE[0]:g} to {FRICTION_RANGE[1]:g} on a test bench",
            )
    cornering = -float(at.cornering_stiffness_Nprad) / nominal
    if cornering <= 0.0:
        yield f"cornering stiffness over load is {cornering:.1f} 1/rad", "the side force would push the tyre sideways"
    elif not CORNERING_RANGE_PRAD[0] <= cornering <= CORNERING_RANGE_PRAD[1]:
        low, high = CORNERING_RANGE_PRAD
        yield f"cornering stiffness over load is {cornering:.1f} 1/rad", f"{low:g} to {high:g} 1/rad are usual"
    slip = float(at.slip_stiffness_N) / nominal
    if not SLIP_RANGE[0] <= slip <= SLIP_RANGE[1]:
        yield f"slip stiffness over load is {slip:.1f}", f"{SLIP_RANGE[0]:g} to {SLIP_RANGE[1]:g} are usual"
    trail = float(at.trail_m)
    if params["QDZ1"] != 0.0 and not TRAIL_RANGE_M[0] <= trail <= TRAIL_RANGE_M[1]:
        yield f"pneumatic trail {1000 * trail:.0f} mm at the nominal load", "5 to 80 mm are usual"
    sigma = float(at.relaxation_length_y_m)
    if params.conventions.relaxation and not RELAXATION_RANGE_M[0] <= sigma <= RELAXATION_RANGE_M[1]:
        yield f"lateral relaxation length {sigma:.2f} m at the nominal load", "one to three contact lengths are usual"
    loads = np.linspace(max(params["FZMIN"], 0.1 * nominal), params["FZMAX"], 60)
    over = MagicFormula(params).evaluate(loads, 0.0, 0.0)
    for name, values in (("mu_x", over.friction_x), ("mu_y", over.friction_y)):
        wrong = loads[np.sign(values) != np.sign(values[np.abs(loads - nominal).argmin()])]
        if wrong.size:
            yield f"{name} changes its sign at {wrong[0]:.0f} N", "the load terms diverge inside the range of validity"


def _curvatures(params: TyreParameters) -> Iterator[tuple[str, str]]:
    nominal = params["FNOMIN"] * params["LFZO"]
    loads = np.linspace(max(params["FZMIN"], 0.1 * nominal), params["FZMAX"], 60)
    dfz = loads / nominal - 1.0
    curves = {
        "E_x": (params["PEX1"] + params["PEX2"] * dfz + params["PEX3"] * dfz**2) * (1.0 + abs(params["PEX4"])),
        "E_y": (params["PEY1"] + params["PEY2"] * dfz) * (1.0 + abs(params["PEY3"])),
        "E_t": (params["QEZ1"] + params["QEZ2"] * dfz + params["QEZ3"] * dfz**2) * (1.0 + abs(params["QEZ4"])),
        "E_xalpha": params["REX1"] + params["REX2"] * dfz,
        "E_ykappa": params["REY1"] + params["REY2"] * dfz,
    }
    scales = {"E_x": params["LEX"], "E_y": params["LEY"]}
    for name, values in curves.items():
        above = loads[scales.get(name, 1.0) * values > 1.0]
        if above.size:
            yield (
                f"{name} exceeds 1 between {above[0]:.0f} and {above[-1]:.0f} N",
                "the curve would turn back on itself; E is held at 1, as the formula requires",
            )


def _asymmetry(params: TyreParameters) -> Iterator[tuple[str, str]]:
    nominal = params["FNOMIN"]
    straight = MagicFormula(params).evaluate(nominal, 0.0, 0.0)
    force, stiffness = float(straight.fy_N), abs(float(straight.cornering_stiffness_Nprad))
    if abs(force) > STRAIGHT_AHEAD_FRACTION * nominal:
        angle = math.degrees(abs(force) / stiffness) if stiffness else math.inf
        yield (
            f"{force:.0f} N of side force straight ahead at the nominal load, as from {angle:.2f} deg of slip angle",
            "ply steer and conicity; a car with the same file on both sides pulls, so mirror it (TYRESIDE)",
        )
    high = min(params["ALPMAX"], -params["ALPMIN"], 0.5)
    sides = np.abs(MagicFormula(params).evaluate(nominal, 0.0, np.linspace(-high, high, 801)).fy_N)
    left, right = float(sides[:400].max()), float(sides[401:].max())
    if left and right and abs(left / right - 1.0) > 0.05:
        yield (
            f"the peak side force differs by {100 * abs(left / right - 1.0):.0f} % between left and right",
            "built-in asymmetry, or a measurement whose shifts were not removed",
        )
