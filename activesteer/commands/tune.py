"""`activesteer tune`: find values of the factors of a study that minimise its objectives."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from activesteer.commands.arguments import add_json, add_output, add_workers
from activesteer.commands.output import tell
from activesteer.commands.progress import ProgressBar

if TYPE_CHECKING:
    from activesteer.studies.engine.tuning import Tuning


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("tune", help="find values of factors that minimise objectives")
    parser.add_argument("study", metavar="STUDY", help="a study file with a table [tune], or its name")
    add_output(parser, "DIR", "folder of the search; a search found there is resumed", "tuning")
    parser.add_argument("--trials", type=int, metavar="N", help="total number of sets (default: that of the file)")
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_tune)


def _tune(options: argparse.Namespace) -> int:
    from activesteer.studies.engine.tuning import tune

    options.how_to_resume = "; the same command resumes it"
    with ProgressBar("tune", quiet=options.json) as bar:
        result = tune(
            options.study,
            options.output,
            trials=options.trials,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=lambda done, total: bar(done / total, f"{done}/{total} sets"),
        )
    figures = _draw(result, options.output)
    about = {"done": result.done, "failed": result.failed, "without_effect": result.without_effect}
    tell(options, about | {"front": [vars(trial) for trial in result.front]}, _lines(result), figures)
    return 0


def _lines(result: Tuning) -> Iterator[str]:
    yield f"{result.done} sets tried, {result.failed} with a failed run; the best:"
    for trial in result.front:
        yield "  ".join(f"{name} {value:.4g}" for name, value in trial.objectives.items())
        yield from (f"  {key} = {value!r}" for key, value in trial.values.items())
    yield from (f"without effect: {key} changes no metric of any run" for key in result.without_effect)


def _draw(result: Tuning, folder: Path) -> list[Path]:
    """Draw two objectives against each other, or one over the sets; nothing without matplotlib."""
    if not result.trials:
        return []
    from activesteer.errors import ParameterError, StudyError
    from activesteer.plotting import new_figure, save

    try:
        figure = new_figure(6.0, 4.5, "Objectives of the sets that were tried")
    except ParameterError:
        return []
    names = list(result.trials[0].objectives)
    x, y = names[:2] if len(names) > 1 else ("set", names[0])
    axes = figure.subplots()
    kept = [trial for trial in result.trials if trial.violation == 0.0]
    broken = [trial for trial in result.trials if trial.violation > 0.0]
    front = sorted(result.front, key=lambda trial: trial.objectives[names[0]])
    for trials, look, label in (
        (broken, {"color": "0.6", "marker": "x"}, "breaks a constraint"),
        (kept, {"color": "0.6", "marker": "o"}, "tried"),
        (front, {"color": "C3", "marker": "o", "linestyle": "-", "drawstyle": "steps-post"}, "best"),
    ):
        places = [trial.objectives.get(x, trial.number) for trial in trials]
        values = [trial.objectives[y] for trial in trials]
        if trials:
            axes.plot(places, values, **{"linestyle": "none", "markersize": 4, "label": label, **look})
    axes.set_xlabel(f"{x} [-]")
    axes.set_ylabel(f"{y} [-]")
    axes.legend()
    return [save(figure, folder / f"front.{kind}", StudyError) for kind in ("png", "svg")]
