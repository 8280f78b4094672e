"""What is driven, by which car: manoeuvre file, vehicle file and overrides, checked before anything runs."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.config import Source, build, key_paths, merged, read_toml, to_table
from activesteer.controllers import ControllerParameters, ControllerSetup, SingleTrackParameters
from activesteer.driver import DriverParameters, DriverSetup
from activesteer.errors import ManeuverError, ModelError, ParameterError, TyreFileError, nearest_names
from activesteer.maneuver import Maneuver, build_maneuver, filled_from_csv, maneuver_class
from activesteer.resources import find_maneuver, find_vehicle, models_dir
from activesteer.tyre.file.tir import load_tir
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import VehicleParameters

FileOrTable = str | os.PathLike[str] | Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class CarFile(VehicleParameters):
    """A whole vehicle file: the car, what the controllers know of it, and who drives it."""

    single_track: SingleTrackParameters
    """The car as the controllers see it."""
    controllers: ControllerParameters = ControllerParameters()
    """Gains and limits."""
    driver: DriverParameters = DriverParameters()
    """Gains and limits."""


@dataclass(frozen=True)
class Scenario:
    """A manoeuvre and a car, ready to run.

    Attributes:
        maneuver: The manoeuvre.
        car: The vehicle file.
        mjcf: The model file.
        tyres: Tyres of the front and of the rear axle.
        overrides: What was changed against the files.
        files: What it was made from, by name, to be kept with the recording.
    """

    maneuver: Maneuver
    car: CarFile
    mjcf: Path
    tyres: tuple[TyreParameters, TyreParameters]
    overrides: dict[str, Any] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)

    def controller_setup(self, timestep_s: float) -> ControllerSetup:
        """What controllers may know."""
        return ControllerSetup(
            self.car.single_track, self.car.controllers, self.car.steering.ratio, self.maneuver.road.mu, timestep_s
        )

    def driver_setup(self, timestep_s: float, rack_per_steering_wheel_m: float | None) -> DriverSetup:
        """What drivers may know."""
        car = self.car
        return DriverSetup(
            car.single_track, car.driver, car.steering.ratio, car.steering.steering_wheel_limit_rad,
            rack_per_steering_wheel_m, car.powertrain.max_torque_Nm, car.powertrain.engine_brake_torque_Nm, timestep_s,
        )  # fmt: skip


_PARTS: Final = ("maneuver", "vehicle")


def resolve(
    maneuver: FileOrTable, vehicle: FileOrTable = "compact", overrides: Mapping[str, Any] | None = None
) -> Scenario:
    """Reads and checks everything that a run needs.

    Args:
        maneuver: Name, path, or table of a manoeuvre.
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key -> value: `speed_kmh`, `road.mu`, `controllers.ars.limit_deg`; with `maneuver.` or
            `vehicle.` in front where both have such a key.

    Returns:
        The scenario.

    Raises:
        ManeuverError: the manoeuvre is not found or wrong.
        ParameterError: the vehicle is not found or wrong, or an override names a key that does not exist.
        ModelError: the model file is not found.
        TyreFileError: a tyre file is not found or wrong.
    """
    maneuver_table, maneuver_source, files = _read(maneuver, "maneuver", ManeuverError)
    car_table, car_source, car_files = _read(vehicle, "vehicle", ParameterError)
    files |= car_files
    kind = maneuver_class(maneuver_table, maneuver_source)
    changes = {key: _plain(value) for key, value in (overrides or {}).items()}
    changed: dict[str, set[str]] = {part: set() for part in _PARTS}
    for key, value in changes.items():
        part, path = _which_part(key, kind)
        source = Source(f"override {key}", error=ParameterError)
        if part == "maneuver":
            maneuver_table = merged(kind, maneuver_table, path, value, source)
        else:
            car_table = merged(CarFile, car_table, path, value, source)
        changed[part].add(".".join(path))
    maneuver_source = replace(maneuver_source, overridden=frozenset(changed["maneuver"]))
    car_source = replace(car_source, overridden=frozenset(changed["vehicle"]))
    car = build(CarFile, car_table, car_source)
    if any(field.name == "vehicle_width_m" for field in fields(kind)):
        maneuver_table = {"vehicle_width_m": car.width_m, **maneuver_table}
    own = None if isinstance(maneuver, Mapping) else find_maneuver(maneuver).parent
    maneuver_table, csv_files = filled_from_csv(maneuver_table, own, maneuver_source)
    files |= csv_files
    built = build_maneuver(maneuver_table, maneuver_source)
    own = None if isinstance(vehicle, Mapping) else find_vehicle(vehicle).parent
    mjcf = _find_file(car.mjcf, own, models_dir() / "mjcf", car_source, ("mjcf",), ModelError)
    front, rear = (
        _find_file(name, own, models_dir() / "tyres", car_source, ("tyres", axle), TyreFileError)
        for axle, name in (("front", car.tyres.front), ("rear", car.tyres.rear))
    )
    files |= {f"tyres/{path.name}": path.read_bytes() for path in (front, rear)}
    files |= {f"mjcf/{mjcf.parent.name}/{path.name}": path.read_bytes() for path in sorted(mjcf.parent.glob("*.xml"))}
    front_tyre = replace(load_tir(front), conventions=car.tyres.conventions)
    rear_tyre = front_tyre if rear == front else replace(load_tir(rear), conventions=car.tyres.conventions)
    return Scenario(built, car, mjcf, (front_tyre, rear_tyre), changes, files)


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays as Python's: sweeps are made of them, JSON is not."""
    return value.tolist() if isinstance(value, (np.generic, np.ndarray)) else value


