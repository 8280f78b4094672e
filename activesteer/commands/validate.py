"""`activesteer validate`: compare a car with another multibody code or with a measurement."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_json, add_output, add_workers
from activesteer.commands.output import BAD, painted, print_json, print_notes, tell, tell_files
from activesteer.commands.progress import ProgressBar
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.errors import ParameterError


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("validate", help="compare a car with another multibody code or a measurement")
    parser.add_argument(
        "name",
        nargs="?",
        default="sedan",
        metavar="NAME",
        help="a car of the package: sedan, tesla_model_s, bmw_m8 (default: sedan); or a folder with measured runs and "
        "a validation.toml",
    )
    parser.add_argument(
        "--new", type=Path, metavar="FOLDER", help="make a folder with an example, to be replaced by your measured runs"
    )
    add_output(parser, "DIR", "folder for page, JSON and runs (default: no files)")
    parser.add_argument(
        "--reference", type=Path, metavar="DIR", help="folder with further reference runs NAME.csv in the same columns"
    )
    parser.add_argument(
        "--study", action="store_true",
        help="also compute the effect of the other code's tyre simplifications and of the step size",
    )  # fmt: skip
    parser.add_argument(
        "--samples", type=int, metavar="N",
        help="number of samples of mass, tyre, radius and lateral acceleration for a car measured on the road "
        "(default: 200)",
    )  # fmt: skip
    parser.add_argument("--timestep", type=float, metavar="S", help="step of the simulation [s] (default: 0.001)")
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_validate)


def _validate(options: argparse.Namespace) -> int:
    if options.new is not None:
        from activesteer.validation.template import write_template

        for file in write_template(options.new):
            print(file)
        print(f"next: activesteer validate {options.new} -o {options.new}/page; then replace the lines marked with <-")
        return 0
    from activesteer.validation.measured_circle import is_measured
    from activesteer.validation.measured_file import measured_folder

    circle, folder = is_measured(options.name), measured_folder(options.name)
    code = not circle and folder is None
    belongs = {"reference": (code, "another code"), "study": (code, "another code"), "timestep": (code, "another code"),
               "samples": (circle, "a measured circle")}  # fmt: skip
    for name, (allowed, other) in belongs.items():
        if getattr(options, name) and not allowed:
            raise ParameterError(f"belongs to a comparison with {other}; {options.name} is none", key=f"--{name}")
    if circle:
        return _circle(options)
    if folder is not None:
        return _measured(options, folder)
    from activesteer.validation import to_json, validate
    from activesteer.validation.programme import write_json, write_runs
    from activesteer.validation.study import TITLES, as_text, responses
    from activesteer.validation.validation_page import write_page

    with ProgressBar("validate", quiet=options.json) as bar:
        result = validate(
            options.name,
            more=options.reference,
            timestep_s=options.timestep or DEFAULT_TIMESTEP_S,
            jobs=options.jobs,
            scheduler=options.scheduler,
            unknown_runs=options.output is not None,
            progress=bar,
        )
    tables = {}
    if options.study:
        with ProgressBar("study", quiet=options.json) as bar:
            tables = responses(result.reference, bar, options.jobs, scheduler=options.scheduler)
    titled = {TITLES[key]: rows for key, rows in tables.items()}
    files: list[Path] = []
    if options.output is not None:
        files = [
            write_page(result, options.output / "validation.html", titled),
            write_json(result, options.output / "validation.json"),
            *write_runs(result, options.output / "runs"),
        ]
    status = 1 if result.outside else 0
    if options.json:
        print_json(to_json(result.comparisons) | {key: [row._asdict() for row in rows] for key, rows in tables.items()})
        return status
    for comparison in result.comparisons:
        mark = {True: " ", False: "!", None: "~"}[comparison.inside]
        run, quantity, ours, theirs, error, tolerance = comparison.words()
        line = f"{mark} {run:13} {quantity:42} {ours:>15} {theirs:>15} {error:>14} {tolerance:>9}"
        print(painted(line, BAD) if comparison.inside is False else line)
    kept = result.judged - len(result.outside)
    print(f"{kept} of {result.judged} comparisons within tolerance (! outside, ~ no tolerance)")
    if options.output is not None:
        print(f"page: {files[0]}\nruns: {len(result.runs)} CSV files in {options.output / 'runs'}")
    for title, rows in titled.items():
        print(as_text(title, rows))
    return status


def _circle(options: argparse.Namespace) -> int:
    from activesteer.validation.circle_page import write_circle_page
    from activesteer.validation.measured_circle import SAMPLES, validate_circle

    with ProgressBar("validate", quiet=options.json) as bar:
        result = validate_circle(
            options.name, options.samples or SAMPLES, options.jobs, scheduler=options.scheduler, progress=bar
        )  # fmt: skip
    tell(options, result.as_table(), [result.text()])
    if options.output is not None:
        tell_files(options, [write_circle_page(result, options.output / "validation.html")], "page")
    return 0 if result.inside else 1


def _measured(options: argparse.Namespace, folder: Path) -> int:
    from activesteer.validation.measured_file import read_measured
    from activesteer.validation.measured_folder import validate_measured
    from activesteer.validation.measured_page import measured_text, write_measured_page

    file = read_measured(folder)
    with ProgressBar("validate", quiet=options.json) as bar:
        result = validate_measured(file, options.jobs, scheduler=options.scheduler, progress=bar)
    print_notes(result.notes)
    tell(options, result.to_json(), [measured_text(result)])
    if options.output is not None:
        tell_files(options, [write_measured_page(result, options.output / "validation.html")], "page")
    return 0 if result.inside else 1
