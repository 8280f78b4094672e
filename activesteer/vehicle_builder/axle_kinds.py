"""Kinds of axles, and the levers of their springs and dampers.

A massless arm that turns about its inner bushings carries a force f at P as a force r f at its outer joint O, with r =
|PH| / |OH|. H is the point where the line through O and P meets the axis of the arm; the chassis carries the rest of f.
The tendon therefore ends at O, begins at a point 1/r times as far from O as the upper spring end from P, and runs
through a pulley of 1/r. By similar triangles it has the length of the spring in every position of the arm. A foot P off
the plane of the arm has the right length and motion ratio at the design position, but does not turn with the arm.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from activesteer.config import read_toml
from activesteer.core.conventions import Array
from activesteer.errors import ParameterError, nearest_names


@dataclass(frozen=True)
class LinkKind:
    """Link between chassis (or rack) and knuckle of the left side, with its elasticity."""

    name: str
    inner: str  # point on the chassis, or on the rack
    outer: str  # point on the knuckle; the two links of an arm share it
    stiffness_Npm: float  # rod and both bushings in series, unloaded [N/m]
    hardening_Npm3: float  # cubic part of the force [N/m3]
    damping_Nspm: float  # damping of the rubber [N s/m]
    reason: str  # meaning or source of these values


@dataclass(frozen=True)
class AxleKind:
    """A kind of suspension, with its links and points."""

    name: str
    axles: Sequence[str]  # that can have it
    links: tuple[LinkKind, ...]
    points: Sequence[str]  # in addition to the ends of the links
    # Of a spring or damper: `strut`, `knuckle`, the `travel` of the wheel, or an arm with its one or two inner points.
    carriers: Mapping[str, Sequence[str]]
    spring_on: str  # default carrier of the spring

    @property
    def strut(self) -> bool:
        """True if the knuckle slides on a strut."""
        return self.spring_on == "strut"

    @property
    def guided(self) -> bool:
        """True if curves guide the wheel."""
        return self.spring_on == "travel"

    @property
    def needed(self) -> tuple[str, ...]:
        """All required points of the axle, in the order of the messages."""
        ends = [point for link in self.links for point in (link.inner, link.outer)]
        return tuple(dict.fromkeys((*self.points, *ends)))

    @property
    def arms(self) -> dict[str, tuple[Sequence[str], str]]:
        """Arms by name, each with its inner points (one or two) and its outer point."""
        arms = {}
        for name, inner in self.carriers.items():
            if inner:
                outer = next(link.outer for link in self.links if link.inner == inner[0])
                arms[name] = (inner, outer)
        return arms


def _read() -> Iterator[AxleKind]:
    for table in read_toml(Path(__file__).with_name("axle_kinds.toml"))[0]["kind"]:
        links = tuple(
            LinkKind(name, f"{name}_inner", **({"outer": f"{name}_outer", "hardening_Npm3": 0.0} | link))
            for name, link in table.pop("links", {}).items()
        )
        yield AxleKind(links=links, **table)


KINDS: Final = tuple(_read())
DEFAULTS: Final = {"front": "mcpherson", "rear": "five_link"}


def kind_of(axle: str, name: str) -> AxleKind:
    """Return a kind of suspension."""
    kinds = {kind.name: kind for kind in KINDS if axle in kind.axles}
    if name not in kinds:
        raise ParameterError(f"no {axle} suspension is named {name!r}; {nearest_names(name, kinds)}", value=name)
    return kinds[name]


_MIN_LEVER, _MAX_LEVER = 0.05, 1.5
"""Smallest and largest lever of a spring of a car."""


@dataclass(frozen=True)
class Mount:
    """Attachment of a spring or damper."""

    carrier: str  # of its lower end
    lever: float  # force at the arm's outer joint, or along the wheel travel, per force of the spring; 1 on the knuckle
    outer: str  # site at which the tendon ends, without the corner
    start_m: Array | None  # start of the tendon on the chassis; None along a strut or along the travel
    length_m: float  # in the design position; 0 along a strut

    @property
    def on_arm(self) -> bool:
        """True if the tendon ends at the outer joint of an arm."""
        return self.start_m is not None and self.lever != 1.0


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
            f"is at {lever:.2f} of the length of {carrier}, seen from its inner end; a {part} on an arm is between "
            f"{_MIN_LEVER:g} and {_MAX_LEVER:g}. Is {part}_on right, and {part}_outer on the left side?",
            key=f"{axle}.points.{part}_outer",
        )
    return Mount(carrier, lever, outer, points[outer] + (upper - lower) / lever, length)


def _lever(inner: list[Array], outer: Array, foot: Array, along: Array) -> float:
    """Return the motion ratio of a spring: compression per travel of the arm's outer joint, at the design position."""
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
