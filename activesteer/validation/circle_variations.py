"""Changes of a vehicle file whose axles are given by curves: without one effect, or with an open decision reversed.

`measured_circle` drives each variant, so the contribution of each effect to the predicted angle is known.
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
"""Height of the wheel centre: a side force at the road acts at the centre as the force and a moment about x."""


def _axle(table: Mapping[str, Any], axle: str, **changes: Any) -> dict[str, Any]:
    curves = table["curves"]
    return {**table, "curves": {**curves, axle: {**curves[axle], **changes}}}


def _over_travel(axle: str, curve: str, changed: Callable[[float, float], float]) -> Change:
    """Return a change that maps each value of a curve over travel; `changed` takes the value and the static value."""

    def change(table: Mapping[str, Any]) -> dict[str, Any]:
        given = table["curves"][axle]
        static = float(np.interp(0.0, given["travel_m"], given[curve]))
        return _axle(table, axle, **{curve: [changed(value, static) for value in given[curve]]})

    return change


def _flat(axle: str, curve: str) -> Change:
    """Return a change that holds a curve over travel at its static value."""
    return _over_travel(axle, curve, lambda _, static: static)


def _static(axle: str, curve: str) -> Change:
    """Return a change that shifts a curve over travel so that its static value is zero."""
    return _over_travel(axle, curve, lambda value, static: value - static)


def _compliance(axle: str, change: Callable[[Array], None]) -> Change:
    """Return a change of the linear compliance of an axle; its hardening is kept."""

    def changed(table: Mapping[str, Any]) -> dict[str, Any]:
        matrix = np.zeros((5, 5))
        matrix[_ENTRIES] = table["curves"][axle]["stiffness"]
        compliance = np.asarray(np.linalg.inv(matrix + np.triu(matrix, 1).T), np.float64)
        change(compliance)
        return _axle(table, axle, stiffness=list(upper_triangle(np.asarray(np.linalg.inv(compliance), np.float64))))

    return changed


def _toe_alone(compliance: Array) -> None:
    """Leave only the compliance of toe to aligning moment."""
    others = [index for index in range(5) if index != _TOE]
    compliance[_TOE, others] = compliance[others, _TOE] = 0.0


def _least_toe(compliance: Array) -> None:
    """Keep toe over side force, and reduce toe over aligning moment to the least value that allows."""
    others = [index for index in range(5) if index != _TOE]
    coupling = compliance[_TOE, others]
    least = float(coupling @ np.linalg.solve(compliance[np.ix_(others, others)], coupling))
    # Slightly above the bound of a positive definite matrix, and positive where side force has no effect.
    compliance[_TOE, _TOE] = max(1.05 * least, 1e-2 * compliance[_TOE, _TOE])


def _stiff_camber(compliance: Array) -> None:
    """Reduce the camber compliance to a thousandth; toe over a side force at the road is unchanged."""
    own, over_roll = compliance[_CAMBER, _CAMBER], compliance[_TOE, _CAMBER]
    compliance[_CAMBER, :] = compliance[:, _CAMBER] = 0.0
    compliance[_CAMBER, _CAMBER] = 1e-3 * own
    compliance[_TOE, _SIDE] += _RADIUS_M * over_roll
    compliance[_SIDE, _TOE] = compliance[_TOE, _SIDE]


def _turned_toe(compliance: Array) -> None:
    """Reverse the sign of toe over all forces."""
    compliance[_TOE, :] *= -1.0
    compliance[:, _TOE] *= -1.0


def ratio(factor: float) -> Change:
    """Return a change that multiplies the steer angle of the rack."""

    def change(table: Mapping[str, Any]) -> dict[str, Any]:
        steer = table["curves"]["front"]["rack_steer_deg"]
        return _axle(table, "front", rack_steer_deg=[factor * value for value in steer])

    return change


def _progressive(at_lock: float, lock_m: float) -> Change:
    """Return a change that multiplies the rack's steer angle; the factor rises from 1 at the centre to the lock."""

    def change(table: Mapping[str, Any]) -> dict[str, Any]:
        front = table["curves"]["front"]
        factors = 1.0 + (at_lock - 1.0) * np.abs(front["rack_m"]) / lock_m
        return _axle(table, "front", rack_steer_deg=list(factors * np.array(front["rack_steer_deg"])))

    return change


