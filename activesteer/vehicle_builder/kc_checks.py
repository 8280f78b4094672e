"""Checks of the measurements of a K&C rig: signs and units of the columns.

Measurements that would create energy, or turn the wheels against the rack, are errors. Unusual measurements give a
question.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

import numpy as np

from activesteer.errors import ParameterError
from activesteer.vehicle_builder.kc_tables import NAMES_FILE, Samples

_NEAR: Final = {
    "parallel_travel": 0.02,
    "steering": 0.02,
    "side_force": 1500.0,
    "side_force_opposed": 1500.0,
    "braking_force": 1500.0,
    "drive_force": 1500.0,
    "aligning_moment": 100.0,
    "aligning_moment_opposed": 100.0,
}
"""Range about zero within which a slope counts [m, N, N m]."""
_HINT: Final = f" ({NAMES_FILE} turns the sign of a channel)"
_MUST_RISE: Final = (
    ("parallel_travel", "load", "the wheel load falls in bump: is travel positive in bump?"),
    ("steering", "-toe", "the left wheel turns to the right as the rack steers left: signs of rack and toe?"),
    # The force does work at the contact point; a wheel that leans over may move its centre the other way.
    ("side_force", "contact_outwards", "the contact moves against the side force: sign of force or way outwards?"),
    (
        "side_force_opposed",
        "contact_outwards",
        "the contact moves against the side force: sign of force or way outwards?",
    ),
    ("braking_force", "contact_forward", "the contact moves against the longitudinal force: sign of force or way?"),
    ("drive_force", "centre_forward", "the wheel moves against the longitudinal force: sign of force or way?"),
    ("aligning_moment", "-toe", "the wheel turns against the moment: sign of moment or toe?"),
    ("aligning_moment_opposed", "-toe", "the wheel turns against the moment: sign of moment or toe?"),
)
"""Test, channel that has to rise with the variable, and message if it falls."""


def check_signs(tests: dict[str, Samples]) -> None:
    """Check the signs of the slopes.

    Raises:
        ParameterError: a slope has the wrong sign.
    """
    for name, channel, words in _MUST_RISE:
        if name not in tests or (slope := _slope(name, tests[name], channel)) is None:
            continue
        if slope < -_least(name, channel, tests[name]):
            raise ParameterError(words + _HINT, file=tests[name].file, key=channel.removeprefix("-"))


def unusual(axle: str, tests: dict[str, Samples]) -> Iterator[str]:
    """Return questions about unusual measurements.

    Args:
        axle: `front` or `rear`.
        tests: All tests of the axle.
    """
    per_m, per_kN = np.degrees(1.0), np.degrees(1e3)
    front = axle == "front"
    rows: tuple[tuple[str, str, float, Callable[[float], bool], str], ...] = (
        ("parallel_travel", "toe", per_m, lambda x: not front and x < -1.0,
         "toe-out in bump at the rear: is the sign of the file ISO (toe-in positive)?"),
        ("parallel_travel", "toe", per_m, lambda x: front and x > 3.0,
         "toe-in in bump at the front: is the sign of the file ISO (toe-in positive)?"),
        ("parallel_travel", "toe", per_m, lambda x: abs(x) > 40.0, "is toe in degrees, or travel in millimetres?"),
        ("parallel_travel", "camber", per_m, lambda x: x > 3.0,
         "the top leans out in bump: is camber negative with the top inwards in the file?"),
        ("parallel_travel", "centre_forward", 1e3, lambda x: not front and x > 30.0,
         "the rear wheel moves forwards in bump: does x point forwards in the file?"),
        ("side_force", "toe", per_kN, lambda x: (x < -0.03) if front else (x > 0.03),
         "side force steers into the turn in front or out of it behind: sign of the force or of toe?"),
        ("side_force", "camber", per_kN, lambda x: x > 0.05,
         "a force outwards at the road leans the top outwards: sign of the force or of camber?"),
    )  # fmt: skip
    for name, channel, factor, odd, words in rows:
        if name in tests and (slope := _slope(name, tests[name], channel)) is not None and odd(factor * slope):
            unit = "deg/kN" if factor == per_kN else "deg/m" if factor == per_m else "mm/m"
            yield f"{tests[name].file}: {channel} {factor * slope:+.3g} {unit}: {words}"


def _slope(name: str, samples: Samples, channel: str) -> float | None:
    values = samples.channels.get(channel.removeprefix("-"))
    if values is None:
        return None
    near = np.abs(samples.x) <= _NEAR[name]
    if int(near.sum()) < 3:
        near = np.ones(len(samples.x), dtype=bool)
    return (-1.0 if channel.startswith("-") else 1.0) * float(np.polyfit(samples.x[near], values[near], 1)[0])


def _least(name: str, channel: str, samples: Samples) -> float:
    """Smallest slope that counts: 0.02 mm or 0.002 deg, or 10 N, over the evaluated range."""
    step = 10.0 if channel == "load" else 3e-5 if channel.endswith("toe") else 2e-5
    return step / min(_NEAR[name], float(np.abs(samples.x).max()))
