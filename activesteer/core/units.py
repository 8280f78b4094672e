"""The units of all keys, channels, files and displays, and the display of quantities.

Values are SI and radians. One table has each unit once: its name, the ending of a key in this unit, its size in SI, and
the unit in which its values are shown. Everything that is read, printed, plotted or drawn takes its units from here.
"""

from __future__ import annotations

import math
import re
from typing import Final, NamedTuple

from activesteer.core.conventions import CORNERS, GRAVITY_MPS2
from activesteer.core.text_table import unsigned_zeros

_DEG, _G, _TURN = math.radians(1.0), GRAVITY_MPS2, 2.0 * math.pi


class Unit(NamedTuple):
    """A unit: value in SI = factor times value + offset."""

    name: str
    factor: float  # factor to SI
    dimension: tuple[int, int, int, int]  # exponents of kg, m, s and rad
    offset: float = 0.0  # offset in SI, which an FMU may declare


class DisplayUnit(NamedTuple):
    """Display unit: its name, `-` for a pure number, and the factor from the SI value."""

    name: str
    factor: float


_ROWS: Final = (
    # Name, ending of a key, factor to SI, exponents of kg m s rad, unit of the display, other names, between commas.
    ("", "", 1.0, (0, 0, 0, 0), "-", "1,-"),
    ("rad", "rad", 1.0, (0, 0, 0, 1), "deg", "radian"),
    ("deg", "deg", _DEG, (0, 0, 0, 1), "deg", "°,degree,degrees,grad"),
    ("arcmin", "", _DEG / 60.0, (0, 0, 0, 1), "deg", ""),
    ("rad/rad", "radprad", 1.0, (0, 0, 0, 0), "deg/deg", "m/m,deg/deg"),
    ("rad/s", "radps", 1.0, (0, 0, -1, 1), "deg/s", "radps"),
    ("1/s", "1ps", 1.0, (0, 0, -1, 0), "1/s", ""),
    ("deg/s", "degps", _DEG, (0, 0, -1, 1), "deg/s", "°/s,deg/sec,degps,dps,grad/s"),
    ("rpm", "", _TURN / 60.0, (0, 0, -1, 1), "rpm", "1/min,u/min,r/min,rev/min"),
    ("Hz", "Hz", _TURN, (0, 0, -1, 1), "Hz", "rev/s"),
    ("rad/s2", "radps2", 1.0, (0, 0, -2, 1), "rad/s²", "rad/s²"),
    ("m", "m", 1.0, (0, 1, 0, 0), "m", ""),
    ("mm", "mm", 1e-3, (0, 1, 0, 0), "mm", ""),
    ("cm", "", 1e-2, (0, 1, 0, 0), "cm", ""),
    ("km", "", 1e3, (0, 1, 0, 0), "km", ""),
    ("m2", "m2", 1.0, (0, 2, 0, 0), "m²", "m²"),
    ("1/m", "1pm", 1.0, (0, -1, 0, 0), "1/m", "rad/m"),
    ("m/s", "mps", 1.0, (0, 1, -1, 0), "km/h", "mps"),
    ("km/h", "kmh", 1.0 / 3.6, (0, 1, -1, 0), "km/h", "kmh,kph"),
    ("mph", "", 0.44704, (0, 1, -1, 0), "mph", ""),
    ("m/s2", "mps2", 1.0, (0, 1, -2, 0), "m/s²", "m/s²,m/s^2,m/s/s,mps2"),
    ("g", "g", _G, (0, 1, -2, 0), "g", "gn"),
    ("s", "s", 1.0, (0, 0, 1, 0), "s", ""),
    ("ms", "", 1e-3, (0, 0, 1, 0), "ms", ""),
    ("us", "", 1e-6, (0, 0, 1, 0), "us", ""),
    ("s2", "s2", 1.0, (0, 0, 2, 0), "s²", "s²"),
    ("m2/s3", "m2ps3", 1.0, (0, 2, -3, 0), "m²/s³", "m²/s³"),
    ("m2/s5", "m2ps5", 1.0, (0, 2, -5, 0), "m²/s⁵", "m²/s⁵"),
    ("rad2/s3", "rad2ps3", 1.0, (0, 0, -3, 2), "rad²/s³", "rad²/s³"),
    ("rad s2/m", "s2radpm", 1.0, (0, -1, 2, 1), "rad s²/m", "rad s²/m"),
    ("kg", "kg", 1.0, (1, 0, 0, 0), "kg", ""),
    ("kg m2", "kgm2", 1.0, (1, 2, 0, 0), "kg m²", "kg m²"),
    ("N", "N", 1.0, (1, 1, -2, 0), "N", ""),
    ("kN", "", 1e3, (1, 1, -2, 0), "kN", ""),
    ("N/m", "Npm", 1.0, (1, 0, -2, 0), "N/m", ""),
    ("N/mm", "Npmm", 1e3, (1, 0, -2, 0), "N/mm", ""),
    ("N s/m", "Nspm", 1.0, (1, 0, -1, 0), "N s/m", ""),
    ("Nm", "Nm", 1.0, (1, 2, -2, 0), "Nm", "N.m,N*m,N m"),
    ("kNm", "", 1e3, (1, 2, -2, 0), "kNm", ""),
    ("Pa", "Pa", 1.0, (1, -1, -2, 0), "bar", "N/m2"),
    ("kPa", "", 1e3, (1, -1, -2, 0), "kPa", ""),
    ("MPa", "", 1e6, (1, -1, -2, 0), "MPa", ""),
    ("bar", "", 1e5, (1, -1, -2, 0), "bar", ""),
    ("J", "J", 1.0, (1, 2, -2, 0), "kJ", ""),
    ("kJ", "", 1e3, (1, 2, -2, 0), "kJ", ""),
    ("W", "W", 1.0, (1, 2, -3, 0), "W", ""),
    ("s rad", "srad", 1.0, (0, 0, 1, 1), "s deg", ""),
    ("s deg", "", _DEG, (0, 0, 1, 1), "s deg", ""),
    ("rad/(m/s2)", "radpmps2", 1.0, (0, -1, 2, 1), "deg/g", ""),
    ("deg/g", "", _DEG / _G, (0, -1, 2, 1), "deg/g", ""),
    ("(m/s2)/rad", "mps2prad", 1.0, (0, 1, -2, -1), "g/100deg", ""),
    ("g/100deg", "", _G / math.radians(100.0), (0, 1, -2, -1), "g/100deg", ""),
    ("%", "", 0.01, (0, 0, 0, 0), "%", ""),
)


