"""`activesteer recover FILE.mcap -o OUT.mcap`: a sound file of what can be read of a broken one."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_recording
from activesteer.errors import ParameterError


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser(
        "recover",
        help="a sound file of what a killed run left",
        description="Writes what can be read of a recording that was cut short or damaged to a new file, which ends "
        "properly, so that tools that seek open it too. It stays marked as incomplete.",
    )
    add_recording(parser)
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="OUT.mcap", help="file to write")
    parser.set_defaults(action=_recover)


def _recover(options: argparse.Namespace) -> int:
    from activesteer.recording import Recording

    recording = Recording.open(options.file, recover=True)
    if options.output.exists() and options.output.samefile(options.file):
        raise ParameterError(f"-o {options.output} is the file that is to be recovered; give another name")
    recording.save(options.output)
    span = f"{len(recording)} steps up to {recording.time_s[-1]:.3f} s" if len(recording) else "no steps"
    print(f"{options.output}: {span}")
    return 0
