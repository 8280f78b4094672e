"""Cars that are drawn transparent beside another one."""

from __future__ import annotations

from typing import Final

import numpy as np

from activesteer.conventions import Array

_HIDDEN_M: Final = 0.2
_SEEN_M: Final = 1.0


def share_seen(apart_m: Array | float) -> Array:
    """Return the fraction of a ghost's opacity: it fades between 1 m and 0.2 m from the car and vanishes below.

    Two surfaces in one place would show through each other in patches.

    Args:
        apart_m: Distance between the chassis of ghost and car [m].

    Returns:
        Fraction, 0 to 1.
    """
    return np.clip((apart_m - _HIDDEN_M) / (_SEEN_M - _HIDDEN_M), 0.0, 1.0)
