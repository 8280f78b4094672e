"""`activesteer replay FILE.mcap...`: show recordings in the rerun viewer."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_cutaway, add_recording
from activesteer.errors import ParameterError, PlaybackError


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "replay",
        help="show recordings in 3D, with signals and metrics",
        description="Open recordings in the rerun viewer, several in one window.",
    )
    add_recording(parser, several=True)
    parser.add_argument(
        "-o",
        "--output",
        "--save",
        type=Path,
        dest="output",
        metavar="OUT.rrd",
        help="write a file for the viewer instead of opening a window",
    )
    parser.add_argument("--web", action="store_true", help="serve a page for a browser until Ctrl-C")
    parser.add_argument(
        "--compare", action="store_true", help="show only the page that compares several files side by side"
    )
    add_cutaway(parser)
    parser.set_defaults(action=_replay)


def _replay(options: argparse.Namespace) -> int:
    # Threads of rerun would repeat our messages on the terminal.
    os.environ.setdefault("RUST_LOG", "warn,re_log_encoding=off,re_sdk=off")
    try:
        from activesteer.playback import Showing, runs_of, save, serve, show
    except ImportError as error:
        raise PlaybackError("replay needs the viewer rerun: pip install rerun-sdk") from error
    from activesteer.analysis.verdict import verdict
    from activesteer.recording import Recording
    from activesteer.recording.run_names import run_names

    if options.compare and len(options.files) < 2:
        raise ParameterError(f"--compare needs at least two files, and {options.files[0]} is one")
    if len(set(options.files)) != len(options.files):
        raise ParameterError(f"a file is named twice: {', '.join(str(file) for file in options.files)}")
    recordings = [Recording.open(file, recover=True) for file in options.files]
    names = run_names(options.files, recordings)
    named = dict(zip(names, recordings, strict=True))
    runs, how = runs_of(named), Showing(options.compare, options.cutaway, tuple(verdict(named)))
    if options.output is not None:
        save(runs, options.output, how)
        print(f"{options.output}: open it with `rerun {options.output}`", file=sys.stderr)
    if options.web:
        serve(runs, _announce, how)
    elif options.output is None:
        show(runs, how)
    return 0


def _announce(url: str) -> None:
    import webbrowser

    print(url, flush=True)
    print("Ctrl-C ends the server", file=sys.stderr, flush=True)
    webbrowser.open(url)
