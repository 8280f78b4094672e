"""Damping of driver and car after a small step of the path."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from activesteer.analysis.source import RecordingLike
from activesteer.conventions import Array
from activesteer.errors import StudyError
from activesteer.resources import DEFAULT_DRIVER
from activesteer.scenario import FileOrTable
from activesteer.simulation.runner import simulate

STEP_M: Final = 0.5
"""Offset of the path beside the car [m]. It needs about 1.6 m/s2 of lateral acceleration, where tyres are linear, and
moves the steering wheel further than the friction of the rack can hide."""
_CLOSE: Final = 0.1
"""Fraction of the step that may remain at the end; the friction of the rack hides some."""
DURATION_S: Final = 7.0
"""Length of the run [s]."""
_SPACING_M: Final = 15.0
_FIT_INTERVAL_S: Final = 0.01
"""Sampling interval of the fit [s]."""


def small_step(
    speed_mps: float,
    controller: Any = "none",
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    driver: Any = DEFAULT_DRIVER,
) -> RecordingLike:
    """Return the run for the damping: a straight path that begins `STEP_M` to the left of the car."""
    x_m = np.arange(0.0, speed_mps * (DURATION_S + 6.0), _SPACING_M)
    path = {"x_m": x_m.tolist(), "y_m": [STEP_M] * len(x_m)}
    table = {
        "kind": "follow_path",
        "name": "small_step",
        "speed_mps": speed_mps,
        "duration_s": DURATION_S,
        "path": path,
    }
    return simulate(table, controller, vehicle, overrides, driver=driver)


def damping_of(time_s: Array, y_m: Array) -> tuple[float, float]:
    """Return damping ratio and natural frequency of the oscillation about the path, after its first crossing.

    They belong to the decaying oscillation that fits best by least squares. This equals the logarithmic decrement if
    all decrements are alike; the friction of the rack makes those of small amplitudes smaller.
    """
    from scipy.optimize import least_squares  # noqa: PLC0415 - slow to import

    off = np.asarray(y_m, dtype=np.float64) / STEP_M - 1.0
    beyond = np.flatnonzero(off > 0.0)
    if not beyond.size:
        if off[-1] < -_CLOSE:
            raise StudyError(
                f"the driver does not come to a path {STEP_M} m beside him within the run; is he slower than that?"
            )
        return 1.0, math.nan
    every = max(1, round(_FIT_INTERVAL_S / float(time_s[1] - time_s[0])))
    time_s, off = np.asarray(time_s, dtype=np.float64)[beyond[0] :: every], off[beyond[0] :: every]
    time_s = time_s - time_s[0]

    def residual(p: np.ndarray) -> np.ndarray:
        ratio, natural, sine, cosine, rest = p
        swing = natural * math.sqrt(1.0 - ratio * ratio) * time_s
        return np.exp(-ratio * natural * time_s) * (sine * np.sin(swing) + cosine * np.cos(swing)) + rest - off

    bounds = [-0.5, 0.3, -10.0, -10.0, -1.0], [0.999, 15.0, 10.0, 10.0, 1.0]
    starts = [[ratio, natural, 0.3, 0.0, 0.0] for ratio in (0.1, 0.5) for natural in (1.5, 3.0, 5.0)]
    fits = [least_squares(residual, start, bounds=bounds) for start in starts]
    ratio, natural, *_ = min(fits, key=lambda fit: fit.cost).x
    return float(ratio), float(natural)
