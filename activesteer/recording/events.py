"""Events of a run: what was changed on the way, which fault was set, which phase began.

In a file an event is a message of Foxglove's log, so other tools show it on their time axis. In the metadata the events
are a list of tables with the fields of `Event`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final, NamedTuple

from activesteer import limits
from activesteer.errors import RecordingError
from activesteer.recording.schemas import LOG_SCHEMA, message_class
from activesteer.road.recorded import fail, sequence, table_of, text

_INFO: Final = 2
"""Level of the messages in Foxglove's log."""


class Event(NamedTuple):
    """An event.

    Attributes:
        time_s: Time at which the next step began [s].
        kind: `set` for a changed key, `fail` for a fault, `phase` for a phase of the manoeuvre, `note` for a limit of
            accuracy.
        what: The change (`road.mu = 0.3`), the fault (`rear:stuck`), the name of the phase, or the limit in words.
    """

    time_s: float
    kind: str
    what: str


def events_of(metadata: Mapping[str, Any]) -> list[Event]:
    """Return the events in the metadata of a recording."""
    listed = sequence(metadata.get("events", ()), "events")
    limits.check_count(len(listed), limits.MAX_EVENTS, "entries", RecordingError, file="the metadata", key="events")
    return [_event(entry, f"events.{index}") for index, entry in enumerate(listed)]


def tables_of(events: Iterable[Event]) -> list[dict[str, Any]]:
    """Return events as the list of tables that the metadata hold."""
    return [event._asdict() for event in events]


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
