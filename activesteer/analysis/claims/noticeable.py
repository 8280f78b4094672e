"""Sizes below which a difference does not count: what a driver or a sensor in a test car could not tell.

They rest on what is published about sensors and humans. That results of an earlier driver and earlier gains were known
when they were written down is said in the guide (`docs/claims.md`).
"""

from __future__ import annotations

import math
from typing import Final

STEER_RAD: Final = math.radians(0.05)
"""Angle of a road wheel that is turned or added [rad]: workshops set wheel alignment to some 3 minutes of arc. One
that is demanded counts as `action` says, so that no noise passes for it."""
SETTLED_SIDESLIP_RAD: Final = math.radians(0.05)
"""Difference of a sideslip angle that is the mean over a second [rad]: half of an optical sensor's +-0.1 deg."""
SIDESLIP_RAD: Final = math.radians(0.1)
"""Difference of two sideslip angles of an instant or an oscillation [rad]: an optical sensor is good to 0.1 deg."""
YAW_RATE_RADPS: Final = math.radians(0.5)
"""Difference of two yaw rates [rad/s]: humans notice 0.6 deg/s of a quick rotation (Grabherr et al. 2008), production
sensors have 0.1 to 0.2 deg/s of noise."""
TIME_S: Final = 0.01
"""Difference of two times [s]: a yaw rate or acceleration sensor on a car's bus reports every 10 ms."""
TRACK_M: Final = 0.05
"""Difference of two tracks [m]: each is known to 0.02 m with differential satellite positioning."""
STEERING_WHEEL_RAD: Final = math.radians(5.0)
"""Difference of two steering wheel angles [rad]: about what a driver can tell apart while he turns the wheel."""


def noticeable(metric: str) -> float:
    """The size for a metric, by its name [SI]; 0 where none of these sizes is meant for it."""
    return next((size for word, unit, size in _METRICS if word in metric and metric.endswith(unit)), 0.0)


_METRICS: Final = (
    ("rear_steer", "_rad", STEER_RAD),
    ("superposition", "_rad", STEER_RAD),
    ("sideslip_steady_state", "_rad", SETTLED_SIDESLIP_RAD),
    ("sideslip", "_rad", SIDESLIP_RAD),
    ("steering_wheel", "_rad", STEERING_WHEEL_RAD),
    ("yaw_rate", "_radps", YAW_RATE_RADPS),
    ("", "_s", TIME_S),
    ("", "_m", TRACK_M),
)
"""What is in the name of a metric, and its unit; the first that fits counts."""
