"""Rough roads of ISO 8608: a random surface with the displacement spectrum of a class.

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
from typing import Annotated, ClassVar, Final, Literal

import numpy as np

from activesteer.config import Range
from activesteer.conventions import Array
from activesteer.errors import ManeuverError
from activesteer.road.grid import Grid

REFERENCE_1PM: Final = 0.1
"""Spatial frequency at which the classes are defined [cycles/m]."""
CLASSES: Final = {"A": 16e-6, "B": 64e-6, "C": 256e-6, "D": 1024e-6, "E": 4096e-6}
"""Class -> geometric mean of the displacement spectrum at `REFERENCE_1PM` [m3]."""
STEP_M: Final = 0.05
"""Distance of the rows [m]."""
_ACROSS_M: Final = 0.2
"""Distance of the columns [m]."""
_CHUNK: Final = 1000
_NUGGET: Final = 1e-10
"""Added to the diagonal, so that long waves, which all tracks share, keep a Cholesky factor."""


@dataclass(frozen=True)
class Roughness:
    """A random rough surface; keys of the table [road.roughness]."""

    OVERRULED: ClassVar = {"class_": {"spectrum_m3": None}}

    class_: Literal["A", "B", "C", "D", "E"] = "C"
    """Class of ISO 8608, of which the surface has the geometric mean; the key in a file is `class`."""
    seed: Annotated[int, Range(0, 2**31)] = 1
    """Number of the surface: the same seed gives the same surface."""
    spectrum_m3: Annotated[float, Range(1e-9, 1e-1)] | None = None
    """Displacement spectrum at 0.1 cycles/m, instead of a class [m3]."""
    length_m: Annotated[float, Range(20.0, 20_000.0)] = 1000.0
    """Length of the surface [m]."""
    width_m: Annotated[float, Range(1.0, 20.0)] = 8.0
    """Width of the surface [m]."""
    least_1pm: Annotated[float, Range(1e-4, 1.0)] = 0.01
    """Lowest spatial frequency [cycles/m]; longer waves are left out."""
    greatest_1pm: Annotated[float, Range(0.1, 10.0)] = 4.0
    """Highest spatial frequency [cycles/m]; the tyre swallows shorter waves."""

    def __post_init__(self) -> None:
        """Check the band."""
        if not max(self.least_1pm, 1.0 / self.length_m) < self.greatest_1pm:
            raise ManeuverError(f"is {self.greatest_1pm:g}, not above least_1pm and 1/length_m", key="greatest_1pm")

    @property
    def level_m3(self) -> float:
        """Displacement spectrum at `REFERENCE_1PM` [m3]."""
        return CLASSES[self.class_] if self.spectrum_m3 is None else self.spectrum_m3

    def grid(self) -> Grid:
        """Return the surface."""
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
    for part in np.array_split(inside, math.ceil(inside.size / _CHUNK)):
        n = frequency[part]
        level = np.sqrt(it.level_m3 * (n / REFERENCE_1PM) ** -2.0 / (count * STEP_M))
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
