"""Commands that verify: `reproduce`, `test`, `bench`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from activesteer.commands import arguments, terminal
from activesteer.core.files import write_json
from activesteer.errors import ParameterError

if TYPE_CHECKING:
    from activesteer.studies.reproduction import Reproduction

command: Final = arguments.Group("verify")
SETTINGS: Final = {"paper": "paper's setting", "literature": "driver from literature"}
"""Names of the settings, as in `analysis.claims.scorecard`, which takes too long to import for `--help`."""


def _setting(name: str) -> str:
    """Return the name of a setting, or reject its former name."""
    if name == "human":
        raise argparse.ArgumentTypeError("the setting 'human' is now 'literature'")
    return name


@command("reproduce", "drive the scenarios of the paper and check its claims",
    arguments.output("DIR", "folder for recordings, report and figures", "runs"),
    arguments.VEHICLE,
    arguments.option("--setting", tuple(SETTINGS),
        "paper: the most plausible values found for what the paper does not give, selected by the verdicts; "
        "literature: the nominal car with a driver from published ranges (default). Both may be given",
        many=True, dest="settings", type=_setting),
    arguments.JOBS,
    arguments.flag("--all", "also print every claim with its numbers"),
    arguments.flag("--figures", "also draw the figures"),
    arguments.JSON,
)  # fmt: skip
def _reproduce(options: argparse.Namespace) -> int:
    """Drive the 15 runs in each requested setting, and print the verdicts."""
    from activesteer.studies.reproduction import draw_figures, write_page

    settings = list(dict.fromkeys(options.settings or ["literature"]))
    folders = {name: options.output / name if len(settings) > 1 else options.output for name in settings}
    results = _driven(options, folders)
    for result in results.values():
        for (scenario, system), problem in result.failures.items():
            print(f"{scenario} {system} failed: {problem}", file=sys.stderr)
    report = write_page(results.values(), options.output)
    figures: list[Path] = []
    if options.figures:
        figures = draw_figures(results[settings[0]].recordings(), options.output / "figures", options.vehicle)
    status = max(result.exit_status for result in results.values())
    tables, lines = [], []
    for name, result in results.items():
        failures = {f"{scenario} {system}": problem for (scenario, system), problem in result.failures.items()}
        files = [str(path) for systems in result.paths.values() for path in systems.values()]
        tables.append({**result.scorecard.to_json(), "files": files, "failures": failures})
        lines += [f"{SETTINGS[name]}:"] if len(results) > 1 else []
        lines += [terminal.coloured(result.scorecard.to_text())] if options.all else []
        lines += [f"recordings: {3 * len(result.paths)} MCAP files in {folders[name]}", *_scenarios(result)]
    if report is not None:
        lines.append(f"report: {report}")
    if figures:
        lines.append(f"figures: {len(figures)} files in {options.output / 'figures'}")
    if "paper" in settings:
        lines.append(
            "The paper's setting was selected by the verdicts. It shows only that the claims can hold at the same time."
        )
    if not options.all:
        lines.append("--all prints every claim with its numbers")
    if "paper" not in settings and options.vehicle == "compact":
        lines.append("--setting paper uses the most plausible values where the paper gives none")
    values = tables[0] if len(tables) == 1 else {"settings": tables}
    about = {"figures": list(map(str, figures)), "report": None if report is None else str(report)}
    terminal.tell(options, values | about | {"exit_status": status}, lines)
    return status


def _driven(options: argparse.Namespace, folders: Mapping[str, Path]) -> dict[str, Reproduction]:
    from activesteer.studies.reproduction import reproduce

    results: dict[str, Reproduction] = {}
    with terminal.Progress("reproduce", quiet=options.json) as bar:

        def show(what: str, done: int, total: int) -> None:
            begun = len(results)
            bar((begun + done / total) / len(folders), what)
            if not options.json and not sys.stderr.isatty():
                print(f"{begun * total + done}/{len(folders) * total} {what}", file=sys.stderr)

        for name, folder in folders.items():
            results[name] = reproduce(folder, options.vehicle, setting=name, jobs=options.jobs, progress=show)
    return results


def _scenarios(result: Reproduction) -> Iterator[str]:
    """Yield the number of reproduced claims for each scenario and in total, with the other claims."""
    from activesteer.analysis.claims.judge import SCENARIO_OF
    from activesteer.analysis.claims.scorecard import Verdict

    words = {Verdict.FAILED: "FAILED", Verdict.NOT_REPRODUCED: "not reproduced"}
    width = max(map(len, result.paths), default=0)
    for scenario in (*result.paths, "all"):
        judged = [item for item in result.scorecard.judged if scenario in (SCENARIO_OF[item.claim.id], "all")]
        held = sum(item.claim.passed for item in judged)
        count = f"{held} of {len(judged)} claims reproduced" if judged else "not judged: a run failed"
        yield f"{scenario:{width}}  {count}"
        for item in judged:
            if item.verdict in words and scenario != "all":
                head = f"  {item.claim.id}  {terminal.coloured(words[item.verdict])}  "
                yield terminal.entry(head, item.claim.text, hanging=6)


@command("test", "test a car by a standard",
    arguments.option("standard", "STANDARD", "name of the standard (default: print all names)", nargs="?"),
    arguments.controllers(), arguments.CAR, arguments.driver("the driver of the standard"),
    arguments.output("DIR", "folder for page, JSON and runs; an interrupted test is resumed there (default: none)"),
    arguments.WORKERS, arguments.JSON,
)  # fmt: skip
def _test(options: argparse.Namespace) -> bool:
    from activesteer.pages import write_page
    from activesteer.standards.examination import examination_page, examine

    if options.output is not None:
        options.how_to_resume = "; the same command resumes it"
    with terminal.Progress(options.standard or "test", quiet=options.json) as bar:
        result = examine(
            options.standard or "",
            options.controller or ["none"],
            options.vehicle,
            arguments.overrides_of(options),
            driver=options.driver,
            output=options.output,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=lambda controller, series, done, total: bar(
                done / total, f"{controller}: {series} {done}/{total}"
            ),
        )
    values, files = result.to_json(), []
    if options.output is not None:
        name = result.standard.name
        files = [
            write_page(examination_page(result), options.output / f"{name}.html"),
            write_json(options.output / f"{name}.json", values, ParameterError),
        ]
    lines = [result.standard.title]
    width = min(max([12, *map(len, result.findings)]), 24)
    for controller, found in result.findings.items():
        word = {True: "passed", False: "FAILED", None: ""}[found.passed]
        lines.append(terminal.entry(terminal.coloured(f"{controller:{width}} {word:7}"), found.summary, width + 8))
    terminal.tell(options, values, lines, files, "written")
    return bool(result.failed)


@command("bench", "measure the time of a step and of its parts",
    arguments.one_of(
        arguments.flag("--tyre", "measure the evaluation of a tyre instead"),
        arguments.flag("--batch",
            "measure many cars in one native call instead: car-steps per second, processor time, memory"),
    ),
    arguments.JSON,
    arguments.option("--rounds", "N", "repeat N times and print the best (default: 5)", type=int),
    description="Measure the time of a step and of its parts, in microseconds. Ratios to `bare` compare with an engine "
    "without tyres and motion. Ratios to `engine` compare with a replay of the same drive by the engine only.",
)  # fmt: skip
def _bench(options: argparse.Namespace) -> bool:
    from activesteer.studies import benchmark

    if options.rounds is not None and options.rounds < 1:
        raise ParameterError(f"--rounds {options.rounds}: at least 1 is needed")
    rounds = options.rounds or benchmark.ROUNDS
    if options.batch:
        results = benchmark.bench_batch(rounds)
        terminal.tell(options, results, [benchmark.batch_table(results)])
    else:
        results = (benchmark.bench_tyre if options.tyre else benchmark.bench)(rounds)
        terminal.tell(options, results, (f"{name:28} {value:8.2f}" for name, value in results.items()))
    return False
