"""Units and signs that cannot be: speed, yaw rate, lateral acceleration and steering of a car belong together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from activesteer.conventions import GRAVITY_MPS2, Array

_ALIKE: Final = 0.7
"""Correlation from which on two signals belong to the same motion."""
_FACTORS: Final = (
    (math.radians(1.0), "yaw_rate_radps is 57 times too large: it looks like deg/s that were taken as rad/s"),
    (math.degrees(1.0), "yaw_rate_radps is 57 times too small: it looks like rad/s that were taken as deg/s"),
    (1.0 / 3.6, "the speed is 3.6 times too large: it looks like km/h that were taken as m/s"),
    (3.6, "the speed is 3.6 times too small: it looks like m/s that were taken as km/h"),
    (1.0 / GRAVITY_MPS2, "ay_mps2 is 9.8 times too small: it looks like g that were taken as m/s2"),
    (GRAVITY_MPS2, "ay_mps2 is 9.8 times too large: it looks like m/s2 that were taken as g"),
)
"""ay / (v yaw rate), which is 1 but for the change of the sideslip, and what it means."""
_NEAR: Final = math.log(1.5)
_STEER_RANGE: Final = (0.001, 0.15)
"""Yaw rate over speed and steering wheel angle that a car may have [1/m]: 1/(wheelbase x ratio) is 0.02, divided by
1 + (v/v_ch)^2, and less at the limit; degrees for radians are 57 times beyond."""
_FASTEST_RADPS: Final = 4.0
"""Yaw rate that no car on its wheels reaches [rad/s]."""


def suspicions(channels: Mapping[str, Array]) -> list[str]:
    """What looks like a wrong unit or sign, one line each.

    Args:
        channels: Values by channel name, SI, all of one length.
    """
    speed, rate, ay, wheel = (
        channels.get(name) for name in ("speed_mps", "yaw_rate_radps", "ay_mps2", "steering_wheel_rad")
    )
    found: list[str] = []
    if speed is not None and rate is not None and ay is not None:
        found += _against_acceleration(speed * rate, ay, wheel)
    elif rate is not None and np.abs(rate).max() > _FASTEST_RADPS:
        found.append(f"yaw_rate_radps reaches {np.abs(rate).max():.0f} rad/s: it looks like deg/s")
    opposite = rate is not None and wheel is not None and _alike(wheel, rate) < -_ALIKE
    if opposite and not any("sign" in line for line in found):
        found.append(
            "steering_wheel_rad and yaw_rate_radps are of opposite sign: one of them is positive to the right, the "
            "steering wheel where ay_mps2 agrees with the yaw rate"
        )
    if speed is not None and rate is not None and wheel is not None and not found:
        found += _against_steering(speed, rate, wheel)
    return found


def _against_acceleration(product: Array, ay: Array, wheel: Array | None) -> list[str]:
    alike = _alike(product, ay)
    if abs(alike) < _ALIKE:
        return []
    found = []
    if alike < 0.0:
        guilty = "one of them is"
        if wheel is not None and abs(_alike(wheel, ay)) > _ALIKE:
            guilty = "ay_mps2 is" if _alike(wheel, ay) < 0.0 else "yaw_rate_radps is"
        found.append(f"ay_mps2 and yaw_rate_radps are of opposite sign: {guilty} positive to the right")
    ratio = float(product @ ay / (product @ product))
    factor, words = min(_FACTORS, key=lambda each: abs(math.log(abs(ratio) / each[0])))
    if abs(math.log(abs(ratio) / factor)) < _NEAR:
        found.append(words)
    return found


def _against_steering(speed: Array, rate: Array, wheel: Array) -> list[str]:
    product = speed * wheel
    if abs(_alike(product, rate)) < _ALIKE:
        return []
    gain = abs(float(product @ rate / (product @ product)))
    if gain < _STEER_RANGE[0]:
        return [
            f"the yaw rate is {gain:.2g} 1/m of speed times steering wheel angle, 0.003 to 0.03 is a car: "
            "steering_wheel_rad looks like deg that were taken as rad"
        ]
    if gain > _STEER_RANGE[1]:
        return [
            f"the yaw rate is {gain:.2g} 1/m of speed times steering wheel angle, 0.003 to 0.03 is a car: "
            "steering_wheel_rad looks like the angle of the road wheels, or rad that were taken as deg"
        ]
    return []


def _alike(one: Array, other: Array) -> float:
    """Cosine between two signals; 0 where one of them is nothing."""
    size = math.sqrt(float(one @ one) * float(other @ other))
    return float(one @ other) / size if size > 0.0 else 0.0
