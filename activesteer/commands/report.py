"""`activesteer report FILE.mcap...`: runs compared on one HTML page."""

from __future__ import annotations

import argparse
from typing import Any

from activesteer.commands.arguments import add_output, add_recording


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser(
        "report",
        help="compare recordings on one HTML page",
        description="One page that needs no network: scorecard, plots, track, metrics, parameters, versions.",
    )
    add_recording(parser, several=True)
    add_output(parser, "FILE.html", "the page; one that exists is replaced", "report.html")
    parser.set_defaults(action=_report)


def _report(options: argparse.Namespace) -> int:
    from activesteer.analysis.report import open_all, write_report
    from activesteer.errors import ParameterError

    if options.output.suffix.lower() not in {".html", ".htm"}:
        raise ParameterError(f"-o {options.output}: a report is a page, whose name ends in .html; a browser prints it")

    print(f"report: {write_report(open_all(options.files), options.output)}")
    return 0
