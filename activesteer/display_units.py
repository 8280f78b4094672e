"""Display of quantities: label, unit, factor from the SI value, digits, smallest height of an axis.

Values are SI and radians. Everything that is printed, plotted or drawn takes its unit from here.
"""

from __future__ import annotations

import math
import re
from typing import Final, NamedTuple

from activesteer.conventions import CORNERS, GRAVITY_MPS2

_DEG: Final = math.degrees(1.0)


class DisplayUnit(NamedTuple):
    """Unit for display.

    Attributes:
        name: Name of the unit; `-` for a pure number.
        factor: Factor from the SI value.
    """

    name: str
    factor: float


_BY_SUFFIX: Final = {
    # Longest suffix first: `_srad` also ends in `rad`.
    "_radpmps2": DisplayUnit("deg/g", _DEG * GRAVITY_MPS2),
    "_mps2prad": DisplayUnit("g/100deg", math.radians(100.0) / GRAVITY_MPS2),
    "_radprad": DisplayUnit("deg/deg", 1.0),
    "_1ps": DisplayUnit("1/s", 1.0),
    "_Hz": DisplayUnit("Hz", 1.0),
    "_radps": DisplayUnit("deg/s", _DEG),
    "_srad": DisplayUnit("s deg", _DEG),
    "_rad": DisplayUnit("deg", _DEG),
    "_mps2": DisplayUnit("m/s²", 1.0),
    "_mps": DisplayUnit("km/h", 3.6),
    "_Nm": DisplayUnit("Nm", 1.0),
    "_Pa": DisplayUnit("bar", 1e-5),
    "_J": DisplayUnit("kJ", 1e-3),
    "_N": DisplayUnit("N", 1.0),
    "_m": DisplayUnit("m", 1.0),
    "_s": DisplayUnit("s", 1.0),
}
_PERCENT: Final = DisplayUnit("%", 100.0)
_PURE: Final = DisplayUnit("-", 1.0)
_KILONEWTON: Final = DisplayUnit("kN", 1e-3)


class Quantity(NamedTuple):
    """Display of a recorded signal.

    Attributes:
        channel: Name of the channel.
        label: Label of the signal.
        short: Short label.
        unit: Display unit.
        digits: Digits after the decimal point.
        min_span: Smallest height of an axis in the display unit, which keeps a nearly constant signal flat.
    """

    channel: str
    label: str
    short: str
    unit: DisplayUnit
    digits: int
    min_span: float

    @property
    def factor(self) -> float:
        """Factor from the SI value to the display unit."""
        return self.unit.factor

    @property
    def title(self) -> str:
        """Label and unit, the title of a plot."""
        return f"{self.label[0].upper()}{self.label[1:]} [{self.unit.name}]"

    @property
    def axis_title(self) -> str:
        """Short label and unit in two lines, the title of an axis."""
        return f"{self.short}\n[{self.unit.name}]"

    def value_text(self, value: float) -> str:
        """Return a value as text without its unit, and a zero without a minus sign.

        Args:
            value: The value, SI; `n/a` if it is not finite.
        """
        if not math.isfinite(value):
            return "n/a"
        text = f"{value * self.factor:.{self.digits}f}"
        return text.lstrip("-") if float(text) == 0.0 else text


_AS_WRITTEN: Final = {
    "_radpmps2": "rad/(m/s2)", "_mps2prad": "(m/s2)/rad", "_radprad": "rad/rad", "_Nspm": "N s/m", "_kgm2": "kg m2",
    "_Npm": "N/m", "_Npmm": "N/mm", "_radps": "rad/s", "_degps": "deg/s", "_mps2": "m/s2", "_srad": "s rad",
    "_1ps": "1/s", "_mps": "m/s", "_kmh": "km/h", "_Nm": "N m", "_Hz": "Hz", "_kg": "kg", "_rad": "rad", "_deg": "deg",
    "_mm": "mm", "_Pa": "Pa", "_m": "m", "_s": "s", "_N": "N", "_g": "g",
    "_s2": "s2",
}  # fmt: skip
"""Suffix of a key or a column -> unit of its values."""


