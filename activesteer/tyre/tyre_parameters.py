"""Parameters of a tyre, their conventions, and a check that the forces are finite.

A .tir file holds coefficients, not a program. The defaults are the conventions of this package. The alternatives are
the conventions of other codes, so that a car can be compared with a car of such a code, force by force.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Final, Literal

import numpy as np

from activesteer.config import Range
from activesteer.errors import ParameterError, nearest_names
from activesteer.native.compilation import compiled
from activesteer.native.records import numbers_type
from activesteer.tyre.file.syntax import BY_NAME, COEFFICIENTS
from activesteer.tyre.kernels.contact import tyre_on_road
from activesteer.tyre.kernels.magic_formula import (
    FORCE_COLUMNS,
    INPUT_COLUMNS,
    ROLLING_COLUMNS,
    evaluate_rows,
    rolling_rows,
)


@dataclass(frozen=True)
class TyreConventions:
    """Conventions for a tyre's coefficients, as the table [tyres.conventions] of a vehicle file."""

    camber: bool = True
    """True if camber enters the formula. Without it, camber still acts by geometry: contact point and direction of
    forces."""
    relaxation: bool = True
    """True if slip builds up over the relaxation length. Without it, forces follow slip within 20 mm of road, except at
    walking speed, where the standing tyre needs its carcass."""
    combined_slip: Literal["weights", "friction_ellipse"] = "weights"
    """`weights`: the cosine functions of the formula, which are 1 without R.. coefficients in the file;
    `friction_ellipse`: longitudinal and lateral force scaled down to an ellipse by the ratio of the slips."""
    friction_scales: Literal["formula", "peaks"] = "formula"
    """Effect of the road's friction. `formula`: it scales all that LMUX and LMUY scale. `peaks`: it scales the peaks
    D_x and D_y only, not shifts, trail and residual moment."""
    slip_velocity: Literal["contact_point", "wheel_centre"] = "contact_point"
    """Point whose lateral velocity is the slip: `contact_point` (with a part from the camber rate) or `wheel_centre`.
    """
    rolling_radius: Literal["file", "third_of_deflection"] = "file"
    """Effective rolling radius. `file`: from BREFF, DREFF, FREFF. `third_of_deflection`: R_0 minus a third of the
    deflection."""
    trail_load: Literal["nominal", "scaled"] = "nominal"
    """Reference load of the pneumatic trail. `nominal`: FNOMIN. `scaled`: LFZO FNOMIN."""
    speed_offset_mps: Annotated[float, Range(0.0, 1.0)] = 0.0
    """Speed added to the divisor of slip velocities [m/s], against division by zero; 0.1 m/s makes slips 0.45 % smaller
    at 80 km/h."""
    reference_friction: Annotated[float, Range(0.1, 2.0)] = 1.0
    """Friction of the road to which the file's peaks belong. The road's friction is divided by it [-]."""

    def numbers(self) -> dict[str, float]:
        """Numbers of a tyre for the kernels, by field of its record."""
        return {
            "CAMBER_OFF": float(not self.camber),
            "RELAXATION_OFF": float(not self.relaxation),
            "FRICTION_ELLIPSE": float(self.combined_slip == "friction_ellipse"),
            "SCALE_PEAKS_ONLY": float(self.friction_scales == "peaks"),
            "SLIP_AT_CENTRE": float(self.slip_velocity == "wheel_centre"),
            "RADIUS_BY_DEFLECTION": float(self.rolling_radius == "third_of_deflection"),
            "TRAIL_BY_SCALED_LOAD": float(self.trail_load == "scaled"),
            "SPEED_OFFSET": self.speed_offset_mps,
            "REFERENCE_FRICTION": self.reference_friction,
        }


_MAX_FORCE: Final = 1e12
"""Bound of all results of a tyre [N, Nm, m ...]; beyond it, the engine's state soon overflows too."""
_ENORMOUS: Final = 1e7
"""Bound of all coefficients of a tyre in SI: pressures and stiffnesses are about 1e6."""
_TURN_SLIP_1PM: Final = 0.1
_MF52: Final = 52.0

_WORKED_OUT: Final = (
    "MF_VERSION",  # 52, 60, 61 or 62
    "SLIP_TANGENT",  # 0: alpha* = alpha and gamma* = gamma; 1: alpha* = tan(alpha) and gamma* = sin(gamma)
    "SIDE",  # +1: mounted on the side of the file; -1: on the other side, everything mirrored
    "PTX_GIVEN",  # 1 where the file gives PTX1 (MF 5.2 relaxation length of Fx)
    "PTY_GIVEN",  # 1 where the file gives PTY1 (MF 5.2 relaxation length of Fy)
    "Q_RA_GIVEN",  # 1 where the file gives the contact length
    "Q_RB_GIVEN",  # 1 where the file gives the contact width
)
"""Fields that no file holds. `TyreParameters.record` sets them."""

