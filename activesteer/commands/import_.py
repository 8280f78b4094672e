"""`activesteer import FILE... -o OUT.mcap`: convert measured data to a recording."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_json, add_output, add_vehicle
from activesteer.commands.output import print_entry, print_json, print_notes
from activesteer.errors import ParameterError, RecordingError
from activesteer.files import replacing


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "import",
        help="convert measured data to a recording",
        description="Read CSV, MAT, Parquet or MDF files of one run. Columns become channels in SI units with the "
        "signs of ISO 8855 on a uniform time. Without a map, columns are recognised by the names that exporters write.",
    )
    parser.add_argument(
        "files", nargs="+", type=Path, metavar="FILE",
        help="a .csv, .txt, .mat, .parquet or .mf4 file, or several of one run, each with its own times",
    )  # fmt: skip
    parser.add_argument("--map", type=Path, metavar="MAP.toml", help="column and unit of each channel")
    add_vehicle(parser)
    add_output(parser, "OUT.mcap", "the recording (default: FILE.mcap)")
    add_json(parser)
    parser.set_defaults(action=_import)


def _import(options: argparse.Namespace) -> int:
    from activesteer.measured.importing import import_file
    from activesteer.recording import check_target

    if options.output is not None and options.output.suffix != ".mcap":
        raise ParameterError(f"-o {options.output}: the name of a recording ends in .mcap")
    found = import_file(options.files, options.map, options.vehicle)
    output = options.output or options.files[0].with_suffix(".mcap")
    recording = found.recording
    check_target(output)
    with replacing(output, RecordingError) as part:
        try:
            recording.save(part)
        except RecordingError as error:
            raise RecordingError(error.problem.replace(str(part), str(output))) from error
    print_notes(found.notes)
    if options.json:
        step_s = float(recording.time_s[1] - recording.time_s[0])
        print_json({"file": str(output), "rows": len(recording), "step_s": step_s, "channels": found.taken,
                    "notes": list(found.notes)})  # fmt: skip
        return 0
    print(f"{output}: {len(recording)} rows, {recording.time_s[0]:.3f} to {recording.time_s[-1]:.3f} s")
    for name, column in found.taken.items():
        print_entry(f"  {name:24} ", column)
    return 0
