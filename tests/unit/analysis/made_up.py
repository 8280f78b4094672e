"""Recordings made of formulas, for the analysis alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from activesteer.errors import RecordingError

STEP_S = 1.0
"""Time at which the steering wheel of the made-up runs passes half of its final angle [s]."""

RAMP_S = 0.1
"""Duration of its ramp [s]."""


class MadeUp:
    """A recording of arrays that were computed, not driven."""

    def __init__(self, time_s: np.ndarray, channels: Mapping[str, np.ndarray], kind: str = "step_steer") -> None:
        self.time_s = time_s
        self.metadata: dict[str, Any] = {"maneuver": {"kind": kind}, "controller": "none"}
        self.channels = dict(channels)

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.channels:
            raise RecordingError(f"no channel {name!r}")
        return self.channels[name]


Response = Callable[[np.ndarray], np.ndarray]


def first_order(time_s: np.ndarray, lag_s: float = 0.2) -> np.ndarray:
    """Unit step response of a first-order lag, from t = 0 on."""
    after_s = np.maximum(time_s, 0.0)
    return np.where(time_s >= 0.0, 1.0 - np.exp(-after_s / lag_s), 0.0)


def second_order(time_s: np.ndarray, natural_radps: float = 9.0, damping: float = 0.5) -> np.ndarray:
    """Unit step response of an underdamped second-order lag, from t = 0 on."""
    after_s = np.maximum(time_s, 0.0)
    root = np.sqrt(1.0 - damping**2)
    decay = np.exp(-damping * natural_radps * after_s)
    phase = root * natural_radps * after_s
    return np.where(time_s >= 0.0, 1.0 - decay * (np.cos(phase) + damping / root * np.sin(phase)), 0.0)


def step_steer(
    yaw: Response = second_order,
    *,
    side: float = 1.0,
    yaw_radps: float = 0.2,
    sideslip_rad: float = -0.01,
    rear_rad: float = 0.0,
    superposition_rad: float = 0.0,
    duration_s: float = 7.0,
    timestep_s: float = 0.001,
) -> MadeUp:
    """A step steer to the left (side 1) or right (-1): everything steps at `STEP_S`, to the given final values."""
    time_s = np.arange(round(duration_s / timestep_s) + 1) * timestep_s
    since_s = time_s - STEP_S
    ramp = np.clip(since_s / RAMP_S + 0.5, 0.0, 1.0)
    channels = {
        "steering_wheel_rad": 1.0 * ramp,
        "front_steer_rad": ramp / 16.0,
        "rear_steer_rad": rear_rad * first_order(since_s),
        "rear_steer_demand_rad": rear_rad * (since_s >= 0.0),
        "superposition_rad": superposition_rad * first_order(since_s),
        "superposition_demand_rad": superposition_rad * (since_s >= 0.0),
        "yaw_rate_radps": yaw_radps * yaw(since_s),
        "yaw_rate_desired_radps": yaw_radps * first_order(since_s, 0.1),
        "ay_mps2": 4.0 * first_order(since_s),
        "roll_rad": 0.04 * second_order(since_s),
        "sideslip_rad": sideslip_rad * first_order(since_s, 0.3),
    }
    mirrored = {name: side * values for name, values in channels.items()}
    return MadeUp(time_s, {**mirrored, "speed_mps": np.full_like(time_s, 22.0)})
