"""Contents of a recording except its rows, with their checks: metadata, metrics, names, events, scene.

In a file an event is a message of Foxglove's log, so other tools show it on their time axis. In the metadata the events
are a list of tables with the fields of `Event`.

A file may come from anywhere. Everything that reads recordings can handle what is accepted here: names are strings,
sizes are numbers, and a small file cannot fill memory or time.

A file holds, in this order: schemas and topics, attachments, the record of the run, the format record, chunks of about
a second, the record of the result, metrics. Metadata values are JSON text, metrics are numbers as text.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from activesteer.core import limits
from activesteer.core.limits import fail, sequence, table_of, text
from activesteer.errors import RecordingError
from activesteer.recording.schemas import LOG_SCHEMA, SCENE_SCHEMA, WORLD, message_class
from activesteer.road.course import course_of, footprint_of
from activesteer.road.drawn import surface_in
from activesteer.road.road import road_of

_INFO: Final = 2
"""Level of the messages in Foxglove's log."""


class Event(NamedTuple):
    """An event during a run, with its time and kind."""

    time_s: float  # time at which the next step began [s]
    # `set` for a changed key, `fail` for a fault, `phase` for a phase of the manoeuvre, `note` for a limit of
    # accuracy
    kind: str
    what: str  # the change (`road.mu = 0.3`), the fault (`rear:stuck`), the name of the phase, or the limit in words


def events_of(metadata: Mapping[str, Any]) -> list[Event]:
    """Return the events in the metadata of a recording."""
    listed = sequence(metadata.get("events", ()), "events")
    limits.check_count(len(listed), limits.MAX_EVENTS, "entries", RecordingError, file="the metadata", key="events")
    return [_event(entry, f"events.{index}") for index, entry in enumerate(listed)]


def encode_event(event: Event) -> tuple[int, bytes]:
    """Return the time [ns] and the message of an event."""
    time_ns = round(event.time_s * 1e9)
    message = message_class(LOG_SCHEMA)(level=_INFO, message=event.what, name=event.kind)
    message.timestamp.FromNanoseconds(time_ns)
    return time_ns, message.SerializeToString()


def decode_event(data: bytes) -> Event:
    """Return the event of a message."""
    message = message_class(LOG_SCHEMA).FromString(data)
    return _event({"time_s": message.timestamp.ToNanoseconds() / 1e9, "kind": message.name, "what": message.message},
                  "events")  # fmt: skip


def _event(entry: object, key: str) -> Event:
    table = table_of(entry, key)
    time_s, kind, what = table.get("time_s"), text(table.get("kind"), f"{key}.kind"), text(table.get("what"), key)
    if isinstance(time_s, bool) or not isinstance(time_s, int | float) or not 0.0 <= time_s <= 1e6:
        raise fail(f"{key}.time_s", f"is {time_s!r:.40}, expected a time from 0 to 1e6 s")
    limits.check_count(max(len(kind), len(what)), limits.MAX_EVENT_LETTERS, "letters", RecordingError, key=key)
    return Event(float(time_s), kind, what)


_SHOWN: Final = 100
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,254}")

Check = Callable[[Any, str], object]
"""Check of a value with its key. Raises `RecordingError`."""


def _name(value: Any, key: str) -> None:
    _letters(text(value, key), key, limits.MAX_NAME_LETTERS)


def _flag(value: Any, key: str) -> None:
    if not isinstance(value, bool):
        raise fail(key, f"is {value!r:.{_SHOWN}}, expected true or false")


def _number(low: float, high: float) -> Check:
    def check(value: Any, key: str) -> None:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise fail(key, f"is {value!r:.{_SHOWN}}, expected a number from {low:g} to {high:g}")

    return check


def _all(check: Check) -> Check:
    """Check all values of a table."""

    def entries(value: Any, key: str) -> None:
        for name, entry in table_of(value, key).items():
            check(entry, f"{key}.{name}")

    return entries


