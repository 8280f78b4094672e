"""`activesteer match`: find settings in which statements about runs hold."""

from __future__ import annotations

import argparse
from typing import Any

from activesteer.commands.arguments import add_json, add_output, add_workers
from activesteer.commands.output import tell
from activesteer.commands.progress import ProgressBar


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("match", help="find settings of factors in which statements about the runs hold")
    parser.add_argument("study", metavar="STUDY", help="a study file with a table [match], or its name")
    add_output(parser, "DIR", "folder of the search; a search found there is resumed", "match")
    parser.add_argument(
        "--evaluations", type=int, metavar="N",
        help="total number of evaluations, a scenario with all controllers each (default: that of the file)",
    )  # fmt: skip
    parser.add_argument(
        "--least", type=int, metavar="K", help="draw settings in which at least K statements hold, after a search"
    )
    parser.add_argument(
        "--neighbours", type=float, metavar="PERCENT",
        help="drive settings whose numbers differ by up to PERCENT from those of the best one, after a search",
    )  # fmt: skip
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_match)


def _match(options: argparse.Namespace) -> int:
    from activesteer.studies.engine.matching import lines_of, match

    options.how_to_resume = "; the same command resumes it"
    with ProgressBar("match", quiet=options.json) as bar:
        found = match(
            options.study,
            options.output,
            evaluations=options.evaluations,
            least=options.least,
            neighbours=None if options.neighbours is None else options.neighbours / 100.0,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=lambda done, total, best, of: bar(
                min(1.0, done / total), f"{done}/{total} evaluations, {best} of {of} hold"
            ),
        )
    quantiles = {} if options.least is None else found.quantiles(options.least)
    values = {**found.to_json(), "quantiles": {key: list(ends) for key, ends in quantiles.items()}}
    tell(options, values, lines_of(found, options.least))
    return 0