_FIELDS: Final = (*(coefficient.name for coefficient in COEFFICIENTS), *_WORKED_OUT, *TyreConventions().numbers())

TYRE_RECORD: Final = numbers_type(*_FIELDS)
"""Coefficients in the order of their table, derived fields, and the conventions."""


def is_finite(tyre: np.record) -> bool:
    """Return whether forces, radii and relaxation lengths are finite over the tyre's ranges."""
    return _is_finite(np.atleast_1d(tyre).tobytes())


def culprit(tyre: np.record, names: Iterable[str]) -> str | None:
    """Return the extremely large coefficient that alone makes the forces infinite, or None if there is none."""
    enormous = (name for name in names if abs(tyre[name]) > _ENORMOUS)
    for name in sorted(enormous, key=lambda name: -abs(tyre[name])):
        tried = np.atleast_1d(tyre).copy()
        tried[name] = BY_NAME[name].default if BY_NAME[name].default is not None else 1.0
        if is_finite(tried[0]):
            return name
    return None


@lru_cache(maxsize=64)
def _is_finite(record: bytes) -> bool:
    tyre = np.frombuffer(record, TYRE_RECORD)
    inputs = _operating_points(tyre[0])
    forces = np.empty((len(inputs), len(FORCE_COLUMNS)))
    rolling = np.empty((len(inputs), len(ROLLING_COLUMNS)))
    evaluate_rows(tyre, inputs, forces, np.empty(len(inputs), np.int64))
    rolling_rows(tyre, inputs, forces, rolling)
    driven = np.array([_on_road(tyre, *point) for point in _motions(tyre[0])])
    return all(bool((np.abs(values) < _MAX_FORCE).all()) for values in (forces, rolling, driven))


@compiled
def _on_road(tyre, deflection_m, camber_rad, speed_mps, slip, across_mps, closing_mps):
    """Evaluate the tyre as the engine does, without relaxation states."""
    p = tyre[0]
    cos, sin = math.cos(camber_rad), math.sin(camber_rad)
    spin = (1.0 + slip) * speed_mps / p.UNLOADED_RADIUS
    return tyre_on_road(
        p, 1.0, p.INFLPRES, 2.0, 1500.0, 0.001, (p.UNLOADED_RADIUS - deflection_m) * cos, 0.0, cos, sin,
        speed_mps, across_mps, -closing_mps, 0.0, spin * cos, spin * sin, 0.01, 0.01, 0.01,
    )  # fmt: skip


def _motions(p: np.record) -> Iterator[tuple[float, ...]]:
    """Yield states of wheels that stand, roll, slide and fall, under a small and a large deflection."""
    height = p.UNLOADED_RADIUS - p.RIM_RADIUS
    return product(
        (0.02 * height, 0.3 * height),
        (p.CAMMIN, 0.0, p.CAMMAX),
        (0.0, 1.0, p.LONGVL),
        (-0.5, 0.0),
        (0.0, 2.0),
        (0.0, 1.0),
    )


def _operating_points(p: np.record) -> np.ndarray:
    """Return corners, centre and intermediate points of the ranges of a tyre file."""
    loads = {max(p.FZMIN, 0.01 * p.FZMAX), min(max(p.FNOMIN, p.FZMIN), p.FZMAX), p.FZMAX}
    slips, angles = (
        (low, 0.1 * low, 0.0, 0.1 * high, high) for low, high in ((p.KPUMIN, p.KPUMAX), (p.ALPMIN, p.ALPMAX))
    )
    turn = 0.0 if p.MF_VERSION == _MF52 else _TURN_SLIP_1PM
    return np.array(
        [
            (load, slip, angle, camber, pressure, speed, 1.0, turn_slip)
            for load, slip, angle, camber, pressure, (speed, turn_slip) in product(
                sorted(loads), slips, angles, (p.CAMMIN, 0.0, p.CAMMAX), (p.PRESMIN, p.INFLPRES, p.PRESMAX),
                ((p.LONGVL, 0.0), (0.0, turn)),
            )
        ]
    ).reshape(-1, len(INPUT_COLUMNS))  # fmt: skip


DEFAULT_PRESSURE_PA = 220_000.0
DEFAULT_LONGITUDINAL_STIFFNESS_NPM = 300_000.0
DEFAULT_LATERAL_STIFFNESS_NPM = 100_000.0

Side = Literal["LEFT", "RIGHT"]

