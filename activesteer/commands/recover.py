"""`activesteer recover FILE.mcap -o OUT.mcap`: write the readable part of a broken recording to a new file."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_recording
from activesteer.errors import ParameterError


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "recover",
        help="repair the recording of a killed run",
        description="Write the readable part of a damaged or cut recording to a new file that ends properly, so that "
        "all tools can open it. The new file stays marked as incomplete.",
    )
    add_recording(parser)
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT.mcap", help="the new file")
    parser.set_defaults(action=_recover)


def _recover(options: argparse.Namespace) -> int:
    from activesteer.recording import Recording

    recording = Recording.open(options.file, recover=True)
    if options.output.exists() and options.output.samefile(options.file):
        raise ParameterError(f"-o {options.output} is the input file; choose another name")
    recording.save(options.output)
    span = f"{len(recording)} steps up to {recording.time_s[-1]:.3f} s" if len(recording) else "no steps"
    print(f"{options.output}: {span}")
    return 0
