"""`activesteer falsify`: search for the worst case of a requirement, for a controller of the package or your own."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from activesteer.commands.arguments import add_controller, add_json, add_output, add_workers
from activesteer.commands.output import BAD, GOOD, painted, tell
from activesteer.commands.progress import ProgressBar

if TYPE_CHECKING:
    from activesteer.studies.falsification import Falsified

_SHOWN_FALLS: Final = 8
"""Number of improvements that are printed."""


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "falsify",
        help="search for the worst case of a requirement",
        description="Search the ranges of the factors for the worst case of a requirement, for each controller in "
        "each manoeuvre. The exit status is 1 if the requirement is violated.",
    )
    parser.add_argument("requirement", metavar="REQUIREMENT", help="a study file with a table [falsify], or its name")
    add_output(parser, "DIR", "folder of the searches; searches found there are resumed", "falsification")
    add_controller(parser, several=True, default="those of the file")
    parser.add_argument(
        "-m", "--maneuver", action="append", metavar="MANEUVER", help="one of the file; may be repeated (default: all)"
    )
    parser.add_argument(
        "--runs", type=int, metavar="N", help="budget of runs of each search (default: that of the file)"
    )
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_falsify)


def _falsify(options: argparse.Namespace) -> int:
    from activesteer.studies.falsification import falsify

    options.how_to_resume = "; the same command resumes it"
    with ProgressBar("falsify", quiet=options.json) as bar:
        found = falsify(
            options.requirement,
            options.output,
            controllers=options.controller,
            maneuvers=options.maneuver,
            runs=options.runs,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=lambda what, done, total: bar(done / total, f"{what} {done}/{total} sets"),
        )
    figures = _draw(found, options.output)
    violated = any(one.violated for one in found)
    table = {"violated": violated, "searches": [one.to_json() for one in found]}
    tell(options, table, (line for one in found for line in _lines(one)), figures)
    return int(violated)


def _lines(one: Falsified) -> Iterator[str]:
    verdict = painted("VIOLATED", BAD) if one.violated else painted("not violated", GOOD)
    failed = f", {one.failed} sets not judged" if one.failed else ""
    yield f"{one.controller}, {one.maneuver}: {one.requirement}"
    if math.isnan(one.robustness):
        yield f"  no set could be judged in {one.runs} runs{failed}"
        return
    yield f"  {verdict} in {one.violations} of {len(one.sets)} sets ({one.runs} runs{failed})"
    yield f"  least robustness {one.robustness:.4g}"
    falls = list(one.fall)
    shown = falls if len(falls) <= _SHOWN_FALLS else [*falls[:1], *falls[1 - _SHOWN_FALLS :]]
    yield "  fell: " + ", ".join(f"{value:.3g} after {runs} runs" for runs, value in shown)
    yield from (f"    {key} = {value!r}" for key, value in one.values.items())
    yield from (f"  {command}" for command in one.commands.values())


def _draw(found: list[Falsified], folder: Path) -> list[Path]:
    """Draw each search; nothing without matplotlib."""
    from activesteer.errors import ParameterError
    from activesteer.files import file_word
    from activesteer.studies.falsification_figure import draw_falsified

    paths = []
    for one in found:
        if one.sets:
            try:
                below = folder / f"{file_word(one.controller)}-{file_word(one.maneuver)}"
                paths.append(draw_falsified(one, below / "violations.png"))
            except ParameterError:
                return []
    return paths
