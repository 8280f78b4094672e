"""`activesteer reproduce`: drive the paper's five scenarios with its three systems, and check its claims."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from activesteer.commands.arguments import add_jobs, add_json, add_output, add_vehicle
from activesteer.commands.output import print_entry, print_json, wrapped
from activesteer.commands.progress import ProgressBar

if TYPE_CHECKING:
    from activesteer.analysis.claims.scorecard import Judged
    from activesteer.studies.reproduction import Reproduction

SETTINGS: Final = {"paper": "paper's setting", "human": "human driver"}
"""As in `activesteer.analysis.claims.stored`, which takes too long to import for `--help`."""


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("reproduce", help="drive the scenarios of the paper and check its claims")
    add_output(parser, "DIR", "folder for recordings, report and figures", "runs")
    add_vehicle(parser)
    parser.add_argument(
        "--setting", action="append", dest="settings", choices=list(SETTINGS),
        help="paper: the most plausible numbers found for what the paper leaves open, selected by the verdicts; human: "
        "the nominal car with a driver from published ranges (default). Both may be given",
    )  # fmt: skip
    add_jobs(parser)
    parser.add_argument("--all", action="store_true", help="also print every claim with its numbers")
    parser.add_argument("--figures", action="store_true", help="also draw the figures")
    add_json(parser)
    parser.set_defaults(action=_settings)


def _settings(options: argparse.Namespace) -> int:
    """Drive the 15 runs in every setting asked for, and tell the verdicts."""
    settings = list(dict.fromkeys(options.settings or ["human"]))
    folders = {name: options.output / name if len(settings) > 1 else options.output for name in settings}
    results = _driven(options, folders)
    for result in results.values():
        for (scenario, system), problem in result.failures.items():
            print(f"{scenario} {system} failed: {problem}", file=sys.stderr)
    report = _report(results.values(), options.output)
    figures: list[Path] = []
    if options.figures:
        from activesteer.commands.paper_figures import draw_all

        figures = draw_all(results[settings[0]].recordings(), options.output / "figures", options.vehicle)
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


def _json(result: Reproduction) -> dict[str, Any]:
    failures = {f"{scenario} {system}": problem for (scenario, system), problem in result.failures.items()}
    files = [str(path) for systems in result.paths.values() for path in systems.values()]
    return {**result.scorecard.to_json(), "files": files, "failures": failures}


def _print_scenarios(result: Reproduction) -> None:
    """Print a line for each scenario: how many claims are reproduced, and the verdicts of all others."""
    from activesteer.analysis.claims.scorecard import Verdict

    width = max(map(len, result.paths), default=0)
    for scenario in result.paths:
        judged = _judged(result, scenario)
        passed = sum(item.claim.passed for item in judged)
        words = f"{passed} of {len(judged)} claims reproduced" if judged else "not judged: a run failed"
        for verdict, name in ((Verdict.FAILED, "FAILED"), (Verdict.NOT_REPRODUCED, "not")):
            if claims := [item.claim.id for item in judged if item.verdict is verdict]:
                words += f"; {name}: {' '.join(claims)}"
        print_entry(f"{scenario:{width}}  ", words, hanging=width + 2)


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
        "population varies the setting with the human driver (mean share of the claims)."
    )
    print("\n".join(wrapped(words)))


def _report(results: Iterable[Reproduction], folder: Path) -> Path | None:
    """Write a page with all runs, including those that ended early; return None if no run made a step."""
    from activesteer.analysis.report import write_report
    from activesteer.errors import RecordingError
    from activesteer.recording import Recording

    recordings: dict[str, Recording] = {}
    for result in results:
        for scenario, systems in result.paths.items():
            for system, path in systems.items():
                with suppress(RecordingError):
                    recording = Recording.open(path, recover=True)
                    # A complete file of a run that failed now is left from an earlier call.
                    if len(recording) and recording.metadata["complete"] is ((scenario, system) not in result.failures):
                        recordings[str(path)] = recording
    return write_report(recordings, folder / "report.html") if recordings else None
