"""`activesteer report FILE.mcap...`: compare runs on one HTML page."""

from __future__ import annotations

import argparse
from typing import Any

from activesteer.commands.arguments import add_output, add_recording


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "report",
        help="compare recordings on one HTML page",
        description="Write a page that needs no network: scorecard, plots, track, metrics, parameters, versions.",
    )
    add_recording(parser, several=True)
    add_output(parser, "FILE.html", "the page; replaces an existing one", "report.html")
    parser.set_defaults(action=_report)


def _report(options: argparse.Namespace) -> int:
    from activesteer.analysis.report import open_all, write_report
    from activesteer.errors import ParameterError

    if options.output.suffix.lower() not in {".html", ".htm"}:
        raise ParameterError(f"-o {options.output}: the name of a report ends in .html")

    print(f"report: {write_report(open_all(options.files), options.output)}")
    return 0
