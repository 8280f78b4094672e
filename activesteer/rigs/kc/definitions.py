"""A metric of the rig, and the axle from whose sweeps it is evaluated."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final, Literal, NamedTuple

import numpy as np

from activesteer.conventions import Array
from activesteer.rigs.kc.programme import Measured
from activesteer.rigs.kc.steering_axis import SteeringAxis
from activesteer.rigs.kc.sweep import Sweep
from activesteer.rigs.kc.tyre_stiffness import TyreStiffness

AxleName = Literal["front", "rear", "car"]

DEG: Final = math.degrees(1.0)
SMALL_TRAVEL_M: Final = 0.015
_SMALL: Final = {
    "parallel": SMALL_TRAVEL_M, "opposite": SMALL_TRAVEL_M, "lateral": 1000.0, "longitudinal": 1000.0,
    "aligning": 100.0,
}  # fmt: skip
"""First word of a sweep's name -> range about static ride in which a straight line gives the slopes: travel [m], force
[N] or moment [N m]."""


class Axle(NamedTuple):
    """One axle of the measured car; arrays of its wheels are in the order left, right."""

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

    def beside(self, name: AxleName) -> Axle:
        """Return another axle of the same car."""
        return Axle(name, self.measured)

    def sweep(self, name: str) -> Sweep:
        """Return a sweep of the rig."""
        return self.measured.sweeps[name]

    def slope(self, sweep: str, values: Array, over: Array | None = None) -> Array:
        """Return the slopes of the axle's wheels about static ride, within 15 mm, 1 kN or 100 N m, shape (2,).

        Args:
            sweep: Name of the sweep.
            values: Its values, shape (n, 4).
            over: Variable of the slope, shape (n, 4). Default: the variable of the sweep.
        """
        x = self.sweep(sweep).x
        near = np.abs(x) <= _SMALL[sweep.split("_", maxsplit=1)[0]] * (1.0 + 1e-9)
        rows = values[near][:, self.wheels]
        base = np.repeat(x[near, None], rows.shape[1], axis=1) if over is None else over[near][:, self.wheels]
        base = base - base.mean(axis=0)
        return np.sum(base * (rows - rows.mean(axis=0)), axis=0) / np.sum(base * base, axis=0)

    def mean_slope(self, sweep: str, quantity: str, axis: int | None = None) -> float:
        """Return the mean slope of both wheels over the variable of the sweep.

        Args:
            sweep: Name of the sweep.
            quantity: One of the arrays of a `Sweep`.
            axis: Coordinate of a point.
        """
        values = getattr(self.sweep(sweep), quantity)
        return float(self.slope(sweep, values if axis is None else values[..., axis]).mean())


Evaluate = Callable[[Axle], float]


def slope(sweep: str, quantity: str, factor: float = 1.0, axis: int | None = None) -> Evaluate:
    """Return the evaluation of `Axle.mean_slope`, times a factor."""
    return lambda axle: factor * axle.mean_slope(sweep, quantity, axis)


class Definition(NamedTuple):
    """A metric's definition.

    Attributes:
        name: Name.
        unit: Unit.
        evaluate: Function from an axle to its value.
        text: Definition, sign, source.
        axles: Axles that have the metric.
    """

    name: str
    unit: str
    evaluate: Evaluate
    text: str
    axles: tuple[AxleName, ...] = ("front", "rear")
