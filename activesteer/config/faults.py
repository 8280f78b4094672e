"""Faults of actuators and sensors, as declared in files and on the command line."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated, Any, Final, NamedTuple

from activesteer.config import Range, Source, build
from activesteer.core.conventions import CORNERS
from activesteer.core.signals import Measurement, numbers_of
from activesteer.core.units import display_unit
from activesteer.errors import ActiveSteerError, ManeuverError, ParameterError, nearest_names, shown


class Actuator(NamedTuple):
    """A part with actuators that can fail."""

    members: tuple[str, ...]  # the engine's actuators that it stands for
    unit: str = "rad"  # unit of a size, as the suffix of a key
    # true if its angle is the steering ratio times that of the road wheel; a size is given at the road wheel
    by_ratio: bool = False

    @property
    def has_torque(self) -> bool:
        """True for a brake or a motor. Its demand is a torque, and it has only one stop."""
        return self.unit == "Nm"


ANGLE_SENSOR: Final = "steering_wheel_sensor"
"""Sensor that gives controllers the driver's demand if the sensor is not ideal."""


MOTOR: Final = "motor_"
"""Prefix of the parts that are electric motors, followed by their places."""
ACTUATORS: Final = {
    "rear": Actuator(("rl_steer", "rr_steer")),
    "rear_left": Actuator(("rl_steer",)),
    "rear_right": Actuator(("rr_steer",)),
    "superposition": Actuator(("superposition",), by_ratio=True),
    **{f"{corner}_brake": Actuator((f"{corner}_brake",), "Nm") for corner in CORNERS},
    **{f"{MOTOR}{place}": Actuator((f"{MOTOR}{place}",), "Nm") for place in ("front", "rear", *CORNERS)},
}
"""Actuators of each part."""
SENSORS: Final = {
    f"{name}_sensor": unit for name, _, unit in (number.name.rpartition("_") for number in numbers_of(Measurement)[1:])
}
"""Unit of each sensor's signal, as the suffix of a key. All signals of a controller except the time."""

KINDS: Final = {
    "stuck": "an actuator keeps its position, a brake or motor its torque, a sensor its last reading",
    "runaway": "an actuator runs to its stop, a brake or motor to its largest torque, a sensor to the end of its range",
    "float": "a steering actuator is disconnected from its drive and moves freely",
    "offset": "the demand of an actuator, or the reading of a sensor, has an offset",
    "reversed": "demand or reading has the opposite sign",
    "delayed": "demand or reading comes late",
    "dropout": "demand or reading is missing and treated as zero",
}
"""Effect of each kind of fault."""

_SIZES: Final = ("size_rad", "size_radps", "size_mps", "size_mps2", "size_Nm", "size_Pa")


