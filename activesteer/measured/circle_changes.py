"""Changes that a `validation.toml` declares: of keys of the car, of the circle, and of axles given by curves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, Literal, NamedTuple

import numpy as np

from activesteer.config import Range
from activesteer.core.conventions import Array
from activesteer.errors import ParameterError, nearest_names
from activesteer.vehicle.curve_axles import COORDINATES, upper_triangle

_TOE, _CAMBER, _SIDE = (COORDINATES.index(name) for name in ("toe", "camber", "y"))
_ENTRIES: Final = np.triu_indices(5)
_RADIUS_M: Final = 0.335
"""Height of the wheel centre: a side force at the road acts at the centre as the force and a moment about x."""


@dataclass(frozen=True)
class ChangeTable:
    """A change. The keys that are given act in this order."""

    without: tuple[str, ...] = ()
    """Effects to remove."""
    set: dict[str, Any] = field(default_factory=dict)
    """Key -> value, as `--set` has them."""
    add: dict[str, float] = field(default_factory=dict)
    """`radius_m` and `ay_mps2` of the circle, `zero_deg` of the steering wheel angle, or `body_roll` -> what is added.
    `body_roll` is the part of the body's roll angle by which the accelerometer tilts: 0 levelled, 1 on the body."""
    stiff_column: bool = False
    """Whether the steering column does not twist."""
    axle: Literal["front", "rear"] = "front"
    """The axle of the following keys."""
    hold: str = ""
    """Curve over travel to be held at its static value."""
    centre: str = ""
    """Curve over travel to be shifted so that its static value is zero."""
    steer: Annotated[float, Range(1e-3)] = 1.0
    """Factor on the steer angle of the rack."""
    steer_at_lock: Annotated[float, Range(1e-3)] | None = None
    """The factor at the lock. It changes in proportion to the rack travel."""
    lock_m: Annotated[float, Range(1e-3)] = 0.06
    """Rack travel at the lock [m]."""
    compliance: Literal["", "no_toe_by_force", "least_toe_by_moment", "no_camber", "reversed_toe"] = ""
    """Change of the linear compliance."""


class Case(NamedTuple):
    """A car on a circle."""

    vehicle: str  # name or path of the car
    # `radius_m` of the centre of gravity, measured `ay_mps2`, `zero_deg` and `body_roll`; see `ChangeTable`
    circle: dict[str, float]
    overrides: dict[str, Any]  # overrides of the car
    stiff_column: bool = False  # whether the angle is that of a column that does not twist

    def changed_by(self, change: ChangeTable, curves: Mapping[str, Any]) -> Case:
        """Return the case with a change, whose effects have been removed already."""
        if unknown := sorted(set(change.add) - set(self.circle)):
            raise ParameterError(
                f"the circle has no {unknown[0]}; {nearest_names(unknown[0], self.circle)}", value=unknown[0]
            )
        overrides = self.overrides | change.set
        of_file = curves.get(change.axle, {})

        def curve(name: str) -> Array:
            if name not in of_file:
                raise ParameterError(
                    f"curves.{change.axle} of {self.vehicle} has no {name}; {nearest_names(name, of_file)}"
                )
            return np.array(overrides.get(f"curves.{change.axle}.{name}", of_file[name]), np.float64)

        def put(name: str, values: Array) -> None:
            overrides[f"curves.{change.axle}.{name}"] = values.tolist()

        for name, held in ((change.hold, True), (change.centre, False)):
            if name:
                travel_m, values = curve("travel_m"), curve(name)
                if values.shape != travel_m.shape:
                    raise ParameterError(f"{name} is no curve over travel", value=name)
                static = float(np.interp(0.0, travel_m, values))
                put(name, np.full_like(values, static) if held else values - static)
        if change.steer != 1.0 or change.steer_at_lock is not None:
            end = change.steer if change.steer_at_lock is None else change.steer_at_lock
            factors = change.steer + (end - change.steer) * np.abs(curve("rack_m")) / change.lock_m
            put("rack_steer_deg", factors * curve("rack_steer_deg"))
        if change.compliance:
            matrix = np.zeros((5, 5))
            matrix[_ENTRIES] = curve("stiffness")
            compliance = np.asarray(np.linalg.inv(matrix + np.triu(matrix, 1).T), np.float64)
            _COMPLIANCES[change.compliance](compliance)
            put("stiffness", np.array(upper_triangle(np.asarray(np.linalg.inv(compliance), np.float64))))
        circle = {key: value + change.add.get(key, 0.0) for key, value in self.circle.items()}
        return Case(self.vehicle, circle, overrides, self.stiff_column or change.stiff_column)


def _no_toe_by_force(compliance: Array) -> None:
    """Leave only the compliance of toe to aligning moment."""
    others = [index for index in range(5) if index != _TOE]
    compliance[_TOE, others] = compliance[others, _TOE] = 0.0


def _least_toe_by_moment(compliance: Array) -> None:
    """Keep toe over side force, and reduce toe over aligning moment to the least value that allows."""
    others = [index for index in range(5) if index != _TOE]
    coupling = compliance[_TOE, others]
    least = float(coupling @ np.linalg.solve(compliance[np.ix_(others, others)], coupling))
    # Slightly above the bound of a positive definite matrix, and positive where side force has no effect.
    compliance[_TOE, _TOE] = max(1.05 * least, 1e-2 * compliance[_TOE, _TOE])


def _no_camber(compliance: Array) -> None:
    """Reduce the camber compliance to a thousandth. Toe over a side force at the road is unchanged."""
    own, over_roll = compliance[_CAMBER, _CAMBER], compliance[_TOE, _CAMBER]
    compliance[_CAMBER, :] = compliance[:, _CAMBER] = 0.0
    compliance[_CAMBER, _CAMBER] = 1e-3 * own
    compliance[_TOE, _SIDE] += _RADIUS_M * over_roll
    compliance[_SIDE, _TOE] = compliance[_TOE, _SIDE]


def _reversed_toe(compliance: Array) -> None:
    compliance[_TOE, :] *= -1.0
    compliance[:, _TOE] *= -1.0


_COMPLIANCES: Final = {
    "no_toe_by_force": _no_toe_by_force, "least_toe_by_moment": _least_toe_by_moment, "no_camber": _no_camber,
    "reversed_toe": _reversed_toe,
}  # fmt: skip
