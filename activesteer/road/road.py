"""The road that the manoeuvre sets and the vehicle drives on.

A road is plane. Its friction may differ from place to place, in the world axes of the recording: x along the track from
the initial position of the centre of gravity, y to the left. For a wheel, the friction at its contact point counts.
While the car settles before the recording, it rolls on `mu` alone.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final, NamedTuple

from activesteer.config import Range, Source, build
from activesteer.errors import ManeuverError, RecordingError, nearest_names
from activesteer.road.recorded import table_of

Friction = Annotated[float, Range(0.01, 2.0)]

_SIDES: Final = {"both": (-math.inf, math.inf), "left": (0.0, math.inf), "right": (-math.inf, 0.0)}
"""Name of a side -> its right and left border [m]."""


@dataclass(frozen=True)
class RoadPatch:
    """A stretch of the track with its own friction; keys of a table [[road.patches]]."""

    start_m: float
    """Start along x, included [m]."""
    end_m: float
    """End along x, not included [m]."""
    mu: Friction
    """Friction relative to that in the tyre files [-]."""
    side: str = "both"
    """`both`, `left` (y > 0) or `right` (y <= 0)."""

    def __post_init__(self) -> None:
        """Check the place.

        Raises:
            ManeuverError: the patch ends before it begins, or its side has an unknown name.
        """
        if not self.end_m > self.start_m:
            raise ManeuverError(
                f"the patch ends at {self.end_m:g} m, which is not behind its start_m of {self.start_m:g} m"
            )
        if self.side not in _SIDES:
            raise ManeuverError(f"is {self.side!r}; {nearest_names(self.side, _SIDES)}", key="side", value=self.side)


class Area(NamedTuple):
    """A rectangle of the road: x from start (included) to end, y from right to left border (included) [m]."""

    start_m: float
    end_m: float
    right_m: float
    left_m: float
    mu: float

    def clipped(self, start_m: float, end_m: float, right_m: float, left_m: float) -> Area | None:
        """Return its part within a rectangle [m]; None if they do not overlap."""
        start, end = max(self.start_m, start_m), min(self.end_m, end_m)
        right, left = max(self.right_m, right_m), min(self.left_m, left_m)
        return Area(start, end, right, left, self.mu) if start < end and right < left else None


@dataclass(frozen=True)
class Road:
    """The road under the wheels; keys of the table [road] in a manoeuvre file."""

    OVERRULED: ClassVar = {"mu": {"mu_left": None, "mu_right": None}}

    mu: Friction = 1.0
    """Friction relative to that in the tyre files [-]."""
    grade: Annotated[float, Range(-0.5, 0.5)] = 0.0
    """Rise over run in the direction of travel [-]; positive is uphill."""
    mu_left: Friction | None = None
    """Friction where y > 0 [-]; default `mu`."""
    mu_right: Friction | None = None
    """Friction where y <= 0 [-]; default `mu`."""
    patches: tuple[RoadPatch, ...] = ()
    """Stretches with their own friction; where two overlap, the later one counts."""

    def areas(self) -> tuple[Area, ...]:
        """Return the areas whose friction is not `mu`; where areas overlap, the later one counts."""
        sides = (("left", self.mu_left), ("right", self.mu_right))
        split = [Area(-math.inf, math.inf, *_SIDES[side], mu) for side, mu in sides if mu is not None]
        return (*split, *(Area(it.start_m, it.end_m, *_SIDES[it.side], it.mu) for it in self.patches))


def road_of(metadata: Mapping[str, Any]) -> Road:
    """Return the road of a recorded run; a default road if it was not recorded.

    Raises:
        RecordingError: a recorded key is unknown, missing, of the wrong type or out of range.
    """
    maneuver = table_of(metadata.get("maneuver", {}), "maneuver")
    table = table_of(maneuver.get("road", {}), "maneuver.road")
    return build(Road, table, Source("the metadata of the recording", error=RecordingError), ("maneuver", "road"))
