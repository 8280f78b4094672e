"""`activesteer video FILE.mcap`: make a film of a recording."""

from __future__ import annotations

import argparse
import re
import sys
import time
from pathlib import Path
from typing import Any, Final

from activesteer.commands.arguments import add_cutaway, add_output, add_pace, add_recording
from activesteer.commands.progress import ProgressBar
from activesteer.errors import ParameterError

_CORNERS: Final = ("fl", "fr", "rl", "rr")
"""As in `activesteer.conventions`, which takes too long to import for `--help`."""


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "video",
        help="make a film of a recording",
        description="Draw a recording without a window, and write an MP4 or a GIF.",
    )
    add_recording(parser)
    add_output(parser, "OUT.mp4|gif", "the film (default: FILE.mp4 beside the recording)")
    parser.add_argument(
        "--camera", default="chase", choices=("chase", "top", "wheel"), help="camera position (default: chase)"
    )
    parser.add_argument("--corner", choices=_CORNERS, help="wheel for the camera `wheel` (default: fl)")
    parser.add_argument(
        "--compare", type=Path, action="append", default=[], metavar="OTHER.mcap",
        help="also show the car of another recording; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--layout", default="overlay", choices=("overlay", "side-by-side"),
        help="transparent cars in one picture, or one picture for each car (default: overlay)",
    )  # fmt: skip
    parser.add_argument(
        "--gauges", default="full", choices=("full", "sideslip"),
        help="all gauges, or one large sideslip angle for each car (default: full)",
    )  # fmt: skip
    parser.add_argument("--size", type=_size, default=(1280, 720), metavar="WxH", help="pixels (default: 1280x720)")
    parser.add_argument("--fps", type=float, help="pictures per second (default: 30, GIF: 20)")
    add_pace(parser)
    add_cutaway(parser)
    parser.set_defaults(action=_video)


def _size(text: str) -> tuple[int, int]:
    """`1280x720`."""
    found = re.fullmatch(r"(\d{1,6})[x*](\d{1,6})", text.strip().lower())
    if found is None:
        raise argparse.ArgumentTypeError(f"{text!r} is no size such as 1280x720")
    return int(found[1]), int(found[2])


def _video(options: argparse.Namespace) -> int:
    from activesteer.analysis.verdict import verdict
    from activesteer.recording import Recording
    from activesteer.recording.run_names import run_names
    from activesteer.video import Settings, make_film

    files = [options.file, *options.compare]
    for number, other in enumerate(files):
        if other.resolve() in [file.resolve() for file in files[:number]]:
            raise ParameterError(f"--compare {other}: this file is already shown")
    if options.corner and options.camera != "wheel":
        raise ParameterError("belongs to --camera wheel", key="--corner", value=options.corner)
    if options.layout == "side-by-side" and not options.compare:
        raise ParameterError("--layout side-by-side needs --compare OTHER.mcap")
    recordings = [Recording.open(file, recover=True) for file in files]
    output = options.output if options.output is not None else options.file.with_suffix(".mp4")
    rate = options.fps if options.fps is not None else 20.0 if output.suffix.lower() == ".gif" else 30.0
    settings = Settings(
        options.camera,
        options.corner or _CORNERS[0],
        options.size,
        rate,
        options.speed,
        options.layout,
        gauges=options.gauges,
        cutaway=options.cutaway,
    )
    named = dict(zip(run_names(files, recordings), recordings, strict=True))
    started = time.monotonic()
    with ProgressBar(f"{output}", quiet=False) as progress:
        made = make_film(named, output, settings, progress, verdict(named))
    took = time.monotonic() - started
    print(
        f"{output}: {made.pictures} pictures, {made.pictures / made.rate_hz:.1f} s at {made.rate_hz:g} a second, "
        f"made in {took:.1f} s",
        file=sys.stderr,
    )
    return 0
