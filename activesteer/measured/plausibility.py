"""Suspicious units and signs: speed, yaw rate, lateral acceleration and steering of a car are related."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from activesteer.conventions import Array
from activesteer.units import known_unit

_ALIKE: Final = 0.7
"""Correlation above which two signals belong to the same motion."""
_MISTAKES: Final = {
    name: (known_unit(right).factor / known_unit(wrong).factor, wrong, right)
    for name, wrong, right in (
        ("yaw_rate_radps", "deg/s", "rad/s"),
        ("speed_mps", "km/h", "m/s"),
        ("ay_mps2", "g", "m/s2"),
    )
}
"""Channel -> factor of the error if the first unit was taken for the second."""
_NEAR: Final = math.log(1.5)
"""Ratios within this range count as equal: ay/(v yaw rate) is 1 except for the change of the sideslip angle."""
_LONGEST_STEP_S: Final = 1.0
"""Step from which a motion of the car cannot be seen [s]."""
_STEER_RANGE: Final = (0.001, 0.15)
"""Plausible yaw rate over speed and steering wheel angle [1/m]. The value 1/(wheelbase x ratio) is 0.02, divided by 1
+ (v/v_ch)^2, and less at the limit. Degrees taken as radians are off by a factor of 57."""
_SHORTEST_M: Final = 2.4
"""Wheelbase of a short car [m]. With the angle of the road wheels, yaw rate over speed and angle is 1/wheelbase in a
neutral car and less in one that understeers."""
_FASTEST_RADPS: Final = 4.0
"""Yaw rate that no car on its wheels reaches [rad/s]."""


def suspicions(channels: Mapping[str, Array], step_s: float = 0.01) -> list[str]:
    """Return signs of a wrong unit or sign, one line each.

    Args:
        channels: Values by channel name, SI, of equal length.
        step_s: Time between two values [s].
    """
    rate, ay, wheel = (channels.get(name) for name in ("yaw_rate_radps", "ay_mps2", "steering_wheel_rad"))
    speed = channels.get("speed_mps", channels.get("vx_mps"))
    found: list[str] = []
    if step_s >= _LONGEST_STEP_S:
        found.append(f"the time has steps of {step_s:g} s: it looks like ms or us that were taken as s (time_unit)")
    if speed is not None and rate is not None and ay is not None:
        found += _against_acceleration(speed * rate, ay, wheel)
    elif rate is not None and np.abs(rate).max() > _FASTEST_RADPS:
        found.append(f"yaw_rate_radps reaches {np.abs(rate).max():.0f} rad/s: it looks like deg/s")
    roll = channels.get("roll_rad")
    signed = any("sign" in line for line in found)
    if roll is not None and ay is not None and _alike(roll, ay) < -_ALIKE and not signed:
        found.append(
            "roll_rad and ay_mps2 are of opposite sign: a car rolls to the outside of the turn, so roll_rad is "
            'positive to the left, or all are in axes of SAE J670 (axes = "sae_j670" in a map)'
        )
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
    found += _unit_words(abs(float(product @ ay / (product @ product))))
    return found


def _unit_words(ratio: float) -> list[str]:
    """Explain the ratio of lateral acceleration to speed x yaw rate by the fewest wrong units."""
    if abs(math.log(ratio)) < _NEAR:
        return []
    guesses = []
    for powers in itertools.product((0, 1, -1), repeat=len(_MISTAKES)):
        would = math.prod(
            size ** (power if name == "ay_mps2" else -power)
            for power, (name, (size, _, _)) in zip(powers, _MISTAKES.items(), strict=True)
        )
        if abs(math.log(ratio / would)) < _NEAR:
            guesses.append((sum(map(abs, powers)), abs(math.log(ratio / would)), powers))
    if not guesses:
        return [f"ay_mps2 is {ratio:.2g} times speed x yaw rate, nearly 1 in a car: a unit of the three is wrong"]
    return [_unit_word(name, power) for power, name in zip(min(guesses)[2], _MISTAKES, strict=True) if power]


def _unit_word(name: str, power: int) -> str:
    size, wrong, right = _MISTAKES[name]
    if power < 0:
        size, wrong, right = 1.0 / size, right, wrong
    times = f"{size:.2g} times too large" if size > 1.0 else f"{1.0 / size:.2g} times too small"
    return f"{name} is {times}: it looks like {wrong} that were taken as {right}"


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
    if gain > 1.0 / _SHORTEST_M:
        return [
            f"the yaw rate is {gain:.2g} 1/m of speed times steering wheel angle, 0.003 to 0.03 is a car: "
            "steering_wheel_rad is too small even for the angle of the road wheels (0.1 to 0.4); it looks like rad "
            "that were taken as deg (0.2 to 1.7), or has a scale of its own: give its `factor` in a map, or fit "
            "steering.factor"
        ]
    if gain > _STEER_RANGE[1]:
        return [
            f"the yaw rate is {gain:.2g} 1/m of speed times steering wheel angle, 0.003 to 0.03 is a car: "
            "steering_wheel_rad looks like the angle of the road wheels, or rad that were taken as deg"
        ]
    return []


def _alike(one: Array, other: Array) -> float:
    """Return the cosine between two signals; 0 if one of them is zero."""
    size = math.sqrt(float(one @ one) * float(other @ other))
    return float(one @ other) / size if size > 0.0 else 0.0
