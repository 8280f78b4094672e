"""Phases: inputs that follow each other, at given times or when the car reaches a state.

Each phase moves steering wheel, speed and pedals to its values and ends by its condition. A manoeuvre can thus react to
the car: the fishhook steers back when the roll rate has died away.
"""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Final, NamedTuple

from activesteer.config import Range
from activesteer.core.signals import Setpoint, new_message
from activesteer.errors import ManeuverError
from activesteer.maneuver.base import SIGNS, DriveMode, Maneuver, Search, Side, Speed, check_speed, within
from activesteer.maneuver.steering_tests import reference_angle_search

_Pedal = Annotated[float, Range(0.0, 1.0)]
_Ramp = Annotated[float, Range(0.0, 60.0)]
_SENSES: Final = ("above", "below", "within")


class Seen(NamedTuple):
    """State of the car that can end a phase."""

    yaw_rate_radps: float  # left positive
    roll_rate_radps: float  # positive when the left side rises
    ay_mps2: float  # left positive
    speed_mps: float  # along the heading
    x_m: float  # of the centre of gravity, in the world
    y_m: float  # left positive


@dataclass(frozen=True)
class Until:
    """End of a phase: the first condition that holds, with signs of a manoeuvre to the left."""

    time_s: Annotated[float, Range(0.0, 3600.0)] | None = None
    """Time since the start of the phase [s]."""
    yaw_rate_above_radps: float | None = None
    """Yaw rate above a value [rad/s]."""
    yaw_rate_below_radps: float | None = None
    """Yaw rate below a value [rad/s]."""
    yaw_rate_within_radps: float | None = None
    """Yaw rate within plus and minus a value [rad/s]."""
    roll_rate_above_radps: float | None = None
    """Roll rate above a value [rad/s]. A turn to the left rolls the car with a positive rate."""
    roll_rate_below_radps: float | None = None
    """Roll rate below a value [rad/s]."""
    roll_rate_within_radps: float | None = None
    """Roll rate within plus and minus a value [rad/s]."""
    ay_above_mps2: float | None = None
    """Lateral acceleration above a value [m/s2]."""
    ay_below_mps2: float | None = None
    """Lateral acceleration below a value [m/s2]."""
    ay_within_mps2: float | None = None
    """Lateral acceleration within plus and minus a value [m/s2]."""
    speed_above_mps: float | None = None
    """Speed above a value [m/s]."""
    speed_below_mps: float | None = None
    """Speed below a value [m/s]."""
    x_above_m: float | None = None
    """World x of the centre of gravity beyond a value [m]."""
    x_below_m: float | None = None
    """World x below a value [m]."""
    y_above_m: float | None = None
    """World y above a value [m]."""
    y_below_m: float | None = None
    """World y below a value [m]."""

    @cached_property
    def conditions(self) -> tuple[tuple[int, str, float], ...]:
        """Conditions on the car: index in `Seen`, direction and value."""
        found = []
        for place, name in enumerate(Seen._fields):
            stem, _, unit = name.rpartition("_")
            for sense in _SENSES:
                value = getattr(self, f"{stem}_{sense}_{unit}", None)
                if value is not None:
                    found.append((place, sense, value))
        return tuple(found)

    def holds(self, seen: Sequence[float]) -> bool:
        """Return whether a condition on the car holds."""
        for place, sense, value in self.conditions:
            now = seen[place]
            if now > value if sense == "above" else now < value if sense == "below" else -value <= now <= value:
                return True
        return False


