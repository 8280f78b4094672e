"""The steering wheel angle at which the tested car reaches a lateral acceleration."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from activesteer.config import Range
from activesteer.errors import RecordingError
from activesteer.standards.standard import Ground, NoResult

_RATE_DEGPS: Final = 5.0
"""Rate of the ramp [deg/s]; the car lags by some 0.1 s, which is half a degree."""
_LONGEST_S: Final = 30.0


def steering_wheel_at(ground: Ground, speed_kmh: float, ay_mps2: float) -> float:
    """Return the angle from a slow ramp to the left at constant speed.

    Returns:
        Steering wheel angle, to 0.1 deg [deg].
    """
    [run] = ground.drive(
        f"ramp_{speed_kmh:g}kmh",
        "slowly_increasing_steer",
        [{"speed_kmh": speed_kmh}],
        {"steer.rate_degps": _RATE_DEGPS, "duration_s": _LONGEST_S},
        ("steering_wheel_rad", "ay_mps2"),
    )
    try:
        ay = run["ay_mps2"]
    except RecordingError as reason:
        raise NoResult(f"the slow ramp at {speed_kmh:g} km/h cannot be driven: {reason}") from reason
    if ay.max() < ay_mps2:
        raise NoResult(
            f"the car reaches {ay.max():.3g} m/s2 at {speed_kmh:g} km/h; the test needs {ay_mps2:g} m/s2",
            value=ay.max(), allowed=Range(ay_mps2),
        )  # fmt: skip
    # Apart from noise, the acceleration rises until then.
    end = int(np.argmax(ay >= ay_mps2))
    rising = np.maximum.accumulate(ay[: end + 1])
    return round(math.degrees(float(np.interp(ay_mps2, rising, run["steering_wheel_rad"][: end + 1]))), 1)