def combined(*changes: Change) -> Change:
    """Return a change that makes all of these."""

    def change(table: Mapping[str, Any]) -> dict[str, Any]:
        return functools.reduce(lambda result, each: each(result), changes, dict(table))

    return change


def _keys(section: str, **values: float) -> Change:
    return lambda table: {**table, section: {**table.get(section, {}), **values}}


_KERB: Final = 1.124
"""Factor on the steer angle. The maker's service manual (Technical Data) gives 2.45 turns from lock to lock, a circle
of 12.4 m between kerbs and a variable ratio. At 441 deg `isteerL` turns the outer wheel by 25.6 deg. That circle needs
asin(2.96 / (6.2 - 0.12)) = 29.1 deg, which is 12.4 % more of the mean angle, 28.5 deg."""
_LOCK_M: Final = 0.0577
"""Rack travel at the lock [m]: 441 deg at 7.5 mm of rack per radian."""

_TOE_EFFECTS: Final[dict[str, Change]] = {
    "roll steer, front": _flat("front", "toe_deg"),
    "roll steer, rear": _flat("rear", "toe_deg"),
    "toe over side force, front": _compliance("front", _toe_alone),
    "toe over side force, rear": _compliance("rear", _toe_alone),
    "toe over aligning moment, front (assumed)": _compliance("front", _least_toe),
    "toe over aligning moment, rear (assumed)": _compliance("rear", _least_toe),
}

EFFECTS: Final[dict[str, Change]] = {
    **_TOE_EFFECTS,
    "all six effects on toe": combined(*_TOE_EFFECTS.values()),
    "camber over side force, front": _compliance("front", _stiff_camber),
    "camber over side force, rear": _compliance("rear", _stiff_camber),
    "static camber, front": _static("front", "camber_deg"),
    "static camber, rear": _static("rear", "camber_deg"),
    "static toe, rear": _static("rear", "toe_deg"),
    "drive on the front wheels (assumed)": _keys("powertrain", front_fraction=0.0),
}
"""Effect -> change of the vehicle file that removes it."""

WITHOUT_ALIGNING: Final = combined(_compliance("front", _least_toe), _compliance("rear", _least_toe))
"""Change that removes the assumed compliance to aligning moment of both axles."""

DECISIONS: Final[dict[str, Change]] = {
    "no toe over aligning moment (assumed: the compact's)": WITHOUT_ALIGNING,
    "isteerR as given (used: the mirror image of isteerL)": ratio(0.5 * (0.0646 + 0.070055) / 0.0646),
    "isteer_skalar for both wheels (used: isteerL and its mirror image)": ratio(0.070055 / 0.0646),
    "steering ratio of the maker's circle between kerbs, everywhere": ratio(_KERB),
    "the same ratio at the lock, unchanged at the centre": _progressive(_KERB, _LOCK_M),
    "anti-roll bars twice as stiff (used: rate of an axle, like springs)": _keys("factors", anti_roll_bar=2.0),
    "springs and bars twice as stiff (used: rates of an axle)": _keys("factors", anti_roll_bar=2.0, spring_rate=2.0),
    "elkin_y_toe of the front axle reversed (used: toe-out)": _compliance("front", _turned_toe),
    "elkin_y_toe of both axles reversed (used: understeering)": combined(
        _compliance("front", _turned_toe), _compliance("rear", _turned_toe)
    ),
}
"""Open decision -> change of the vehicle file that reverses it."""
