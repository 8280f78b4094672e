"""`activesteer bench`: where the time of a step goes, what a tyre costs, or how fast the paper's scenarios run."""

from __future__ import annotations

import argparse
from typing import Any, Final

from activesteer.commands.arguments import add_json
from activesteer.commands.output import print_json
from activesteer.errors import ParameterError


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser(
        "bench",
        help="where the time of a step goes",
        description="Where the time of a step goes, in microseconds. Ratios to `bare` compare with an engine that has "
        "neither tyres nor motion, ratios to `engine` with the engine alone on the same drive, its inputs played back.",
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--tyre", action="store_true", help="what a tyre's evaluation costs instead")
    what.add_argument("--maneuvers", action="store_true", help="the paper's scenarios instead, and their key metrics")
    add_json(parser)
    parser.add_argument("--rounds", type=int, metavar="N", help="the best of N counts (default: 5)")
    parser.set_defaults(action=_bench)


def _bench(options: argparse.Namespace) -> int:
    from activesteer.studies.benchmark import bench, bench_tyre

    if options.rounds is not None and options.rounds < 1:
        raise ParameterError(f"--rounds {options.rounds}: at least 1 is needed")
    if options.maneuvers and options.rounds:
        raise ParameterError("has no effect with --maneuvers: each is driven once", key="--rounds")
    if options.maneuvers:
        return _maneuvers(as_json=options.json)
    results = (bench_tyre if options.tyre else bench)(options.rounds or 5)
    if options.json:
        print_json(results)
        return 0
    for name, value in results.items():
        print(f"{name:28} {value:8.2f}")
    return 0


_KEY_METRICS: Final = (
    "yaw_rate_peak_radps", "sideslip_peak_rad", "ay_peak_mps2", "yaw_rate_ratio_1_00_s", "yaw_rate_ratio_1_75_s",
    "after_last_gate_yaw_rate_rms_radps", "after_last_gate_sideslip_rms_rad", "lane_overstep_m",
)  # fmt: skip


def _maneuvers(*, as_json: bool) -> int:
    from activesteer.analysis.tables import comparison
    from activesteer.studies.benchmark import bench_maneuvers

    rows = bench_maneuvers()
    if as_json:
        print_json({"runs": rows})
        return 0
    for name in dict.fromkeys(row["maneuver"] for row in rows):
        runs = {row["controller"]: row for row in rows if row["maneuver"] == name}
        factors = ", ".join(f"{system} {row['real_time_factor']:.1f}" for system, row in runs.items())
        print(f"{name}: times real time: {factors}")
        print(
            comparison(
                {
                    system: {metric: row["metrics"][metric] for metric in _KEY_METRICS if metric in row["metrics"]}
                    for system, row in runs.items()
                }
            )
        )
        print()
    return 0