_MF_VERSIONS = {5: 52, 6: 52, 21: 52, 52: 52, 60: 60, 61: 61, 62: 62}
_POSITIVE = (
    "UNLOADED_RADIUS", "FNOMIN", "LONGVL", "NOMPRES", "INFLPRES", "PRESMIN", "WIDTH", "VERTICAL_STIFFNESS", "PCX1",
    "PCY1", "PKY2", "LFZO", "LONGITUDINAL_STIFFNESS", "LATERAL_STIFFNESS", "RIM_RADIUS", "FZMAX", "PTY2", "LCZ",
)  # fmt: skip
_RANGES = (("PRESMIN", "PRESMAX"), ("FZMIN", "FZMAX"), ("KPUMIN", "KPUMAX"), ("ALPMIN", "ALPMAX"), ("CAMMIN", "CAMMAX"))


@dataclass(frozen=True)
class TyreParameters(Mapping[str, float]):
    """Coefficients of one tyre, in SI and radians.

    A read-only mapping from key to value, defaults included.

    Attributes:
        given: Values in the file, by key in upper case, in SI.
        source: The file; None without one.
        side: Side of the vehicle that the coefficients belong to.
        mounted: Side of the vehicle that the tyre is mounted on; on the other side everything is mirrored.
        slip_tangent: True for alpha* = tan(alpha) and gamma* = sin(gamma), False for the angles themselves.
        texts: Values of the file that are words, by (section, key).
        unused: Numbers of the file that no formula of the package uses, by (section, key).
        tables: Rows of numbers, by section.
        conventions: Choices that the file leaves to the program.
    """

    given: Mapping[str, float]
    source: Path | None = None
    side: Side = "LEFT"
    mounted: Side = "LEFT"
    slip_tangent: bool = False
    texts: Mapping[tuple[str, str], str] = field(default_factory=dict)
    unused: Mapping[tuple[str, str], float] = field(default_factory=dict)
    tables: Mapping[str, tuple[tuple[float, ...], ...]] = field(default_factory=dict)
    conventions: TyreConventions = TyreConventions()

    def __post_init__(self) -> None:
        """Check the values, and derive missing ones."""
        source = str(self.source or "tyre")
        values = _resolve(self.given, source)
        object.__setattr__(self, "_values", MappingProxyType(values))
        record = self.record
        if not is_finite(record):
            name = culprit(record, self.given)
            blamed = "the tyre is" if name is None else f"is {values[name]:g} and makes forces that are"
            raise ParameterError(
                f"{blamed} not finite inside the file's own ranges of load and slip",
                file=source,
                key=name,
                value=None if name is None else values[name],
            )

    def __reduce__(self) -> tuple[type[TyreParameters], tuple[object, ...]]:
        """Pickle the tyre by its constructor's arguments, since read-only views cannot be copied."""
        texts, unused, tables = dict(self.texts), dict(self.unused), dict(self.tables)
        made_from = (dict(self.given), self.source, self.side, self.mounted, self.slip_tangent, texts, unused, tables)
        return TyreParameters, (*made_from, self.conventions)

    @property
    def version(self) -> int:
        """Version of the formula: 52, 60, 61 or 62."""
        return _MF_VERSIONS[int(self["FITTYP"])]

    @property
    def record(self) -> np.record:
        """Return a new `TYRE_RECORD` for the kernels."""
        record = np.zeros(1, TYRE_RECORD)[0]
        for coefficient in COEFFICIENTS:
            record[coefficient.name] = self[coefficient.name]
        record["MF_VERSION"] = self.version
        record["SLIP_TANGENT"] = self.slip_tangent
        record["SIDE"] = 1.0 if self.mounted == self.side else -1.0
        record["PTX_GIVEN"] = self.version == 52 and "PTX1" in self.given
        record["PTY_GIVEN"] = self.version == 52 and "PTY1" in self.given
        record["Q_RA_GIVEN"] = "Q_RA1" in self.given or "Q_RA2" in self.given
        record["Q_RB_GIVEN"] = "Q_RB1" in self.given or "Q_RB2" in self.given
        for name, number in self.conventions.numbers().items():
            record[name] = number
        for name in ("VERTICAL_STIFFNESS", "Q_FZ1", "Q_FZ2", "Q_FZ3"):
            record[name] = self[name] * self["LCZ"]
        return record

    def mounted_on(self, side: Side) -> TyreParameters:
        """Return the tyre for a side of the vehicle, mirrored if its coefficients belong to the other side."""
        if side not in ("LEFT", "RIGHT"):
            raise ParameterError(f"is {side!r}; allowed: 'LEFT' and 'RIGHT'", key="side", value=side)
        return replace(self, mounted=side)

    def with_values(self, **changes: float) -> TyreParameters:
        """Return a copy with other values of some keys, in SI.

        Raises:
            ParameterError: a key does not exist, or a value is not allowed.
        """
        return replace(self, given={**self.given, **changes})

    def __getitem__(self, key: str) -> float:
        """Return the value of a key in SI, from the file or by default."""
        values: Mapping[str, float] = self.__dict__["_values"]
        try:
            return values[key]
        except KeyError:
            raise ParameterError(
                f"there is no tyre coefficient {key!r}: {nearest_names(key, values)}", value=key
            ) from None

    def __iter__(self) -> Iterator[str]:
        """Iterate over every key, in the order of the table."""
        return iter(BY_NAME)

    def __len__(self) -> int:
        """Return the number of keys."""
        return len(BY_NAME)

    def __contains__(self, key: object) -> bool:
        """Return whether the key exists."""
        return key in BY_NAME