def _single_track(value: Any, key: str) -> None:
    """Check the numbers of a single-track model and their source."""
    for name, entry in table_of(value, key).items():
        (_name if name == "source" else _number(1e-9, 1e12))(entry, f"{key}.{name}")


def _controllers(value: Any, key: str) -> None:
    """Check tables of gains, and the numbers that all controllers share."""
    for name, entry in table_of(value, key).items():
        (_number(0.0, 1.0) if name in ("interval_s", "bus_delay_s") else table_of)(entry, f"{key}.{name}")


SCHEMA: Final[Mapping[str, Check]] = {
    "complete": _flag,
    "error": text,
    "metrics_error": text,
    "controller": _name,
    "controller_uses_truth": _flag,
    "controller_interval_s": _number(1e-9, 1e3),
    "timestep_s": _number(1e-9, 1e3),
    "slip_limit_rad": _number(0.0, 2.0),
    "overrides": table_of,
    "versions": _all(_name),
    "maneuver": table_of,
    "maneuver.name": _name,
    "maneuver.kind": _name,
    "maneuver.title": text,
    "vehicle": table_of,
    "vehicle.name": _name,
    "vehicle.single_track": _single_track,
    "vehicle.controllers": _controllers,
    "vehicle.sensors": table_of,
    "vehicle.sensors.preset": _name,
    "vehicle.sensors.seed": _number(0, 2**32 - 1),
    "vehicle.sensors.yaw_rate": _all(_number(0.0, 1e12)),
    "vehicle.controllers.ars.corrector": _all(_number(-1e12, 1e12)),
    "vehicle.controllers.afs.corrector": _all(_number(-1e12, 1e12)),
    "car": _all(lambda value, key: None if isinstance(value, list) else _number(1e-3, 100.0)(value, key)),
}
"""Checks of the values of known keys of the metadata. Road, course and car are checked in the modules that define them.
Any key may be missing. Other keys may hold any JSON within the limits above."""


def check_metadata(metadata: Mapping[str, Any]) -> None:
    """Check the size of metadata and the values of all known keys."""
    _Sizes().check(metadata, "")
    for key, check in SCHEMA.items():
        value: Any = metadata
        for part in key.split("."):
            value = value.get(part, _MISSING) if isinstance(value, Mapping) else _MISSING
        if value is not _MISSING:
            check(value, key)
    for key, check in _READERS.items():
        if key in metadata:
            check(metadata)


_MISSING: Final = object()
_READERS: Final[dict[str, Callable[[Mapping[str, Any]], Any]]] = {
    "maneuver": road_of, "course": course_of, "surface": surface_in, "car": footprint_of, "events": events_of,
}  # fmt: skip
"""Functions that read and check a value, by key of the metadata."""


def _count(count: int, most: int, what: str, **place: Any) -> None:
    limits.check_count(count, most, what, RecordingError, **{"file": "the metadata", **place})


class _Sizes:
    """Counter of the values in a tree."""

    def __init__(self) -> None:
        self._entries = self._elements = 0

    def check(self, value: Any, key: str, depth: int = 0) -> None:
        if depth > limits.MAX_METADATA_DEPTH:
            raise fail(key[:_SHOWN], f"is nested more than {limits.MAX_METADATA_DEPTH} levels deep")
        if isinstance(value, Mapping):
            self._entries += len(value)
            _count(self._entries, limits.MAX_METADATA_ENTRIES, "entries")
            for name, entry in value.items():
                _letters(name, key or "the name of an entry", limits.MAX_NAME_LETTERS)
                self.check(entry, f"{key}.{name}" if key else name, depth + 1)
        elif isinstance(value, str):
            _letters(value, key, limits.MAX_METADATA_LETTERS)
        elif isinstance(value, Sequence):
            self._elements += len(value)
            _count(self._elements, limits.MAX_METADATA_ELEMENTS, "values in lists")
            for entry in value:
                if entry.__class__ is not float:
                    self.check(entry, key, depth + 1)
        elif isinstance(value, int) and abs(value) > 2**63:
            raise fail(key, f"is a whole number of {value.bit_length()} bits, expected one of at most 64")


