"""`activesteer tune`: minimise objectives, satisfy statements or violate a requirement over the factors of a study."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from activesteer.commands.arguments import add_controller, add_json, add_output, add_workers
from activesteer.commands.output import BAD, GOOD, painted, tell
from activesteer.commands.progress import ProgressBar

if TYPE_CHECKING:
    from activesteer.studies.engine.tuning import Trial, Tuning

_SHOWN_FALLS: Final = 8
"""Number of improvements that are printed."""


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "tune",
        help="minimise objectives, satisfy statements or violate a requirement",
        description="Search the ranges of the factors of a study for values that minimise objectives, satisfy as many "
        "statements as possible, or violate a requirement. The exit status is 1 if the requirement is violated.",
    )
    parser.add_argument("study", metavar="STUDY", help="a study file with a table [tune], or its name")
    add_output(parser, "DIR", "folder of the search; a search found there is resumed", "tuning")
    add_controller(parser, several=True, default="with the goal violate, those of the file")
    parser.add_argument(
        "-m", "--maneuver", action="append", metavar="MANEUVER",
        help="one of the file; may be repeated (default: with the goal violate, all of the file)",
    )  # fmt: skip
    size = parser.add_mutually_exclusive_group()
    size.add_argument(
        "--trials", type=int, metavar="N", help="total number of sets of each search (default: that of the file)"
    )
    size.add_argument(
        "--runs", type=int, metavar="N", help="the same as a budget of runs, of which a set needs several"
    )
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_tune)


def _tune(options: argparse.Namespace) -> int:
    from activesteer.studies.engine.tuning import Goal, tune

    options.how_to_resume = "; the same command resumes it"
    with ProgressBar("tune", quiet=options.json) as bar:
        found = tune(
            options.study,
            options.output,
            controllers=options.controller,
            maneuvers=options.maneuver,
            trials=options.trials,
            runs=options.runs,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=lambda what, done, total: bar(done / total, f"{what} {done}/{total} sets".lstrip()),
        )
    if found[0].goal is not Goal.VIOLATE:
        tell(options, found[0].to_json(), _lines(found[0]), _draw(found, options.output))
        return 0
    violated = any(one.violations for one in found)
    values = {"violated": violated, "searches": [one.to_json() for one in found]}
    tell(options, values, (line for one in found for line in _worst(one)), _draw(found, options.output))
    return int(violated)


def _lines(found: Tuning) -> Iterator[str]:
    yield f"{found.done} sets tried, {found.failed} with a failed run; the best:"
    for trial in found.front:
        yield "  ".join(f"{name} {value:.4g}" for name, value in trial.objectives.items()) or _held(trial)
        if found.plausibility is None or trial is found.front[0]:
            yield from _values(trial)
    yield from (f"hold alone and never together: {' and '.join(pair)}" for pair in found.never_together)
    yield from (f"without effect: {key} changes no metric of any run" for key in found.without_effect)


def _held(trial: Trial) -> str:
    fails = [name for name in trial.margins if name not in trial.holding]
    about = f"{len(trial.holding)} of {len(trial.margins)} hold, implausibility {trial.implausibility:.2f}"
    return f"{about}, set {trial.number}{'; fails: ' * bool(fails)}{' '.join(fails)}"


def _worst(found: Tuning) -> Iterator[str]:
    verdict = painted("VIOLATED", BAD) if found.violations else painted("not violated", GOOD)
    failed = f", {found.failed} sets not judged" if found.failed else ""
    yield f"{found.controller}, {found.maneuver}: {found.requirement}"
    if not found.front:
        yield f"  no set could be judged in {found.runs} runs{failed}"
        return
    yield f"  {verdict} in {found.violations} of {len(found.trials)} sets ({found.runs} runs{failed})"
    falls = found.fall
    yield f"  least margin {falls[-1][1]:.4g}"
    shown = falls if len(falls) <= _SHOWN_FALLS else [*falls[:1], *falls[1 - _SHOWN_FALLS :]]
    yield "  fell: " + ", ".join(f"{value:.3g} after {runs} runs" for runs, value in shown)
    yield from _values(found.front[0], "    ")
    yield from (f"  {command}" for command in found.commands.values())


def _values(trial: Trial, indent: str = "  ") -> Iterator[str]:
    yield from (f"{indent}{key} = {value!r}" for key, value in trial.values.items())


def _draw(found: list[Tuning], folder: Path) -> list[Path]:
    """Draw each search; nothing without matplotlib."""
    from activesteer.errors import ParameterError
    from activesteer.studies.engine.tuning_figure import draw_tuning

    try:
        return [path for one in found for path in draw_tuning(one, folder)]
    except ParameterError:
        return []
