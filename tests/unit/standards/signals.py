"""Runs with prescribed channels."""

from __future__ import annotations

import numpy as np

from activesteer.core.conventions import CURVE_STEP_S
from activesteer.standards.standard import StandardRun


def run_of(channels: dict[str, np.ndarray], **metrics: float) -> StandardRun:
    return StandardRun({}, metrics, {name: np.asarray(values, dtype=float) for name, values in channels.items()}, "")


def times(duration_s: float) -> np.ndarray:
    return np.arange(round(duration_s / CURVE_STEP_S) + 1) * CURVE_STEP_S