@dataclass(frozen=True)
class Fault:
    """A fault of one part."""

    part: str
    """Faulty part: `rear`, `rear_left`, `rear_right`, `superposition`, `fl_brake` and the other brakes, an electric
    motor (`motor_front`, `motor_rear`, `motor_rl` ...), or a sensor such as `yaw_rate_sensor`."""
    kind: str
    """Effect: `stuck`, `runaway`, `float`, `offset`, `reversed`, `delayed` or `dropout`."""
    start_s: Annotated[float, Range(0.0)]
    """Start of the fault [s]."""
    end_s: Annotated[float, Range(0.0)] | None = None
    """Time from which the part works again [s]; default never."""
    side: str | None = None
    """Stop that a steering actuator runs away to: `left` or `right`."""
    size_rad: float | None = None
    """Offset of an actuator (at the road wheel) or an angle sensor, or the reading of such a sensor at runaway [rad].
    """
    size_radps: float | None = None
    """The same for a yaw rate or wheel speed sensor [rad/s]."""
    size_mps: float | None = None
    """The same for a speed sensor [m/s]."""
    size_mps2: float | None = None
    """The same for an acceleration sensor [m/s2]."""
    size_Nm: float | None = None
    """Offset of a brake, or of a motor at its wheels [N m]."""
    size_Pa: float | None = None
    """The same for a brake pressure sensor [Pa]."""
    delay_s: Annotated[float, Range(0.001, 10.0)] | None = None
    """Delay of the demand or reading [s]."""

    def __post_init__(self) -> None:
        """Check that the part can fail in this way, and that exactly the keys of this kind are given."""
        if self.part not in ACTUATORS and self.part not in SENSORS:
            names = [*ACTUATORS, *SENSORS]
            raise ManeuverError(
                f"there is no part {self.part!r}; {nearest_names(self.part, names)}",
                key="part",
                value=self.part,
                allowed=names,
            )
        if self.kind not in KINDS:
            raise ManeuverError(
                f"there is no kind of fault {self.kind!r}; {nearest_names(self.kind, KINDS)}",
                key="kind",
                value=self.kind,
                allowed=list(KINDS),
            )
        if self.kind == "float" and self.part in SENSORS:
            raise ManeuverError(
                "a sensor cannot move freely; use dropout for a broken wire", key="kind", value=self.kind
            )
        is_brake = self._has_torque and not self.part.startswith(MOTOR)
        if (self.kind == "float" and self._has_torque) or (self.kind == "reversed" and is_brake):
            problem = "a brake cannot float or be reversed, and a motor cannot float; use dropout to leave it open"
            raise ManeuverError(problem, key="kind", value=self.kind)
        if self.end_s is not None and self.end_s <= self.start_s:
            raise ManeuverError(
                f"is {self.end_s:g} s, but must be after start_s, {self.start_s:g} s", key="end_s", value=self.end_s
            )
        needed = self._needed
        given = [name for name in ("side", *_SIZES, "delay_s") if getattr(self, name) is not None]
        for name in given:
            if name != needed:
                problem = f"has no effect on {self.part} with kind {self.kind!r}"
                raise ManeuverError(f"{problem}; " + (f"{needed} has" if needed else "leave it out"), key=name)
        if needed and not given:
            raise ManeuverError(f"is needed for kind {self.kind!r} of {self.part}", key=needed)
        if self.kind == "offset" and self.size == 0.0:
            raise ManeuverError("is 0, which has no effect", key=needed, value=0.0)
        if self.side not in (None, "left", "right"):
            raise ManeuverError(f"is {self.side!r}; allowed: 'left' and 'right'", key="side", value=self.side)

    @property
    def _needed(self) -> str | None:
        """Key that the kind of fault requires, or None."""
        if self.kind == "delayed":
            return "delay_s"
        if self.kind == "runaway" and self.part in ACTUATORS:
            return None if self._has_torque else "side"
        if self.kind in ("offset", "runaway"):
            return f"size_{SENSORS[self.part] if self.part in SENSORS else ACTUATORS[self.part].unit}"
        return None

    @property
    def _has_torque(self) -> bool:
        return self.part in ACTUATORS and ACTUATORS[self.part].has_torque

    @property
    def size(self) -> float:
        """Size in the unit of the part, or 0 if the kind has none."""
        return next((value for name in _SIZES if (value := getattr(self, name)) is not None), 0.0)

    @property
    def name(self) -> str:
        """The fault without its time, as written on the command line."""
        needed = self._needed
        if needed is None:
            return f"{self.part}:{self.kind}"
        value, unit = getattr(self, needed), needed.rpartition("_")[2]
        if needed == "side":
            return f"{self.part}:{self.kind}={value}"
        if unit.startswith("rad"):
            value, unit = math.degrees(value), unit.replace("rad", "deg")
        return f"{self.part}:{self.kind}={value:g}{unit}"

    def name_at(self, now_s: float) -> str:
        """Return the name with its time, except for a fault that starts now and has no end."""
        start = "" if self.start_s <= now_s + 1e-9 and self.end_s is None else f"@{self.start_s:g}"
        return f"{self.name}{start}{'' if self.end_s is None else f'-{self.end_s:g}'}"

    def shares_a_part_with(self, other: Fault) -> bool:
        """Return True if both faults act on the same part."""
        if self.part in ACTUATORS and other.part in ACTUATORS:
            return bool({*ACTUATORS[self.part].members} & {*ACTUATORS[other.part].members})
        return self.part == other.part


