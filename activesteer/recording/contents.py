"""What a recording may contain: limits, and a schema of its metadata. Checked where one is made and where one is read.

A file comes from anywhere. What is accepted here, everything that reads recordings can handle: names are texts, sizes
are numbers, and a small file cannot fill memory or time.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from activesteer.errors import RecordingError

MAX_ROWS: Final = 20_000_000
"""Rows of a recording: five and a half hours at 1 ms, 160 MB for a channel in memory."""
MAX_CHANNELS: Final = 10_000
"""Channels of a recording; a car has some 150."""
MAX_CHUNK_BYTES: Final = 2**26
"""Size of a chunk, compressed or not: one second of a car is 1 MB."""
MAX_EXPANSION: Final = 200
"""How many times larger a chunk may become when it is decompressed; what would become more is written uncompressed.
Driving gives 2 to 4, standing still some 50."""
MAX_OTHER_BYTES: Final = 2**28
"""Size of everything but rows together: attachments, schemas, metadata. Models with meshes have some 50 MB."""
MAX_OTHER_RECORDS: Final = 20_000
"""How many records there may be of attachments, schemas, topics and metadata together."""
MAX_FOREIGN_MESSAGES: Final = 100_000
"""Messages of topics that are not ours, as other tools may add them."""
MAX_BODIES: Final = 1000
"""Bodies with poses; a car has some 30."""
MAX_PARTS: Final = 100_000
"""Parts of a scene; a car has some 60."""

_MAX_NAME: Final = 5000
"""Letters of a name; that of a controller is a path, which may have 4096."""
_MAX_TEXT: Final = 100_000
_MAX_DEPTH: Final = 16
_MAX_ENTRIES: Final = 20_000
"""Named values in all tables of the metadata; a run has some 150."""
_MAX_NUMBERS: Final = 5_000_000
"""Values in all lists of the metadata: a path with a point each centimetre for 20 km."""
_FAR: Final = 1e7
"""Largest coordinate of a course [m] and largest number of its kind."""
_SHOWN_CHARACTERS: Final = 100
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,254}")

Check = Callable[[Any, str], None]
"""Takes a value and where it stands; raises `RecordingError`."""


def _wrong(where: str, value: object, needed: str) -> RecordingError:
    text = repr(value) if isinstance(value, str | int | float | bool | None) else f"a {type(value).__name__}"
    shown = text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 3] + "..."
    return RecordingError(f"metadata '{where}' is {shown}, where {needed} is needed")


def _text(value: Any, where: str, most: int = _MAX_TEXT) -> None:
    if not isinstance(value, str):
        raise _wrong(where, value, "a text")
    if len(value) > most:
        raise _wrong(where, value, f"a text of at most {most} letters")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise _wrong(where, value, "a text of whole letters") from None


def _name(value: Any, where: str) -> None:
    _text(value, where, _MAX_NAME)


def _flag(value: Any, where: str) -> None:
    if not isinstance(value, bool):
        raise _wrong(where, value, "true or false")


def _number(low: float = -_FAR, high: float = _FAR) -> Check:
    def check(value: Any, where: str) -> None:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise _wrong(where, value, f"a number from {low:g} to {high:g}")

    return check


def _optional(check: Check) -> Check:
    return lambda value, where: None if value is None else check(value, where)


def _one_of(*names: str) -> Check:
    def check(value: Any, where: str) -> None:
        if not isinstance(value, str) or value not in names:
            raise _wrong(where, value, " or ".join(repr(name) for name in names))

    return check


def _each(check: Check, least: int = 0, most: int = _MAX_NUMBERS) -> Check:
    def elements(value: Any, where: str) -> None:
        if not isinstance(value, list | tuple) or not least <= len(value) <= most:
            raise _wrong(where, value, f"a list of {least} to {most} values")
        for number, element in enumerate(value):
            check(element, f"{where}[{number}]")

    return elements


def _table(needed: Mapping[str, Check] | None = None, **allowed: Check) -> Check:
    """A table that has the needed keys, and may have the allowed ones and others."""
    checks = {**(needed or {}), **allowed}

    def check(value: Any, where: str) -> None:
        if not isinstance(value, Mapping):
            raise _wrong(where, value, "a table")
        for key in needed or ():
            if key not in value:
                raise RecordingError(f"metadata '{where}' has no {key!r}")
        for key, test in checks.items():
            if key in value:
                test(value[key], f"{where}.{key}")

    return check


def _named(check: Check) -> Check:
    """A table of which every value passes."""

    def entries(value: Any, where: str) -> None:
        if not isinstance(value, Mapping):
            raise _wrong(where, value, "a table")
        for key, entry in value.items():
            check(entry, f"{where}.{key}")

    return entries


def _path(value: Any, where: str) -> None:
    points = _each(_number(), least=2)
    _table({"x_m": points, "y_m": points})(value, where)
    if len(value["x_m"]) != len(value["y_m"]):
        raise RecordingError(f"metadata '{where}' has {len(value['x_m'])} x_m and {len(value['y_m'])} y_m")


_SIZE: Final = _number(1e-3, 100.0)
_FRICTION: Final = _number(0.0, 100.0)
_PATCH: Final = _table(
    {"start_m": _number(), "end_m": _number(), "mu": _FRICTION}, side=_one_of("both", "left", "right")
)
_LANE: Final = _table({key: _number() for key in ("start_x_m", "end_x_m", "right_y_m", "left_y_m")}, name=_name)
_CORRECTOR: Final = _table(corrector=_table(off_radps=_number(0.0), full_radps=_number(0.0)))

SCHEMA: Final[Mapping[str, Check]] = {
    "complete": _flag,
    "error": _text,
    "metrics_error": _text,
    "controller": _name,
    "timestep_s": _number(1e-9, 1e3),
    "maneuver": _table(
        name=_name,
        kind=_name,
        title=_text,
        road=_table(
            mu=_FRICTION, mu_left=_optional(_FRICTION), mu_right=_optional(_FRICTION), patches=_each(_PATCH, most=1000)
        ),
    ),
    "vehicle": _table(
        name=_name,
        single_track=_named(_number(1e-9, 1e12)),
        controllers=_table(ars=_CORRECTOR, afs=_CORRECTOR),
    ),
    "overrides": _table(),
    "versions": _named(_name),
    "car": _table(
        width_m=_SIZE, wheelbase_m=_SIZE, front_track_m=_SIZE, rear_track_m=_SIZE, tyre_width_m=_each(_SIZE, 2, 2)
    ),
    "course": _table(
        {"path": _path, "lanes": _each(_LANE, most=10_000), "cones": _each(_each(_number(), 2, 2), most=100_000)},
        last_gate_x_m=_optional(_number()),
    ),
}
"""What the values of known keys must be. Other keys, here and in tables, may hold any JSON within the limits above."""


def check_metadata(metadata: Mapping[str, Any]) -> None:
    """Checks metadata as JSON gives them: their size, and the values of all keys in `SCHEMA`.

    Raises:
        RecordingError: a value is not what its key stands for, or too large.
    """
    _Sizes().check(metadata, "")
    for key, check in SCHEMA.items():
        if key in metadata:
            check(metadata[key], key)


class _Sizes:
    """Counts what there is of a tree of values."""

    def __init__(self) -> None:
        self._entries = self._numbers = 0

    def check(self, value: Any, where: str, depth: int = 0) -> None:
        if depth > _MAX_DEPTH:
            raise RecordingError(f"metadata '{where[:_SHOWN_CHARACTERS]}' lie more than {_MAX_DEPTH} levels deep")
        if isinstance(value, Mapping):
            self._entries += len(value)
            if self._entries > _MAX_ENTRIES:
                raise RecordingError(f"the metadata have more than {_MAX_ENTRIES} entries")
            for key, entry in value.items():
                _text(key, where or "the name of an entry", _MAX_NAME)
                self.check(entry, f"{where}.{key}" if where else key, depth + 1)
        elif isinstance(value, str):
            _text(value, where)
        elif isinstance(value, Sequence):
            self._numbers += len(value)
            if self._numbers > _MAX_NUMBERS:
                raise RecordingError(f"the lists in the metadata have more than {_MAX_NUMBERS} values")
            for entry in value:
                if entry.__class__ is not float:
                    self.check(entry, where, depth + 1)
        elif isinstance(value, int) and abs(value) > 2**63:
            raise _wrong(where, value, "a number that 64 bit can hold")


def check_metrics(metrics: Mapping[str, Any]) -> None:
    """Checks metrics: names that can be field names everywhere, and numbers.

    Raises:
        RecordingError: a name or a value is none, or there are too many.
    """
    if len(metrics) > MAX_CHANNELS:
        raise RecordingError(f"{len(metrics)} metrics, at most {MAX_CHANNELS} are allowed")
    for name, value in metrics.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise RecordingError(f"metric name {name!r:.{_SHOWN_CHARACTERS}}: letters, digits and '_', a letter first")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise RecordingError(f"metric {name!r} is {value!r:.{_SHOWN_CHARACTERS}}, which is no number")


def check_names(names: Sequence[Any], what: str, most: int) -> None:
    """Checks names of bodies, parts, attachments.

    Raises:
        RecordingError: one is no text or empty, or there are too many.
    """
    if len(names) > most:
        raise RecordingError(f"{len(names)} {what}, at most {most} are allowed")
    for name in names:
        if not isinstance(name, str) or not 0 < len(name) <= 255 or not name.isprintable():
            raise RecordingError(f"{what}: {name!r:.{_SHOWN_CHARACTERS}} is no name of 1 to 255 letters")


def check_numbers(values: Sequence[Any], what: str, low: float, high: float) -> None:
    """Checks sizes, places and colours.

    Raises:
        RecordingError: one is no number within the limits; they are part of them.
    """
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise RecordingError(f"{what}: {value!r:.{_SHOWN_CHARACTERS}} is no number from {low:g} to {high:g}")


