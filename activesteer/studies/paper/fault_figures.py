"""Names of the values of a fault, apart from the code that calculates them."""

from __future__ import annotations

from typing import Final

FIGURES: Final = (
    "yaw_rate_change_radps", "ay_change_mps2", "lateral_offset_1s_m", "lateral_offset_1s_driver_m",
    "steering_correction_rad", "fault_tolerant_time_s",
)  # fmt: skip
"""Values of a fault; see `FaultMap`."""
