"""The sliders of the page: keys of manoeuvre, road, car and controllers, with their ranges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Final, NamedTuple

from activesteer.config import Range, dataclass_in, field_in_unit, key_paths, spellings
from activesteer.config.keys import fields_of, hints_of
from activesteer.display_units import parameter_label
from activesteer.scenario import Scenario

_MANEUVER: Final = {
    "speed_kmh": (20.0, 160.0, 1.0),
    "road.mu": (0.1, 1.1, 0.01),
    "steer.lateral_acceleration_mps2": (0.5, 9.0, 0.1),
    "steer.amplitude_factor": (0.5, 8.0, 0.1),
    "cones.spacing_m": (20.0, 60.0, 0.5),
    "cones.offset_m": (0.5, 4.0, 0.05),
    "brake.pedal": (0.0, 1.0, 0.01),
}
"""Key of a manoeuvre -> least and greatest value, and step, of its slider. The ranges are those of passenger cars."""
_CAR: Final = {
    "factors.mass": (0.8, 1.4, 0.01),
    "factors.yaw_inertia": (0.7, 1.4, 0.01),
    "load.cg_forward_change_m": (-0.3, 0.3, 0.005),
    "factors.front_cornering_stiffness": (0.6, 1.4, 0.01),
    "factors.rear_cornering_stiffness": (0.6, 1.4, 0.01),
    "factors.tyre_friction": (0.5, 1.2, 0.01),
    "factors.damper": (0.3, 2.0, 0.05),
    "factors.anti_roll_bar": (0.0, 2.0, 0.05),
    "factors.servo_lag": (0.2, 4.0, 0.1),
}
"""The same for keys of a vehicle."""
_TIMES: Final = 4.0
"""Greatest value of the slider of a gain, in multiples of its present value."""
_STEPS: Final = 200


class Slider(NamedTuple):
    """A slider.

    Attributes:
        key: Key as `--set` takes it.
        label: Label in words.
        unit: Unit of its value; empty for a pure number.
        group: `manoeuvre`, `car`, or the name of a controller.
        low: Least value.
        high: Greatest value.
        step: Distance between two values.
        value: Value of the files.
    """

    key: str
    label: str
    unit: str
    group: str
    low: float
    high: float
    step: float
    value: float


def sliders(scenario: Scenario, controllers: Sequence[str]) -> list[Slider]:
    """Return the sliders of a run.

    Args:
        scenario: Manoeuvre and car with the values of their files.
        controllers: Names of the controllers, whose gains follow.
    """
    found = [*_of("manoeuvre", scenario.maneuver, _MANEUVER), *_of("car", scenario.car.config, _CAR)]
    table = scenario.car.config.controllers
    for name in controllers:
        gains = getattr(table, name, None)
        if gains is not None:
            found += _gains(name, gains, f"controllers.{name}")
    return found


def _of(group: str, values: Any, ranges: dict[str, tuple[float, float, float]]) -> Iterator[Slider]:
    known = set(key_paths(type(values)))
    for key, (low, high, step) in ranges.items():
        if key in known and (value := _value(values, key)) is not None:
            label, unit = _label(key)
            yield Slider(key, label, unit, group, min(low, value), max(high, value), step, value)


def _label(key: str) -> tuple[str, str]:
    """Return label and unit of a key, without the tables that only sort it."""
    words, unit = parameter_label(key)
    return words.removeprefix("factors: ").removeprefix("load: "), unit


def _value(holder: Any, key: str) -> float | None:
    """Return the value of a key in the unit of the key; None if it is no number."""
    *tables, last = key.split(".")
    for table in tables:
        holder = getattr(holder, table)
    name, factor = field_in_unit(last, fields_of(type(holder)))
    value = None if name is None else getattr(holder, name)
    return float(value) / factor if isinstance(value, (int, float)) and not isinstance(value, bool) else None


def _gains(group: str, gains: Any, prefix: str) -> Iterator[Slider]:
    """Yield sliders for the gains of a controller, from zero to some multiples of the present value."""
    hints = hints_of(type(gains), include_extras=True)
    for name, field_value in ((name, getattr(gains, name)) for name in fields_of(type(gains))):
        if dataclass_in(hints[name]) is not None:
            yield from _gains(group, field_value, f"{prefix}.{name}")
            continue
        value = _value(gains, key := spellings(name)[-1])
        if value is None:
            continue
        _, factor = field_in_unit(key, fields_of(type(gains)))
        limits = next((item for item in getattr(hints[name], "__metadata__", ()) if isinstance(item, Range)), Range())
        low, high = (limit / factor for limit in limits[:2])
        top = min(high, _TIMES * abs(value)) if value else min(high, 1.0)
        low = max(low, 0.0)
        digits = 2 - math.floor(math.log10(max(top - low, 1e-9)))
        label, unit = _label(key)
        yield Slider(
            f"{prefix}.{key}", label, unit, group, low, round(top, digits + 2), round((top - low) / _STEPS, digits + 2),
            value,
        )  # fmt: skip
