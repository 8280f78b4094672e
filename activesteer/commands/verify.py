"""Commands that verify: `reproduce`, `test`, `bench`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from activesteer.commands.options import (
    CAR,
    JOBS,
    JSON,
    VEHICLE,
    WORKERS,
    Group,
    OneOf,
    controllers,
    driver,
    flag,
    option,
    output,
    overrides_of,
)
from activesteer.commands.terminal import ProgressBar, coloured, print_entry, print_json, tell, wrapped
from activesteer.errors import ParameterError
from activesteer.files import write_json

if TYPE_CHECKING:
    from activesteer.analysis.claims.scorecard import Judged
    from activesteer.studies.reproduction import Reproduction

command: Final = Group("verify")
SETTINGS: Final = {"paper": "paper's setting", "literature": "driver from literature"}
"""As in `activesteer.analysis.claims.stored`, which takes too long to import for `--help`."""


def _setting(name: str) -> str:
    """Return the name of a setting. Its former name is rejected."""
    if name == "human":
        raise argparse.ArgumentTypeError("the setting 'human' is now 'literature'")
    return name


@command("reproduce", "drive the scenarios of the paper and check its claims",
    output("DIR", "folder for recordings, report and figures", "runs"),
    VEHICLE,
    option("--setting", tuple(SETTINGS),
        "paper: the most plausible numbers found for what the paper leaves open, selected by the verdicts; "
        "literature: the nominal car with a driver from published ranges (default). Both may be given",
        many=True, dest="settings", type=_setting),
    JOBS,
    flag("--all", "also print every claim with its numbers"),
    flag("--figures", "also draw the figures"),
    JSON,
)  # fmt: skip
def _settings(options: argparse.Namespace) -> int:
    """Drive the 15 runs in every setting asked for, and tell the verdicts."""
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
    if options.json:
        tables = [_json(result) for result in results.values()]
        about = {"figures": list(map(str, figures)), "report": None if report is None else str(report)}
        print_json({**(tables[0] if len(tables) == 1 else {"settings": tables}), **about, "exit_status": status})
        return status
    _tell(results, folders, options, report, figures)
    return status


def _driven(options: argparse.Namespace, folders: Mapping[str, Path]) -> dict[str, Reproduction]:
    from activesteer.studies.reproduction import reproduce

    results: dict[str, Reproduction] = {}
    with ProgressBar("reproduce", quiet=options.json) as bar:

        def show(what: str, done: int, total: int) -> None:
            begun = len(results)
            bar((begun + done / total) / len(folders), what)
            if not options.json and not sys.stderr.isatty():
                print(f"{begun * total + done}/{len(folders) * total} {what}", file=sys.stderr)

        for name, folder in folders.items():
            results[name] = reproduce(folder, options.vehicle, setting=name, jobs=options.jobs, progress=show)
    return results


def _tell(
    results: Mapping[str, Reproduction],
    folders: Mapping[str, Path],
    options: argparse.Namespace,
    report: Path | None,
    figures: list[Path],
) -> None:
    for name, result in results.items():
        if options.all:
            if len(results) > 1:
                print(f"{SETTINGS[name]}:")
            print("\n".join(wrapped(result.scorecard.to_text())))
        print(f"recordings: {3 * len(result.paths)} MCAP files in {folders[name]}")
    if report is not None:
        print(f"report: {report}")
    if figures:
        print(f"figures: {len(figures)} files in {options.output / 'figures'}")
    if len(results) > 1:
        _print_settings(results)
    else:
        _print_scenarios(next(iter(results.values())))
    _print_hints(options, results)


def _json(result: Reproduction) -> dict[str, Any]:
    failures = {f"{scenario} {system}": problem for (scenario, system), problem in result.failures.items()}
    files = [str(path) for systems in result.paths.values() for path in systems.values()]
    return {**result.scorecard.to_json(), "files": files, "failures": failures}


def _print_scenarios(result: Reproduction) -> None:
    """Print how many claims are reproduced, by scenario and in all, with the texts of the others."""
    from activesteer.analysis.claims.scorecard import Verdict

    words = {Verdict.FAILED: "FAILED", Verdict.NOT_REPRODUCED: "not reproduced"}
    width = max(map(len, result.paths), default=0)
    for scenario in result.paths:
        judged = _judged(result, scenario)
        print(f"{scenario:{width}}  {_reproduced(judged) if judged else 'not judged: a run failed'}")
        for item in judged:
            if item.verdict in words:
                print_entry(f"  {item.claim.id}  {coloured(words[item.verdict])}  ", item.claim.text, hanging=6)
    print(f"{'all':{width}}  {_reproduced(result.scorecard.judged)}")


def _reproduced(judged: Sequence[Judged]) -> str:
    return f"{sum(item.claim.passed for item in judged)} of {len(judged)} claims reproduced"


def _print_hints(options: argparse.Namespace, settings: Collection[str]) -> None:
    """Print which options show more."""
    if not options.all:
        print("--all prints every claim with its numbers")
    if "paper" not in settings and options.vehicle == "compact":
        print("--setting paper drives the most plausible numbers for what the paper leaves open")


def _judged(result: Reproduction, scenario: str) -> list[Judged]:
    from activesteer.analysis.claims.statements import SCENARIO_OF

    return [item for item in result.scorecard.judged if SCENARIO_OF[item.claim.id] == scenario]


def _print_settings(results: Mapping[str, Reproduction]) -> None:
    """Print a line for each scenario: claims that hold in each setting, and their share of the population."""
    from activesteer.theory.proportions import percent

    scenarios = list(next(iter(results.values())).paths)
    width = max(map(len, scenarios))
    print(f"\n{'claims that hold':{width}}" + "".join(f"  {SETTINGS[name]:>15}" for name in results) + "  population")
    total: dict[str, list[Judged]] = {name: [] for name in results}
    for scenario in [*scenarios, "all"]:
        line, shares = f"{scenario:{width}}", []
        for name, result in results.items():
            judged = total[name] if scenario == "all" else _judged(result, scenario)
            total[name] = judged if scenario == "all" else total[name] + judged
            count = f"{sum(item.claim.passed for item in judged)} of {len(judged)}" if judged else "not judged"
            line += f"  {count:>15}"
            shares += [item.proportion.share for item in judged if item.proportion is not None]
        print(line + (f"  {percent(sum(shares) / len(shares)):>8} %" if shares else ""))
    for name, result in results.items():
        failed = [item.claim.id for item in result.scorecard.judged if not item.claim.passed]
        print_entry(f"not in the {SETTINGS[name]}: ", " ".join(failed) or "-", hanging=4)
    words = (
        "The paper's setting was selected by its verdicts, within ranges of everything that the paper leaves open; the "
        "population varies the setting with the driver from literature (mean share of the claims)."
    )
    print("\n".join(wrapped(words)))


@command("test", "test a car by a standard",
    option("standard", "STANDARD", "name of the standard (default: print all names)", nargs="?"),
    controllers(), CAR, driver("the driver of the standard"),
    output("DIR", "folder for page, JSON and runs; an interrupted test is resumed there (default: none)"),
    WORKERS, JSON,
)  # fmt: skip
def _test(options: argparse.Namespace) -> int:
    from activesteer.pages import write_page
    from activesteer.standards.examination import examination_page, examine

    if options.output is not None:
        options.how_to_resume = "; the same command resumes it"
    with ProgressBar(options.standard or "test", quiet=options.json) as bar:
        result = examine(
            options.standard or "",
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


@command("bench", "where the time of a step goes",
    OneOf((
        flag("--tyre", "what a tyre's evaluation costs instead"),
        flag("--maneuvers",
            "drive the paper's scenarios instead and compare their key metrics with the stored baseline; exit with 1 "
            "if one has drifted"),
        flag("--batch", "measure many cars in one native call instead: car-steps per second, processor time, memory"),
    )),
    flag("--renew", "with --maneuvers: store the metrics as the new baseline"),
    output("SUMMARY.md", "with --maneuvers: write a summary in Markdown"),
    JSON,
    option("--rounds", "N", "the best of N counts (default: 5)", type=int),
    description="Where the time of a step goes, in microseconds. Ratios to `bare` compare with an engine that has "
    "neither tyres nor motion, ratios to `engine` with the engine alone on the same drive, its inputs played back.",
)  # fmt: skip
def _bench(options: argparse.Namespace) -> int:
    from activesteer.studies import benchmark

    if options.rounds is not None and options.rounds < 1:
        raise ParameterError(f"--rounds {options.rounds}: at least 1 is needed")
    for key, given in (("--renew", options.renew), ("--output", options.output is not None)):
        if given and not options.maneuvers:
            raise ParameterError("has an effect with --maneuvers only", key=key)
    if options.maneuvers and options.rounds:
        raise ParameterError("has no effect with --maneuvers: each is driven once", key="--rounds")
    if options.maneuvers:
        return _maneuvers(options)
    rounds = options.rounds or benchmark.ROUNDS
    if options.batch:
        results = benchmark.bench_batch(rounds)
        tell(options, results, [benchmark.batch_table(results)])
    else:
        results = (benchmark.bench_tyre if options.tyre else benchmark.bench)(rounds)
        tell(options, results, (f"{name:28} {value:8.2f}" for name, value in results.items()))
    return 0


def _maneuvers(options: argparse.Namespace) -> int:
    from activesteer.analysis.tables import comparison
    from activesteer.files import write_text
    from activesteer.studies import benchmark

    baseline = {} if options.renew else benchmark.read_baseline()
    found = benchmark.bench_maneuvers()
    if options.renew:
        baseline = found.key_metrics()
        benchmark.write_baseline(found)
    drifts = benchmark.drifts(found, baseline)
    if options.output is not None:
        write_text(options.output, benchmark.as_markdown(found, drifts), ParameterError)
    if options.json:
        print_json(benchmark.as_json(found, drifts))
        return 1 if drifts else 0
    for name, runs in found.by_maneuver().items():
        factors = ", ".join(f"{run.controller} {run.real_time_factor:.0f}" for run in runs)
        search = found.search_told(name)
        print(f"{name}: {factors} times real time" + (f"; {search}" if search else ""))
        print(comparison({run.controller: run.metrics for run in runs}))
        print()
    print(f"peak memory {found.peak_memory_B / 1e6:.0f} MB")
    if options.renew:
        print(f"renewed {benchmark.BASELINE}")
    for drift in drifts:
        print(drift)
    checked = sum(len(run.metrics) for run in found.runs)
    print(f"{checked - len(drifts)} of {checked} key metrics are as in the baseline")
    return 1 if drifts else 0
