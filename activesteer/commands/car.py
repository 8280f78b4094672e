"""Commands on the car: `vehicle`, `tyre`, `kc`, `export`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from activesteer.commands import arguments, terminal
from activesteer.core.files import write_text
from activesteer.errors import ParameterError, TyreFileError, nearest_names
from activesteer.resources import models_dir

command: Final = arguments.Group("car")
vehicle: Final = command.with_actions("vehicle", "make a car from a table of hardpoints, or check a car")


@vehicle("new", "make a car from a table of hardpoints, masses, springs and bushings",
    arguments.option("name", "NAME", "name of the car"),
    arguments.option("--table", "FILE",
        ".toml or .csv; see docs/own_car.md (default with --kc: its car.toml)", type=Path),
    arguments.option("--kc", "DIR", "measurements of a K&C rig, for axles of kind curves", type=Path),
    arguments.output("DIR", "folder for the files (default: vehicles/NAME)"),
    arguments.option("--front", "KIND", "mcpherson, double_wishbone, curves (default: from the table)"),
    arguments.option("--rear", "KIND", "five_link, multilink, double_wishbone, curves (default: from the table)"),
    arguments.flag("--overwrite", "replace an earlier car in that folder"),
    arguments.JSON,
)  # fmt: skip
def _new(options: argparse.Namespace) -> None:
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
    values = {
        "folder": str(made.folder),
        "vehicle_file": str(made.vehicle_file),
        "questions": list(made.questions),
        "assumptions": [{"key": item.key, "value": item.value, "rule": item.rule} for item in made.assumptions],
    }
    axles = ((axle, made.trimmed.axle(axle)) for axle in ("front", "rear"))
    lines = [
        f"vehicle: {made.vehicle_file}",
        *(
            f"  {axle} springs {1e-3 * part.spring_rate_Npm:.1f} N/mm, {part.spring_force_N:.0f} N as it stands"
            for axle, part in axles
        ),
        f"  steering ratio {made.trimmed.ratio:.2f}, chassis {made.trimmed.chassis.mass_kg:.0f} kg",
        f"  {len(made.assumptions)} missing values were assumed by rules: {made.folder / 'README.md'}",
        *(f"  unusual: {line}" for line in made.questions),
        f"next: activesteer vehicle check {made.vehicle_file}",
    ]
    terminal.tell(options, values, lines)


@vehicle("table", "print a table of the package, as a starting point",
    arguments.option("table", "NAME", "name of a table (default: print all names)", nargs="?"),
)  # fmt: skip
def _table(options: argparse.Namespace) -> None:
    files = {file.stem: file for file in sorted((models_dir() / "tables").iterdir())}
    if options.table is None:
        print("\n".join(file.name for file in files.values()))
    elif file := files.get(options.table.removesuffix(".toml").removesuffix(".csv")):
        print(file.read_text(encoding="utf-8"), end="")
    else:
        raise ParameterError(
            f"no table is named {options.table!r}; {nearest_names(options.table, files)}", value=options.table
        )


@vehicle("check", "list missing and implausible values of a car; exit status 1 on errors",
    arguments.option("vehicle", "NAME_OR_PATH", "name, vehicle file, or its folder"),
    arguments.JSON,
)  # fmt: skip
def _check(options: argparse.Namespace) -> bool:
    from activesteer.vehicle_builder import check_vehicle

    report = check_vehicle(options.vehicle)
    terminal.tell(options, report.as_table(), [report.table()])
    return report.count("error") > 0


@vehicle("keyframe", "write the standing position of an edited car",
    arguments.option("vehicle", "PATH", "vehicle file or its folder"),
)  # fmt: skip
def _keyframe(options: argparse.Namespace) -> None:
    from activesteer.vehicle_builder.build import keyframe_xml

    text, path = keyframe_xml(options.vehicle)
    print(write_text(path, text, ParameterError))


@command("tyre", "describe a tyre file, list unusual values, draw curves",
    arguments.option("file", "FILE.tir", "a path, or a name in models/tyres"),
    arguments.FIGURES, arguments.JSON,
)  # fmt: skip
def _tyre(options: argparse.Namespace) -> None:
    from activesteer.tyre import load_tir
    from activesteer.tyre.report import describe, draw, key_figures

    name, folder = options.file, models_dir() / "tyres"
    file = next((path for path in (Path(name), folder / name, folder / f"{name}.tir") if path.is_file()), None)
    if file is None:
        words = nearest_names(name, [path.name for path in folder.glob("*.tir")])
        raise TyreFileError(f"there is no tyre file {name}, neither as a path nor in models/tyres; {words}", value=name)
    params = load_tir(file)
    figures = [] if options.output is None else draw(params, options.output)
    terminal.tell(options, key_figures(params), [describe(params)], figures)


@command("kc", "measure kinematics and compliance of the suspensions",
    arguments.CAR, arguments.FIGURES,
    arguments.option("--tables", "DIR",
        "write all curves as CSV and the table of the car, as input of vehicle new --kc",
        type=Path),
    arguments.JSON,
)  # fmt: skip
def _kc(options: argparse.Namespace) -> None:
    from activesteer.rigs.kc import draw, kinematics_compliance

    result = kinematics_compliance(options.vehicle, arguments.overrides_of(options))
    lines = [result.table()]
    if options.tables is not None:
        from activesteer.rigs.kc.result import write_tables
        from activesteer.scenario import load_car
        from activesteer.vehicle_builder.texts import car_table

        written = write_tables(result, options.tables)
        text = car_table(load_car(options.vehicle, arguments.overrides_of(options)), result)
        written.append(write_text(options.tables / "car.toml", text, ParameterError))
        lines.append(f"tables: {len(written)} files in {options.tables}")
    figures = [] if options.output is None else draw(result, options.output)
    terminal.tell(options, result.to_json(), lines, figures)


@command("export", "write the car as an FMU or a C library, without Python",
    arguments.option("vehicle", "VEHICLE", arguments.VEHICLE_WORDS),
    arguments.OVERRIDES,
    arguments.option("--maneuver", "MANEUVER", "manoeuvre that gives road and speed at the start", "straight_line"),
    arguments.option("--fmi", (2, 3), "version of FMI", 2),
    arguments.flag("--header", "write a shared library with a C header instead"),
    arguments.output("FILE.fmu", "the FMU (default: VEHICLE.fmu), or with --header the folder (default: VEHICLE)"),
    arguments.JSON,
)  # fmt: skip
def _export(options: argparse.Namespace) -> None:
    from activesteer.core.files import make_folder
    from activesteer.coupling.car import export_fmu, export_library
    from activesteer.scenario import resolve

    scenario = resolve(options.maneuver, options.vehicle, arguments.overrides_of(options))
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
    terminal.tell(options, about, [f"{output}: {size / 1e6:.1f} MB, {words}; steps of {1e3 * export.timestep_s:g} ms"])
