"""A lane on the road: laid out by the manoeuvre, looked at by the analysis."""

from __future__ import annotations

from typing import NamedTuple


class Lane(NamedTuple):
    """A section between two rows of cones, along the world's x.

    Attributes:
        name: What it is called.
        start_x_m: Where it begins [m].
        end_x_m: Where it ends [m].
        right_y_m: Its right edge [m].
        left_y_m: Its left edge [m].
    """

    name: str
    start_x_m: float
    end_x_m: float
    right_y_m: float
    left_y_m: float