_UNITS: Final = {
    spelling: Unit(name, factor, dimension)
    for name, _, factor, dimension, _, others in _ROWS
    for spelling in (name, *filter(None, others.split(",")))
}


def _in(name: str) -> DisplayUnit:
    """Return the display of SI values in a unit, with a factor of exactly 3.6 for km/h."""
    factor = _UNITS[name].factor
    plain = round(1.0 / factor, 6)
    return DisplayUnit(name, plain if plain and 1.0 / plain == factor else 1.0 / factor)


_IN_LOWER_CASE: Final = {spelling.lower(): unit for spelling, unit in _UNITS.items()}
_BY_ENDING: Final = {ending: _UNITS[name] for name, ending, *_ in _ROWS if ending}
_SHOWN: Final = {
    name: DisplayUnit(shown, 1.0) if shown in {name, "-"} else _in(shown) for name, _, _, _, shown, _ in _ROWS
}
UNIT_NAMES: Final = tuple(name for name, *_ in _ROWS if name)
"""Names of all units."""
EDGE_UNITS: Final = {
    f"_{ending}": (f"_{si}", _BY_ENDING[ending].factor)
    for ending, si in (("deg", "rad"), ("degps", "radps"), ("kmh", "mps"), ("g", "mps2"))
}
"""Ending and factor of the field that a key in a file fills, by the ending of the key."""


