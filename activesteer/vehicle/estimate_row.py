"""Estimate of a controller as one row of numbers that the recorder keeps."""

from __future__ import annotations

import struct
from typing import Final

from activesteer.display_units import ESTIMATED
from activesteer.signals import Channel, Estimate, numbers_of

ESTIMATE_CHANNELS: Final = tuple(
    Channel(
        f"{ESTIMATED}_{number.name}",
        number.recorded.unit,
        f"{number.recorded.meaning}, estimated by the controller",
        "control",
    )
    for number in numbers_of(Estimate)
    if number.recorded is not None
)
"""Channels of the fields of an `Estimate`, in their order."""
write_estimate: Final = struct.Struct(f"{len(Estimate._fields)}d").pack_into
"""`write_estimate(row, 0, *estimate)` writes a row into the memory of an array; the arguments must be numbers."""
