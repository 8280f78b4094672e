"""`activesteer linearise`: modes of the full car at a speed, Bode plots and root locus."""

from __future__ import annotations

import argparse
from typing import Any, Final

from activesteer.commands.arguments import add_car, add_figures_folder, add_json, overrides_of
from activesteer.commands.output import tell
from activesteer.errors import ParameterError
from activesteer.files import make_folder

_LOCUS_KMH: Final = (40.0, 60.0, 80.0, 100.0, 120.0, 140.0, 160.0)
"""Speeds of the root locus [km/h]."""


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("linearise", help="modes of the full car at a speed, Bode plots and root locus")
    add_car(parser)
    parser.add_argument("--speed-kmh", type=float, default=80.0, metavar="V", help="speed (default: 80)")
    add_json(parser)
    add_figures_folder(parser)
    parser.set_defaults(action=_linearise)


def _linearise(options: argparse.Namespace) -> int:
    from activesteer.scenario import check_gains
    from activesteer.studies.linear.linearisation import eigenvalue_table, linear_car, linear_cars

    overrides = overrides_of(options)
    check_gains(overrides, ())
    car = linear_car(options.vehicle, options.speed_kmh / 3.6, overrides)
    modes, figures = car.modes(), []
    label = f"{options.speed_kmh:g} km/h"
    if options.output is not None:
        from activesteer.analysis.linear_plots import draw_bode, draw_root_locus

        make_folder(options.output, ParameterError)
        speeds = [speed / 3.6 for speed in _LOCUS_KMH]
        systems = [each.state_space() for each in linear_cars(options.vehicle, speeds, overrides)]
        figures = [
            draw_bode({label: car.state_space()}, options.output / "bode.png"),
            draw_root_locus(systems, speeds, options.output / "root_locus.png"),
        ]
    values = {"speed_mps": car.speed_mps, "modes": [mode.to_json() for mode in modes]}
    tell(options, values, [f"{options.vehicle} at {label}", eigenvalue_table(modes)], figures)
    return 0
