"""The numbers that compiled code exchanges with the law of a controller."""

from __future__ import annotations

from typing import Final

from numba import types

from activesteer.signals import ActuatorCommand, Estimate, numbers_of

N_STEERING: Final = 6
"""Numbers of an `ActuatorCommand` that a controller with a native law decides."""
N_HELD: Final = N_STEERING + len(Estimate._fields)
"""These numbers, and behind them those of the estimate of a called law."""
CALL: Final = (types.intp, types.intp, types.float64, types.float64, types.intp)
"""Arguments of a called law: addresses of block and measurement, the driver's angle at the road wheel [rad], brake
pedal, address of the `N_HELD` numbers to write."""
assert [number.name for number in numbers_of(ActuatorCommand)[:N_STEERING]] == [
    "rear_steer_demand_rad", "superposition_demand_rad", "yaw_rate_desired_radps", "prediction_rad", "correction_rad",
    "saturated",
]  # fmt: skip