def _letters(value: str, key: str, maximum: int) -> None:
    """Check that a string is short enough and can be encoded in UTF-8."""
    _count(len(value), maximum, "letters", key=key[:_SHOWN])
    try:
        value.encode()
    except UnicodeEncodeError:
        raise fail(ascii(key[:_SHOWN]), "is not UTF-8 text") from None


def check_metrics(metrics: Mapping[str, Any]) -> None:
    """Check that metric names are identifiers and that values are plausible numbers."""
    _count(len(metrics), limits.MAX_CHANNELS, "metrics")
    for name, value in metrics.items():
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise RecordingError(f"metric name {name!r:.{_SHOWN}}: use letters, digits and '_', a letter first")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise RecordingError(f"metric {name!r} is {value!r:.{_SHOWN}}, not a number", key=name, value=value)
        if limits.too_large(float(value), infinite=True):
            limits.check_number(float(value), RecordingError, key=name)


def check_names(names: Sequence[Any], what: str, maximum: int) -> None:
    """Check names of bodies, parts or attachments."""
    _count(len(names), maximum, what)
    for name in names:
        if not isinstance(name, str) or not 0 < len(name) <= 255 or not name.isprintable():
            raise RecordingError(f"{what}: {name!r:.{_SHOWN}} is not a name of 1 to 255 printable characters")


def check_bodies(names: Sequence[Any]) -> None:
    """Check the names of bodies."""
    check_names(names, "bodies", limits.MAX_BODIES)
    if len({WORLD, *names}) != len(names) + 1:
        raise RecordingError(
            f"body names must differ from each other and from {WORLD!r}: {', '.join(names)}", value=tuple(names)
        )


def check_numbers(values: Sequence[Any], what: str, low: float, high: float) -> None:
    """Check sizes, positions or colours."""
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise RecordingError(f"{what}: {value!r:.{_SHOWN}} is not a number from {low:g} to {high:g}")


FORMAT_VERSION = 1
"""Version of the format; raised when an older reader could misread a file."""

STATE_TOPIC, TRANSFORMS_TOPIC, SCENE_TOPIC, EVENTS_TOPIC = "/state/", "/tf", "/scene", "/events"
RUN_RECORD, RESULT_RECORD, METRICS_RECORD = "activesteer.run", "activesteer.result", "activesteer.metrics"
"""Names of the metadata records: known before the run, known after the run, metrics."""

FORMAT_RECORD = "activesteer.format"
"""Name of the metadata record that marks a file as ours."""


LIBRARY = "activesteer "
"""Name of the writing program in the header of a file. The version follows."""


def is_recording_start(data: bytes) -> bool:
    """Return whether a file with this start is a recording of activesteer, even if damaged or empty."""
    # Magic, opcode, length of the record, then two texts with their lengths: profile and library.
    start = len(MCAP0_MAGIC) + 9
    head = MCAP0_MAGIC + bytes([Opcode.HEADER])
    profile_end = start + 4 + int.from_bytes(data[start : start + 4], "little")
    return not data or (data.startswith(head) and data[profile_end + 4 :].startswith(LIBRARY.encode()))


