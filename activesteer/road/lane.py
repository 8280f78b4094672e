"""A lane on the road: laid out by the manoeuvre, evaluated by the analysis."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


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

    def outline_m(self) -> NDArray[np.float64]:
        """Its corners, once round: world x and y [m], shape (5, 2)."""
        (start, end), (right, left) = self[1:3], self[3:]
        return np.array([(start, right), (end, right), (end, left), (start, left), (start, right)])
