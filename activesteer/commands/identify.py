"""`activesteer identify`: steady-state handling by ISO 4138, and the single-track model that the controllers use."""

from __future__ import annotations

import argparse
import datetime
import sys
from typing import Any


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser("identify", help="understeer, limits and single-track model of a vehicle (ISO 4138)")
    parser.add_argument("--vehicle", default="compact", metavar="NAME_OR_PATH", help="default: compact")
    parser.add_argument(
        "--dry-run", action="store_true", help="leave the table [single_track] of the vehicle file as it is"
    )
    parser.add_argument("--json", action="store_true", help="print JSON and nothing else")
    parser.set_defaults(action=_identify)


def _identify(options: argparse.Namespace) -> int:
    from activesteer.resources import find_vehicle
    from activesteer.studies.identification import identify, write_single_track

    def progress(test: str) -> None:
        if not options.json:
            print(f"{test} ...", file=sys.stderr)

    file = find_vehicle(options.vehicle)
    result = identify(options.vehicle, progress=progress)
    if options.json:
        print(result.to_json())
    else:
        print(result.table())
    if not options.dry_run:
        command = "activesteer identify" + (f" --vehicle {options.vehicle}" if options.vehicle != "compact" else "")
        write_single_track(file, result, command, datetime.date.today().isoformat())
        if not options.json:
            print(f"written to {file}")
    return 0
