"""Height profiles of a left and a right track over the distance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.road.obstacles import Grid

STEP_M: Final = 0.05
"""Distance of the samples of a profile [m]."""
_MAX_LENGTH_M: Final = 50_000.0
_HIGHEST_M: Final = 1000.0


@dataclass(frozen=True)
class ProfileTable:
    """Heights over the distance; keys of the table [road.heights], which a CSV of `road.profile` fills.

    The road runs smoothly through the points, without overshoot (monotone cubics), and linearly from track to track. It
    is even across outside the tracks.
    """

    s_m: tuple[float, ...]
    """Distances along x or along the path [m], increasing."""
    left_z_m: tuple[float, ...]
    """Heights of the left track [m]."""
    right_z_m: tuple[float, ...] | None = None
    """Heights of the right track [m]. Default: those of the left track."""
    track_m: Annotated[float, Range(0.1, 10.0)] = 1.5
    """Distance of the two tracks [m]."""

    def __post_init__(self) -> None:
        """Check the points."""
        count = len(self.s_m)
        for key in ("left_z_m", "right_z_m"):
            values = getattr(self, key)
            if values is not None and len(values) != count:
                raise ManeuverError(f"has {len(values)} values beside {count} s_m", key=key)
            if values is not None and any(abs(value) > _HIGHEST_M for value in values):
                raise ManeuverError(f"is higher than {_HIGHEST_M:g} m", key=key)
        if count < 2:
            raise ManeuverError(f"has {count} values; at least 2 are needed", key="s_m")
        for index in range(1, count):
            if not self.s_m[index - 1] < self.s_m[index]:
                problem = f"does not increase from point {index} ({self.s_m[index - 1]:g} m) to {self.s_m[index]:g} m"
                raise ManeuverError(problem, key="s_m")
        if self.s_m[-1] - self.s_m[0] > _MAX_LENGTH_M:
            raise ManeuverError(f"is {self.s_m[-1] - self.s_m[0]:g} m long, at most {_MAX_LENGTH_M:g} m", key="s_m")

    def grid(self) -> Grid:
        """Return the surface."""
        from scipy.interpolate import PchipInterpolator  # noqa: PLC0415 - slow to import, and needed for few roads

        count = max(2, math.ceil((self.s_m[-1] - self.s_m[0]) / STEP_M) + 1)
        s, step = np.linspace(self.s_m[0], self.s_m[-1], count, retstep=True)
        right = self.left_z_m if self.right_z_m is None else self.right_z_m
        columns = [PchipInterpolator(self.s_m, track)(s) for track in (right, self.left_z_m)]
        return Grid(self.s_m[0], float(step), -0.5 * self.track_m, self.track_m, np.column_stack(columns))
