"""`activesteer driver [NAME]`: stability of the loop of driver, controller and car, over speed."""

from __future__ import annotations

import argparse
from typing import Any

from activesteer.commands.arguments import (
    add_car,
    add_controller,
    add_figures_folder,
    add_json,
    add_speeds,
    overrides_of,
)
from activesteer.commands.output import print_json, print_table
from activesteer.errors import ParameterError
from activesteer.files import make_folder
from activesteer.resources import DEFAULT_DRIVER

_COLUMNS = {
    "speed_kmh": "km/h",
    "controller": "controller",
    "damping": "damping",
    "damping_in_step": "in a step",
    "damping_in_run": "in a run",
    "step_difference_m": "apart m",
    "phase_margin_deg": "margin deg",
    "crossover_rad_s": "crossover rad/s",
}
"""Key of a result -> head of its column."""


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "driver",
        help="damping and phase margin of driver and car",
        description="Print crossover frequency, phase margin and damping of the loop of driver, controller and "
        "linearised car, with a fully active corrector. Also print the damping after a small step of the path, for "
        "the same loop and for a run, and the largest distance between the two.",
    )
    parser.add_argument(
        "name", nargs="?", default=DEFAULT_DRIVER, metavar="NAME",
        help="novice, typical, expert, or a driver file (default: typical)",
    )  # fmt: skip
    add_car(parser)
    add_controller(parser, several=True, default="none, ars and afs")
    add_speeds(parser, "60, 80 ... 140")
    add_json(parser)
    add_figures_folder(parser)
    parser.set_defaults(action=_driver)


def _driver(options: argparse.Namespace) -> int:
    from activesteer.studies.linear.driver_loop import SPEEDS_KMH, driver_loops

    if options.output is not None:
        make_folder(options.output, ParameterError)
    loops = driver_loops(
        options.name,
        options.vehicle,
        options.controller or ("none", "ars", "afs"),
        options.speeds_kmh or SPEEDS_KMH,
        overrides_of(options),
    )
    rows = [loop.to_json() for loop in loops]
    if options.json:
        print_json(rows)
    else:
        print(f"{options.name} in {options.vehicle}")
        print_table(rows, _COLUMNS)
    if options.output is not None:
        from activesteer.analysis.linear_plots import driver_loops_figure
        from activesteer.plotting import save
        from activesteer.studies.linear.driver_loop import FREQUENCIES_RADPS

        figure = driver_loops_figure(rows, FREQUENCIES_RADPS, [loop.loop.response for loop in loops])
        path = save(figure, options.output / "driver.png")
        if not options.json:
            print(f"figure: {path}")
    return 0
