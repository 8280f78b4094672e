"""`activesteer report FILE.mcap...`: runs compared on one HTML page."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, Final

_DEFAULT_FILE: Final = Path("report.html")


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser(
        "report",
        help="compare recordings on one HTML page",
        description="One page that needs no network: scorecard, plots, track, metrics, parameters, versions.",
    )
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE.mcap")
    parser.add_argument(
        "-o", "--output", type=Path, default=_DEFAULT_FILE, metavar="FILE.html", help="default: report.html"
    )
    parser.set_defaults(action=_report)


def _report(options: argparse.Namespace) -> int:
    from activesteer.analysis.report import open_all, write_report

    print(f"report: {write_report(open_all(options.files), options.output)}")
    return 0
