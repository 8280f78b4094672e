"""Situations of the fault map, which are paths at a speed, presets, and the names of its values."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np

TURN_MPS2: Final = 4.0
"""Lateral acceleration of the turn, and largest one of the lane change [m/s2]."""
LANE_M: Final = 3.5
"""Width of a lane, and lateral distance to the next one [m]."""
FIGURES: Final = (
    "yaw_rate_change_radps", "ay_change_mps2", "lateral_offset_1s_m", "lateral_offset_1s_driver_m",
    "steering_correction_rad", "fault_tolerant_time_s",
)  # fmt: skip
"""Values of a fault; see `FaultMap`."""
_SPACING_M: Final = 1.0
_ENTRY_S: Final = 2.0
_STEADY_S: Final = 2.5
_QUINTIC_PEAK: Final = 10.0 / math.sqrt(3.0)
"""Largest second derivative of 10 s^3 - 15 s^4 + 6 s^5; it is reached at s = 0.5 - 1 / sqrt(12)."""


class Situation(NamedTuple):
    """A path for the driver, and the time at which faults begin.

    Attributes:
        curvature: Speed [m/s], time since the start [s] -> curvature of the path [1/m].
        fault_s: Speed [m/s] -> time at which faults begin [s].
    """

    curvature: Callable[[float, float], float]
    fault_s: Callable[[float], float]


def _entry(time_s: float) -> float:
    """Return a smooth rise from 0 to 1."""
    return 0.5 - 0.5 * math.cos(math.pi * min(max(time_s / _ENTRY_S, 0.0), 1.0))


def _lane_change_s() -> float:
    """Return the duration of the lane change for its largest lateral acceleration [s]."""
    return math.sqrt(_QUINTIC_PEAK * LANE_M / TURN_MPS2)


def _lane_change(speed_mps: float, time_s: float) -> float:
    fraction = (time_s - 1.0) / _lane_change_s()
    if not 0.0 < fraction < 1.0:
        return 0.0
    return LANE_M * fraction * (60.0 + fraction * (120.0 * fraction - 180.0)) / (_lane_change_s() * speed_mps) ** 2


SITUATIONS: Final = {
    "straight": Situation(lambda speed, time: 0.0, lambda speed: 1.0),
    "turn": Situation(lambda speed, time: TURN_MPS2 / speed**2 * _entry(time), lambda speed: _ENTRY_S + _STEADY_S),
    "lane_change": Situation(_lane_change, lambda speed: 1.0 + (0.5 - 1.0 / math.sqrt(12.0)) * _lane_change_s()),
    "circle_100m": Situation(lambda speed, time: _entry(time) / 100.0, lambda speed: _ENTRY_S + _STEADY_S),
    "circle_100m_right": Situation(lambda speed, time: -_entry(time) / 100.0, lambda speed: _ENTRY_S + _STEADY_S),
}
"""Straight ahead; a left turn of 4 m/s2; a lane change by 3.5 m to the left with 4 m/s2, the fault at the first peak of
its curvature; a circle of 100 m to the left and to the right, as in UN R79, annex 4, for cars."""


class Preset(NamedTuple):
    """Speeds and situations that belong together."""

    speeds_kmh: tuple[float, ...]
    situations: tuple[str, ...]


PRESETS: Final = {
    "usual": Preset((60.0, 100.0, 140.0), ("straight", "turn", "lane_change")),
    # Cars and light vans, from extracts of UN R79, revision 4, annex 4, and of GB 17675-2021, which adopts it.
    "un_r79": Preset((80.0,), ("circle_100m", "circle_100m_right")),
}
"""Name -> preset."""


def path_of(situation: str, speed_mps: float, duration_s: float) -> dict[str, Any]:
    """Return the manoeuvre of a situation: its path, some seconds longer than the run."""
    curvature = SITUATIONS[situation].curvature
    steps = math.ceil(speed_mps * (duration_s + 4.0) / _SPACING_M)
    times = (np.arange(steps) + 0.5) * _SPACING_M / speed_mps
    heading = np.cumsum([0.0, *(_SPACING_M * curvature(speed_mps, float(time)) for time in times)])
    along = 0.5 * (heading[:-1] + heading[1:])
    x, y = (np.concatenate(([0.0], _SPACING_M * np.cumsum(part))) for part in (np.cos(along), np.sin(along)))
    return {
        "kind": "follow_path", "name": situation, "speed_mps": speed_mps, "duration_s": duration_s,
        "path": {"x_m": x.tolist(), "y_m": y.tolist()},
    }  # fmt: skip