def find_unit(name: str, *, any_case: bool = False) -> Unit | None:
    """Return a unit by one of its names, or None if there is none."""
    return _IN_LOWER_CASE.get(name.lower()) if any_case else _UNITS.get(name)


def known_unit(name: str) -> Unit:
    """Return a unit of the table."""
    return _UNITS[name]


def alike(unit: Unit | None, other: Unit | None) -> bool:
    """Return whether two units measure the same quantity, so that values can be converted."""
    return unit is not None and other is not None and unit.dimension == other.dimension


def split_ending(name: str) -> tuple[str, Unit]:
    """Split the name of a key, channel or metric into its stem and the unit at its end."""
    stem, separator, ending = name.rpartition("_")
    return (stem, _BY_ENDING[ending]) if separator and ending in _BY_ENDING else (name, _UNITS[""])


def unit_of(name: str) -> str:
    """Return the unit at the end of a name, empty for a pure number."""
    return split_ending(name)[1].name


def display_unit(name: str) -> DisplayUnit:
    """Return the display unit of a channel, metric or parameter whose name ends in its SI unit."""
    return _SHOWN[unit_of(name)]


class Quantity(NamedTuple):
    """Display of a recorded signal."""

    channel: str
    label: str
    short: str
    unit: DisplayUnit
    digits: int  # digits after the decimal point
    min_span: float  # smallest height of an axis in the display unit, which keeps a nearly constant signal flat

    @property
    def factor(self) -> float:
        """Factor from the SI value to the display unit."""
        return self.unit.factor

    @property
    def title(self) -> str:
        """Label and unit, for a plot title."""
        return f"{self.label[0].upper()}{self.label[1:]} [{self.unit.name}]"

    @property
    def axis_title(self) -> str:
        """Short label and unit in two lines, for an axis title."""
        return f"{self.short}\n[{self.unit.name}]"

    def value_text(self, value: float) -> str:
        """Return a value as text without its unit, and a zero without a minus sign."""
        if not math.isfinite(value):
            return "n/a"
        return f"{value * self.factor:z.{self.digits}f}"


_FILES: Final = frozenset({"maneuver", "vehicle", "controllers", "overrides", "factors", "load"})
"""Tables whose names are left out of the words for a parameter."""
_LISTED: Final = re.compile(r"(?P<one>.*?)(?:(?<=ch)es|s) (?P<number>\d+)(?P<rest>.*)")
"""Words of a key in a list of tables, such as `road patches 0`."""
_ORDINALS: Final = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")
_PARAMETER_WORDS: Final = {
    "mu": "friction coefficient", "cg": "centre of gravity", "ars": "ARS", "afs": "AFS", "lqr": "LQR", "esc": "ESC",
    "tv": "torque vectoring",
}  # fmt: skip


def parameter_label(key: str) -> tuple[str, str]:
    """Return the label and the unit of a parameter, from the words of its key and its tables."""
    stem, unit = split_ending(key)
    *tables, name = stem.split(".")
    words = [parameter_words(table) for table in tables if table not in _FILES]
    within = " ".join(words)
    if listed := _LISTED.fullmatch(within):  # `road.patches.0` is the first road patch
        number = int(listed["number"])
        rank = _ORDINALS[number] if number < len(_ORDINALS) else f"no. {number + 1}"
        within = f"{rank} {listed['one']}{listed['rest']}"
    what = parameter_words(name) + (" factor" if tables[-1:] == ["factors"] else "")
    return f"{within}: {what}" if within else what, _POWER.sub(lambda power: "²³⁴⁵"[int(power[0]) - 2], unit.name)


def parameter_words(name: str) -> str:
    """Return the words of one part of a key, such as `desired yaw rate` or `ARS`."""
    return " ".join(_PARAMETER_WORDS.get(word, word) for word in name.split("_"))


def parameter_title(key: str) -> str:
    """Return label and unit of a parameter, such as `ARS corrector: proportional gain [s]`."""
    words, unit = parameter_label(key)
    return f"{words} [{unit}]" if unit else words


