"""Heights of an uneven road on an even grid."""

from __future__ import annotations

from typing import NamedTuple

from activesteer.conventions import Array


class Grid(NamedTuple):
    """Heights over distance along the road and distance to the left.

    Attributes:
        s_m: First distance along the road [m].
        step_s_m: Distance of the rows [m].
        d_m: First distance to the left [m].
        step_d_m: Distance of the columns [m].
        z_m: Heights [m], shape (rows, columns), at least two of each.
    """

    s_m: float
    step_s_m: float
    d_m: float
    step_d_m: float
    z_m: Array
