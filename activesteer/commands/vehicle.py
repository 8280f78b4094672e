"""`activesteer vehicle`: make a car from a table of hardpoints, and check a car."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_json, add_output


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("vehicle", help="make a car from a table of hardpoints, or check a car")
    actions = parser.add_subparsers(required=True, metavar="ACTION")

    new = actions.add_parser("new", help="make a car from a table of hardpoints, masses, springs and bushings")
    new.add_argument("name", metavar="NAME", help="name of the car")
    new.add_argument(
        "--table",
        type=Path,
        metavar="FILE",
        help=".toml or .csv; see docs/own_car.md (default with --kc: its car.toml)",
    )
    new.add_argument("--kc", type=Path, metavar="DIR", help="measurements of a K&C rig, for axles of kind curves")
    add_output(new, "DIR", "folder for the files (default: vehicles/NAME)")
    new.add_argument("--front", metavar="KIND", help="mcpherson, double_wishbone, curves (default: that of the table)")
    new.add_argument(
        "--rear", metavar="KIND", help="five_link, multilink, double_wishbone, curves (default: that of the table)"
    )
    new.add_argument("--overwrite", action="store_true", help="replace an earlier car in that folder")
    add_json(new)
    new.set_defaults(action=_new)

    table = actions.add_parser("table", help="print a table of the package, as a start")
    table.add_argument("table", nargs="?", metavar="NAME", help="name of a table (default: print all names)")
    table.set_defaults(action=_table)

    check = actions.add_parser("check", help="list missing and implausible values of a car; exit status 1 on errors")
    check.add_argument("vehicle", metavar="NAME_OR_PATH", help="name, vehicle file, or its folder")
    add_json(check)
    check.set_defaults(action=_check)

    keyframe = actions.add_parser("keyframe", help="write the standing position of an edited car")
    keyframe.add_argument("vehicle", metavar="PATH", help="vehicle file or its folder")
    keyframe.set_defaults(action=_keyframe)
    for action in (new, table, check, keyframe):
        action.set_defaults(parser=action)


def _new(options: argparse.Namespace) -> int:
    from activesteer.commands.output import print_json
    from activesteer.vehicle_builder import new_vehicle

    made = new_vehicle(
        options.name,
        options.table,
        options.output,
        options.front,
        options.rear,
        kc=options.kc,
        overwrite=options.overwrite,
    )
    if options.json:
        print_json({
            "folder": str(made.folder),
            "vehicle_file": str(made.vehicle_file),
            "questions": list(made.questions),
            "assumptions": [
                {"key": item.key, "value": item.value, "rule": item.rule} for item in made.assumptions
            ],
        })  # fmt: skip
        return 0
    print(f"vehicle: {made.vehicle_file}")
    found = made.trimmed
    for axle in ("front", "rear"):
        part = found.axle(axle)
        print(f"  {axle} springs {1e-3 * part.spring_rate_Npm:.1f} N/mm, {part.spring_force_N:.0f} N as it stands")
    print(f"  steering ratio {found.ratio:.2f}, chassis {found.chassis.mass_kg:.0f} kg")
    print(f"  {len(made.assumptions)} missing values were assumed by rules: {made.folder / 'README.md'}")
    for line in made.questions:
        print(f"  unusual: {line}")
    print(f"next: activesteer vehicle check {made.vehicle_file}")
    return 0


def _table(options: argparse.Namespace) -> int:
    from activesteer.errors import ParameterError, nearest_names
    from activesteer.resources import models_dir

    files = {file.stem: file for file in sorted((models_dir() / "tables").iterdir())}
    if options.table is None:
        print("\n".join(file.name for file in files.values()))
        return 0
    file = files.get(options.table.removesuffix(".toml").removesuffix(".csv"))
    if file is None:
        raise ParameterError(
            f"no table is named {options.table!r}; {nearest_names(options.table, files)}", value=options.table
        )
    print(file.read_text(encoding="utf-8"), end="")
    return 0


def _check(options: argparse.Namespace) -> int:
    from activesteer.commands.output import tell
    from activesteer.vehicle_builder import check_vehicle

    report = check_vehicle(options.vehicle)
    tell(options, report.as_table(), [report.table()])
    return 1 if report.count("error") else 0


def _keyframe(options: argparse.Namespace) -> int:
    from activesteer.errors import ParameterError
    from activesteer.files import write_text
    from activesteer.vehicle_builder.keyframe import keyframe_xml

    text, path = keyframe_xml(options.vehicle)
    print(write_text(path, text, ParameterError))
    return 0
