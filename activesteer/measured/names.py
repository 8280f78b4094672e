"""Names and units of columns of other programs, and channels with other signs in the axes of SAE J670."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Final, NamedTuple

from activesteer.config import field_in_unit
from activesteer.units import Unit, find_unit

TIME_WORDS: Final = frozenset({"time", "times", "t", "zeit", "timestamp", "timestamps", "tstamp", "tstart"})

TURNED_IN_SAE: Final = (
    "y_m", "z_m", "yaw_rad", "pitch_rad", "vy_mps", "vz_mps", "yaw_rate_radps", "pitch_rate_radps", "ay_mps2",
    "az_mps2", "sideslip_rad", "steering_wheel_rad", "steering_wheel_demand_rad", "hand_torque_Nm", "front_steer_rad",
    "rear_steer_rad", "superposition_rad", "rack_m", "front_axle_y_m",
)  # fmt: skip
"""Channels that are positive to the left or upwards here, and to the right or downwards in the axes of SAE J670 (x
forward, y right, z down): all except those along or about x."""


class Known(NamedTuple):
    """Meaning of a column.

    Attributes:
        channel: Channel that the column fills.
        unit: Unit, if the file states none.
        sign: -1 if the exporter uses the sign opposite to ISO 8855.
        sure: Whether the unit is the exporter's; otherwise SI is assumed.
    """

    channel: str
    unit: str = ""
    sign: float = 1.0
    sure: bool = True


_WORDS: Final = {
    "steering_wheel_rad": "steeringwheelangle steerwheelangle swa handwheelangle lenkradwinkel lwi lws steeringangle "
    "lenkwinkel deltah",
    "yaw_rate_radps": "yawrate yawvelocity gierrate giergeschwindigkeit psidot psip angularratez gyroz r",
    "ay_mps2": "lateralacceleration latacc lateralacc querbeschleunigung accy accely ay",
    "ax_mps2": "longitudinalacceleration longacc laengsbeschleunigung längsbeschleunigung accx accelx ax",
    "speed_mps": "speed velocity vehiclespeed vehspeed geschwindigkeit fahrgeschwindigkeit v vehv",
    "vx_mps": "vx longitudinalvelocity velforward",
    "vy_mps": "vy lateralvelocity vellateral",
    "sideslip_rad": "sideslip sideslipangle schwimmwinkel beta slipangle",
    "roll_rad": "roll rollangle wankwinkel phi",
    "pitch_rad": "pitch pitchangle nickwinkel theta",
    "yaw_rad": "yaw yawangle heading gierwinkel psi",
    "x_m": "x posx positionx", "y_m": "y posy positiony",
    "hand_torque_Nm": "steeringwheeltorque handtorque lenkmoment",
    "brake_pedal": "brakepedal brakepedalposition bremspedal",
}  # fmt: skip
_BY_WORD: Final = {word: channel for channel, words in _WORDS.items() for word in words.split()}

_EXPORTERS: Final[tuple[tuple[str, dict[str, Known]], ...]] = (
    # IPG CarMaker writes SI and ISO 8855.
    ("Car.YawRate", {
        "Steer.WhlAng": Known("steering_wheel_rad", "rad"), "Driver.Steer.Ang": Known("steering_wheel_rad", "rad"),
        "Car.YawRate": Known("yaw_rate_radps", "rad/s"), "Car.ay": Known("ay_mps2", "m/s2"),
        "Car.ax": Known("ax_mps2", "m/s2"), "Car.v": Known("speed_mps", "m/s"), "Car.Roll": Known("roll_rad", "rad"),
        "Car.Pitch": Known("pitch_rad", "rad"), "Car.Yaw": Known("yaw_rad", "rad"),
        "Car.SideSlipAngle": Known("sideslip_rad", "rad"), "Car.tx": Known("x_m", "m"), "Car.ty": Known("y_m", "m"),
    }),
    # Mechanical Simulation CarSim: degrees, km/h and g, ISO 8855.
    ("AVz", {
        "Steer_SW": Known("steering_wheel_rad", "deg"), "AVz": Known("yaw_rate_radps", "deg/s"),
        "Ay": Known("ay_mps2", "g"), "Ax": Known("ax_mps2", "g"), "Vx": Known("vx_mps", "km/h"),
        "Vy": Known("vy_mps", "km/h"), "Beta": Known("sideslip_rad", "deg"), "Roll": Known("roll_rad", "deg"),
        "Pitch": Known("pitch_rad", "deg"), "Yaw": Known("yaw_rad", "deg"), "Xcg_TM": Known("x_m", "m"),
        "Ycg_TM": Known("y_m", "m"),
    }),
    # Runs of Project Chrono, as `tools/validate.py` compares them: SI, and a rack that steers right.
    ("delta_FL", {"rack": Known("rack_m", "m", -1.0), "vx": Known("vx_mps", "m/s"), "vy": Known("vy_mps", "m/s"),
        "r": Known("yaw_rate_radps", "rad/s"), "ax": Known("ax_mps2", "m/s2"), "ay": Known("ay_mps2", "m/s2"),
        "beta": Known("sideslip_rad", "rad"), "roll": Known("roll_rad", "rad"), "pitch": Known("pitch_rad", "rad"),
        "x": Known("x_m", "m"), "y": Known("y_m", "m"), "psi": Known("yaw_rad", "rad"),
    }),
)  # fmt: skip
"""Name that identifies an exporter, and the names that it writes."""


def written_unit(unit: str) -> Unit | None:
    """Return a unit as a file writes it; None if it is unknown."""
    return find_unit(unit.strip().strip("[]()").strip().replace("**", "^"), any_case=True)


def split_unit(name: str) -> tuple[str, str]:
    """Split a name and the unit in brackets behind it."""
    found = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]\s*", name)
    return (found[1], found[2]) if found and written_unit(found[2]) else (name, "")


def before_bracket(name: str) -> str:
    """Return the part of a column's name before a bracket at its end; empty if there is none."""
    found = re.fullmatch(r"(.*?)\s*[\[(][^\])]*[\])]\s*", name)
    return found[1] if found else ""


def is_time(name: str) -> bool:
    """Return whether a column is named like a time."""
    return name == "time_s" or _word(split_unit(name)[0]) in TIME_WORDS


def known_column(name: str, columns: Collection[str], channels: Collection[str]) -> Known | None:
    """Return the meaning of a column by its name, the names of all columns and the channels of a car, or None."""
    for mark, names in _EXPORTERS:
        if mark in columns and name in names:
            return names[name]
    if name in channels:
        return Known(name)
    channel, _ = field_in_unit(name, channels)
    if channel is not None:
        return Known(channel, name.rsplit("_", 1)[1])
    words, unit = split_unit(name)
    channel = _BY_WORD.get(_word(words))
    return None if channel is None else Known(channel, unit, sure=bool(unit))


def _word(name: str) -> str:
    return re.sub(r"[\W_]", "", name.lower())
