"""`activesteer bench`: where the time of a step goes, what a tyre costs, or how fast the paper's scenarios run."""

from __future__ import annotations

import argparse
from typing import Any

from activesteer.commands.arguments import add_json, add_output
from activesteer.commands.output import print_json, tell
from activesteer.errors import ParameterError


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "bench",
        help="where the time of a step goes",
        description="Where the time of a step goes, in microseconds. Ratios to `bare` compare with an engine that has "
        "neither tyres nor motion, ratios to `engine` with the engine alone on the same drive, its inputs played back.",
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--tyre", action="store_true", help="what a tyre's evaluation costs instead")
    what.add_argument(
        "--maneuvers", action="store_true",
        help="drive the paper's scenarios instead and compare their key metrics with the stored baseline; "
        "exit with 1 if one has drifted",
    )  # fmt: skip
    what.add_argument(
        "--batch", action="store_true",
        help="measure many cars in one native call instead: car-steps per second, processor time, memory",
    )  # fmt: skip
    parser.add_argument("--renew", action="store_true", help="with --maneuvers: store the metrics as the new baseline")
    add_output(parser, "SUMMARY.md", "with --maneuvers: write a summary in Markdown")
    add_json(parser)
    parser.add_argument("--rounds", type=int, metavar="N", help="the best of N counts (default: 5)")
    parser.set_defaults(action=_bench)


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
