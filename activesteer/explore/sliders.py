"""The sliders of the page: keys of manoeuvre, road, car and controllers, with their ranges."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.config import field_in_unit, leaf_keys, spellings
from activesteer.controllers import declared_parameters
from activesteer.core.units import parameter_label, parameter_words
from activesteer.errors import ParameterError
from activesteer.plugins import Declared
from activesteer.scenario import Scenario, value_of

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
_COVERED: Final = ("controllers", "single_track", "two_track")
"""Tables of a vehicle that controllers read; the controllers declare what they take from them."""


class Slider(NamedTuple):
    """A slider."""

    key: str  # key as `--set` takes it
    label: str  # label in words
    unit: str  # unit of its value; empty for a pure number
    group: str  # `manoeuvre`, `car`, or the name of a controller or of a table of gains, in words
    low: float  # least value
    high: float  # greatest value
    step: float  # distance between two values
    value: float  # value of the files


def sliders(scenario: Scenario, controllers: Sequence[str], own: Mapping[str, Path] | None = None) -> list[Slider]:
    """Return the sliders of a run; those of `own`, group -> file of the user, include all numbers of the file."""
    found = [*_of("manoeuvre", scenario, _MANEUVER), *_of("car", scenario, _CAR)]
    for group, file in (own or {}).items():
        found += _of_file(group, scenario, file)
    for name in controllers:
        for key, declared in declared_parameters(name, scenario.car.config.controllers).items():
            if (gain := _gain(key, declared)) is not None:
                found.append(gain)
    first: dict[str, Slider] = {}
    for slider in found:
        first.setdefault(slider.key, slider)
    return list(first.values())


def _of(group: str, scenario: Scenario, ranges: Mapping[str, tuple[float, float, float]]) -> Iterator[Slider]:
    for key, (low, high, step) in ranges.items():
        with suppress(ParameterError):  # not every manoeuvre has every key
            value = value_of(scenario, key)
            if _is_number(value):
                yield Slider(key, *_label(key), group, min(low, value), max(high, value), step, value)


def _of_file(group: str, scenario: Scenario, file: Path) -> Iterator[Slider]:
    """Yield sliders of the positive numbers in a file, from half of each to its double."""
    table = tomllib.loads(file.read_text("utf-8"))
    for path in leaf_keys(table):
        key = ".".join(path)
        if path[0] in _COVERED or not _is_number(reduce(getitem, path, table)):
            continue
        with suppress(ParameterError):  # such as the keys of a table that is read from another file
            value = value_of(scenario, key)
            if isinstance(value, float) and value > 0.0:
                label, unit = _label(key)
                high = 1.0 if not unit and value <= 1.0 else 2.0 * value
                digits = 4 - math.floor(math.log10(high))
                yield Slider(key, label, unit, group, 0.5 * value, high, round(high / _STEPS, digits), value)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _label(key: str) -> tuple[str, str]:
    """Return label and unit of a key, without the tables that only sort it."""
    words, unit = parameter_label(key)
    return words.removeprefix("factors: ").removeprefix("load: "), unit


def _gain(key: str, declared: Declared) -> Slider | None:
    """Return the slider of a gain, from zero to some multiples of its value, or None if it is no number."""
    if not _is_number(declared.default):
        return None
    tables, _, name = key.rpartition(".")
    shown = spellings(name)[-1]
    _, factor = field_in_unit(shown, (name,))
    value, (low, high) = declared.default / factor, (limit / factor for limit in declared.limits)
    top = min(high, _TIMES * abs(value) if value else 1.0)
    bottom = max(low, 0.0 if value >= 0.0 else -top)
    digits = 4 - math.floor(math.log10(max(top - bottom, 1e-9)))
    label, unit = _label(f"{tables}.{shown}")
    group = parameter_words(tables.split(".")[1] if "." in tables else tables)
    return Slider(
        f"{tables}.{shown}", label, unit or declared.unit, group, bottom, round(top, digits),
        round((top - bottom) / _STEPS, digits), value,
    )  # fmt: skip
