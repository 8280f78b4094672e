"""The outline of a car on the ground, from the metadata of a recording."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from activesteer.road.recorded import number, numbers, table_of

FRONT_OVERHANG_M: Final = 0.85
"""Distance from the front axle to the front end of the body [m]; usual for the class, since recordings do not hold it.
"""
REAR_OVERHANG_M: Final = 0.75
"""Distance from the rear axle to the rear end of the body [m]; usual for the class."""
_RANGE_M: Final = (0.01, 100.0)


class Footprint(NamedTuple):
    """Dimensions of a car. The defaults are usual ones, for drawing a car whose recording holds none.

    Attributes:
        width_m: Width of the body [m].
        wheelbase_m: Distance between the axles [m].
        tyre_width_m: Width of the front and of the rear tyres [m].
    """

    width_m: float = 1.8
    wheelbase_m: float = 2.7
    tyre_width_m: tuple[float, float] = (0.2, 0.2)

    @property
    def front_m(self) -> float:
        """Position of the front end of the body, ahead of the front axle [m]."""
        return FRONT_OVERHANG_M

    @property
    def rear_m(self) -> float:
        """Position of the rear end of the body, ahead of the front axle and therefore negative [m]."""
        return -self.wheelbase_m - REAR_OVERHANG_M

    @classmethod
    def from_table(cls, table: object) -> Footprint:
        """Read the dimensions from the table `car` of the metadata.

        Raises:
            RecordingError: a dimension is missing, of the wrong type or out of range.
        """
        car = table_of(table, "car")
        width, wheelbase = (number(car.get(key), f"car.{key}", *_RANGE_M) for key in ("width_m", "wheelbase_m"))
        front, rear = numbers(car.get("tyre_width_m"), "car.tyre_width_m", *_RANGE_M, count=2).tolist()
        return cls(width, wheelbase, (front, rear))


def footprint_of(metadata: Mapping[str, Any]) -> Footprint | None:
    """Return the dimensions of the car of a recorded run; None if they were not recorded.

    Raises:
        RecordingError: the recorded dimensions are invalid.
    """
    table = metadata.get("car")
    return None if table is None else Footprint.from_table(table)