@dataclass(frozen=True)
class Phase:
    """One phase. An input that is None stays unchanged."""

    name: str
    """Name, for the events in the recording."""
    steering_wheel_rad: Annotated[float, Range(-15.0, 15.0)] | None = None
    """Steering wheel angle at the end of the phase, positive in the direction of the manoeuvre [rad]."""
    steering_factor: Annotated[float, Range(-15.0, 15.0)] | None = None
    """Angle as a multiple of A, the steering wheel angle at 0.3 g in a slow ramp of the car without control [-]."""
    steering_rate_radps: Annotated[float, Range(0.01, 40.0)] | None = None
    """Rate of the steering wheel [rad/s]. Default: 500 deg/s, or by `steering_time_s`."""
    steering_time_s: _Ramp | None = None
    """Time in which the steering wheel turns, instead of a rate [s]."""
    speed_mps: Speed | None = None
    """Speed to hold [m/s]."""
    acceleration_mps2: Annotated[float, Range(0.01, 20.0)] | None = None
    """Acceleration to that speed [m/s2]. Default: the speed is demanded at once."""
    drive: DriveMode | None = None
    """`hold_speed`, the default of the first phase, or `coast`. The drive is off while the brake is pressed."""
    brake_pedal: _Pedal | None = None
    """Brake pedal, 0 to 1."""
    brake_time_s: _Ramp = 0.1
    """Time in which the pedal moves [s]."""
    parking_brake: _Pedal | None = None
    """Parking brake, 0 to 1."""
    until: Until | None = None
    """End of the phase. Default: when steering wheel, speed demand and pedal have reached their values."""

    def __post_init__(self) -> None:
        """Check that every key has an effect."""
        turns = self.steering_wheel_rad is not None or self.steering_factor is not None
        for key, given, beside, needed in (
            ("steering_factor", self.steering_factor is not None, self.steering_wheel_rad is None,
             "together with steering_wheel_rad; leave one out"),
            ("steering_rate_radps", self.steering_rate_radps is not None, turns and self.steering_time_s is None,
             "without a steering angle, or together with steering_time_s"),
            ("steering_time_s", self.steering_time_s is not None, turns, "without a steering angle"),
            ("acceleration_mps2", self.acceleration_mps2 is not None, self.speed_mps is not None, "without speed_mps"),
            ("until", self.until is not None, self.until is None or self.until != Until(), "without a condition"),
        ):  # fmt: skip
            if given and not beside:
                raise ManeuverError(f"has no effect {needed}", key=key)


@dataclass(frozen=True, kw_only=True)
class Phases(Maneuver, kind="phases"):
    """Successive phases, the last of which lasts until the end of the run."""

    phases: tuple[Phase, ...]
    """Phases in the order of the run."""
    repeat: Annotated[int, Range(1, 1000)] = 1
    """Number of times that the phases are driven."""
    direction: Side = "left"
    """Direction of positive steering angles, rates, accelerations and y: `left` or `right`."""
    reference_angle_rad: Annotated[float, Range(0.0, 15.0)] | None = None
    """A, the angle of `steering_factor = 1` [rad]. Default: a search finds it."""

    def __post_init__(self) -> None:
        """Check that there are phases and that the keys fit together."""
        if not self.phases:
            raise ManeuverError("at least one phase [[phases]] is needed", key="phases")
        if self._needs_reference:
            check_speed(self.speed_mps, "steering_factor", "reference_angle_deg")
        elif self.reference_angle_rad is not None and all(phase.steering_factor is None for phase in self.phases):
            raise ManeuverError("has no effect without steering_factor in a phase", key="reference_angle_rad")

    @property
    def _needs_reference(self) -> bool:
        return self.reference_angle_rad is None and any(phase.steering_factor is not None for phase in self.phases)

    @property
    def search(self) -> Search | None:
        """Return the search for A, if a phase needs it."""
        if not self._needs_reference:
            return None
        return reference_angle_search(self, lambda angle: dataclasses.replace(self, reference_angle_rad=angle))

    def sequence(self) -> PhaseSequence:
        """Return the phases at the start of a run."""
        return PhaseSequence(self)

    def setpoint(self, time_s: float) -> Setpoint:
        """Return the setpoint of phases that end only by time."""
        # A run uses `sequence`, which sees the car.
        sequence, never = self.sequence(), (math.nan,) * len(Seen._fields)
        while True:
            setpoint = sequence.setpoint(time_s, never)
            if not sequence.moved:
                return setpoint

    def settling_setpoint(self) -> Setpoint:
        """Return the setpoint straight ahead, with drive and brake of the first phase."""
        first = self.phases[0]
        setpoint = self.at_speed(0.0, first.drive != "coast")
        return setpoint._replace(brake_pedal=first.brake_pedal or 0.0) if self.speed_mps == 0.0 else setpoint


