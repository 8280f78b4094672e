"""What a metric is: a function with a name, a unit and the axles it is for; its docstring is its definition."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from activesteer.conventions import Array
from activesteer.rigs.kc.programme import Measured
from activesteer.rigs.kc.steering_axis import SteeringAxis
from activesteer.rigs.kc.sweep import Sweep
from activesteer.rigs.kc.tyre_stiffness import TyreStiffness

AxleName = Literal["front", "rear", "car"]

FRONT_AND_REAR: Final = ("front", "rear")
SMALL_TRAVEL_M: Final = 0.015
_SMALL: Final = {
    "parallel": SMALL_TRAVEL_M, "opposite": SMALL_TRAVEL_M, "lateral": 1000.0, "longitudinal": 1000.0,
    "aligning": 100.0,
}  # fmt: skip
"""First word of a sweep's name -> slopes are those of the straight line through the points within this of static ride:
travel [m], force [N] or moment [N m]."""


class Axle(NamedTuple):
    """One axle of the measured car; arrays of its two wheels are left, right."""

    name: AxleName
    measured: Measured

    @property
    def wheels(self) -> slice:
        """Columns of the per-corner arrays."""
        return {"front": slice(0, 2), "rear": slice(2, 4), "car": slice(0, 4)}[self.name]

    @property
    def axes(self) -> tuple[SteeringAxis, ...]:
        """Steering axes of both wheels."""
        return self.measured.axes[self.wheels]

    @property
    def tyre(self) -> TyreStiffness:
        """Stiffness of the tyres of this axle."""
        return self.measured.tyres[0 if self.name == "front" else 1]

    @property
    def load_N(self) -> Array:
        """Static wheel loads [N], shape (2,)."""
        return self.measured.static_load_N[self.wheels]

    @property
    def knuckles(self) -> tuple[str, str]:
        """Names of the knuckles' bodies."""
        return (f"{self.name[0]}l_knuckle", f"{self.name[0]}r_knuckle")

    def sweep(self, name: str) -> Sweep:
        """One of the rig's sweeps."""
        return self.measured.sweeps[name]

    def slope(self, sweep: str, values: Array, over: Array | None = None) -> Array:
        """Slope of each wheel around static ride, within 15 mm, 1 kN or 100 N m.

        Args:
            sweep: Name of the sweep.
            values: Its values, shape (n, 4).
            over: What to take the slope over, shape (n, 4); what was swept, where not given.

        Returns:
            Slopes of the axle's wheels, shape (2,).
        """
        x = self.sweep(sweep).x
        near = np.abs(x) <= _SMALL[sweep.split("_", maxsplit=1)[0]] * (1.0 + 1e-9)
        rows = values[near][:, self.wheels]
        base = np.repeat(x[near, None], rows.shape[1], axis=1) if over is None else over[near][:, self.wheels]
        base = base - base.mean(axis=0)
        return np.sum(base * (rows - rows.mean(axis=0)), axis=0) / np.sum(base * base, axis=0)

    def mean_slope(self, sweep: str, quantity: str, axis: int | None = None) -> float:
        """Mean of both wheels' slopes over what is swept.

        Args:
            sweep: Name of the sweep.
            quantity: One of the arrays of a `Sweep`.
            axis: Which coordinate of a point.
        """
        values = getattr(self.sweep(sweep), quantity)
        return float(self.slope(sweep, values if axis is None else values[..., axis]).mean())


Evaluate = Callable[[Axle], float]


@dataclass(frozen=True)
class Definition:
    """A metric's definition.

    Attributes:
        name: Its name.
        unit: Its unit.
        axles: The axles it is given for.
        text: What it is: definition, sign, source.
        evaluate: Its value for one axle.
    """

    name: str
    unit: str
    axles: tuple[AxleName, ...]
    text: str
    evaluate: Evaluate


DEFINITIONS: Final[list[Definition]] = []
"""All metrics, in the order of the table."""


def metric(unit: str, *axles: AxleName) -> Callable[[Evaluate], Evaluate]:
    """Makes a function of an axle a metric, by its name and docstring.

    Args:
        unit: Unit of its value.
        axles: Axles it is given for; both where none is named.
    """

    def enter(function: Evaluate) -> Evaluate:
        name = getattr(function, "__name__", "")
        text = " ".join((inspect.getdoc(function) or "").split())
        DEFINITIONS.append(Definition(name, unit, axles or FRONT_AND_REAR, text, function))
        return function

    return enter
