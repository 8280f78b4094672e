"""Parameters with every value changed."""

from __future__ import annotations

import dataclasses
import typing
from typing import Any, Final

from activesteer.config import Range, dataclass_in
from activesteer.vehicle.electric_actuators import Motor, Motors
from tests.unit.vehicle_builder.other_curves import other_curves

_WORDS: Final = {
    "combined_slip": "friction_ellipse", "friction_scales": "peaks", "slip_velocity": "wheel_centre",
    "rolling_radius": "third_of_deflection", "trail_load": "scaled", "source": "identified",
}  # fmt: skip
"""Texts that are one of some words."""
_MOTOR: Final = Motor(
    (0.0, 100.0, 300.0), (40.0, 30.0, 5.0), 4e3, 7.0, 0.8, 12.0, 0.7, 0.03, 500.0, 0.02, "splitting", 60.0
)
_WHOLE: Final = {"curves": other_curves(), "motors": Motors(rear=_MOTOR)}
"""Tables whose values belong together."""


def all_changed(cls: type, given: Any) -> Any:
    """Return a dataclass with every field changed, down to the last table; arguments as in `other_values`."""
    return cls(**other_values(cls, given))


def other_values(cls: type, given: Any) -> dict[str, Any]:
    """Return another value for each field; they need not be consistent.

    Args:
        cls: The dataclass.
        given: One of it, or None.
    """
    hints = typing.get_type_hints(cls, include_extras=True)
    values = {
        field.name: _WHOLE.get(field.name)
        or _WORDS.get(field.name)
        or _other(hints[field.name], getattr(given, field.name, None))
        for field in dataclasses.fields(cls)
    }
    assert all(value != getattr(given, name, None) for name, value in values.items())
    return values


def _other(hint: Any, value: Any) -> Any:
    limits = Range()
    while typing.get_origin(hint) is not typing.Literal and type(None) in typing.get_args(hint):
        hint = typing.get_args(hint)[0]
    if typing.get_origin(hint) is typing.Annotated:
        hint, limits, *_ = typing.get_args(hint)
    if (inner := dataclass_in(hint)) is not None:
        return all_changed(inner, value)
    if typing.get_origin(hint) is typing.Literal:
        return next(word for word in typing.get_args(hint) if word not in (value, "hinge"))
    if typing.get_origin(hint) is tuple:
        return tuple(1.01 * item + 0.001 for item in value or (0.1, 0.2, 0.3))
    if hint is bool:
        return not value
    if hint is str:
        return f"other {value}"
    if value is None:
        value = 1.5 * limits.low if limits.low > 0.0 else min(0.01, limits.high)
    choices = (7, 8) if hint is int else (1.01 * value + 1e-3, 0.97 * value)
    return next(number for number in choices if number != value and limits.low <= number <= limits.high)
