"""Axes, signs and orders of the whole package.

SI units and radians are used everywhere inside it.

Axes follow ISO 8855: x forward, y left, z up; a left turn, a left steer and a left yaw are positive.
Roll is positive to the right (rotation about +x), pitch is positive nose down (rotation about +y).

The vehicle axis system of the models has its origin on the road below the middle of the front axle in the
design position; the rear axle is at x = -wheelbase. Results are given for the centre of gravity (the site `cg`).

Tyre quantities use the ISO-W wheel axis system at the contact point: x along the wheel's heading, y to its
left, z normal to the road. A slip angle > 0 gives a lateral force < 0; a slip ratio > 0 drives.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import cycle
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Array of float64, of any shape."""

CORNERS: Final = ("fl", "fr", "rl", "rr")
"""Corner names in the order of every per-corner array: front left, front right, rear left, rear right."""

GRAVITY_MPS2: Final = 9.81
"""Gravitational acceleration [m/s2]."""

DEFAULT_TIMESTEP_S: Final = 0.001
"""Step of the engine and of the control loop [s]."""
CURVE_STEP_S: Final = 0.02
"""Time between two values of a channel that a study keeps over time [s]: enough for a plot."""

SYSTEM_LABELS: Final = {"none": "1 no control", "ars": "2 active rear steering", "afs": "3 active front steering"}
"""Labels of the three systems, numbered as in the paper's figures."""

RUN_COLOURS: Final = ("#333333", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00")
"""Colours of the three systems, then of other runs, distinguishable by colour-blind readers (Okabe and Ito, 2008)."""
RUN_COLOURS_ON_DARK: Final = ("#c9ccd1", "#f0843c", "#4aa8e0", "#2bbd8e", "#e39cc4", "#f0b429")
"""The same hues for a dark background."""
RUN_DASHES: Final = ((), (7.0, 2.0), (7.0, 1.5, 1.5, 1.5), (3.0, 1.5), (10.0, 3.0), (1.5, 1.0))
"""Dashes and gaps of their curves, in line widths: they distinguish curves in grey and show the curve below."""


class RunLook(NamedTuple):
    """Appearance of a run in all figures.

    Attributes:
        label: Label of its curve.
        place: Place of its colour in `RUN_COLOURS`.
        dashes: Dashes and gaps of its curve, in line widths; empty for a full line.
    """

    label: str
    place: int
    dashes: tuple[float, ...]

    @property
    def colour(self) -> str:
        """Colour on a light background, `#rrggbb`."""
        return RUN_COLOURS[self.place]

    @property
    def on_dark(self) -> str:
        """Colour on a dark background."""
        return RUN_COLOURS_ON_DARK[self.place]


def run_looks(names: Iterable[str]) -> dict[str, RunLook]:
    """Assign a look to each of several runs that are shown together.

    Args:
        names: Names of the runs; `none`, `ars` and `afs` are the three systems.

    Returns:
        Looks by name, in drawing order: the systems in the paper's order, always in the same colours, then the others.
        Another run takes a system's colour only if all others are used up and that system is not shown. Next to other
        runs, the systems also have their short names.
    """
    given = list(dict.fromkeys(names))
    known = [name for name in SYSTEM_LABELS if name in given]
    others = [name for name in given if name not in SYSTEM_LABELS]
    places = {name: place for place, name in enumerate(SYSTEM_LABELS)}
    spare = [*range(len(places), len(RUN_COLOURS)), *(places[name] for name in SYSTEM_LABELS if name not in given)]
    places |= dict(zip(others, cycle(spare), strict=False))
    dashes = dict(zip(known + others, cycle(RUN_DASHES), strict=False))
    labels = {} if others else SYSTEM_LABELS
    return {name: RunLook(labels.get(name, name), places[name], dashes[name]) for name in known + others}


def yaw_of(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the yaw angle of a body, the heading of its x axis in the road plane.

    Args:
        quaternions: Orientations w x y z, of length 1, shape (..., 4).

    Returns:
        Angle [rad], left positive, shape (...).
    """
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    return np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
