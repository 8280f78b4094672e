"""Comparison of the other code's tyre forces with ours under the same conventions."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import Array
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import Side, TyreParameters
from tests.reference.chrono.comparison import Comparison
from tests.reference.chrono.reference import ReferenceData, Table

_TOLERANCE: Final = 0.005
"""Fraction of the peak."""
_THEIR_LIMIT: Final = 1.5608
"""The other code limits B times slip, the argument of the formula's arc tangent, to this value; our code does not."""
_SHIFTS: Final = 0.1
"""Margin for the horizontal shifts, which add to the slip [in units of B times slip]."""
_UNJUDGED: Final = ("inclined_3deg", "beyond_their_limits")
"""Blocks in which the other code does not follow the formula; their difference is only reported."""
_KEYS: Final = ("fx_N", "fy_N", "mz_Nm", "friction_x", "friction_y", "slip_stiffness_N", "cornering_stiffness_Nprad")
_SPEED_MPS: Final = 22.22


def compare_tyre(tyre: TyreParameters, data: ReferenceData) -> list[Comparison]:
    """Compare forces and moments over loads, slips, sides, inclination and friction.

    Args:
        tyre: The car's tyre, conventions included.
        data: The reference.

    Returns:
        Largest difference of each block as a fraction of the peak; blocks beyond the other code's limits have no
        tolerance.
    """
    rows = data.texts("tyre_grid")
    numbers = {key: np.array([float(row[key]) for row in rows]) for key in rows[0] if key != "side"}
    left = np.array([row["side"] == "L" for row in rows])
    found = _forces(tyre, numbers, left, numbers["kappa"])
    # In the other code the contact frame of an inclined wheel is too short by the cosine of its inclination. The speed
    # in this frame is too low and the slip too great. The same change of our slip shows that nothing else differs.
    stretched = (1.0 + numbers["kappa"]) / np.cos(np.radians(numbers["incl_deg"])) - 1.0
    in_their_frame = _forces(tyre, numbers, left, stretched)
    load = numbers["load_N"]
    along = found["slip_stiffness_N"] / (tyre["PCX1"] * found["friction_x"] * load) * numbers["kappa"]
    across = found["cornering_stiffness_Nprad"] / (tyre["PCY1"] * found["friction_y"] * load)
    across = across * np.radians(numbers["alpha_deg"])
    within = (np.abs(along) < _THEIR_LIMIT - _SHIFTS) & (np.abs(across) < _THEIR_LIMIT - _SHIFTS)
    pure = (numbers["kappa"] == 0.0) & (numbers["incl_deg"] == 0.0)
    leaning = numbers["incl_deg"] != 0.0
    blocks = {
        "left_pure_side_slip": (within & left & pure, found),
        "right_pure_side_slip": (within & ~left & pure, found),
        "combined_slip": (within & ~pure & ~leaning, found),
        "road_friction_0.8": (within & (numbers["road_friction"] != 0.9), found),
        "inclined_3deg_in_their_frame": (within & leaning, in_their_frame),
        "inclined_3deg": (within & leaning, found),
        "beyond_their_limits": (~within, found),
    }
    peaks = {
        "Fx": found["friction_x"] * load,
        "Fy": found["friction_y"] * load,
        "Mz": np.full(len(rows), np.abs(numbers["Mz_Nm"]).max()),
    }
    comparisons = []
    for block, (here, forces) in blocks.items():
        for key, ours_key, unit in (("Fx", "fx_N", "N"), ("Fy", "fy_N", "N"), ("Mz", "mz_Nm", "Nm")):
            ours, theirs = forces[ours_key][here], numbers[f"{key}_{unit}"][here]
            error = (ours - theirs) / peaks[key][here]
            worst = int(np.abs(error).argmax())
            tolerance = None if block in _UNJUDGED else _TOLERANCE
            comparisons.append(
                Comparison("tyre", f"{block}_{key}_of_peak", unit, float(ours[worst]), float(theirs[worst]),
                           float(error[worst]), tolerance, "relative")
            )  # fmt: skip
    return comparisons


def _forces(tyre: TyreParameters, numbers: Table, left: NDArray[np.bool_], kappa: Array) -> Table:
    found = {key: np.empty(len(kappa)) for key in _KEYS}
    sides: tuple[tuple[Side, NDArray[np.bool_]], ...] = (("LEFT", left), ("RIGHT", ~left))
    for side, chosen in sides:
        forces = MagicFormula(tyre.mounted_on(side)).evaluate(
            numbers["load_N"][chosen],
            kappa[chosen],
            np.radians(numbers["alpha_deg"][chosen]),
            np.radians(numbers["incl_deg"][chosen]),
            vx_mps=_SPEED_MPS,
            road_friction=numbers["road_friction"][chosen],
        )
        for key, values in found.items():
            values[chosen] = getattr(forces, key)
    return found
