"""The kinds of axles: their hardpoints, and the links between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from activesteer.errors import ParameterError, nearest_names


@dataclass(frozen=True)
class LinkKind:
    """One link between chassis (or rack) and knuckle, with its default elasticity."""

    name: str
    inner: str
    """Point on the chassis, or on the rack."""
    outer: str
    """Point on the knuckle; the two links of an arm share it."""
    stiffness_Npm: float
    """Rod and both bushings in series, unloaded [N/m]."""
    hardening_Npm3: float
    """Cubic part of the force [N/m3]."""
    damping_Nspm: float
    """Damping of the rubber [N s/m]."""
    reason: str
    """Meaning of the default."""


@dataclass(frozen=True)
class AxleKind:
    """One kind of suspension.

    Attributes:
        name: Name in a table.
        axles: Axles that can have it, `front` or `rear`.
        links: Its links.
        points: Points needed in addition to the ends of the links.
        carriers: Possible carriers of a spring or damper: `strut`, `knuckle`, the `travel` of the wheel itself, or an
            arm (name to its inner points) of one or two links.
        spring_on: Default carrier of the spring.
    """

    name: str
    axles: tuple[str, ...]
    links: tuple[LinkKind, ...]
    points: tuple[str, ...]
    carriers: dict[str, tuple[str, ...]]
    spring_on: str

    @property
    def strut(self) -> bool:
        """The knuckle slides on a strut."""
        return self.spring_on == "strut"

    @property
    def guided(self) -> bool:
        """Curves guide the wheel."""
        return self.spring_on == "travel"

    @property
    def needed(self) -> tuple[str, ...]:
        """All points that a table has to give, in the order of the messages."""
        ends = [point for link in self.links for point in (link.inner, link.outer)]
        return tuple(dict.fromkeys((*self.points, *ends)))

    @property
    def arms(self) -> dict[str, tuple[tuple[str, ...], str]]:
        """Swinging parts: name -> inner points (one or two) and outer point."""
        arms = {}
        for name, inner in self.carriers.items():
            if inner:
                outer = next(link.outer for link in self.links if link.inner == inner[0])
                arms[name] = (inner, outer)
        return arms


def _link(name: str, stiffness: float, hardening: float, damping: float, reason: str, outer: str = "") -> LinkKind:
    return LinkKind(name, f"{name}_inner", outer or f"{name}_outer", stiffness, hardening, damping, reason)


_SPRINGS: Final = ("spring_inner", "spring_outer", "damper_inner", "damper_outer")
_HANDLING, _COMFORT = "two hard handling bushings", "a hard and a soft comfort bushing, hardening"
_ROD: Final = "rod, ball joints, and the rubber mounts of rack and subframe"
_TIE_ROD: Final = _link("tie_rod", 1e6, 0.0, 3000.0, _ROD)
_TOE_LINK: Final = _link("toe_link", 1.64e6, 0.0, 3000.0, "two bushings of 3.3 kN/mm")
_TRAILING: Final = "two soft comfort bushings, hardening"

MCPHERSON: Final = AxleKind(
    "mcpherson",
    ("front",),
    (
        _link("lca_front", 8.5e6, 0.0, 3000.0, _HANDLING, "lca_outer"),
        _link("lca_rear", 1e6, 8e9, 2000.0, _COMFORT, "lca_outer"),
        _link("tie_rod", 1.2e6, 0.0, 3000.0, _ROD),
    ),
    ("wheel_centre", "strut_top", "strut_bottom"),
    {"strut": ()},
    "strut",
)

_WISHBONES: Final = (
    _link("uca_front", 5e6, 0.0, 3000.0, _HANDLING, "uca_outer"),
    _link("uca_rear", 5e6, 0.0, 3000.0, _HANDLING, "uca_outer"),
    _link("lca_front", 8.5e6, 0.0, 3000.0, _HANDLING, "lca_outer"),
    _link("lca_rear", 2e6, 8e9, 2000.0, _COMFORT, "lca_outer"),
)
_ARMS: Final = {
    "knuckle": (),
    "lca": ("lca_front_inner", "lca_rear_inner"),
    "uca": ("uca_front_inner", "uca_rear_inner"),
}
DOUBLE_WISHBONE: Final = AxleKind(
    "double_wishbone", ("front",), (*_WISHBONES, _TIE_ROD), ("wheel_centre", *_SPRINGS), _ARMS, "lca"
)
DOUBLE_WISHBONE_REAR: Final = AxleKind(
    "double_wishbone", ("rear",), (*_WISHBONES, _TOE_LINK), ("wheel_centre", *_SPRINGS), _ARMS, "lca"
)
FIVE_LINK: Final = AxleKind(
    "five_link",
    ("rear",),
    (
        _link("spring_link", 5.2e6, 0.0, 3000.0, _HANDLING),
        _TOE_LINK,
        _link("camber_link", 5.7e6, 0.0, 3000.0, _HANDLING),
        _link("trailing_lower", 2.4e5, 3e9, 1500.0, _TRAILING),
        _link("trailing_upper", 2.5e5, 3e9, 1500.0, _TRAILING),
    ),
    ("wheel_centre", *_SPRINGS),
    {"knuckle": (), "spring_link": ("spring_link_inner",)},
    "knuckle",
)
MULTILINK: Final = AxleKind(
    "multilink",
    ("rear",),
    (
        _link("upper_front", 5e6, 0.0, 3000.0, _HANDLING, "upper_outer"),
        _link("upper_rear", 5e6, 0.0, 3000.0, _HANDLING, "upper_outer"),
        _link("lateral_link", 5.2e6, 0.0, 3000.0, _HANDLING),
        _link("trailing_link", 5e5, 3e9, 1500.0, _TRAILING),
        _TOE_LINK,
    ),
    ("wheel_centre", *_SPRINGS),
    {
        "knuckle": (),
        "lateral_link": ("lateral_link_inner",),
        "trailing_link": ("trailing_link_inner",),
        "upper": ("upper_front_inner", "upper_rear_inner"),
    },
    "knuckle",
)

CURVES: Final = AxleKind("curves", ("front", "rear"), (), ("wheel_centre",), {"travel": ()}, "travel")
"""Measurements of a K&C rig guide the wheel instead of links; springs and dampers act along its travel."""

KINDS: Final = (MCPHERSON, DOUBLE_WISHBONE, DOUBLE_WISHBONE_REAR, FIVE_LINK, MULTILINK, CURVES)
DEFAULTS: Final = {"front": "mcpherson", "rear": "five_link"}


def kinds_for(axle: str) -> dict[str, AxleKind]:
    """Return the kinds of suspension of a front or rear axle by name."""
    return {kind.name: kind for kind in KINDS if axle in kind.axles}


def kind_of(axle: str, name: str) -> AxleKind:
    """Return a kind of suspension."""
    kinds = kinds_for(axle)
    if name not in kinds:
        raise ParameterError(f"no {axle} suspension is named {name!r}; {nearest_names(name, kinds)}", value=name)
    return kinds[name]
