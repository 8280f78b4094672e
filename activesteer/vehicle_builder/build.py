"""Build of a car from its table."""

from __future__ import annotations

import dataclasses
import os
import re
import secrets
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from activesteer.core.files import is_file, user_path, writing
from activesteer.errors import ActiveSteerError, ParameterError, TyreFileError, nearest_names, shown
from activesteer.resources import models_dir
from activesteer.scenario import FileOrTable, load_car
from activesteer.simulation.runner import run_scenario
from activesteer.simulation.two_track_search import two_track_of
from activesteer.tyre.file.tir import load_tir
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle_builder.axle_kinds import AxleKind
from activesteer.vehicle_builder.completion import DEFAULT_TYRE, check_origin, complete
from activesteer.vehicle_builder.design import Assumption, CarDesign, Log
from activesteer.vehicle_builder.kc_tables import KcTables, read_kc
from activesteer.vehicle_builder.table import CarTable, check_points, chosen_kinds, in_vehicle_axes, read_table
from activesteer.vehicle_builder.texts import mjcf_files, readme_text, vehicle_text
from activesteer.vehicle_builder.trim import Trimmed, compiled_model, trim


def keyframe_xml(vehicle: FileOrTable) -> tuple[str, Path]:
    """Return the text of keyframes.xml, and the path of this file."""
    car = load_car(vehicle)
    qpos = " ".join(f"{value:.15g}" for value in car.on().data.qpos)
    text = f"""<mujocoinclude>
  <!-- Written by tools/make_keyframe.py: static equilibrium on the tyres. -->
  <keyframe>
    <key name="static_ride"
      qpos="{qpos}"/>
  </keyframe>
</mujocoinclude>
"""
    return text, car.mjcf.parent / "keyframes.xml"


@dataclass(frozen=True)
class NewVehicle:
    """A new car: its files, and its assumed or adjusted values.

    Attributes:
        folder: Folder of its files.
        vehicle_file: Vehicle file, as for `--vehicle`.
        assumptions: Values that the table does not give.
        trimmed: Values from the standing car.
        questions: Unusual measurements, and what the car cannot drive.
    """

    folder: Path
    vehicle_file: Path
    assumptions: tuple[Assumption, ...]
    trimmed: Trimmed
    questions: tuple[str, ...] = ()


def new_vehicle(
    name: str,
    table: str | os.PathLike[str] | None = None,
    folder: str | os.PathLike[str] | None = None,
    front: str | None = None,
    rear: str | None = None,
    *,
    kc: str | os.PathLike[str] | None = None,
    overwrite: bool = False,
) -> NewVehicle:
    """Create a car from a table, or from measurements of a K&C rig.

    Examples:
        >>> from activesteer.resources import models_dir
        >>> from activesteer.vehicle_builder import check_vehicle, new_vehicle
        >>> made = new_vehicle("mine", models_dir() / "tables" / "wishbone.csv")
        >>> made.vehicle_file.as_posix()
        'vehicles/mine/mine.toml'
        >>> check_vehicle(made.vehicle_file).count("error")
        0
    """
    if not re.fullmatch(r"[A-Za-z][\w-]*", name):
        raise ParameterError(
            f"{name!r} cannot be the name of a car: a letter first, then letters, digits, _ and -", value=name
        )
    if table is None and kc is None:
        raise ParameterError("a table of the car or a folder of K&C measurements is needed (--table, --kc)")
    target = Path(folder) if folder is not None else Path("vehicles") / name
    table_path = Path(table) if table is not None else Path(kc or "") / "car.toml"
    if target.exists() and (not target.is_dir() or any(target.iterdir())) and not overwrite:
        raise ParameterError(
            f"{target} is not empty; give another folder with -o, or --overwrite to replace its files", value=target
        )
    raw, source = read_table(table_path)
    kinds = chosen_kinds(raw, front, rear)
    check_points(raw, kinds, source)
    tables = _measurements(kinds, kc)
    log = Log()
    tyres = {axle: _tyre(axle, raw, table_path.parent, log) for axle in ("front", "rear")}
    given = in_vehicle_axes(raw)
    if tables is not None and given.steering.ratio is None and given.steering.pinion_radius_m is None:
        pinion = tables.rack_per_steering_wheel_m
        given = dataclasses.replace(given, steering=dataclasses.replace(given.steering, pinion_radius_m=pinion))
    car = complete(
        name, given, kinds, {axle: (file, parameters) for axle, (file, parameters, _) in tyres.items()}, log, tables
    )
    check_origin(car, raw)
    # All files are written in a temporary folder: a car that cannot stand leaves no files.
    with tempfile.TemporaryDirectory() as scratch:
        files = Path(scratch)
        for _, _, own in tyres.values():
            if own is not None:
                shutil.copyfile(own, files / own.name)
        trimmed = trim(car, lambda trimmed: _write(files, car, trimmed), log)
        _write(files, car, trimmed, final=True)
        text, keyframes = keyframe_xml(files / f"{name}.toml")
        keyframes.write_text(text, encoding="utf-8")
        questions = [*car.questions, *_drive(files, car, trimmed)]
        shutil.copyfile(table_path, files / f"table{table_path.suffix.lower()}")
        readme = readme_text(car, trimmed, f"table{table_path.suffix.lower()}")
        (files / "README.md").write_text(readme, encoding="utf-8")
        _install(files, target)
    return NewVehicle(target, target / f"{name}.toml", tuple(car.assumptions), trimmed, tuple(questions))


