"""Sensors with a given truth, without a car."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from activesteer.config import Source, build
from activesteer.core.signals import Measurement
from activesteer.native.compilation import compiled
from activesteer.sensors import SensorBlock, Sensors
from activesteer.sensors.block import measure

Values = NDArray[np.float64]
STANDING: Final = Measurement(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 0.0))
PLACES: Final = {
    "speed": 0,
    "yaw_rate": 1,
    "ay": 2,
    "ax": 3,
    "steering_wheel": 4,
    "rear_steer": 5,
    "wheel_speed": 7,
    "brake_pressure": 11,
}
"""Columns of what is shown and said; the wheels have four each."""


@compiled
def _shown(chains, memory, wheel_radii_m, timestep_s, truth, said):
    for row in range(len(truth)):
        memory[: said.shape[1]] = truth[row]
        measure(chains, memory, wheel_radii_m, timestep_s)
        said[row] = memory[: said.shape[1]]


def block(timestep_s: float = 0.001, **tables: Any) -> SensorBlock:
    """Return sensors by the description of a vehicle file, in a standing car."""
    made = SensorBlock(build(Sensors, tables, Source("test")), timestep_s)
    made.reset(STANDING)
    return made


def shown(sensors: SensorBlock, truth: Values, timestep_s: float = 0.001, radii_m: Values | None = None) -> Values:
    """Return the measurements of a truth, both of shape (n, 15)."""
    said = np.empty_like(truth)
    _shown(sensors.chains, sensors.memory, np.zeros(4) if radii_m is None else radii_m, timestep_s, truth, said)
    return said


def said_of(name: str, truth: ArrayLike, steps: int = 0, timestep_s: float = 0.001, **table: Any) -> Values:
    """Return the measurements of one sensor, shape (n,); all others are ideal."""
    signal: Any = np.full(steps, truth) if steps else np.asarray(truth)
    rows = np.zeros((len(signal), 15))
    rows[:, PLACES[name]] = signal
    given = {key: table.pop(key) for key in ("preset", "seed") if key in table}
    return shown(block(timestep_s, **given, **{name: table}), rows, timestep_s)[:, PLACES[name]]
