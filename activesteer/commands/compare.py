"""`activesteer compare MEASURED... SIMULATED`, or `compare FOLDER`: compare measured runs with simulated ones."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_json, add_output, add_workers
from activesteer.commands.measured_folder import add_samples, judge
from activesteer.commands.output import BAD, GOOD, painted, print_json
from activesteer.errors import ParameterError


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "compare",
        help="compare measured runs with a simulated one",
        description="Find the time shift, and print the share of the measurement inside the tolerance corridor of "
        "the simulation. With a folder of measured runs, or of a measured circle, predict the measurement first. The "
        "exit status is 1 if a quantity is outside.",
    )
    parser.add_argument(
        "files", nargs="*", type=Path, metavar="FILE.mcap",
        help="recordings: measured ones, whose mean is compared, and the simulated one last; or a folder with a "
        "validation.toml, or bmw_m8 or tesla_model_s",
    )  # fmt: skip
    parser.add_argument(
        "--new", type=Path, metavar="FOLDER", help="make a folder with an example, to be replaced by your measured runs"
    )
    parser.add_argument(
        "--standard", choices=("iso19364", "iso19365"),
        help="iso19364: cross plots over the lateral acceleration, for steady-state driving; iso19365: over time "
        "(default)",
    )  # fmt: skip
    parser.add_argument(
        "--filter", choices=("iso15037", "fmvss126", "none"),
        help="zero-phase Butterworth filter of both sides: iso15037 (8 poles, 10.1 Hz; default), fmvss126 (12 poles, "
        "6 Hz, steering wheel 10 Hz), or none",
    )  # fmt: skip
    parser.add_argument(
        "--noise", choices=("estimate", "none"),
        help="widen the corridor by the noise of the measurement, estimated from it (default), or not",
    )  # fmt: skip
    add_output(parser, "FILE.html", "the page (default: no page)")
    add_samples(parser)
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_compare)


def _compare(options: argparse.Namespace) -> int:
    if options.new is not None:
        from activesteer.measured.example_folder import write_template

        if options.files:
            raise ParameterError("makes a new folder and compares nothing", key="--new")
        for file in write_template(options.new):
            print(file)
        print(f"next: activesteer fit {options.new} -o {options.new}/page; then replace the lines marked with <-")
        return 0
    of_recordings, of_folder = ("standard", "filter", "noise"), ("samples", "jobs", "scheduler")
    is_folder = len(options.files) == 1 and options.files[0].suffix != ".mcap"
    for name in of_recordings if is_folder else of_folder:
        if getattr(options, name) is not None:
            raise ParameterError(f"has no effect with {'a folder' if is_folder else 'recordings'}", key=f"--{name}")
    if is_folder:
        return judge(str(options.files[0]), options, page=options.output)
    return _recordings(options)


def _recordings(options: argparse.Namespace) -> int:
    from activesteer.measured.comparison import compare, words
    from activesteer.measured.noise import FILTERS
    from activesteer.recording import Recording

    if len(options.files) < 2:
        raise ParameterError("at least two recordings are needed: measured ones, and the simulated one last")
    *measured, simulated = (Recording.open(file, recover=True) for file in options.files)
    found = compare(
        measured, simulated, options.standard or "iso19365", filtered=options.filter or "iso15037",
        noise=options.noise != "none",
    )  # fmt: skip
    if options.output is not None:
        from activesteer.measured.comparison_page import comparison_page
        from activesteer.pages import write_page

        names = [file.stem for file in options.files]
        write_page(comparison_page(found, names[:-1], names[-1]), options.output)
    if options.json:
        print_json(found.to_json())
        return 0 if found.inside else 1
    for file, shift_s in zip(options.files, found.shifts_s, strict=False):
        later = "unknown (nothing moves)" if math.isnan(shift_s) else f"{round(1e3 * shift_s, 1) + 0.0:+.1f} ms"
        print(f"time shift of {file}: {later}")
    chosen = FILTERS[found.filtered]
    print(f"filter of both sides: {'none' if chosen is None else chosen.words()}")
    for problem in found.unfiltered:
        print(f"not filtered: {problem}")
    for each in found.quantities:
        label, residual, tolerance, share, _ = words(each)
        print(f"  {label:24} rms {residual:>14}   {tolerance:>30}   {share:>7} {_verdict(each.inside)}")
    print(_verdict(found.inside))
    if options.output is not None:
        print(f"page: {options.output}")
    return 0 if found.inside else 1


def _verdict(inside: bool) -> str:
    return painted("inside", GOOD) if inside else painted("outside", BAD)