def _install(files: Path, target: Path) -> None:
    """Copy files to a folder that appears only when it is complete, so that a full disk leaves no files."""
    part = target.with_name(f".{target.name}-{secrets.token_hex(4)}.part")
    with writing(target, ParameterError):
        try:
            shutil.copytree(files, part)
            target.mkdir(exist_ok=True)
            for file in part.iterdir():
                file.replace(target / file.name)
        finally:
            shutil.rmtree(part, ignore_errors=True)


def _measurements(kinds: dict[str, AxleKind], kc: str | os.PathLike[str] | None) -> KcTables | None:
    guided = [axle for axle, kind in kinds.items() if kind.guided]
    if guided and kc is None:
        raise ParameterError(f"the {guided[0]} axle has curves, so the folder of its measurements is needed (--kc)")
    if kc is not None and not guided:
        raise ParameterError(
            'no axle of the table is of the type "curves", so the measurements would have no effect; use '
            "--front curves or --rear curves",
            key="--kc", value=kc,
        )  # fmt: skip
    return None if kc is None else read_kc(Path(kc), guided)


def _drive(folder: Path, car: CarDesign, trimmed: Trimmed) -> list[str]:
    """Drive the standing car and write its two-track properties, or return the reason for a failure."""
    file = folder / f"{car.name}.toml"
    try:
        found = two_track_of(file, run_scenario)
    except ActiveSteerError as reason:
        return [f"no [two_track], which estimators need: {reason}"]
    file.write_text(vehicle_text(car, trimmed, compiled_model(file.with_suffix(".xml")), found), encoding="utf-8")
    return []


def _write(folder: Path, car: CarDesign, trimmed: Trimmed, *, final: bool = False) -> Path:
    """Write MJCF and vehicle file. The final vehicle file has the single-track model of the car."""
    for name, text in mjcf_files(car, trimmed).items():
        (folder / name).write_text(text, encoding="utf-8")
    model = compiled_model(folder / f"{car.name}.xml") if final else None
    file = folder / f"{car.name}.toml"
    file.write_text(vehicle_text(car, trimmed, model), encoding="utf-8")
    return file


def _tyre(axle: str, table: CarTable, beside: Path, log: Log) -> tuple[str, TyreParameters, Path | None]:
    """Return name and parameters of an axle's tyre file, and the file to copy."""
    name = table.axle(axle).tyre
    if name is None:
        log.note(f"{axle}.tyre", DEFAULT_TYRE, "the compact's")
        name = DEFAULT_TYRE
    own, shipped = beside / user_path(name, TyreFileError), models_dir() / "tyres" / name
    if is_file(own):
        return own.name, load_tir(own), own
    if is_file(shipped):
        return name, load_tir(shipped), None
    present = [path.name for path in (models_dir() / "tyres").glob("*.tir")]
    raise TyreFileError(
        f"there is no file {shown(name)} next to the table or in models/tyres; {nearest_names(name, present)}",
        key=f"{axle}.tyre",
        value=name,
        allowed=present,
    )
