"""Springs and dampers that stand on an arm: links have no body, so the arm's lever goes into the tendon.

A massless arm that turns about its inner bushings carries a force f at P as a force r f at its outer joint O, where
r = |PH| / |OH| and H is where the line through O and P meets the arm's axis; the rest of f goes into the chassis. The
tendon therefore runs from a point that is 1/r times as far from O as the spring's upper end is from P, to O, and
through a pulley of 1/r. By similar triangles its length is that of the spring, in every position of the arm. A foot P
beside the arm's plane has the right length and motion ratio at the design position, but does not turn with the arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ParameterError
from activesteer.vehicle_builder.axle_kinds import AxleKind

_MIN_LEVER, _MAX_LEVER = 0.05, 1.5
"""Levers beyond these are no springs of a car."""


@dataclass(frozen=True)
class Mount:
    """How a spring or damper is attached.

    Attributes:
        carrier: What carries its lower end.
        lever: Force at the arm's outer joint, or along the wheel's travel, per force of the spring; 1 on the knuckle.
        outer: Site at which the tendon ends, without the corner.
        start_m: Where the tendon begins on the chassis; None where it lies along a strut or acts along the travel.
        length_m: Its length in the design position; 0 along a strut.
    """

    carrier: str
    lever: float
    outer: str
    start_m: Array | None
    length_m: float


def mount(axle: str, part: str, carrier: str, kind: AxleKind, points: dict[str, Array], ratio: float = 1.0) -> Mount:
    """Attaches a spring or damper.

    Args:
        axle: For messages.
        part: `spring` or `damper`.
        carrier: What carries its lower end, one of the kind's carriers.
        kind: The suspension.
        points: Its points.
        ratio: Shortening per wheel travel, where it acts along that.

    Raises:
        ParameterError: the arm cannot carry it there.
    """
    if carrier in ("strut", "travel"):
        return Mount(carrier, 1.0 if carrier == "strut" else ratio, "", None, 0.0)
    upper, lower = points[f"{part}_inner"], points[f"{part}_outer"]
    length = float(np.linalg.norm(upper - lower))
    if length < 0.02:
        raise ParameterError(
            f"is {1e3 * length:.1f} mm from {part}_outer; a {part} needs length", key=f"{axle}.points.{part}_inner"
        )
    if carrier == "knuckle":
        return Mount(carrier, 1.0, f"{part}_outer", upper, length)
    inner, outer = kind.arms[carrier]
    lever = _lever([points[name] for name in inner], points[outer], lower, (upper - lower) / length)
    if not _MIN_LEVER < lever < _MAX_LEVER:
        raise ParameterError(
            f"lies at {lever:.2f} of the length of {carrier}, seen from its inner end; a {part} on an arm lies between "
            f"{_MIN_LEVER:g} and {_MAX_LEVER:g}. Is {part}_on right, and {part}_outer on the left side?",
            key=f"{axle}.points.{part}_outer",
        )
    return Mount(carrier, lever, outer, points[outer] + (upper - lower) / lever, length)


def _lever(inner: list[Array], outer: Array, foot: Array, along: Array) -> float:
    """Shortening of a spring per travel of the arm's outer joint along the spring, at the design position."""
    base = inner[0]
    if len(inner) == 1:
        rod = outer - base
        axis = np.cross(rod, [0.0, 0.0, 1.0])
    else:
        axis = inner[1] - base
    turned = np.cross(axis, outer - base)
    along_outer, along_foot = float(along @ turned), float(along @ np.cross(axis, foot - base))
    if abs(along_outer) < 1e-3 * float(np.linalg.norm(turned)):
        return float("nan")
    return along_foot / along_outer