def unit_of(name: str) -> str:
    """Return the unit at the end of a name; empty for a pure number.

    Args:
        name: Name of a metric, or dotted key of a parameter.
    """
    return next((unit for ending, unit in _AS_WRITTEN.items() if name.endswith(ending)), "")


_FILES: Final = frozenset({"maneuver", "vehicle", "controllers", "overrides"})
"""Tables that only locate a parameter."""
_PARAMETER_WORDS: Final = {
    "mu": "friction coefficient", "cg": "centre of gravity", "ars": "ARS", "afs": "AFS", "lqr": "LQR", "esc": "ESC",
}  # fmt: skip


def parameter_label(key: str) -> tuple[str, str]:
    """Return the label and the unit of a parameter, from the words of its key and its tables.

    Args:
        key: Dotted key, such as `controllers.ars.corrector.proportional_gain_s`.

    Returns:
        The label, such as `ARS corrector: proportional gain`, and the unit; empty for a pure number.
    """
    *tables, name = key.removesuffix(next((end for end in _AS_WRITTEN if key.endswith(end)), "")).split(".")
    within, what = (
        " ".join(_PARAMETER_WORDS.get(word, word) for part in parts for word in part.split("_"))
        for parts in ([table for table in tables if table not in _FILES], [name])
    )
    return f"{within}: {what}" if within else what, unit_of(key)


def parameter_title(key: str) -> str:
    """Return label and unit of a parameter, such as `ARS corrector: proportional gain [s]`."""
    words, unit = parameter_label(key)
    return f"{words} [{unit}]" if unit else words


def display_unit(name: str) -> DisplayUnit:
    """Return the display unit of a value.

    Args:
        name: Name of a channel or parameter, ending in its SI unit.
    """
    return next((unit for suffix, unit in _BY_SUFFIX.items() if name.endswith(suffix)), _PURE)


_NEGATIVE: Final = re.compile(r"(?<![\w.)\]-])-(?=[\d.])")


def typeset(text: str) -> str:
    """Return a text of numbers for a page: minus signs instead of hyphens, and m/s² with its superscript."""
    return _NEGATIVE.sub("\N{MINUS SIGN}", text).replace("m/s2", "m/s²")


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
        _row("tyre_fx_N", "longitudinal tyre force", 2, 0.5, unit=_KILONEWTON),
        _row("tyre_fy_N", "lateral tyre force", 2, 0.5, unit=_KILONEWTON),
        _row("tyre_fz_N", "wheel load", 2, 0.5, unit=_KILONEWTON),
        _row("tyre_mz_Nm", "aligning moment", 1, 5.0),
        _row("drive_torque_Nm", "drive torque", 0, 5.0),
        _row("brake_torque_Nm", "brake torque", 0, 5.0),
        _row("brake_pressure_Pa", "brake pressure", 0, 5.0),
        _row("steer_rad", "steer angle", 2, 0.1),
        _row("tie_rod_force_N", "tie rod force", 2, 0.5, unit=_KILONEWTON),
        _row("friction_utilisation", "friction utilisation", 0, 10.0, unit=_PERCENT),
    )
}


def quantity_of(channel: str) -> Quantity:
    """Return the display of a channel.

    Args:
        channel: Name of the channel, possibly with a corner, `measured` or `estimated` before it.
    """
    corner, _, rest = channel.partition("_")
    if corner in (MEASURED, ESTIMATED):
        true = quantity_of(rest)
        return true._replace(channel=channel, label=f"{corner} {true.label}", short=f"{corner} {true.short}")
    return _QUANTITIES[rest]._replace(channel=channel) if corner in CORNERS else _QUANTITIES[channel]
