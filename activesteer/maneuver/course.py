"""What a driver follows: a path, and the lanes and cones beside it."""

from __future__ import annotations

from typing import Any, NamedTuple

from activesteer.road.lane import Lane
from activesteer.road.path import Path


class Course(NamedTuple):
    """Path, lanes and cones in the world frame: the car starts at the origin, heading along x.

    Attributes:
        path: Path of the centre of gravity.
        lanes: Lanes that the car has to stay in.
        cones: Points (x, y) where cones stand [m].
        last_gate_x_m: Where the last gate ends [m]; None where there is none.
    """

    path: Path
    lanes: tuple[Lane, ...] = ()
    cones: tuple[tuple[float, float], ...] = ()
    last_gate_x_m: float | None = None

    def describe(self) -> dict[str, Any]:
        """The same as plain tables, to be kept with a recording."""
        return {
            "path": {"x_m": self.path.x_m.tolist(), "y_m": self.path.y_m.tolist()},
            "lanes": [lane._asdict() for lane in self.lanes],
            "cones": [list(cone) for cone in self.cones],
            "last_gate_x_m": self.last_gate_x_m,
        }
