"""Single obstacles on a road: bumps, cleats, kerbs, potholes, cross slopes and waves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

import numpy as np

from activesteer.config import Range
from activesteer.errors import ManeuverError
from activesteer.native_records import numbers_type

Side = Literal["both", "left", "right"]
Height = Annotated[float, Range(0.0, 2.0)]

COSINE_BUMP, PLATEAU, CROSS_SLOPE, SINE = 0.0, 1.0, 2.0, 3.0
_SHAPES: Final = {
    "cosine_bump": COSINE_BUMP, "cleat": PLATEAU, "kerb": PLATEAU, "pothole": PLATEAU,
    "cross_slope_ramp": CROSS_SLOPE, "sine_wave": SINE,
}  # fmt: skip
Kind = Literal["cosine_bump", "cleat", "kerb", "pothole", "cross_slope_ramp", "sine_wave"]
_SIDES: Final = {"both": (-math.inf, math.inf), "left": (0.0, math.inf), "right": (-math.inf, 0.0)}
FIRST_START_M: Final = 2.0
"""Least distance of an obstacle from the start [m]: the front wheels stand some 1.3 m ahead of the origin."""
_SMOOTH: Final = ("cosine_bump", "cross_slope_ramp", "sine_wave")
_LONG_M: Final = 1.5
"""Length from which a smooth obstacle hardly bends within the contact patch [m]: ten patches of 0.15 m."""

OBSTACLE: Final = numbers_type(
    "shape", "start_m", "length_m", "height_m", "right_m", "left_m", "edge_m", "skew", "waves"
)  # fmt: skip
"""An obstacle for the kernels; see `height_of`. `skew`: metres by which it begins earlier per metre to the left."""


@dataclass(frozen=True)
class Obstacle:
    """An obstacle; keys of a table [[road.obstacle]]."""

    kind: Kind
    """`cosine_bump`: h/2 (1 - cos(2 pi x/L)). `cleat`, `kerb`: a step of `height_m` with edges of `edge_m`. `pothole`:
    the same downwards. `cross_slope_ramp`: the road turns about its middle to `slope` within `length_m` and stays so.
    `sine_wave`: h sin(2 pi x/L), growing over the first wave."""
    start_m: Annotated[float, Range(FIRST_START_M)]
    """Distance from the start of the manoeuvre, along x or along the path [m]."""
    length_m: Annotated[float, Range(1e-3)] | None = None
    """Length [m]; wavelength of a `sine_wave`; length over which a `cross_slope_ramp` turns. Default: without end, for
    a `kerb`."""
    height_m: Height | None = None
    """Height; depth of a `pothole`; amplitude of a `sine_wave` [m]."""
    side: Side = "both"
    """`both`, `left` or `right` side of the middle."""
    left_m: float | None = None
    """Left border, instead of a side [m]."""
    right_m: float | None = None
    """Right border, instead of a side [m]."""
    angle_rad: Annotated[float, Range(-math.radians(80.0), math.radians(80.0))] = 0.0
    """Angle by which the obstacle is turned [rad], positive anticlockwise seen from above: a `kerb` at 70 deg is struck
    at a flat angle, by the left wheels first."""
    edge_m: Annotated[float, Range(1e-3, 1.0)] = 0.01
    """Length over which the edges of a `cleat`, `kerb` or `pothole` rise [m]."""
    slope: Annotated[float, Range(-0.5, 0.5)] | None = None
    """Cross slope that a `cross_slope_ramp` reaches, rise to the left over run [-]."""
    waves: Annotated[int, Range(0, 100_000)] = 0
    """Number of waves of a `sine_wave`; 0 for no end."""

    def __post_init__(self) -> None:
        """Check that the obstacle has what its kind needs, and nothing without effect."""
        ramp = self.kind == "cross_slope_ramp"
        for key, needed in (
            ("length_m", self.kind != "kerb"), ("height_m", not ramp), ("slope", ramp)
        ):  # fmt: skip
            if needed and getattr(self, key) is None:
                raise ManeuverError(f"is missing; a {self.kind} needs it", key=key)
        steep = _SHAPES[self.kind] == PLATEAU
        for key, without in (
            ("height_m", ramp and self.height_m is not None),
            ("slope", not ramp and self.slope is not None),
            ("edge_m", not steep and self.edge_m != type(self).edge_m),
            ("waves", self.kind != "sine_wave" and self.waves != 0),
            ("side", self.side != "both" and (self.left_m is not None or self.right_m is not None)),
        ):
            if without:
                raise ManeuverError(f"has no effect on this {self.kind}; leave it out", key=key)
        right, left = self.borders
        if not right < left:
            raise ManeuverError(f"the left border at {left:g} m is not left of the right one at {right:g} m")
        if steep and self.length_m is not None and self.length_m < 2.0 * self.edge_m:
            raise ManeuverError(
                f"is {self.length_m:g} m; two edges of edge_m = {self.edge_m:g} m need more", key="length_m"
            )

    @property
    def borders(self) -> tuple[float, float]:
        """Right and left border [m]; infinite where there is none."""
        right, left = _SIDES[self.side]
        return (right if self.right_m is None else self.right_m), (left if self.left_m is None else self.left_m)

    @property
    def is_smooth(self) -> bool:
        """True if the obstacle hardly bends within the contact patch, so that one point of contact tells enough."""
        return self.kind in _SMOOTH and self.length_m is not None and self.length_m >= _LONG_M

    def record(self) -> Any:
        """Return the obstacle for the kernels, an `OBSTACLE`."""
        right, left = self.borders
        height = self.slope if self.height_m is None else -self.height_m if self.kind == "pothole" else self.height_m
        length = math.inf if self.length_m is None else self.length_m
        skew = math.tan(self.angle_rad)
        numbers = (_SHAPES[self.kind], self.start_m, length, height, right, left, self.edge_m, skew, float(self.waves))
        return np.array([numbers], OBSTACLE)
