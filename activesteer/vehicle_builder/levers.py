"""Springs and dampers on an arm: links have no body, so the lever of the arm goes into the tendon.

A massless arm that turns about its inner bushings carries a force f at P as a force r f at its outer joint O, with r =
|PH| / |OH|. H is the point where the line through O and P meets the axis of the arm; the chassis carries the rest of f.
The tendon therefore ends at O, begins at a point 1/r times as far from O as the upper spring end from P, and runs
through a pulley of 1/r. By similar triangles it has the length of the spring in every position of the arm. A foot P
beside the plane of the arm has the right length and motion ratio at the design position, but does not turn with the
arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from activesteer.conventions import Array
from activesteer.errors import ParameterError
from activesteer.vehicle_builder.axle_kinds import AxleKind

_MIN_LEVER, _MAX_LEVER = 0.05, 1.5
"""Smallest and largest lever of a spring of a car."""


@dataclass(frozen=True)
class Mount:
    """Attachment of a spring or damper.

    Attributes:
        carrier: Carrier of its lower end.
        lever: Force at the outer joint of the arm, or along the wheel travel, per force of the spring; 1 on the
            knuckle.
        outer: Site at which the tendon ends, without the corner.
        start_m: Start of the tendon on the chassis; None if it lies along a strut or acts along the travel.
        length_m: Length in the design position; 0 along a strut.
    """

    carrier: str
    lever: float
    outer: str
    start_m: Array | None
    length_m: float


def mount(axle: str, part: str, carrier: str, kind: AxleKind, points: dict[str, Array], ratio: float = 1.0) -> Mount:
    """Attach a spring or damper."""
    if carrier in ("strut", "travel"):
        return Mount(carrier, 1.0 if carrier == "strut" else ratio, "", None, 0.0)
    upper, lower = points[f"{part}_inner"], points[f"{part}_outer"]
    length = float(np.linalg.norm(upper - lower))
    if length < 0.02:
        raise ParameterError(
            f"is {1e3 * length:.1f} mm from {part}_outer, too short for a {part}", key=f"{axle}.points.{part}_inner"
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
    """Return the shortening of a spring per travel of the arm's outer joint along it, at the design position."""
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
