"""`activesteer test`: test a car by a standard, with verdict and page."""

from __future__ import annotations

import argparse
from typing import Any

from activesteer.commands.arguments import (
    add_car,
    add_controller,
    add_driver,
    add_json,
    add_output,
    add_workers,
    overrides_of,
)
from activesteer.commands.output import coloured, print_entry, print_json
from activesteer.commands.progress import ProgressBar
from activesteer.errors import ParameterError
from activesteer.files import write_json


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("test", help="test a car by a standard")
    parser.add_argument(
        "standard",
        metavar="STANDARD",
        nargs="?",
        default="",
        help="name of the standard (default: print all names)",
    )
    add_controller(parser, several=True)
    add_car(parser)
    add_driver(parser, default="the driver of the standard")
    add_output(parser, "DIR", "folder for page, JSON and runs; an interrupted test is resumed there (default: none)")
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_test)


def _test(options: argparse.Namespace) -> int:
    from activesteer.pages import write_page
    from activesteer.standards.examination import examine
    from activesteer.standards.examination_page import examination_page

    if options.output is not None:
        options.how_to_resume = "; the same command resumes it"
    with ProgressBar(options.standard, quiet=options.json) as bar:
        result = examine(
            options.standard,
            options.controller or ["none"],
            options.vehicle,
            overrides_of(options),
            driver=options.driver,
            output=options.output,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=lambda controller, series, done, total: bar(
                done / total, f"{controller}: {series} {done}/{total}"
            ),
        )
    files = []
    if options.output is not None:
        name = result.standard.name
        files = [
            write_page(examination_page(result), options.output / f"{name}.html"),
            write_json(options.output / f"{name}.json", result.to_json(), ParameterError),
        ]
    status = 1 if result.failed else 0
    if options.json:
        print_json(result.to_json())
        return status
    print(result.standard.title)
    for controller, found in result.findings.items():
        word = {True: "passed", False: "FAILED", None: ""}[found.passed]
        print_entry(coloured(f"{controller:12} {word:7}"), found.summary, 20)
    for path in files:
        print(f"written: {path}")
    return status
