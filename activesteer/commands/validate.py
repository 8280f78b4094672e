"""`activesteer validate`: compare a car with another multibody code or with a measurement."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from activesteer.commands.arguments import add_json, add_output, add_workers
from activesteer.commands.output import BAD, painted, print_json, print_notes, tell, tell_files
from activesteer.commands.progress import ProgressBar
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.errors import ParameterError
from activesteer.files import write_json

if TYPE_CHECKING:
    from activesteer.validation.measured_file import MeasuredFile


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
    from activesteer.validation.measured_file import measured_folder, read_measured

    folder = measured_folder(options.name)
    file = None if folder is None else read_measured(folder)
    circle = file is not None and file.table.circle is not None
    belongs = {"reference": (file is None, "another code"), "study": (file is None, "another code"),
               "timestep": (file is None, "another code"), "samples": (circle, "a measured circle")}  # fmt: skip
    for name, (allowed, other) in belongs.items():
        if getattr(options, name) and not allowed:
            raise ParameterError(f"belongs to a comparison with {other}; {options.name} is none", key=f"--{name}")
    return _code(options) if file is None else _measured(options, file)


def _code(options: argparse.Namespace) -> int:
    from activesteer.pages import write_page
    from activesteer.validation import to_json, validate
    from activesteer.validation.programme import write_runs
    from activesteer.validation.study import TITLES, responses
    from activesteer.validation.validation_page import comparison_table, study_table, validation_page

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
            write_page(validation_page(result, titled), options.output / "validation.html"),
            write_json(options.output / "validation.json", to_json(result.comparisons), ParameterError),
            *write_runs(result, options.output / "runs"),
        ]
    status = 1 if result.outside else 0
    if options.json:
        print_json(to_json(result.comparisons) | {key: [row._asdict() for row in rows] for key, rows in tables.items()})
        return status
    for line in comparison_table(result.comparisons).lines():
        print(painted(line, BAD) if line.startswith("!") else line)
    kept = result.judged - len(result.outside)
    print(f"{kept} of {result.judged} comparisons within tolerance (! outside, ~ no tolerance)")
    if options.output is not None:
        print(f"page: {files[0]}\nruns: {len(result.runs)} CSV files in {options.output / 'runs'}")
    for title, rows in titled.items():
        print("\n".join((title, *study_table(rows).lines())))
    return status


def _measured(options: argparse.Namespace, file: MeasuredFile) -> int:
    from activesteer.pages import write_page
    from activesteer.validation.circle import SAMPLES, validate_circle
    from activesteer.validation.measured_folder import validate_measured
    from activesteer.validation.measured_page import measured_page

    with ProgressBar("validate", quiet=options.json) as bar:
        if file.table.circle is None:
            result = validate_measured(file, options.jobs, scheduler=options.scheduler, progress=bar)
            print_notes(result.notes)
        else:
            result = validate_circle(
                file, options.samples or SAMPLES, options.jobs, scheduler=options.scheduler, progress=bar
            )
    page = measured_page(result)
    tell(options, result.to_json(), (*page.lines(), "inside" if result.inside else "outside"))
    if options.output is not None:
        tell_files(options, [write_page(page, options.output / "validation.html")], "page")
    return 0 if result.inside else 1
