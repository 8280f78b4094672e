"""The figures that are found for a fault: names that lists and pages need without what finds them."""

from __future__ import annotations

from typing import Final

FIGURES: Final = (
    "yaw_rate_change_radps", "ay_change_mps2", "lateral_offset_1s_m", "lateral_offset_1s_driver_m",
    "steering_correction_rad", "fault_tolerant_time_s",
)  # fmt: skip
"""What is said of a fault; see `FaultMap`."""