def check_faults(faults: Sequence[Fault], duration_s: float, fail: Any) -> None:
    """Check that every fault begins before the end, and that no two act on a part at the same time."""
    for number, fault in enumerate(faults):
        if fault.start_s >= duration_s:
            raise fail(
                ("fault", str(number), "start_s"),
                f"is {fault.start_s:g} s, but the run ends at {duration_s:g} s (duration_s): it has no effect",
                fault.start_s,
            )
    for (number, one), (later, other) in combinations(enumerate(faults), 2):
        apart = any(a.end_s is not None and a.end_s <= b.start_s for a, b in ((one, other), (other, one)))
        if one.shares_a_part_with(other) and not apart:
            raise fail(
                ("fault", str(later)),
                f"{other.part} has fault {number} at the same time, {one.name}; one part has one fault at a time",
            )


_NUMBER: Final = r"\d+(?:\.\d*)?(?:[eE][+-]?\d+)?|\.\d+"
_FAULT: Final = re.compile(
    rf"(?P<part>\w+):(?P<kind>\w+)(?:=(?P<value>[+-]?(?:{_NUMBER}))(?P<unit>[A-Za-z]\w*)|=(?P<side>[a-z]+))?"
    rf"(?:@(?P<start>{_NUMBER})(?:-(?P<end>{_NUMBER}))?)?"
)
_WHAT: Final = "PART:KIND[=SIZE]"
_WHEN: Final = "@START[-END]"


def fault_table(text: str, start_s: float | None = None) -> dict[str, Any]:
    """Parse a fault into a table of a manoeuvre file, without checks."""
    found = _FAULT.fullmatch(text.strip())
    if found is None or (found["start"] is None) is (start_s is None):
        if start_s is None:
            form = f"{_WHAT}{_WHEN}, as rear:stuck@2.0, rear:offset=1deg@2-3 or rear:runaway=left@2"
        else:
            form = f"{_WHAT}, as rear:stuck, rear:offset=1deg or rear:runaway=left, without a time"
        raise ParameterError(f"{shown(text)}: a fault is written {form}", key="--fault", value=text)
    table: dict[str, Any] = {"part": found["part"], "kind": found["kind"]}
    table["start_s"] = float(found["start"]) if start_s is None else start_s
    if found["end"] is not None:
        table["end_s"] = float(found["end"])
    if found["side"] is not None:
        table["side"] = found["side"]
    elif found["unit"] is not None:
        table["delay_s" if found["unit"] == "s" else f"size_{found['unit']}"] = float(found["value"])
    return table


def faults_text(faults: Any) -> str:
    """Return the faults of an override as written on the command line, separated by blanks."""
    each = [faults] if isinstance(faults, str | Mapping) else faults
    try:
        names = [one if isinstance(one, str) else build(Fault, dict(one), Source("")).name_at(-1.0) for one in each]
    except (ActiveSteerError, TypeError, ValueError):  # of a recording that is not from this version
        return str(faults)
    return " ".join(names) or "none"


def fault_words(fault: Mapping[str, Any]) -> str:
    """Return a fault as written for people: without its time, and with its size in display units."""
    said = f"{str(fault.get('part', '?')).replace('_', ' ')}: {fault.get('kind', '?')}"
    for key, value in fault.items():
        if key == "side" and value:
            said += f" {value}"
        elif (key == "delay_s" or key.startswith("size_")) and isinstance(value, int | float):
            unit, factor = display_unit(key)
            said += f" {factor * value:.4g} {unit}"
    return said


def fault_from(given: Any, now_s: float) -> Fault:
    """Return a fault that is set during a run. By default it starts now."""
    if isinstance(given, str):
        table = fault_table(given, None if "@" in given else now_s)
        given = build(Fault, table, Source("", error=ManeuverError))
    if not isinstance(given, Fault):
        raise ParameterError(f"is {shown(given)}; a fault or its text is needed", key="fault", value=given)
    if given.start_s < now_s - 1e-9:
        raise ManeuverError(f"is {given.start_s:g} s; the run is at {now_s:g} s", key="start_s")
    return given
