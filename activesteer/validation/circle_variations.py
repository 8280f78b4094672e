"""A car of curves with one effect switched off, or with an open decision reversed: vehicle file -> vehicle file.

`measured_circle` drives each of them, so that every degree of the predicted angle has an owner.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from activesteer.conventions import Array
from activesteer.vehicle.axle_curves import COORDINATES, upper_triangle

Change = Callable[[Mapping[str, Any]], dict[str, Any]]
_TOE, _CAMBER, _SIDE = (COORDINATES.index(name) for name in ("toe", "camber", "y"))
_ENTRIES: Final = np.triu_indices(5)
_RADIUS_M: Final = 0.335
"""Height of the wheel centre: the lever of a side force at the road about x [m]."""


def _axle(table: Mapping[str, Any], axle: str, **changes: Any) -> dict[str, Any]:
    curves = table["curves"]
    return {**table, "curves": {**curves, axle: {**curves[axle], **changes}}}


def _over_travel(axle: str, curve: str, changed: Callable[[float, float], float]) -> Change:
    """Replace the values of a curve over travel by a function of the value and the static value."""

    def change(table: Mapping[str, Any]) -> dict[str, Any]:
        given = table["curves"][axle]
        static = float(np.interp(0.0, given["travel_m"], given[curve]))
        return _axle(table, axle, **{curve: [changed(value, static) for value in given[curve]]})

    return change


def _flat(axle: str, curve: str) -> Change:
    """A curve over travel stays at its static value."""
    return _over_travel(axle, curve, lambda _, static: static)


def _static(axle: str, curve: str) -> Change:
    """A curve over travel goes through zero."""
    return _over_travel(axle, curve, lambda value, static: value - static)


def _compliance(axle: str, change: Callable[[Array], None]) -> Change:
    """The linear part of what gives way is changed; what hardens stays."""

    def changed(table: Mapping[str, Any]) -> dict[str, Any]:
        matrix = np.zeros((5, 5))
        matrix[_ENTRIES] = table["curves"][axle]["stiffness"]
        compliance = np.asarray(np.linalg.inv(matrix + np.triu(matrix, 1).T), np.float64)
        change(compliance)
        return _axle(table, axle, stiffness=list(upper_triangle(np.asarray(np.linalg.inv(compliance), np.float64))))

    return changed


def _toe_alone(compliance: Array) -> None:
    """Toe gives way to aligning moment alone."""
    others = [index for index in range(5) if index != _TOE]
    compliance[_TOE, others] = compliance[others, _TOE] = 0.0


def _least_toe(compliance: Array) -> None:
    """Toe gives way to side force as it did, and to aligning moment no more than that needs."""
    others = [index for index in range(5) if index != _TOE]
    coupling = compliance[_TOE, others]
    least = float(coupling @ np.linalg.solve(compliance[np.ix_(others, others)], coupling))
    # A little more than what keeps the matrix positive, also where side force does nothing.
    compliance[_TOE, _TOE] = max(1.05 * least, 1e-2 * compliance[_TOE, _TOE])


def _stiff_camber(compliance: Array) -> None:
    """Camber gives way a thousandth as much; toe gives way to a side force at the road as it did."""
    own, over_roll = compliance[_CAMBER, _CAMBER], compliance[_TOE, _CAMBER]
    compliance[_CAMBER, :] = compliance[:, _CAMBER] = 0.0
    compliance[_CAMBER, _CAMBER] = 1e-3 * own
    compliance[_TOE, _SIDE] += _RADIUS_M * over_roll
    compliance[_SIDE, _TOE] = compliance[_TOE, _SIDE]


def _turned_toe(compliance: Array) -> None:
    """Side force turns the wheel the other way."""
    compliance[_TOE, :] *= -1.0
    compliance[:, _TOE] *= -1.0


def _ratio(factor: float) -> Change:
    """The rack steers more."""

    def change(table: Mapping[str, Any]) -> dict[str, Any]:
        steer = table["curves"]["front"]["rack_steer_deg"]
        return _axle(table, "front", rack_steer_deg=[factor * value for value in steer])

    return change


def _progressive(at_lock: float, lock_m: float) -> Change:
    """The rack steers as much at the centre, and more in proportion to its travel."""

    def change(table: Mapping[str, Any]) -> dict[str, Any]:
        front = table["curves"]["front"]
        factors = 1.0 + (at_lock - 1.0) * np.abs(front["rack_m"]) / lock_m
        return _axle(table, "front", rack_steer_deg=list(factors * np.array(front["rack_steer_deg"])))

    return change


def _both(*changes: Change) -> Change:
    def change(table: Mapping[str, Any]) -> dict[str, Any]:
        return functools.reduce(lambda result, each: each(result), changes, dict(table))

    return change


def _keys(section: str, **values: float) -> Change:
    return lambda table: {**table, section: {**table.get(section, {}), **values}}


_KERB: Final = 1.124
"""The maker's service manual (Technical Data) has 2.45 turns from lock to lock, a circle of 12.4 m between kerbs and a
variable ratio. At 441 deg `isteerL` turns the outer wheel by 25.6 deg; that circle asks for
asin(2.96 / (6.2 - 0.12)) = 29.1 deg, 12.4 % more of the mean angle, 28.5 deg."""
_LOCK_M: Final = 0.0577
"""441 deg at 7.5 mm of rack for one radian."""

_TOE_EFFECTS: Final[dict[str, Change]] = {
    "roll steer in front": _flat("front", "toe_deg"),
    "roll steer behind": _flat("rear", "toe_deg"),
    "toe over side force in front": _compliance("front", _toe_alone),
    "toe over side force behind": _compliance("rear", _toe_alone),
    "toe over aligning moment in front (assumed)": _compliance("front", _least_toe),
    "toe over aligning moment behind (assumed)": _compliance("rear", _least_toe),
}

EFFECTS: Final[dict[str, Change]] = {
    **_TOE_EFFECTS,
    "all six together": _both(*_TOE_EFFECTS.values()),
    "camber over side force in front": _compliance("front", _stiff_camber),
    "camber over side force behind": _compliance("rear", _stiff_camber),
    "static camber in front": _static("front", "camber_deg"),
    "static camber behind": _static("rear", "camber_deg"),
    "static toe behind": _static("rear", "toe_deg"),
    "drive on the front wheels (assumed)": _keys("powertrain", front_fraction=0.0),
}
"""Effect -> the vehicle file without it."""

_WITHOUT_ALIGNING: Final = _both(_compliance("front", _least_toe), _compliance("rear", _least_toe))

READINGS: Final[dict[str, Change]] = {
    "no compliance to aligning moment (assumed: as the compact's)": _WITHOUT_ALIGNING,
    "isteerR by the letter (read: the mirror image of isteerL)": _ratio(0.5 * (0.0646 + 0.070055) / 0.0646),
    "isteer_skalar for both wheels (read: isteerL and its mirror image)": _ratio(0.070055 / 0.0646),
    "as direct as the maker's circle between kerbs asks for, everywhere": _ratio(_KERB),
    "the same at the lock, growing from nothing at the centre": _progressive(_KERB, _LOCK_M),
    "anti-roll bars twice as stiff (read: of an axle, as the springs)": _keys("factors", anti_roll_bar=2.0),
    "springs and bars twice as stiff (read: of an axle)": _keys("factors", anti_roll_bar=2.0, spring_rate=2.0),
    "elkin_y_toe in front the other way round (read: toe-out)": _compliance("front", _turned_toe),
    "elkin_y_toe of both axles the other way round (read: understeering)": _both(
        _compliance("front", _turned_toe), _compliance("rear", _turned_toe)
    ),
}
"""Open decision -> the vehicle file with it turned over."""
