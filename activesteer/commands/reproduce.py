"""`activesteer reproduce`: drive the paper's five scenarios with its three systems, and check its claims."""

from __future__ import annotations

import argparse
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from activesteer.commands.arguments import add_json, add_output, add_vehicle, add_workers
from activesteer.commands.output import print_entry, print_json, print_wrapped
from activesteer.commands.progress import ProgressBar, RunCounter
from activesteer.errors import ParameterError

if TYPE_CHECKING:
    from activesteer.studies.paper.reproduction import Reproduction


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("reproduce", help="drive the scenarios of the paper and check its claims")
    words = "folder for recordings, report and figures (default: runs, comparison or population)"
    add_output(parser, "DIR", words)
    add_vehicle(parser)
    add_workers(parser)
    parser.add_argument("--all", action="store_true", help="also print every claim with its numbers")
    parser.add_argument("--figures", action="store_true", help="also draw the figures")
    parser.add_argument(
        "--population", type=int, metavar="N",
        help="instead, check each claim for N cars, roads and drivers (15 N runs); with --controllers, compare these "
        "controllers for N cars",
    )  # fmt: skip
    parser.add_argument(
        "-c", "--controllers", "--controller", action="append", dest="controllers", metavar="C,C...",
        help="instead, compare these controllers with the sensors of production cars: in the five scenarios, a step at "
        "120 km/h, the severe lane change, braking on split friction and in a turn, a turn across snow",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, metavar="S", help="seed of the population (default: the stored one)")
    add_json(parser)
    parser.set_defaults(action=_reproduce)


def _reproduce(options: argparse.Namespace) -> int:
    # The handler of signals looks there for saved files.
    given = {"comparison": options.controllers, "population": options.population}
    default = "_".join(name for name, value in given.items() if value is not None) or "runs"
    options.output = options.output or Path(default)
    if options.population is not None:
        options.how_to_resume = "; the same command resumes it"
        return _population(options)
    for name in ("seed", "scheduler"):
        if getattr(options, name) is not None:
            raise ParameterError(f"--{name} belongs to --population")
    if options.controllers is not None:
        return _compare(options)
    from activesteer.studies.paper.reproduction import reproduce

    folder = options.output
    with ProgressBar("reproduce", quiet=options.json) as bar:

        def show(what: str, done: int, total: int) -> None:
            bar(done / total, what)
            if not options.json and not sys.stderr.isatty():
                print(f"{done}/{total} {what}", file=sys.stderr)

        result = reproduce(folder, options.vehicle, jobs=options.jobs, progress=show)
    for (scenario, system), problem in result.failures.items():
        print(f"{scenario} {system} failed: {problem}", file=sys.stderr)
    files = [str(path) for systems in result.paths.values() for path in systems.values()]
    report = _report(result, folder)
    figures: list[Path] = []
    if options.figures:
        from activesteer.commands.figures import draw_all

        figures = draw_all(result.recordings(), folder / "figures", options.vehicle)
    if options.json:
        failures = {f"{scenario} {system}": problem for (scenario, system), problem in result.failures.items()}
        table = {**result.scorecard.to_json(), "files": files, "figures": [str(path) for path in figures]}
        table["report"] = None if report is None else str(report)
        print_json({**table, "failures": failures, "exit_status": result.exit_status})
        return result.exit_status
    if options.all:
        print_wrapped(result.scorecard.to_text())
    print(f"recordings: {len(files)} MCAP files in {folder}")
    if report is not None:
        print(f"report: {report}")
    if figures:
        print(f"figures: {len(figures)} files in {options.output / 'figures'}")
    _print_scenarios(result)
    return result.exit_status


def _print_scenarios(result: Reproduction) -> None:
    """Print a line for each scenario: how many claims are reproduced, and the verdicts of all others."""
    from activesteer.analysis.claims import SCENARIO_OF, Verdict

    width = max(map(len, result.paths), default=0)
    for scenario in result.paths:
        judged = [item for item in result.scorecard.judged if SCENARIO_OF[item.claim.id] == scenario]
        passed = sum(item.claim.passed for item in judged)
        words = f"{passed} of {len(judged)} claims reproduced" if judged else "not judged: a run failed"
        for verdict, name in ((Verdict.FAILED, "FAILED"), (Verdict.NOT_REPRODUCED, "not")):
            if claims := [item.claim.id for item in judged if item.verdict is verdict]:
                words += f"; {name}: {' '.join(claims)}"
        print_entry(f"{scenario:{width}}  ", words, hanging=width + 2)


def _compare(options: argparse.Namespace) -> int:
    from activesteer.studies.paper.comparison import compare

    with ProgressBar("compare", quiet=options.json) as bar:
        made = compare(
            _controllers(options),
            options.output,
            options.vehicle,
            jobs=options.jobs,
            progress=lambda what, done, total: bar(done / total, what),
        )
    for (scenario, name), problem in made.failures.items():
        print(f"{scenario} {name} failed: {problem}", file=sys.stderr)
    figures = []
    if options.figures:
        from activesteer.studies.paper.comparison_figure import draw_comparison

        figures = [draw_comparison(made, options.output / "comparison.png")]
    if options.json:
        print_json({**made.to_json(), "figures": [str(path) for path in figures]})
    else:
        print_wrapped(made.to_text())
        for path in figures:
            print(f"figure: {path}")
    return 1 if made.failures else 0


def _report(result: Reproduction, folder: Path) -> Path | None:
    """Write a page with all runs, including those that ended early; return None if no run made a step."""
    from activesteer.analysis.report import write_report
    from activesteer.errors import RecordingError
    from activesteer.recording import Recording

    recordings: dict[str, Recording] = {}
    for scenario, systems in result.paths.items():
        for system, path in systems.items():
            with suppress(RecordingError):
                recording = Recording.open(path, recover=True)
                # A complete file of a run that failed now is left from an earlier call.
                if len(recording) and recording.metadata["complete"] is ((scenario, system) not in result.failures):
                    recordings[str(path)] = recording
    return write_report(recordings, folder / "report.html") if recordings else None


def _population(options: argparse.Namespace) -> int:
    from activesteer.studies.paper.comparison_population import comparison_json, comparison_text
    from activesteer.studies.paper.population import population

    if options.figures and options.controllers is None:
        raise ParameterError("--figures draws the nominal runs; leave out --population")
    controllers = None if options.controllers is None else _controllers(options)
    with RunCounter("population", quiet=options.json) as counter:
        found = population(
            options.population,
            controllers,
            seed=options.seed,
            vehicle=options.vehicle,
            output=options.output,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=counter,
        )
    table, figures = found.to_json() if controllers is None else comparison_json(found), []
    if options.figures:
        from activesteer.studies.paper.comparison_figure import draw_comparison_population

        figures = [draw_comparison_population(found, options.output / "comparison_population.png")]
        table["figures"] = [str(path) for path in figures]
    if options.json:
        print_json(table)
        return 0
    print_wrapped(found.to_text() if controllers is None else comparison_text(found))
    for path in figures:
        print(f"figure: {path}")
    return 0


def _controllers(options: argparse.Namespace) -> list[str]:
    return [name.strip() for name in ",".join(options.controllers).split(",") if name.strip()]