def _read(
    given: FileOrTable, part: str, error: type[ManeuverError] | type[ParameterError]
) -> tuple[dict[str, Any], Source, dict[str, bytes]]:
    if isinstance(given, Mapping):
        name = str(given.get("name") or part)
        return {"name": name, **given}, Source(f"{part} given as a table", error=error), {}
    path = find_maneuver(given) if part == "maneuver" else find_vehicle(given)
    table, source = read_toml(path, error)
    table.setdefault("name", path.stem)
    return table, source, {f"{part}.toml": source.text.encode()}


def _which_part(key: str, kind: type[Maneuver]) -> tuple[str, list[str]]:
    """Whether an override is meant for the manoeuvre or for the vehicle, and the key inside it."""
    first, *rest = key.split(".")
    if first in _PARTS and rest:
        return first, rest
    paths = {"maneuver": key_paths(kind), "vehicle": key_paths(CarFile)}
    # A key may name a whole table, a value, or, behind the number of a list's entry, a value in it.
    dotted = key + "."
    holders = [
        part
        for part in _PARTS
        if any(f"{path}.".startswith(dotted) or dotted.startswith(f"{path}.") for path in paths[part])
    ]
    if len(holders) == 1:
        return holders[0], [first, *rest]
    if holders:
        msg = f"override {key}: both manoeuvre and vehicle have this key; say maneuver.{key} or vehicle.{key}"
        raise ParameterError(msg)
    known = [f"{part}.{path}" for part in _PARTS for path in paths[part]] + paths["maneuver"] + paths["vehicle"]
    msg = f"override {key}: neither manoeuvre nor vehicle has such a key; {nearest_names(key, known)}"
    raise ParameterError(msg)


def _find_file(
    name: str,
    own: Path | None,
    folder: Path,
    source: Source,
    key: tuple[str, ...],
    error: type[ModelError] | type[TyreFileError],
) -> Path:
    """A file that a vehicle file names: beside the vehicle file, among the package's models, or a path of its own."""
    beside = () if own is None else (own / name,)
    for candidate in (*beside, folder / name, Path(name).expanduser()):
        if candidate.is_file():
            return candidate
    present = [str(path.relative_to(folder)) for path in folder.rglob(f"*{Path(name).suffix or '.*'}")]
    raise replace(source, error=error).fail(
        key, f"there is no file {name!r} in {folder.parent.name}/{folder.name}; {nearest_names(name, present)}"
    )


def describe(scenario: Scenario) -> dict[str, Any]:
    """The resolved parameters as plain tables, from which the same scenario can be built again."""
    return {
        "maneuver": to_table(scenario.maneuver),
        "vehicle": to_table(scenario.car),
        "overrides": dict(scenario.overrides),
    }
