"""The tyre as the other code applies it, against ours under the same conventions."""

from __future__ import annotations

from typing import Final

import numpy as np

from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.validation.comparison import Comparison
from activesteer.validation.reference import ReferenceData

_TOLERANCE: Final = 0.005
"""Share of the peak."""
_MOST_ALPHA_DEG: Final = 6.0
_MOST_KAPPA: Final = 0.1
"""The other code limits slope times slip; up to these slips no load of the grid reaches the limit."""
_SPEED_MPS: Final = 22.22


def compare_tyre(tyre: TyreParameters, data: ReferenceData) -> list[Comparison]:
    """Forces and moments over loads, slips, sides, inclination and friction.

    Args:
        tyre: The car's tyre, conventions included.
        data: The reference.

    Returns:
        Largest differences as shares of the peaks, block by block; what lies beyond the other code's limits without a
        tolerance.
    """
    rows = data.texts("tyre_grid")
    numbers = {key: np.array([float(row[key]) for row in rows]) for key in rows[0] if key != "side"}
    left = np.array([row["side"] == "L" for row in rows])
    found = {key: np.empty(len(rows)) for key in ("fx_N", "fy_N", "mz_Nm", "friction_x", "friction_y")}
    for side, chosen in (("LEFT", left), ("RIGHT", ~left)):
        formula = MagicFormula(tyre.mounted_on(side))  # type: ignore[arg-type]
        for mu in np.unique(numbers["road_friction"]):
            here = chosen & (numbers["road_friction"] == mu)
            forces = formula.evaluate(
                numbers["load_N"][here],
                numbers["kappa"][here],
                np.radians(numbers["alpha_deg"][here]),
                np.radians(numbers["incl_deg"][here]),
                vx_mps=_SPEED_MPS,
                road_friction=float(mu),
            )
            for key, values in found.items():
                values[here] = getattr(forces, key)
    within = (np.abs(numbers["alpha_deg"]) <= _MOST_ALPHA_DEG) & (np.abs(numbers["kappa"]) <= _MOST_KAPPA)
    pure = (numbers["kappa"] == 0.0) & (numbers["incl_deg"] == 0.0)
    leaning = numbers["incl_deg"] != 0.0
    slippery = numbers["road_friction"] != 0.9
    blocks = {
        "left_pure_side_slip": within & left & pure,
        "right_pure_side_slip": within & ~left & pure,
        "combined_slip": within & ~pure & ~leaning,
        "inclined_3deg": within & leaning,
        "road_friction_0.8": within & slippery,
        "beyond_their_limits": ~within,
    }
    peaks = {
        "Fx": found["friction_x"] * numbers["load_N"],
        "Fy": found["friction_y"] * numbers["load_N"],
        "Mz": np.full(len(rows), np.abs(numbers["Mz_Nm"]).max()),
    }
    comparisons = []
    for block, rows_in in blocks.items():
        for key, ours_key, unit in (("Fx", "fx_N", "N"), ("Fy", "fy_N", "N"), ("Mz", "mz_Nm", "Nm")):
            ours, theirs = found[ours_key][rows_in], numbers[f"{key}_{unit}"][rows_in]
            error = (ours - theirs) / peaks[key][rows_in]
            worst = int(np.abs(error).argmax())
            tolerance = None if block == "beyond_their_limits" else _TOLERANCE
            comparisons.append(
                Comparison("tyre", f"{block}_{key}_of_peak", unit, float(ours[worst]), float(theirs[worst]),
                           float(error[worst]), tolerance, "relative")
            )  # fmt: skip
    return comparisons