def metadata_texts(metadata: Mapping[str, object]) -> tuple[dict[str, str], dict[str, str]]:
    """Convert metadata to the strings of an MCAP file."""
    texts: dict[str, str] = {}
    metrics = metadata.get("metrics", {})
    if not isinstance(metrics, Mapping):
        raise RecordingError(
            f"is a {type(metrics).__name__}, expected numbers by name", file="the metadata", key="metrics"
        )
    metrics = {name: value.item() if isinstance(value, np.generic) else value for name, value in metrics.items()}
    # As in the rows, a value that is too large for a file becomes infinite.
    metrics |= {name: math.copysign(math.inf, value) for name, value in metrics.items()
                if isinstance(value, float) and abs(value) > limits.MAX_NUMBER}  # fmt: skip
    check_metrics(metrics)
    for key, value in metadata.items():
        if key in ("metrics", "events"):
            continue
        try:
            texts[str(key)] = json.dumps(value, default=_plain, ensure_ascii=False)
        except (TypeError, ValueError, RecursionError) as error:
            raise RecordingError(f"cannot be kept as JSON: {error}", file="the metadata", key=str(key)) from None
    check_metadata({key: json.loads(text) for key, text in texts.items()})
    return texts, {name: repr(float(value)) for name, value in metrics.items()}


def _plain(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"a {type(value).__name__} ({value!r})")


_FIELDS = {"box": "cubes", "cylinder": "cylinders", "sphere": "spheres"}
LINK_KINDS: Final = ("link", "spring", "damper")
"""Kinds of a `Link`."""
_MAX_SIZE_M: Final = 1e4
"""Largest size of a part, and largest distance from the origin of its body [m]."""
_LINK_KEY: Final = "activesteer.link"
"""Key in the metadata of an entity that makes it a link."""


class Primitive(NamedTuple):
    """Solid that is fixed in the frame of a body.

    Attributes:
        body: Name of the body, or `world`.
        kind: `box`, `cylinder` (its axis along z) or `sphere` (an ellipsoid).
        size_m: Full extents along x, y, z of the solid [m].
        position_m: Centre in the body frame [m].
        quaternion: Orientation in the body frame, w x y z.
        rgba: Colour and opacity, 0 to 1.
    """

    body: str
    kind: str
    size_m: tuple[float, float, float]
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    rgba: tuple[float, float, float, float] = (0.5, 0.5, 0.5, 1.0)


class Link(NamedTuple):
    """Straight line through points of bodies, such as a suspension link.

    The poses of the bodies move it.

    Attributes:
        name: Name of the part.
        kind: `link`, `spring` or `damper`.
        points: Name of the body and point in its frame [m]; at least two.
        radius_m: Radius in drawings [m].
        rgba: Colour and opacity, 0 to 1.
    """

    name: str
    kind: str
    points: tuple[tuple[str, tuple[float, float, float]], ...]
    radius_m: float = 0.01
    rgba: tuple[float, float, float, float] = (0.5, 0.5, 0.5, 1.0)


ScenePart = Primitive | Link
"""Part of a scene: a solid or a link."""


def encode_scene(parts: Iterable[ScenePart]) -> bytes:
    """Serialise a scene as a foxglove.SceneUpdate: an entity for each body with solids, and for each link."""
    # Foxglove has no solid that spans two frames: a link is an entity without a solid, with its points in the metadata.
    update = message_class(SCENE_SCHEMA)()
    entities: dict[str, Any] = {}
    parts = tuple(parts)
    for primitive in parts:
        if isinstance(primitive, Link):
            continue
        if primitive.kind not in _FIELDS:
            raise RecordingError(
                f"unknown primitive kind {primitive.kind!r}; known: {', '.join(_FIELDS)}",
                key=primitive.body,
                value=primitive.kind,
            )
        if primitive.body not in entities:
            entities[primitive.body] = _new_entity(update, primitive.body, primitive.body)
        solid = getattr(entities[primitive.body], _FIELDS[primitive.kind]).add()
        if primitive.kind == "cylinder":
            solid.bottom_scale = solid.top_scale = 1.0
        try:
            for target, names, values in (
                (solid.size, "xyz", primitive.size_m),
                (solid.pose.position, "xyz", primitive.position_m),
                (solid.pose.orientation, "wxyz", primitive.quaternion),
                (solid.color, "rgba", primitive.rgba),
            ):
                for name, value in zip(names, values, strict=True):
                    setattr(target, name, float(value))
        except (TypeError, ValueError) as error:
            raise RecordingError(
                f"a number of the {primitive.kind} is missing or wrong: {primitive} ({error})", key=primitive.body
            ) from None
    for part in parts:
        if isinstance(part, Link):
            _add_link(update, part)
    data = update.SerializeToString()
    decode_scene(data)  # refuses here what a reader would refuse
    return data


