"""What a controller estimates of the motion of the car, as one row of numbers that the recorder keeps."""

from __future__ import annotations

import struct
from typing import Final

from activesteer.quantities import ESTIMATED
from activesteer.signals import Channel, Estimate

_MEANINGS: Final = {
    "speed_mps": ("m/s", "speed along the car"),
    "lateral_speed_mps": ("m/s", "speed across the car, left positive,"),
    "sideslip_rad": ("rad", "sideslip angle"),
    "yaw_rate_radps": ("rad/s", "yaw rate"),
    "friction": ("", "friction of the road, relative to that of the tyres' files,"),
    "speed_std_mps": ("m/s", "standard deviation of the speed"),
    "lateral_speed_std_mps": ("m/s", "standard deviation of the lateral speed"),
    "sideslip_std_rad": ("rad", "standard deviation of the sideslip angle"),
    "yaw_rate_std_radps": ("rad/s", "standard deviation of the yaw rate"),
    "friction_std": ("", "standard deviation of the friction"),
}
ESTIMATE_CHANNELS: Final = tuple(
    Channel(
        f"{ESTIMATED}_{name}", _MEANINGS[name][0], f"{_MEANINGS[name][1]} as the controller estimates it", "control"
    )
    for name in Estimate._fields
)
"""Channels of the members of an `Estimate`, in their order."""
_pack_into = struct.Struct(f"{len(Estimate._fields)}d").pack_into


def write_estimate(row: memoryview, estimate: Estimate | None) -> None:
    """Writes a row; what is there stays where there is no estimate.

    Args:
        row: Memory of an array of as many float64 as an `Estimate` has members.
        estimate: What the controller estimates.
    """
    if estimate is not None:
        _pack_into(row, 0, *estimate)
