"""Metrics for every manoeuvre: peaks, root mean squares, and the fraction of their friction that the tyres use."""

from __future__ import annotations

from contextlib import suppress
from typing import Final

import numpy as np

from activesteer.analysis.series import counted_sideslip
from activesteer.analysis.source import RecordingLike
from activesteer.conventions import CORNERS
from activesteer.errors import RecordingError

SIGNALS: Final = (("yaw_rate", "radps"), ("ay", "mps2"), ("sideslip", "rad"), ("roll", "rad"))
"""Channels that are evaluated: name and unit suffix."""

KEY_METRICS: Final = (
    "yaw_rate_peak_abs_radps", "yaw_rate_rms_radps", "ay_peak_abs_mps2", "ay_rms_mps2", "sideslip_peak_abs_rad",
    "sideslip_rms_rad", "roll_peak_abs_rad", "roll_rms_rad", "steering_wheel_peak_abs_rad", "speed_end_mps",
)  # fmt: skip
"""Key metrics, the most telling first."""


def general_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return peaks and root mean squares of a run.

    Returns:
        `<name>_peak_abs_<unit>` and `<name>_rms_<unit>` of yaw rate, lateral acceleration, sideslip (above 10 km/h)
        and roll; the largest steering wheel angle; `friction_utilisation_max`, the largest fraction of its available
        friction that any tyre uses; and `speed_end_mps`.

    Raises:
        RecordingError: a channel is missing.
    """
    values: dict[str, float] = {}
    for name, unit in SIGNALS:
        values |= _size(recording, name, unit)
    values["steering_wheel_peak_abs_rad"] = float(np.abs(recording["steering_wheel_rad"]).max())
    values["friction_utilisation_max"] = max(
        float(recording[f"{corner}_friction_utilisation"].max()) for corner in CORNERS
    )
    values["speed_end_mps"] = float(recording["speed_mps"][-1])
    return values


def measured_metrics(recording: RecordingLike) -> dict[str, float]:
    """Return the metrics whose channels were measured; a car on a proving ground has no sensors of tyre forces."""
    values: dict[str, float] = {}
    for name, unit in SIGNALS:
        with suppress(RecordingError):
            values |= _size(recording, name, unit)
    with suppress(RecordingError):
        values["steering_wheel_peak_abs_rad"] = float(np.abs(recording["steering_wheel_rad"]).max())
    with suppress(RecordingError):
        values["speed_end_mps"] = float(recording["speed_mps"][-1])
    return values


def _size(recording: RecordingLike, name: str, unit: str) -> dict[str, float]:
    channel = counted_sideslip(recording) if name == "sideslip" else np.asarray(recording[f"{name}_{unit}"], np.float64)
    return {
        f"{name}_peak_abs_{unit}": float(np.abs(channel).max()),
        f"{name}_rms_{unit}": float(np.sqrt(np.mean(channel**2))),
    }
