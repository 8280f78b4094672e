"""`activesteer driver [NAME]`: how stable driver, controller and car are as one loop, over speed."""

from __future__ import annotations

import argparse
from typing import Any

from activesteer.commands.arguments import (
    add_controller,
    add_figures_folder,
    add_json,
    add_overrides,
    add_vehicle,
    overrides_of,
)
from activesteer.commands.output import print_json
from activesteer.errors import ParameterError
from activesteer.files import make_folder
from activesteer.resources import DEFAULT_DRIVER

_COLUMNS = ("speed_kmh", "controller", "damping", "damping_in_run", "phase_margin_deg", "crossover_rad_s")


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser(
        "driver",
        help="damping and phase margin of driver and car",
        description="Crossover frequency, phase margin and damping of the loop of driver, controller and linearised "
        "car, the corrector fully active; beside it the damping after a small step of the path in a run.",
    )
    parser.add_argument(
        "name", nargs="?", default=DEFAULT_DRIVER, metavar="NAME",
        help="novice, typical, expert, or a driver file (default: typical)",
    )  # fmt: skip
    add_vehicle(parser)
    add_controller(parser, several=True, default="none, ars and afs")
    add_overrides(parser)
    parser.add_argument(
        "--speed-kmh", type=float, action="append", metavar="V", help="may be repeated (default: 60, 80 ... 140)"
    )
    add_json(parser)
    add_figures_folder(parser)
    parser.set_defaults(action=_driver)


def _driver(options: argparse.Namespace) -> int:
    from activesteer.studies.driver_loop import SPEEDS_KMH, driver_loops

    if options.output is not None:
        make_folder(options.output, ParameterError)
    loops = driver_loops(
        options.name,
        options.vehicle,
        options.controller or ("none", "ars", "afs"),
        options.speed_kmh or SPEEDS_KMH,
        overrides_of(options),
    )
    rows = [loop.to_json() for loop in loops]
    if options.json:
        print_json(rows)
    else:
        print(f"{options.name} in {options.vehicle}")
        print(_table(rows))
    if options.output is not None:
        from activesteer.analysis.linear_plots import driver_loops_figure
        from activesteer.plotting import save
        from activesteer.studies.driver_loop import FREQUENCIES_RADPS

        figure = driver_loops_figure(rows, FREQUENCIES_RADPS, [loop.loop.response for loop in loops])
        path = save(figure, options.output / "driver.png")
        if not options.json:
            print(f"figure: {path}")
    return 0


def _table(rows: list[dict[str, Any]]) -> str:
    heads = ("km/h", "controller", "damping", "in a run", "margin deg", "crossover rad/s")
    lines = [" ".join(f"{head:>15}" for head in heads)]
    for row in rows:
        values = (row[key] for key in _COLUMNS)
        lines.append(" ".join(f"{value:>15}" if isinstance(value, str) else f"{value:15.3g}" for value in values))
    return "\n".join(lines)
