"""`activesteer bench`: where the time of a step goes, or what a tyre costs."""

from __future__ import annotations

import argparse
from typing import Any

from activesteer.commands.output import print_json
from activesteer.errors import ParameterError


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser("bench", help="where the time of a step goes")
    parser.add_argument("--tyre", action="store_true", help="what a tyre's evaluation costs instead")
    parser.add_argument("--json", action="store_true", help="print JSON and nothing else")
    parser.add_argument("--rounds", type=int, default=5, metavar="N", help="the best of N counts (default: 5)")
    parser.set_defaults(action=_bench)


def _bench(options: argparse.Namespace) -> int:
    from activesteer.bench import bench, bench_tyre

    if options.rounds < 1:
        msg = f"--rounds {options.rounds}: at least 1 is needed"
        raise ParameterError(msg)
    results = bench_tyre(options.rounds) if options.tyre else bench(options.rounds)
    if options.json:
        print_json(results)
        return 0
    for name, value in results.items():
        print(f"{name:28} {value:8.2f}")
    return 0
