"""Events of a run: what was changed on the way, active faults, and actuators at their limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from activesteer.playback.runs import Run
from activesteer.playback.timeline import times
from activesteer.recording.contents import events_of
from activesteer.units import display_unit

_LIMIT: Final = "_saturated"
_SHORTEST_S: Final = 0.05
"""Shorter interruptions of a saturation are ignored [s]."""


class Event(NamedTuple):
    """Begin or end of a fault or a saturation, or a recorded event.

    Attributes:
        time_s: Time of the event [s].
        text: Description.
        level: Level of the viewer's log.
    """

    time_s: float
    text: str
    level: rr.TextLogLevel


def events(run: Run) -> list[Event]:
    """Return the faults of the manoeuvre, the recorded events and the saturations, sorted by time."""
    found = [*_faults(run), *_recorded(run), *_limits(run)]
    return sorted(found, key=lambda event: event.time_s)


def _recorded(run: Run) -> list[Event]:
    levels = {"fail": ("FAULT ", rr.TextLogLevel.ERROR)}
    found = []
    for event in events_of(run.recording.metadata):
        start, level = levels.get(event.kind, (f"{event.kind}: ", rr.TextLogLevel.INFO))
        found.append(Event(event.time_s, start + event.what, level))
    return found


def _faults(run: Run) -> list[Event]:
    maneuver = run.recording.metadata.get("maneuver")
    faults = maneuver.get("fault") if isinstance(maneuver, Mapping) else None
    last_s = float(run.recording.time_s[-1])
    found = []
    for fault in faults if isinstance(faults, list | tuple) else ():
        if not isinstance(fault, Mapping):
            continue
        name = f"{fault.get('part', '?')}: {fault.get('kind', '?')}{_size(fault)}"
        ends = (("start_s", f"FAULT {name}", rr.TextLogLevel.ERROR), ("end_s", f"{name} is over", rr.TextLogLevel.INFO))
        for key, text, level in ends:
            time_s = fault.get(key)
            if isinstance(time_s, int | float) and time_s <= last_s:
                found.append(Event(float(time_s), text, level))
    return found


def _size(fault: Mapping[str, Any]) -> str:
    """Return the size of a fault in display units."""
    said = ""
    for key, value in fault.items():
        if key == "side":
            said += f" {value}"
        elif (key == "delay_s" or key.startswith("size_")) and isinstance(value, int | float):
            unit, factor = display_unit(key)
            said += f" {factor * value:.4g} {unit}"
    return said


def _limits(run: Run) -> list[Event]:
    found = []
    time_s = run.recording.time_s
    for channel in run.recording.channels:
        if not channel.name.endswith(_LIMIT):
            continue
        begins, ends = _spans(run.channel(channel.name) > 0.5, time_s)
        what = channel.name.removesuffix(_LIMIT).replace("_", " ")
        found += [Event(float(when), f"{what} at its limit", rr.TextLogLevel.WARN) for when in begins]
        found += [Event(float(when), f"{what} no longer at its limit", rr.TextLogLevel.INFO) for when in ends]
    return found


def _spans(active: np.ndarray, time_s: np.ndarray) -> tuple[list[float], list[float]]:
    """Return the times at which a flag rises and falls, with short gaps closed."""
    edges = np.diff(np.concatenate(([False], active)).astype(np.int8))
    begins, ends = list(time_s[edges > 0]), list(time_s[edges < 0])
    kept_begins, kept_ends = begins[:1], []
    for end, begin in zip(ends, begins[1:], strict=False):
        if begin - end >= _SHORTEST_S:
            kept_ends.append(end)
            kept_begins.append(begin)
    return kept_begins, kept_ends + ends[len(begins) - 1 :] if begins else []


def send_events(stream: rr.RecordingStream, run: Run) -> None:
    """Send the warnings of a run, if it has any."""
    found = events(run)
    if found:
        when = times(np.array([event.time_s for event in found]))
        texts, levels = [event.text for event in found], [event.level for event in found]
        stream.send_columns(_path(run), when, rr.TextLog.columns(text=texts, level=levels))


def view(runs: Sequence[Run]) -> list[rrb.TextLogView]:
    """Return the view of the warnings of these runs, or None if there are none."""
    paths = [f"/{_path(run)}" for run in runs if events(run)]
    return [rrb.TextLogView(origin="/", contents=paths, name="Warnings")] if paths else []


def _path(run: Run) -> str:
    return f"{run.name}/warnings"
