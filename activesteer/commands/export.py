"""`activesteer export VEHICLE`: the car as an FMU, or as a shared library with a C header."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_json, add_overrides, overrides_of
from activesteer.commands.output import tell
from activesteer.errors import ParameterError


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    export = commands.add_parser("export", help="write the car as an FMU or a C library, without Python")
    export.add_argument(
        "vehicle", metavar="VEHICLE", help="a name from `activesteer list`, a vehicle file or its folder"
    )
    add_overrides(export)
    export.add_argument(
        "--maneuver", default="straight_line", metavar="MANEUVER",
        help="manoeuvre that gives road and speed at the start (default: straight_line)",
    )  # fmt: skip
    export.add_argument("--fmi", type=int, choices=(2, 3), default=2, help="version of FMI (default: 2)")
    export.add_argument("--header", action="store_true", help="write a shared library with a C header instead")
    export.add_argument(
        "-o", "--output", type=Path, metavar="FILE.fmu", default=None,
        help="the FMU (default: VEHICLE.fmu), or with --header the folder (default: VEHICLE)",
    )  # fmt: skip
    add_json(export)
    export.set_defaults(action=_export)


def _export(options: argparse.Namespace) -> int:
    from activesteer.coupling.car import export_fmu, export_library
    from activesteer.files import make_folder
    from activesteer.scenario import resolve

    scenario = resolve(options.maneuver, options.vehicle, overrides_of(options))
    name = scenario.car.name
    output = options.output or Path(name if options.header else f"{name}.fmu")
    if options.header:
        export = export_library(scenario, make_folder(output, ParameterError))
    else:
        if output.suffix != ".fmu" or output.is_dir():
            raise ParameterError(f"-o {output}: an FMU ends in .fmu; --header writes a folder", value=output)
        export = export_fmu(scenario, output, options.fmi)
    size = sum(file.stat().st_size for file in output.iterdir()) if options.header else output.stat().st_size
    count = {cause: sum(v.causality == cause for v in export.variables) for cause in ("input", "output", "parameter")}
    about = {"file": str(output), "bytes": size, "token": export.token, "timestep_s": export.timestep_s, **count}
    words = ", ".join(f"{number} {cause}s" for cause, number in count.items())
    tell(options, about, [f"{output}: {size / 1e6:.1f} MB, {words}; steps of {1e3 * export.timestep_s:g} ms"])
    return 0
