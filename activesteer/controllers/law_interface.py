"""The numbers that compiled code exchanges with the law of a controller."""

from __future__ import annotations

from typing import Final

from numba import types

from activesteer.signals import ActuatorCommand, Estimate, numbers_of

N_STEERING: Final = 6
"""Numbers of an `ActuatorCommand` that a controller with a native law decides; the others are 0."""
N_COMMAND: Final = len(numbers_of(ActuatorCommand))
"""Numbers of an `ActuatorCommand`."""
N_HELD: Final = N_COMMAND + len(Estimate._fields) + 1
"""Numbers of a decision: those of the command, of its estimate, and 1 if there is an estimate."""
CALL: Final = (types.intp, types.intp, types.intp, types.intp)
"""Arguments of a law: addresses of its block, of the numbers of a `DriverCommand` and of a `Measurement`, and of the
`N_HELD` numbers to write."""
assert [number.name for number in numbers_of(ActuatorCommand)[:N_STEERING]] == [
    "rear_steer_demand_rad", "superposition_demand_rad", "yaw_rate_desired_radps", "prediction_rad", "correction_rad",
    "saturated",
]  # fmt: skip