class PhaseSequence:
    """The phases of one run, with time and name of each phase that has begun."""

    def __init__(self, maneuver: Phases) -> None:
        """Begin with the first phase at time zero."""
        self.maneuver = maneuver
        self._number, self._begin_s = 0, 0.0
        # Steering wheel angle, speed demand, pedal: where the phase begins; drive and parking brake of the phase.
        self._from = (0.0, maneuver.speed_mps, 0.0)
        self._drive, self._parking = True, 0.0
        self.began: list[tuple[float, str]] = []
        self.moved = False
        self.present = maneuver.settling_setpoint()
        self._enter(0.0)

    def _enter(self, time_s: float) -> None:
        phase = self._phase
        self._begin_s = time_s
        self._drive = self._drive if phase.drive is None else phase.drive == "hold_speed"
        self._parking = self._parking if phase.parking_brake is None else phase.parking_brake
        angle, speed, pedal = self._from
        goal = phase.steering_wheel_rad
        if phase.steering_factor is not None:
            goal = phase.steering_factor * (self.maneuver.reference_angle_rad or 0.0)
        goals = (
            angle if goal is None else goal,
            speed if phase.speed_mps is None else phase.speed_mps,
            pedal if phase.brake_pedal is None else phase.brake_pedal,
        )
        turn_s = phase.steering_time_s
        if turn_s is None:
            turn_s = abs(goals[0] - angle) / (phase.steering_rate_radps or math.radians(500.0))
        speed_s = abs(goals[1] - speed) / phase.acceleration_mps2 if phase.acceleration_mps2 else 0.0
        self._ramps = tuple(
            (start, goal, length if goal != start else 0.0)
            for start, goal, length in zip(self._from, goals, (turn_s, speed_s, phase.brake_time_s), strict=True)
        )
        self._ready_s = max(length for _, _, length in self._ramps)
        self.began.append((time_s, phase.name))

    def __deepcopy__(self, memo: dict[int, Any]) -> PhaseSequence:
        other = copy.copy(self)
        other.began = list(self.began)
        return other

    @property
    def _phase(self) -> Phase:
        return self.maneuver.phases[self._number % len(self.maneuver.phases)]

    def setpoint(self, time_s: float, seen: Sequence[float]) -> Setpoint:
        """Return the setpoint at a time [s] and a state (`Seen`), and start the next phase when it is due."""
        self.moved = False
        maneuver, until, elapsed_s = self.maneuver, self._phase.until, time_s - self._begin_s
        sign = SIGNS[maneuver.direction]
        if self._number + 1 < maneuver.repeat * len(maneuver.phases):
            if until is None:
                over, end_s = elapsed_s >= self._ready_s - 1e-9, self._begin_s + self._ready_s
            else:
                end_s = math.inf if until.time_s is None else self._begin_s + until.time_s
                over = time_s >= end_s - 1e-9
                if not over and until.conditions:
                    yaw_rate, roll_rate, ay, speed, x, y = seen
                    over = until.holds((sign * yaw_rate, sign * roll_rate, sign * ay, speed, x, sign * y))
                    end_s = time_s
            if over:
                self._from = tuple(_along(ramp, end_s - self._begin_s) for ramp in self._ramps)
                self._number += 1
                self.moved = True
                self._enter(min(end_s, time_s))
                elapsed_s = time_s - self._begin_s
        angle, speed, pedal = (_along(ramp, elapsed_s) for ramp in self._ramps)
        drives = self._drive and pedal == 0.0 and self._parking == 0.0
        self.present = new_message(
            Setpoint, (sign * angle, speed, pedal, drives, None, None, None, None, self._parking)
        )
        return self.present


def _along(ramp: tuple[float, float, float], elapsed_s: float) -> float:
    start, goal, length_s = ramp
    return goal if length_s == 0.0 else start + (goal - start) * within(elapsed_s / length_s, 1.0)


def seen_of(measurement: Any, motion: Any, roll_rate_radps: float) -> tuple[float, ...]:
    """Return the state of the car in the order of `Seen`, from the true measurement and motion."""
    return (
        motion.yaw_rate_radps, roll_rate_radps, measurement.ay_mps2, motion.speed_mps, motion.x_m, motion.y_m
    )  # fmt: skip