def _add_link(update: Any, link: Link) -> None:
    if link.kind not in LINK_KINDS:
        raise RecordingError(
            f"unknown link kind {link.kind!r}; known: {', '.join(LINK_KINDS)}", key=link.name, value=link.kind
        )
    if len(link.points) < 2:
        raise RecordingError(f"has {len(link.points)} points; at least 2 are needed", key=link.name)
    try:
        text = json.dumps(_link_of(link._asdict())._asdict())
    except (TypeError, ValueError) as error:
        raise RecordingError(
            f"a number of the {link.kind} is missing or wrong: {link} ({error})", key=link.name
        ) from None
    _new_entity(update, link.points[0][0], link.name).metadata.add(key=_LINK_KEY, value=text)


def _new_entity(update: Any, frame: str, name: str) -> Any:
    entity = update.entities.add(frame_id=frame, id=name, frame_locked=True)
    entity.timestamp.SetInParent()
    entity.lifetime.SetInParent()
    return entity


def _link_of(table: dict[str, Any]) -> Link:
    points = tuple((str(body), (float(x_m), float(y_m), float(z_m))) for body, (x_m, y_m, z_m) in table["points"])
    r, g, b, a = (float(value) for value in table["rgba"])
    return Link(str(table["name"]), str(table["kind"]), points, float(table["radius_m"]), (r, g, b, a))


def decode_scene(data: bytes) -> tuple[ScenePart, ...]:
    """Parse a serialised scene."""
    update = message_class(SCENE_SCHEMA).FromString(data)
    limits.check_count(len(update.entities), limits.MAX_PARTS, "entities", RecordingError, key="scene")
    primitives: list[ScenePart] = []
    for entity in update.entities:
        primitives += [_link_of(json.loads(pair.value)) for pair in entity.metadata if pair.key == _LINK_KEY]
        for kind, field in _FIELDS.items():
            for solid in getattr(entity, field):
                at, turn, size, color = solid.pose.position, solid.pose.orientation, solid.size, solid.color
                primitives.append(
                    Primitive(
                        entity.frame_id,
                        kind,
                        (size.x, size.y, size.z),
                        (at.x, at.y, at.z),
                        (turn.w, turn.x, turn.y, turn.z),
                        (color.r, color.g, color.b, color.a),
                    )
                )
    check_scene(primitives)
    return tuple(primitives)


def check_scene(parts: Sequence[ScenePart]) -> None:
    """Check that a scene can be drawn."""
    check_names([part.body if isinstance(part, Primitive) else part.name for part in parts], "parts", limits.MAX_PARTS)
    for part in parts:
        check_numbers(part.rgba, "colour", 0.0, 1.0)
        if isinstance(part, Primitive):
            check_numbers(part.size_m, f"size of a {part.kind} of {part.body}", 0.0, _MAX_SIZE_M)
            check_numbers((*part.position_m, *part.quaternion), f"pose of a {part.kind}", -_MAX_SIZE_M, _MAX_SIZE_M)
            continue
        if part.kind not in LINK_KINDS:
            raise RecordingError(f"{part.name}: unknown link kind {part.kind!r:.100}; known: {', '.join(LINK_KINDS)}")
        if len(part.points) < 2:
            raise RecordingError(f"{part.name} has {len(part.points)} points; at least 2 are needed")
        check_names([body for body, _ in part.points], f"bodies of {part.name}", limits.MAX_PARTS)
        numbers = [number for _, point in part.points for number in point]
        check_numbers([*numbers, part.radius_m], f"place or radius of {part.name}", -_MAX_SIZE_M, _MAX_SIZE_M)