def _resolve(given: Mapping[str, float], source: str) -> dict[str, float]:
    """Return every coefficient as given, by default, or from the quantity that replaces it."""

    def fail(key: str, value: float, problem: str) -> ParameterError:
        return ParameterError(f"is {value:g}; {problem}", file=source, key=key, value=value)

    for key, value in given.items():
        if key not in BY_NAME:
            raise ParameterError(
                f"is not a tyre coefficient; {nearest_names(key, BY_NAME)}", file=source, key=key, value=key
            )
        if not math.isfinite(value):
            raise fail(key, value, "must be finite")
    if missing := [each.name for each in COEFFICIENTS if each.required and each.name not in given]:
        needed = "it" if len(missing) == 1 else "them"
        raise ParameterError(f"missing; a tyre needs {needed}", file=source, key=", ".join(missing))
    values = {each.name: float(given.get(each.name, each.default or 0.0)) for each in COEFFICIENTS}
    if values["FITTYP"] not in _MF_VERSIONS:
        raise fail("FITTYP", values["FITTYP"], f"allowed: {', '.join(str(version) for version in _MF_VERSIONS)}")
    _fill(values, given, source)
    for key in _POSITIVE:
        if not (value := values[key]) > 0.0:
            raise fail(key, value, "must be greater than 0")
    for low, high in _RANGES:
        if not values[low] < values[high]:
            raise fail(low, values[low], f"must be less than {high}, {values[high]:g}")
    for key in ("VXLOW", "FZMIN"):
        if (value := values[key]) < 0.0:
            raise fail(key, value, "must not be negative")
    return values


def _fill(values: dict[str, float], given: Mapping[str, float], source: str) -> None:
    """Compute the coefficients that have no fixed default."""
    pressure = given.get("NOMPRES", given.get("INFLPRES", DEFAULT_PRESSURE_PA))
    stand_ins = {
        "NOMPRES": pressure,
        "INFLPRES": pressure,
        "FZMAX": 2.5 * values["FNOMIN"],
        "RIM_RADIUS": 0.6 * values["UNLOADED_RADIUS"],
        "LONGITUDINAL_STIFFNESS": DEFAULT_LONGITUDINAL_STIFFNESS_NPM,
        "LATERAL_STIFFNESS": DEFAULT_LATERAL_STIFFNESS_NPM,
    }
    for key, value in stand_ins.items():
        if key not in given:
            values[key] = value
    # Stiffness at the nominal load and the coefficients of force over deflection are equivalent (Besselink 2010, 4).
    r0, fz0 = values["UNLOADED_RADIUS"], values["FNOMIN"]
    if not (r0 > 0.0 and fz0 > 0.0):
        return
    if "Q_FZ1" not in given or values["Q_FZ1"] == 0.0:
        if "VERTICAL_STIFFNESS" not in given:
            raise ParameterError("missing; a tyre needs one of them", file=source, key="VERTICAL_STIFFNESS, Q_FZ1")
        relative = values["VERTICAL_STIFFNESS"] * r0 / fz0
        square = relative * relative - 4.0 * values["Q_FZ2"]
        if not square > 0.0:
            problem = (
                f"is {values['Q_FZ2']:g}; with VERTICAL_STIFFNESS {values['VERTICAL_STIFFNESS']:g} N/m it must be "
                f"below {relative * relative / 4.0:g}"
            )
            raise ParameterError(problem, file=source, key="Q_FZ2", value=values["Q_FZ2"])
        values["Q_FZ1"] = math.sqrt(square)
    elif "VERTICAL_STIFFNESS" not in given:
        square = values["Q_FZ1"] * values["Q_FZ1"] + 4.0 * values["Q_FZ2"]
        values["VERTICAL_STIFFNESS"] = fz0 / r0 * math.sqrt(max(square, 0.0))
    if not (math.isfinite(values["Q_FZ1"]) and math.isfinite(values["VERTICAL_STIFFNESS"])):
        raise ParameterError("is not finite, or Q_FZ1 or Q_FZ2 is not", file=source, key="VERTICAL_STIFFNESS")
