"""Curve axles: an axle described by the curves that a K&C rig measures, in place of links.

The wheel centre's height is free. Its other five coordinates (forwards, outwards, camber, caster, toe) follow curves
over the height and, at a steered axle, over the rack. Forces deflect the wheel from the curves against a 5 x 5
stiffness. Path and forces are consistent by virtual work: the slope of a curve passes part of the lateral force to the
springs, and the rack feels the trail. `native_curve_axle` has the forces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range
from activesteer.errors import ParameterError

COORDINATES: Final = ("x", "y", "camber", "caster", "toe")
"""Order of the five coordinates in every array: slides along x and y, hinges about x, y and z."""
OVER_TRAVEL: Final = ("forward_m", "outwards_m", "camber_rad", "caster_rad", "toe_rad")
OVER_RACK: Final = ("rack_forward_m", "rack_outwards_m", "rack_camber_rad", "rack_caster_rad", "rack_steer_rad")
"""Fields with the curves of these coordinates over the rack."""
_TRAVEL_SIGNS: Final = np.array([1.0, 1.0, -1.0, -1.0, -1.0])
_RACK_SIGNS: Final = np.array([1.0, 1.0, -1.0, -1.0, 1.0])
"""Signs from the file to the left wheel's joints, where camber and toe-in are negative rotations."""
_POINTS: Final = Range(5, 41)
_ENTRIES: Final = 15


@dataclass(frozen=True)
class AxleCurves:
    """The curves of one axle: left wheel, cubic splines through the points, straight beyond their ends."""

    travel_m: tuple[float, ...]
    """Height of the wheel centre above the design position, positive in bump, increasing [m]."""
    toe_rad: tuple[float, ...]
    """Toe angle of one wheel, positive toe-in, static toe included [rad]."""
    camber_rad: tuple[float, ...]
    """Camber, negative with the top inwards, static camber included [rad]."""
    outwards_m: tuple[float, ...]
    """Displacement of the wheel centre outwards: half of the track change at the wheel centres [m]."""
    forward_m: tuple[float, ...]
    """Displacement of the wheel centre forwards [m]."""
    caster_rad: tuple[float, ...]
    """Rotation of the knuckle in side view, positive with the top to the rear, from the design position [rad]."""
    load_N: tuple[float, ...]
    """Measured wheel load less the loads of spring, stops and anti-roll bar [N]."""
    stiffness: tuple[float, ...]
    """Stiffness of the left wheel at its centre, against forces along x and y and moments about x, y and z: upper
    triangle of the symmetric 5 x 5 matrix, row by row [N/m, N, N m/rad]."""
    hardening: tuple[float, ...] = ()
    """Directions a of additional hardening springs, none or two, five numbers each. A wheel displacement e lengthens
    such a spring by t = a . e, and the spring pushes back with a (s t2 + t3), as a soft bushing along a does."""
    hardening_square: tuple[float, ...] = (0.0, 0.0)
    """Coefficient s of both; it makes them softer to one side than to the other."""
    damping_ratio: Annotated[float, Range(0.0, 0.5)] = 0.2
    """Damping ratio of each mode of the wheel on the elastic part; rubber and joints of the compact have 0.1 to 0.35.
    """
    rack_m: tuple[float, ...] = ()
    """Travel of the rack, positive steers left, increasing; empty if the rack does not steer the axle [m]."""
    rack_steer_rad: tuple[float, ...] = ()
    """Steer angle of the left wheel from straight ahead, positive to the left [rad]."""
    rack_camber_rad: tuple[float, ...] = ()
    """Change of the left wheel's camber [rad]."""
    rack_outwards_m: tuple[float, ...] = ()
    """Displacement of the left wheel's centre outwards [m]."""
    rack_forward_m: tuple[float, ...] = ()
    """Displacement of the left wheel's centre forwards [m]."""
    rack_caster_rad: tuple[float, ...] = ()
    """Rotation of the left knuckle in side view [rad]."""

    def __post_init__(self) -> None:
        """Check lengths, order, and that the stiffness holds the wheel."""
        _check_curves(self, "travel_m", (*OVER_TRAVEL, "load_N"))
        if self.is_steered or any(getattr(self, name) for name in OVER_RACK):
            _check_curves(self, "rack_m", OVER_RACK)
        for name, counts in (("stiffness", (_ENTRIES,)), ("hardening", (0, 10)), ("hardening_square", (2,))):
            given = getattr(self, name)
            if len(given) not in counts:
                raise ParameterError(f"{len(given)} numbers given; {counts[-1]} are needed", key=name)
        least = float(np.linalg.eigvalsh(_scaled(self.stiffness_matrix())).min())
        if least <= 0.0:
            raise ParameterError(
                "does not hold the wheel: the matrix is not positive definite "
                f"(least eigenvalue {least:.3g} N/m with rotations at 0.3 m)",
                key="stiffness",
            )

    @property
    def is_steered(self) -> bool:
        """True if the rack steers the axle."""
        return bool(self.rack_m)

    def stiffness_matrix(self) -> NDArray[np.float64]:
        """Stiffness of the left wheel in the order of `COORDINATES`, shape (5, 5)."""
        matrix = np.zeros((5, 5))
        matrix[np.triu_indices(5)] = self.stiffness
        return matrix + np.triu(matrix, 1).T

    def over_travel(self) -> NDArray[np.float64]:
        """Return the left wheel's joints, and `load_N`, at the points of travel, shape (6, n)."""
        return np.array([*_joints(self, OVER_TRAVEL, _TRAVEL_SIGNS), self.load_N])

    def over_rack(self) -> NDArray[np.float64]:
        """Return the left wheel's joints at the points of the rack, shape (5, n)."""
        return np.array(_joints(self, OVER_RACK, _RACK_SIGNS))


