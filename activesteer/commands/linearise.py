"""`activesteer linearise`: modes of the full car with its tyres at a speed, Bode plots and root locus."""

from __future__ import annotations

import argparse
from typing import Any, Final

from activesteer.commands.arguments import add_figures_folder, add_overrides, add_vehicle, overrides_of
from activesteer.errors import ParameterError
from activesteer.files import make_folder

_LOCUS_KMH: Final = (40.0, 60.0, 80.0, 100.0, 120.0, 140.0, 160.0)
"""Speeds of the root locus [km/h]."""


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser("linearise", help="modes of the full car at a speed, Bode plots and root locus")
    add_vehicle(parser)
    add_overrides(parser)
    parser.add_argument("--speed-kmh", type=float, default=80.0, metavar="V", help="default: 80")
    add_figures_folder(parser)
    parser.set_defaults(action=_linearise)


def _linearise(options: argparse.Namespace) -> int:
    from activesteer.studies.linearisation import eigenvalue_table, linear_car, linear_cars

    overrides = overrides_of(options)
    car = linear_car(options.vehicle, options.speed_kmh / 3.6, overrides)
    print(f"{options.vehicle} at {options.speed_kmh:g} km/h")
    print(eigenvalue_table(car.modes()))
    if options.output is None:
        return 0
    from activesteer.analysis.linear_plots import draw_bode, draw_root_locus

    make_folder(options.output, ParameterError)
    speeds = [speed / 3.6 for speed in _LOCUS_KMH]
    label = f"{options.speed_kmh:g} km/h"
    print(f"figure: {draw_bode({label: car.state_space()}, options.output / 'bode.png')}")
    systems = [each.state_space() for each in linear_cars(options.vehicle, speeds, overrides)]
    print(f"figure: {draw_root_locus(systems, speeds, options.output / 'root_locus.png')}")
    return 0
