"""A lane on the road, laid out by the manoeuvre and evaluated by the analysis."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Lane(NamedTuple):
    """A section between two rows of cones, along the world's x.

    Attributes:
        name: Its name.
        start_x_m: Its start [m].
        end_x_m: Its end [m].
        right_y_m: Its right edge [m].
        left_y_m: Its left edge [m].
    """

    name: str
    start_x_m: float
    end_x_m: float
    right_y_m: float
    left_y_m: float

    def outline_m(self) -> NDArray[np.float64]:
        """Return its corners as a closed line: world x and y [m], shape (5, 2)."""
        (start, end), (right, left) = self[1:3], self[3:]
        return np.array([(start, right), (end, right), (end, left), (start, left), (start, right)])
