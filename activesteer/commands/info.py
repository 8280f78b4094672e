"""`activesteer info FILE.mcap`: print the contents of a recording; with `--recover`, repair it."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from activesteer.commands.arguments import add_json, add_recording
from activesteer.commands.output import print_entry, print_json
from activesteer.errors import ParameterError, shown
from activesteer.files import shown_path

if TYPE_CHECKING:
    from activesteer.recording import Recording


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("info", help="print the contents of a recording, or repair it")
    add_recording(parser)
    parser.add_argument(
        "--recover", type=Path, metavar="OUT.mcap",
        help="instead, write the readable part of a damaged or cut recording to a new file, which stays marked as "
        "incomplete",
    )  # fmt: skip
    add_json(parser)
    parser.set_defaults(action=_info)


def _info(options: argparse.Namespace) -> int:
    from activesteer.analysis.loss_of_control import kept, losses
    from activesteer.analysis.tables import comparison
    from activesteer.recording import Recording
    from activesteer.recording.events import events_of

    recording = Recording.open(options.file, recover=True)
    if options.recover is not None:
        return _recover(recording, options)
    metadata = recording.metadata
    time_s = recording.time_s
    if options.json:
        channels = {each.name: {"unit": each.unit, "meaning": each.meaning} for each in recording.channels}
        span = {"from_s": float(time_s[0]), "to_s": float(time_s[-1])} if len(time_s) else {}
        print_json(
            {"steps": len(time_s), **span, "metadata": metadata, "metrics": recording.metrics, "channels": channels}
        )
        return 0
    span = f"{time_s[0]:.3f} to {time_s[-1]:.3f} s, {len(time_s)} steps" if len(time_s) else "no steps"
    print(f"{shown_path(options.file)}: {span}")
    for key in ("maneuver", "vehicle"):
        table = metadata.get(key, {})
        print_entry(f"{key}: ", f"{table.get('name', '?')} {table.get('title', '')}")
    uses_truth = ", which uses the truth" if metadata.get("controller_uses_truth") else ""
    print_entry("controller: ", f"{metadata.get('controller', '?')}{uses_truth}")
    sensors = metadata.get("vehicle", {}).get("sensors", {})
    if "seed" in sensors or sensors.get("preset", "ideal") != "ideal":
        print_entry("sensors: ", f"{sensors.get('preset', '?')}, seed {sensors.get('seed', 'none')}")
    print_entry("driver: ", _driver(metadata.get("driver", "?")))
    for key in ("overrides", "versions"):
        if metadata.get(key):
            print_entry(f"{key}: ", ", ".join(f"{name} {value}" for name, value in metadata[key].items()))
    for event in events_of(metadata):
        print_entry(f"at {event.time_s:.3f} s: ", f"{event.kind} {event.what}")
    if not metadata.get("complete", True):
        print_entry("INCOMPLETE: ", str(metadata.get("error", "the run did not end properly")))
    if result := [*losses(recording.metrics), *kept(recording.metrics)]:
        print_entry("result: ", ", ".join(result))
    if recording.metrics:
        print(comparison({"metrics": recording.metrics}))
    print("channels:")
    width = max((len(channel.name) for channel in recording.channels), default=0)
    for channel in recording.channels:
        head = f"  {channel.name:{width}} {channel.unit or '-':6} "
        print_entry(head, channel.meaning, len(head))
    print_entry("attachments: ", ", ".join(recording.attachments))
    return 0


def _recover(recording: Recording, options: argparse.Namespace) -> int:
    if options.json:
        raise ParameterError("has no effect with --recover", key="--json")
    if options.recover.exists() and options.recover.samefile(options.file):
        raise ParameterError(f"--recover {options.recover} is the input file; choose another name")
    recording.save(options.recover)
    span = f"{len(recording)} steps up to {recording.time_s[-1]:.3f} s" if len(recording) else "no steps"
    print(f"{options.recover}: {span}")
    return 0


def _driver(recorded: Any) -> str:
    """Name and parameters of the driver; recordings of earlier versions hold the name only."""
    if not isinstance(recorded, dict):
        return str(recorded)
    numbers = recorded.get("parameters", recorded)
    words = (
        f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {shown(value)}"
        for key, value in numbers.items()
        if key not in ("name", "title")
    )
    said = ", ".join(words)
    return f"{recorded.get('name', '?')} {recorded.get('title', '')}".rstrip() + (f" ({said})" if said else "")
