"""Colours as numbers."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import Array

_ASPHALT: Final = np.array((88.0, 90.0, 94.0))
_ABOVE: Final = np.array((228.0, 190.0, 120.0))
_BELOW: Final = np.array((40.0, 62.0, 120.0))


def bytes_of(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue of `#rrggbb`, 0 to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def shares_of(colour: str) -> tuple[float, float, float]:
    """Return red, green and blue of `#rrggbb`, 0 to 1."""
    red, green, blue = bytes_of(colour)
    return red / 255.0, green / 255.0, blue / 255.0


def height_colours(heights_m: Array) -> NDArray[np.uint8]:
    """Return colours of heights, shape (n, 3): asphalt at 0, lighter and warmer above, darker and bluer below.

    The scale ends at the largest height, at least 20 mm.
    """
    share = heights_m / max(0.02, float(np.abs(heights_m).max(initial=0.0)))
    above, below = np.clip(share, 0.0, 1.0)[:, None], np.clip(-share, 0.0, 1.0)[:, None]
    colours = _ASPHALT + above * (_ABOVE - _ASPHALT) + below * (_BELOW - _ASPHALT)
    return np.round(colours).astype(np.uint8)
