"""Folders of measured runs, as `activesteer compare` and `fit` treat them."""

from __future__ import annotations

import argparse
from pathlib import Path

from activesteer.commands.output import print_notes, tell, tell_files
from activesteer.commands.progress import ProgressBar
from activesteer.errors import ParameterError


def add_samples(parser: argparse.ArgumentParser) -> None:
    """Add `--samples`."""
    parser.add_argument(
        "--samples", type=int, metavar="N",
        help="with a measured circle: number of samples of what varies from lap to lap (default: 200)",
    )  # fmt: skip


def judge(name: str, options: argparse.Namespace, *, page: Path | None, fitted: bool = False) -> int:
    """Predict a measurement, with `fitted` also fit the factors of the folder, and print the verdict.

    Args:
        name: Folder, or name of a folder of the package.
        options: `samples`, `jobs`, `scheduler` and `json` of the command.
        page: File of the page; None for no page.
        fitted: Whether the factors are fitted in one window and judged in another.

    Returns:
        Exit status: 1 if a quantity is outside its tolerance.
    """
    from activesteer.measured.circle import SAMPLES, validate_circle
    from activesteer.measured.folder import validate_measured
    from activesteer.measured.folder_file import measured_folder, read_measured
    from activesteer.measured.folder_page import measured_page
    from activesteer.pages import write_page

    file = read_measured(measured_folder(name))
    jobs, scheduler, is_circle = options.jobs, options.scheduler, file.table.circle is not None
    if fitted and (is_circle or not file.factors):
        raise ParameterError(f"{name} has nothing to fit; activesteer compare {name} predicts it", value=name)
    samples = getattr(options, "samples", None)
    if samples is not None and not is_circle:
        raise ParameterError(f"has an effect with a measured circle only, and {name} is none", key="--samples")
    with ProgressBar("fit" if fitted else "compare", quiet=options.json) as bar:
        if is_circle:
            result = validate_circle(file, samples or SAMPLES, jobs, scheduler=scheduler, progress=bar)
        else:
            result = validate_measured(file, jobs, fitted=fitted, scheduler=scheduler, progress=bar)
            print_notes(result.notes)
    told = measured_page(result)
    tell(options, result.to_json(), (*told.lines(), "inside" if result.inside else "outside"))
    if page is not None:
        tell_files(options, [write_page(told, page)], "page")
    return 0 if result.inside else 1