def _joints(curves: AxleCurves, names: tuple[str, ...], signs: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    return [sign * np.array(getattr(curves, name)) for name, sign in zip(names, signs, strict=True)]


def _scaled(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Scale rotations by an arm of 0.3 m, so that all entries have one unit."""
    arms = np.array([1.0, 1.0, 0.3, 0.3, 0.3])
    return matrix / np.outer(arms, arms)


def upper_triangle(matrix: NDArray[np.float64]) -> tuple[float, ...]:
    """Return a symmetric 5 x 5 matrix in the form of `AxleCurves.stiffness`."""
    return tuple(float(f"{value:.7g}") for value in matrix[np.triu_indices(5)])


def _check_curves(curves: AxleCurves, over: str, names: tuple[str, ...]) -> None:
    points = np.array(getattr(curves, over))
    if not _POINTS.low <= len(points) <= _POINTS.high:
        raise ParameterError(f"{len(points)} points given; allowed are {_POINTS.low:g} to {_POINTS.high:g}", key=over)
    if not (np.diff(points) > 0.0).all():
        raise ParameterError("the points do not increase", key=over)
    if not points[0] < 0.0 < points[-1]:
        raise ParameterError(f"runs from {points[0]:g} to {points[-1]:g} m; it must contain 0", key=over)
    for name in names:
        if len(getattr(curves, name)) != len(points):
            raise ParameterError(f"{len(getattr(curves, name))} values for {len(points)} points of {over}", key=name)


@dataclass(frozen=True)
class Curves:
    """Curve axles of a car."""

    front: AxleCurves | None = None
    """The front axle; default the links of the model."""
    rear: AxleCurves | None = None
    """The rear axle; default the links of the model."""

    def __post_init__(self) -> None:
        """Check that the rack steers in front."""
        if self.front is not None and not self.front.is_steered:
            raise ParameterError("the rack must steer the front wheels: curves over rack_m are needed", key="front")
        if self.rear is not None and self.rear.is_steered:
            raise ParameterError("the rack steers the front wheels only", key="rear.rack_m")

    def axle(self, corner: str) -> AxleCurves | None:
        """Return the curves of a corner's axle."""
        return self.front if corner.startswith("f") else self.rear
