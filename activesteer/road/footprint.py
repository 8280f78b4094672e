"""The ground that a car covers: what a recording says of its outline."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from activesteer.road.recorded import number, numbers, table_of

FRONT_OVERHANG_M: Final = 0.85
"""From the front axle to the front end of the body; usual for the class, as recordings do not give it [m]."""
REAR_OVERHANG_M: Final = 0.75
"""From the rear axle to the rear end of the body; usual for the class [m]."""
_RANGE_M: Final = (0.01, 100.0)


class Footprint(NamedTuple):
    """Sizes of a car; the defaults are usual ones, for drawing a car whose recording does not give its own.

    Attributes:
        width_m: Width of its body [m].
        wheelbase_m: Distance of the axles [m].
        tyre_width_m: Width of the front and of the rear tyres [m].
    """

    width_m: float = 1.8
    wheelbase_m: float = 2.7
    tyre_width_m: tuple[float, float] = (0.2, 0.2)

    @property
    def front_m(self) -> float:
        """Front end of the body, ahead of the front axle [m]."""
        return FRONT_OVERHANG_M

    @property
    def rear_m(self) -> float:
        """Rear end of the body, ahead of the front axle and so below 0 [m]."""
        return -self.wheelbase_m - REAR_OVERHANG_M

    @classmethod
    def from_table(cls, table: object) -> Footprint:
        """The sizes in the table `car` of the metadata.

        Raises:
            RecordingError: one is missing, of the wrong type or out of range.
        """
        car = table_of(table, "car")
        width, wheelbase = (number(car.get(key), f"car.{key}", *_RANGE_M) for key in ("width_m", "wheelbase_m"))
        front, rear = numbers(car.get("tyre_width_m"), "car.tyre_width_m", *_RANGE_M, count=2).tolist()
        return cls(width, wheelbase, (front, rear))


def footprint_of(metadata: Mapping[str, Any]) -> Footprint | None:
    """The sizes of the car of a recorded run; None where they were not recorded.

    Raises:
        RecordingError: they are there and wrong.
    """
    table = metadata.get("car")
    return None if table is None else Footprint.from_table(table)
