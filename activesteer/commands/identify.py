"""`activesteer identify`: steady-state handling by ISO 4138, and what controllers and estimators know of the car."""

from __future__ import annotations

import argparse
import datetime
import sys
from typing import Any

from activesteer.commands.arguments import add_car, add_json, overrides_of
from activesteer.commands.output import tell
from activesteer.errors import ParameterError


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("identify", help="understeer, limits and controller models of a vehicle (ISO 4138)")
    add_car(parser)
    parser.add_argument(
        "--write",
        action="store_true",
        help="also write [single_track] and [two_track] of the vehicle file",
    )
    add_json(parser)
    parser.set_defaults(action=_identify)


def _identify(options: argparse.Namespace) -> int:
    from activesteer.resources import check_own, find_vehicle
    from activesteer.studies.linear.identification import identify, write_identified

    def progress(test: str) -> None:
        if not options.json:
            print(f"{test} ...", file=sys.stderr)

    file, overrides = find_vehicle(options.vehicle), overrides_of(options)
    if options.write:
        if overrides:
            raise ParameterError("writes into the vehicle file, so leave out --set and --overrides", key="--write")
        check_own(file)
        options.output = file
    result = identify(options.vehicle, overrides, progress)
    tell(options, result.to_json(), [result.table()])
    if options.write:
        vehicle = f" --vehicle {options.vehicle}" if options.vehicle != "compact" else ""
        command = f"activesteer identify{vehicle} --write"
        write_identified(file, result, command, datetime.date.today().isoformat())
        if not options.json:
            print(f"written to {file}")
    return 0
