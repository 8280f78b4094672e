"""`activesteer fit STUDY.toml`, or `fit FOLDER`: fit parameters of a car to recordings."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from activesteer.commands.arguments import add_json, add_output, add_workers
from activesteer.commands.measured_folder import judge
from activesteer.commands.output import print_entry, print_json, print_notes
from activesteer.commands.progress import ProgressBar

if TYPE_CHECKING:
    from activesteer.measured.fitting import FitProgress


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "fit",
        help="fit parameters of a car to recordings, with intervals",
        description="Drive the inputs of recordings again, and find by least squares the values of the factors of a "
        "study for which the car matches the recordings best.",
    )
    parser.add_argument(
        "study", metavar="STUDY",
        help="a study file (or its name) with recordings as manoeuvres and a table [fit]; or a folder of measured runs "
        "with a validation.toml, or bmw_m8: fitted in one window, judged in another",
    )  # fmt: skip
    add_output(parser, "DIR", "folder for fit.json, fit.html and overrides.toml, or for page.html (default: none)")
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_fit)


def _fit(options: argparse.Namespace) -> int:
    from activesteer.measured.folder_file import is_measured

    if is_measured(options.study):
        page = None if options.output is None else options.output / "page.html"
        return judge(options.study, options, page=page, fitted=True)
    from activesteer.measured.fit_result import rests_on
    from activesteer.measured.fitting import fit

    with ProgressBar("fit", quiet=options.json) as bar:

        def progress(here: FitProgress) -> None:
            so_far = "" if math.isnan(here.misfit) else f", differences {here.misfit:.3g} times the noise"
            bar(here.done / here.total, f"round {here.round}, {here.done}/{here.total} runs{so_far}")

        found = fit(options.study, jobs=options.jobs, scheduler=options.scheduler, progress=progress)
    files = []
    if options.output is not None:
        from activesteer.measured.fit_page import write_fit

        files = write_fit(found, Path(options.study).stem, options.output)
    print_notes(found.notes)
    if options.json:
        print_json(found.to_json())
        return 0
    width = max(len(one.key) for one in found.parameters)
    for one in found.parameters:
        print(f"{one.key:{width}}  {one.words}")
    for one, other, value in found.pairs(0.5):
        print(f"correlation {value:+.2f}  {one}, {other}")
    for recording, label, noise, before, after, samples, independent in (each.words() for each in found.compared):
        print(f"  {recording}: {label:24} noise {noise:>12}   rms {before:>12} -> {after:>12}   "
              f"{independent} of {samples} samples independent")  # fmt: skip
    print(f"{found.rounds} rounds, {found.runs} runs; the remaining difference is {found.misfit:.3g} times the noise")
    for line in rests_on(found)[:1]:
        print_entry("", line, hanging=0)
    for path in files:
        print(path)
    return 0
