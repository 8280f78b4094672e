"""Conversion of recordings to a rerun stream with its layout."""

from __future__ import annotations

import re
from collections.abc import Sequence

import rerun as rr
import rerun.blueprint as rrb

from activesteer.playback.car import send_car, send_ghost
from activesteer.playback.course import send_course, send_road, send_track
from activesteer.playback.events import send_events
from activesteer.playback.layout import SUMMARY
from activesteer.playback.legend import LEGEND, LEGEND_OF_RUNS, send_legend
from activesteer.playback.links import send_links
from activesteer.playback.plots import curves, pages, send_plots
from activesteer.playback.runs import Run
from activesteer.playback.showing import Showing
from activesteer.playback.summary import summary
from activesteer.playback.tyres import send_tyre_forces
from activesteer.playback.wheel_angles import send_wheel_angles


def new_stream(runs: Sequence[Run], *, compare: bool) -> rr.RecordingStream:
    """Return a stream that has no target yet.

    The viewer keeps one layout for each application id while it is open. Another manoeuvre or other runs need another
    layout, so they have another id.
    """
    maneuver = runs[0].recording.metadata.get("maneuver", {})
    words = ["activesteer", str(maneuver.get("name", "")), *(run.name for run in runs), "compared" if compare else ""]
    # An application id may contain letters, digits, spaces, - and _ only.
    stream = rr.RecordingStream(re.sub(r"[^A-Za-z0-9_-]+", " ", " ".join(words)).strip())
    stream.send_recording_name(str(maneuver.get("title") or "activesteer"))
    return stream


def fill(stream: rr.RecordingStream, runs: Sequence[Run], layout: rrb.Blueprint, how: Showing) -> None:
    """Send all data of the runs.

    Args:
        stream: Target of the data; choose its own target first.
        runs: The runs.
        layout: The layout; it replaces a layout that the viewer remembers.
        how: Display options.
    """
    stream.send_blueprint(layout, make_active=True, make_default=True)
    several = len(runs) > 1
    stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    send_road(stream, runs)
    send_course(stream, runs)
    for run in runs:
        send_car(stream, run, cutaway=how.cutaway)
        send_links(stream, run)
        send_tyre_forces(stream, run, runs)
        send_wheel_angles(stream, run, runs)
        send_track(stream, run, runs.index(run))
        for other in runs:
            if other is not run:
                send_ghost(stream, run, other)
        send_plots(stream, run, alone=not several)
        for page, shown in pages(run).items():
            send_legend(stream, f"{LEGEND}/{run.name}/{page}", curves(shown, run, alone=not several))
        send_events(stream, run)
    if several:
        send_legend(stream, LEGEND_OF_RUNS, {run.label: run.colour for run in runs})
    text = rr.TextDocument(summary(runs, how.verdict), media_type=rr.MediaType.MARKDOWN)
    stream.log(SUMMARY, text, static=True)
    stream.flush()