_POWER: Final = re.compile(r"(?<=[a-z])[2-5]\b")
_NEGATIVE: Final = re.compile(r"(?<![\w.)\]-])-(?=[\d.])")


def typeset(text: str) -> str:
    """Typeset numbers in a string: minus and plus-minus signs, no minus before zero, and m/s²."""
    signed = _NEGATIVE.sub("\N{MINUS SIGN}", unsigned_zeros(text)).replace(" +- ", " \N{PLUS-MINUS SIGN} ")
    return signed.replace("m/s2", "m/s²")


def three_digits(value: float) -> str:
    """Typeset a number with three digits."""
    return typeset(f"{value:.0f}" if abs(value) >= 100.0 else f"{value:#.3g}")


def _row(
    channel: str, label: str, digits: int, min_span: float, short: str = "", unit: DisplayUnit | None = None
) -> Quantity:
    return Quantity(channel, label, short or label, unit or display_unit(channel), digits, min_span)


MEASURED: Final = "measured"
"""Prefix of a channel for the measured value."""
ESTIMATED: Final = "estimated"
"""Prefix of a channel for the estimated value."""
_QUANTITIES: Final = {
    row.channel: row
    for row in (
        _row("time_s", "time", 2, 0.0),
        _row("speed_mps", "speed", 1, 4.0),
        _row("steering_wheel_rad", "steering wheel angle", 0, 2.0, "steering wheel"),
        _row("yaw_rate_radps", "yaw rate", 1, 0.5),
        _row("yaw_rate_desired_radps", "desired yaw rate", 1, 0.5),
        _row("sideslip_rad", "sideslip angle", 1, 0.1, "sideslip"),
        _row("slip_angle_rad", "slip angle", 1, 0.5),
        _row("ay_mps2", "lateral acceleration", 1, 0.2, "lateral acc."),
        _row("roll_rad", "roll angle", 1, 0.1),
        _row("ax_mps2", "longitudinal acceleration", 1, 0.2, "longitudinal acc."),
        _row("pitch_rad", "pitch angle", 1, 0.1),
        _row("yaw_rad", "yaw angle", 1, 0.5),
        _row("y_m", "lateral position", 2, 0.1),
        _row("hand_torque_Nm", "steering wheel torque", 2, 0.5),
        _row("front_steer_rad", "steer angle of the front wheels", 2, 0.1, "front wheels"),
        _row("rear_steer_rad", "steer angle of the rear wheels", 2, 0.05, "rear steer"),
        _row("superposition_rad", "front superposition angle", 2, 0.05, "superposition"),
        _row("path_distance_m", "distance from the path", 2, 0.1),
        _row("tyre_fx_N", "longitudinal tyre force", 2, 0.5, unit=_in("kN")),
        _row("tyre_fy_N", "lateral tyre force", 2, 0.5, unit=_in("kN")),
        _row("tyre_fz_N", "wheel load", 2, 0.5, unit=_in("kN")),
        _row("tyre_mz_Nm", "aligning moment", 1, 5.0),
        _row("drive_torque_Nm", "drive torque", 0, 5.0),
        _row("brake_torque_Nm", "brake torque", 0, 5.0),
        _row("brake_pressure_Pa", "brake pressure", 0, 5.0),
        _row("steer_rad", "steer angle", 2, 0.1),
        _row("tie_rod_force_N", "tie rod force", 2, 0.5, unit=_in("kN")),
        _row("friction_utilisation", "friction utilisation", 0, 10.0, unit=_in("%")),
    )
}


def quantity_of(channel: str) -> Quantity:
    """Return the display of a channel."""
    corner, _, rest = channel.partition("_")
    if corner in (MEASURED, ESTIMATED):
        true = quantity_of(rest)
        return true._replace(channel=channel, label=f"{corner} {true.label}", short=f"{corner} {true.short}")
    return _QUANTITIES[rest]._replace(channel=channel) if corner in CORNERS else _QUANTITIES[channel]
