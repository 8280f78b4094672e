"""Messages of the page: fields, ranges and sizes, all checked here, and the queue of waiting messages."""

from __future__ import annotations

from collections import deque
from typing import Annotated, Final

import msgspec
from msgspec import UNSET, Meta, Struct, UnsetType

from activesteer.errors import ParameterError
from activesteer.resources import DEFAULT_DRIVER

MAX_MESSAGE_BYTES: Final = 20_000
"""Largest message of the page. Its choices have some hundred bytes."""
MAX_CONTROLLERS: Final = 4
MAX_WAITING: Final = 100
"""Largest number of messages that wait. The newest choice and the newest hands replace older ones."""
_MAX_NUMBERS: Final = 300

_Name = Annotated[str, Meta(min_length=1, max_length=200)]
_Number = Annotated[int, Meta(ge=0, le=2**53)]
_Pedal = Annotated[float, Meta(ge=0.0, le=1.0)]
_Speed = Annotated[float, Meta(ge=0.0, le=200.0)]
_Friction = Annotated[float, Meta(ge=0.1, le=1.2)]


class Choice(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="kind"):
    """Choice of the page for a run or a drive by hand."""

    id: _Number = 0  # number that the replies repeat
    maneuver: _Name  # manoeuvre, or course of a drive
    vehicle: _Name = "compact"
    driver: _Name = DEFAULT_DRIVER  # not used in a drive by hand
    controllers: Annotated[tuple[_Name, ...], Meta(min_length=1, max_length=MAX_CONTROLLERS)] = ("none",)


class Describe(Choice, frozen=True, tag="describe"):
    """Request of the page for the sliders and the car of a choice."""


class RunRequest(Choice, frozen=True, tag="run"):
    """Request of the page for runs."""

    dragging: bool = False  # whether a slider is being moved: the amplitude of the steering wheel is then held
    values: Annotated[dict[_Name, float], Meta(max_length=_MAX_NUMBERS)] = {}  # key of a slider -> value


class Start(Choice, frozen=True, tag="start"):
    """Request of the page for a car that waits at the start of a course for `Act.go`."""

    speed_kmh: _Speed | None = None  # speed at the start; that of the course by default
    mu: _Friction | None = None  # friction of the road; that of the course by default


class Act(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag_field="kind", tag="act"):
    """Input during a drive: hands and feet, controller, speed and friction, each unchanged if unset."""

    # Position of the steering, -1 full right to 1 full left. Throttle, brake and direct count with it
    steer: Annotated[float, Meta(ge=-1.0, le=1.0)] | UnsetType = UNSET
    throttle: _Pedal = 0.0
    brake: _Pedal = 0.0
    direct: bool = False  # whether `steer` is the position of a gamepad's stick or a slider, and not of a key
    number: _Number = 0  # number of these hands, which the next frame repeats
    controller: _Name | UnsetType = UNSET  # controller that takes over
    speed_kmh: _Speed | UnsetType | None = UNSET  # speed to hold without a foot on a pedal; null lets the car coast
    mu: _Friction | UnsetType = UNSET  # friction of the road from now on
    go: bool = False  # whether the car at the start begins to drive


class Save(Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="save"):
    """Request of the page to write the last runs as recordings."""


class Report(Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="report"):
    """Request of the page for a report of the last runs, or of the last drive."""

    drive: bool = False  # whether the report is that of the last drive


class End(Struct, frozen=True, forbid_unknown_fields=True, tag_field="kind", tag="end"):
    """Request of the page to end the drive."""


Message = Describe | RunRequest | Start | Act | Save | Report | End
_DECODER: Final = msgspec.json.Decoder(Message)


def read(text: str | bytes) -> Message:
    """Return a message of the page."""
    if len(text) > MAX_MESSAGE_BYTES:
        raise ParameterError(
            f"a message of the page has {len(text)} characters; at most {MAX_MESSAGE_BYTES} are allowed"
        )
    try:
        return _DECODER.decode(text)
    except (msgspec.MsgspecError, RecursionError, UnicodeError) as error:
        raise ParameterError(f"a message of the page is not understood: {error}") from error


def add(waiting: deque[Message], message: Message) -> bool:
    """Append a message, or replace an older one with the same meaning; return False if the queue is full."""
    # Beginning and end of a drive are always taken: they make older hands useless.
    if isinstance(message, (Start, End)):
        useless = (Act, End) if isinstance(message, End) else (Act, End, Start)
        for older in [other for other in waiting if isinstance(other, useless)]:
            waiting.remove(older)
        waiting.append(message)
        return True
    if _is_replaced(message):
        for older in [other for other in waiting if type(other) is type(message) and _is_replaced(other)]:
            waiting.remove(older)
    if len(waiting) >= MAX_WAITING:
        return False
    waiting.append(message)
    return True


def _is_replaced(message: Message) -> bool:
    """Return whether a newer message of the same type replaces this one."""
    if isinstance(message, Act):
        return message.controller is UNSET and message.speed_kmh is UNSET and message.mu is UNSET and not message.go
    return True
