"""An axle guided by curves instead of links: what a K&C rig measures of it, as the vehicle file holds it.

The wheel centre's height is free. Its other five coordinates (forwards, outwards, camber, caster, toe) follow curves
over the height and, at a steered axle, over the rack; what forces add to that is elastic, with the energy of a 5 x 5
stiffness about the curves. So the path of the wheel and the forces belong together by themselves (virtual work): the
slope of a curve hands the side force to the springs, the rack feels the trail. `native_guide` has the forces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from activesteer.config import Range
from activesteer.errors import ParameterError

COORDINATES: Final = ("x", "y", "camber", "caster", "toe")
"""Order of the five guided coordinates in every array: slides along x and y, hinges about x, y and z."""
OVER_TRAVEL: Final = ("forward_m", "outwards_m", "camber_rad", "caster_rad", "toe_rad")
OVER_RACK: Final = ("rack_forward_m", "rack_outwards_m", "rack_camber_rad", "rack_caster_rad", "rack_steer_rad")
"""Fields with the curves of these coordinates."""
_TRAVEL_SIGNS: Final = np.array([1.0, 1.0, -1.0, -1.0, -1.0])
_RACK_SIGNS: Final = np.array([1.0, 1.0, -1.0, -1.0, 1.0])
"""From the signs of the file to those of the left wheel's joints: camber and toe-in are negative rotations there."""
_POINTS: Final = Range(5, 41)
_ENTRIES: Final = 15


@dataclass(frozen=True)
class AxleCurves:
    """The curves of one axle: left wheel, cubic splines through the points, straight beyond their ends."""

    travel_m: tuple[float, ...]
    """Height of the wheel centre over the design position, positive in bump, increasing [m]."""
    toe_rad: tuple[float, ...]
    """Toe angle of one wheel, positive toe-in, static toe included [rad]."""
    camber_rad: tuple[float, ...]
    """Camber, negative with the top inwards, static camber included [rad]."""
    outwards_m: tuple[float, ...]
    """Way of the wheel centre outwards: half of the track's change at the wheel centres [m]."""
    forward_m: tuple[float, ...]
    """Way of the wheel centre forwards [m]."""
    caster_rad: tuple[float, ...]
    """Rotation of the knuckle in side view, positive with the top to the rear, from the design position [rad]."""
    load_N: tuple[float, ...]
    """What the wheel carries beside its spring, its stops and the anti-roll bar: the rest of the measured load [N]."""
    stiffness: tuple[float, ...]
    """Of the left wheel at its centre, against forces along x and y and moments about x, y and z: upper triangle of the
    symmetric 5 x 5 matrix, row by row [N/m, N, N m/rad]."""
    hardening: tuple[float, ...] = ()
    """Springs that harden beside it, none or two: five numbers a each; such a spring is longer by t = a . e where the
    wheel is displaced by e, and pushes back with a (s t2 + t3), as a soft bushing along a does."""
    hardening_square: tuple[float, ...] = (0.0, 0.0)
    """s of both: it makes them softer to one side than to the other."""
    damping_ratio: Annotated[float, Range(0.0, 0.5)] = 0.2
    """Of each way in which the wheel swings on the elastic part; of rubber and joints in the compact 0.1 to 0.35."""
    rack_m: tuple[float, ...] = ()
    """Travel of the rack, positive steers left, increasing; none where the rack does not steer the axle [m]."""
    rack_steer_rad: tuple[float, ...] = ()
    """Steer angle of the left wheel from straight ahead, positive to the left [rad]."""
    rack_camber_rad: tuple[float, ...] = ()
    """Change of the left wheel's camber [rad]."""
    rack_outwards_m: tuple[float, ...] = ()
    """Way of the left wheel's centre outwards [m]."""
    rack_forward_m: tuple[float, ...] = ()
    """Way of the left wheel's centre forwards [m]."""
    rack_caster_rad: tuple[float, ...] = ()
    """Rotation of the left knuckle in side view [rad]."""

    def __post_init__(self) -> None:
        """Checks lengths, order, and that the stiffness holds the wheel.

        Raises:
            ParameterError: something does not fit.
        """
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
                "gives way without a force: the matrix is not positive definite "
                f"(least eigenvalue {least:.3g} N/m with rotations at 0.3 m)",
                key="stiffness",
            )

    @property
    def is_steered(self) -> bool:
        """Whether the rack steers the axle."""
        return bool(self.rack_m)

    def stiffness_matrix(self) -> NDArray[np.float64]:
        """The stiffness of the left wheel in the order of `COORDINATES`, shape (5, 5)."""
        matrix = np.zeros((5, 5))
        matrix[np.triu_indices(5)] = self.stiffness
        return matrix + np.triu(matrix, 1).T

    def over_travel(self) -> NDArray[np.float64]:
        """Left wheel's joints, and `load_N`, at the points of travel, shape (6, n)."""
        return np.array([*_joints(self, OVER_TRAVEL, _TRAVEL_SIGNS), self.load_N])

    def over_rack(self) -> NDArray[np.float64]:
        """Left wheel's joints at the points of the rack, shape (5, n)."""
        return np.array(_joints(self, OVER_RACK, _RACK_SIGNS))


def _joints(curves: AxleCurves, names: tuple[str, ...], signs: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    return [sign * np.array(getattr(curves, name)) for name, sign in zip(names, signs, strict=True)]


def _scaled(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """With rotations taken at an arm of 0.3 m, so that all entries are of one kind."""
    arms = np.array([1.0, 1.0, 0.3, 0.3, 0.3])
    return matrix / np.outer(arms, arms)


def upper_triangle(matrix: NDArray[np.float64]) -> tuple[float, ...]:
    """A symmetric 5 x 5 matrix as `AxleCurves.stiffness` has it."""
    return tuple(float(f"{value:.7g}") for value in matrix[np.triu_indices(5)])


def _check_curves(curves: AxleCurves, over: str, names: tuple[str, ...]) -> None:
    points = np.array(getattr(curves, over))
    if not _POINTS.low <= len(points) <= _POINTS.high:
        raise ParameterError(f"{len(points)} points given; allowed are {_POINTS.low:g} to {_POINTS.high:g}", key=over)
    if not (np.diff(points) > 0.0).all():
        raise ParameterError("the points do not increase", key=over)
    if not points[0] < 0.0 < points[-1]:
        raise ParameterError(f"runs from {points[0]:g} to {points[-1]:g} m; 0 has to lie inside", key=over)
    for name in names:
        if len(getattr(curves, name)) != len(points):
            raise ParameterError(f"{len(getattr(curves, name))} values for {len(points)} points of {over}", key=name)


@dataclass(frozen=True)
class Curves:
    """Axles that are guided by curves."""

    front: AxleCurves | None = None
    """The front axle; links of the model where not given."""
    rear: AxleCurves | None = None
    """The rear axle; links of the model where not given."""

    def __post_init__(self) -> None:
        """Checks that the rack steers in front.

        Raises:
            ParameterError: it does not.
        """
        if self.front is not None and not self.front.is_steered:
            raise ParameterError("the rack has to steer the front wheels: curves over rack_m are needed", key="front")
        if self.rear is not None and self.rear.is_steered:
            raise ParameterError("the rack steers the front wheels alone", key="rear.rack_m")

    def axle(self, corner: str) -> AxleCurves | None:
        """The curves of a corner's axle."""
        return self.front if corner.startswith("f") else self.rear
