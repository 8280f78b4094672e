"""Height grids of a road, rough roads of ISO 8608, and single obstacles.

The spectrum of the height along a track is Gd(n) = Gd(n0) (n/n0)^-2 with n0 = 0.1 cycles/m. The surface is isotropic:
it has this spectrum in every direction. So two tracks at the distance d have the coherence function

    gamma(n, d) = x K1(x),        x = 2 pi n d,

the cross spectrum of an isotropic surface with that exponent over the spectrum of a track. Each frequency gets the
Cholesky factor of its matrix of coherence times independent normal amplitudes.

Sources: ISO 8608:2016, annex C (classes, geometric means); Kamash and Robson, The application of isotropy in road
surface modelling, Journal of Sound and Vibration 57 (1978).
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range
from activesteer.core.conventions import Array
from activesteer.errors import ManeuverError
from activesteer.native.records import numbers_type


class Grid(NamedTuple):
    """Grid of heights [m] at even distances along the road (rows) and to the left of its middle line (columns)."""

    s_m: float
    step_s_m: float
    d_m: float
    step_d_m: float
    z_m: Array

    @property
    def s(self) -> Array:
        """Distances of the rows [m]."""
        return self.s_m + self.step_s_m * np.arange(self.z_m.shape[0])

    @property
    def d(self) -> Array:
        """Distances of the columns [m]."""
        return self.d_m + self.step_d_m * np.arange(self.z_m.shape[1])

    def knows(self, s_m: Array, d_m: Array) -> NDArray[np.bool_]:
        """Return the mask of the positions within the grid."""
        along, across = (s_m - self.s_m) / self.step_s_m, (d_m - self.d_m) / self.step_d_m
        rows, columns = self.z_m.shape
        return (along >= 0.0) & (along <= rows - 1) & (across >= 0.0) & (across <= columns - 1)


def summed(fine: Grid, other: Grid) -> Grid:
    """Return the sum of two grids, sampled at the steps of the first. Beyond its edges, each grid is constant."""
    first = min(0, round((other.s_m - fine.s_m) / fine.step_s_m))
    last = max(fine.z_m.shape[0], round((other.s[-1] - fine.s_m) / fine.step_s_m) + 1)
    s = fine.s_m + fine.step_s_m * np.arange(first, last)
    rows = np.clip(np.arange(first, last), 0, fine.z_m.shape[0] - 1)
    across = np.array([np.interp(fine.d, other.d, row) for row in other.z_m])
    more = np.column_stack([np.interp(s, other.s, column) for column in across.T])
    return fine._replace(s_m=float(s[0]), z_m=fine.z_m[rows] + more)


Side = Literal["both", "left", "right"]
Height = Annotated[float, Range(0.0, 2.0)]

COSINE_BUMP, PLATEAU, CROSS_SLOPE, SINE = 0.0, 1.0, 2.0, 3.0
_SHAPES: Final = {
    "cosine_bump": COSINE_BUMP, "cleat": PLATEAU, "kerb": PLATEAU, "pothole": PLATEAU,
    "cross_slope_ramp": CROSS_SLOPE, "sine_wave": SINE,
}  # fmt: skip
Kind = Literal["cosine_bump", "cleat", "kerb", "pothole", "cross_slope_ramp", "sine_wave"]
SIDES: Final = {"both": (-math.inf, math.inf), "left": (0.0, math.inf), "right": (-math.inf, 0.0)}
"""Right and left border of each side [m]."""
FIRST_START_M: Final = 2.0
"""Smallest distance of an obstacle from the start [m]: the front wheels are about 1.3 m ahead of the origin."""
_LONG_M: Final = 1.5
"""Length from which a smooth obstacle hardly bends within the contact patch [m]: ten patches of 0.15 m."""

OBSTACLE: Final = numbers_type(
    "shape", "start_m", "length_m", "height_m", "right_m", "left_m", "edge_m", "skew", "waves"
)  # fmt: skip
"""An obstacle for the kernels. See `height_of`. `skew`: metres by which it begins earlier per metre to the left."""


@dataclass(frozen=True)
class Obstacle:
    """An obstacle, as a table [[road.obstacle]]."""

    kind: Kind
    """`cosine_bump`: h/2 (1 - cos(2 pi x/L)). `cleat`, `kerb`: a step of `height_m` with edges of `edge_m`. `pothole`:
    the same downwards. `cross_slope_ramp`: the road tilts about its middle to `slope` within `length_m` and stays so.
    `sine_wave`: h sin(2 pi x/L), growing over the first wave."""
    start_m: Annotated[float, Range(FIRST_START_M)]
    """Distance from the start of the manoeuvre, along x or along the path [m]."""
    length_m: Annotated[float, Range(1e-3)] | None = None
    """Length [m]. Wavelength of a `sine_wave`. Length over which a `cross_slope_ramp` reaches its slope. A `kerb`
    without a length has no end."""
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
    at a shallow angle, by the left wheels first."""
    edge_m: Annotated[float, Range(1e-3, 1.0)] = 0.01
    """Length over which the edges of a `cleat`, `kerb` or `pothole` rise [m]."""
    slope: Annotated[float, Range(-0.5, 0.5)] | None = None
    """Cross slope that a `cross_slope_ramp` reaches, rise to the left over run [-]."""
    waves: Annotated[int, Range(0, 100_000)] = 0
    """Number of waves of a `sine_wave`, or 0 for no end."""

    def __post_init__(self) -> None:
        """Check that all required keys are given and that no key is without effect."""
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
            raise ManeuverError(
                f"left_m, {left:g} m, must be greater than right_m, {right:g} m: positions count to the left"
            )
        if steep and self.length_m is not None and self.length_m < 2.0 * self.edge_m:
            raise ManeuverError(
                f"is {self.length_m:g} m; it must exceed two edges of edge_m = {self.edge_m:g} m", key="length_m"
            )

    @property
    def borders(self) -> tuple[float, float]:
        """Right and left border [m], infinite where none is given."""
        right, left = SIDES[self.side]
        return (right if self.right_m is None else self.right_m), (left if self.left_m is None else self.left_m)

    @property
    def is_smooth(self) -> bool:
        """True if the obstacle is smooth within the contact patch, so that one contact point is enough."""
        return _SHAPES[self.kind] != PLATEAU and self.length_m is not None and self.length_m >= _LONG_M

    def record(self) -> Any:
        """Return the obstacle as an `OBSTACLE` record for the kernels."""
        right, left = self.borders
        height = self.slope if self.height_m is None else -self.height_m if self.kind == "pothole" else self.height_m
        length = math.inf if self.length_m is None else self.length_m
        skew = math.tan(self.angle_rad)
        numbers = (_SHAPES[self.kind], self.start_m, length, height, right, left, self.edge_m, skew, float(self.waves))
        return np.array([numbers], OBSTACLE)


