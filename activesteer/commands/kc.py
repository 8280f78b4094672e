"""`activesteer kc`: measure kinematics and compliance of both axles, as on a rig."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_car, add_figures_folder, add_json, overrides_of
from activesteer.commands.output import tell, tell_files


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("kc", help="measure kinematics and compliance of the suspensions")
    add_car(parser)
    add_figures_folder(parser)
    parser.add_argument(
        "--tables",
        type=Path,
        metavar="DIR",
        help="write all curves as CSV and the table of the car, as input of vehicle new --kc",
    )
    add_json(parser)
    parser.set_defaults(action=_kc)


def _kc(options: argparse.Namespace) -> int:
    from activesteer.rigs import kinematics_compliance

    result = kinematics_compliance(options.vehicle, overrides_of(options))
    tell(options, result.to_json(), [result.table()])
    if options.tables is not None:
        from activesteer.errors import ParameterError
        from activesteer.files import write_text
        from activesteer.rigs.kc.tables import write_tables
        from activesteer.scenario import load_car
        from activesteer.vehicle_builder.car_table import car_table

        written = write_tables(result, options.tables)
        text = car_table(load_car(options.vehicle, overrides_of(options)), result)
        written.append(write_text(options.tables / "car.toml", text, ParameterError))
        if not options.json:
            print(f"tables: {len(written)} files in {options.tables}")
    if options.output is not None:
        from activesteer.rigs.kc import draw

        tell_files(options, draw(result, options.output))
    return 0