REFERENCE_1PM: Final = 0.1
"""Spatial frequency at which the classes are defined [cycles/m]."""
CLASSES: Final = {"A": 16e-6, "B": 64e-6, "C": 256e-6, "D": 1024e-6, "E": 4096e-6}
"""Geometric mean of the displacement spectrum at `REFERENCE_1PM`, for each class [m3]."""
STEP_M: Final = 0.05
"""Distance of the rows [m]."""
_ACROSS_M: Final = 0.2
"""Distance of the columns [m]."""
_CHUNK: Final = 1000
_NUGGET: Final = 1e-10
"""Number added to the diagonal, so that long waves, which all tracks share, keep a Cholesky factor."""


@dataclass(frozen=True)
class Roughness:
    """A random rough surface, as the table [road.roughness]."""

    OVERRULED: ClassVar = {"class_": {"spectrum_m3": None}}

    class_: Literal["A", "B", "C", "D", "E"] = "C"
    """Class of ISO 8608. The surface has the geometric mean of the class. The key in a file is `class`."""
    seed: Annotated[int, Range(0, 2**31)] = 1
    """Number of the surface: the same seed gives the same surface."""
    spectrum_m3: Annotated[float, Range(1e-9, 1e-1)] | None = None
    """Displacement spectrum at 0.1 cycles/m, instead of a class [m3]."""
    length_m: Annotated[float, Range(20.0, 20_000.0)] = 1000.0
    """Length of the surface [m]."""
    width_m: Annotated[float, Range(1.0, 20.0)] = 8.0
    """Width of the surface [m]."""
    least_1pm: Annotated[float, Range(1e-4, 1.0)] = 0.01
    """Lowest spatial frequency [cycles/m]. Longer waves are left out."""
    greatest_1pm: Annotated[float, Range(0.1, 10.0)] = 4.0
    """Highest spatial frequency [cycles/m]; the tyre absorbs shorter waves."""

    def __post_init__(self) -> None:
        """Check that the band of spatial frequencies is not empty."""
        if not max(self.least_1pm, 1.0 / self.length_m) < self.greatest_1pm:
            needed = f"above least_1pm, {self.least_1pm:g}, and 1/length_m, {1.0 / self.length_m:.3g}"
            raise ManeuverError(f"is {self.greatest_1pm:g}; it must be {needed}", key="greatest_1pm")

    def grid(self) -> Grid:
        """Return the grid of heights."""
        return _grid(self)


@functools.lru_cache(maxsize=4)
def _grid(it: Roughness) -> Grid:
    count = 2 * round(0.5 * it.length_m / STEP_M)
    columns = 2 * max(1, round(0.5 * it.width_m / _ACROSS_M)) + 1
    across = it.width_m / (columns - 1)
    frequency = np.arange(count // 2 + 1) / (count * STEP_M)
    inside = np.flatnonzero((frequency >= it.least_1pm) & (frequency <= it.greatest_1pm))
    random = np.random.default_rng(it.seed)
    lines = np.zeros((columns, count // 2 + 1), np.complex128)
    level_m3 = CLASSES[it.class_] if it.spectrum_m3 is None else it.spectrum_m3
    for part in np.array_split(inside, math.ceil(inside.size / _CHUNK)):
        n = frequency[part]
        level = np.sqrt(level_m3 * (n / REFERENCE_1PM) ** -2.0 / (count * STEP_M))
        normal = random.standard_normal((part.size, columns, 2)) @ np.array([1.0, 1j])
        factor = np.linalg.cholesky(_coherence(n, across * np.arange(columns, dtype=np.float64)))
        lines[:, part] = (level[:, None] * np.einsum("fij,fj->fi", factor, normal)).T
    heights = np.fft.irfft(0.5 * count * lines, count, axis=1).T
    return Grid(0.0, STEP_M, -0.5 * it.width_m, across, np.ascontiguousarray(heights))


def _coherence(frequency_1pm: Array, distances_m: Array) -> Array:
    """Return the coherence functions of tracks at even distances, shape (frequencies, tracks, tracks)."""
    from scipy.special import k1  # noqa: PLC0415 - slow to import, and needed for few roads

    x = 2.0 * math.pi * frequency_1pm[:, None] * distances_m[None, 1:]
    row = np.concatenate([np.full((len(x), 1), 1.0 + _NUGGET), x * k1(x)], axis=1)
    places = np.arange(row.shape[1])
    return row[:, np.abs(places[:, None] - places[None, :])]
