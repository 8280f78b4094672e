"""A car as its files describe it: vehicle file, MJCF, tyres and overrides, checked before the car is built."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Final

from activesteer.config import Range, Source, build, checked_number, read_toml
from activesteer.controllers import ControllerParameters, SingleTrackParameters
from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.errors import ActiveSteerError, ModelError, ParameterError, TyreFileError, nearest_names, shown
from activesteer.files import is_file, read_bytes, user_path
from activesteer.resources import find_vehicle, models_dir
from activesteer.road.road import Road
from activesteer.scenario.model_files import model_files
from activesteer.scenario.overrides import Override, applied, plain
from activesteer.sensors import Sensors
from activesteer.theory.single_track import IDENTIFY
from activesteer.theory.two_track import TwoTrackParameters
from activesteer.tyre.file.tir import load_tir
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import Vehicle, VehicleParameters

TIMESTEP_RANGE_S: Final = Range(1e-4, 5e-3)
"""Steps of the engine for which a car with stiff links is stable and accurate [s]."""
FileOrTable = str | os.PathLike[str] | Mapping[str, Any]


_DRIVER_HINT: Final = "a vehicle file has no driver: see models/drivers, --driver and --set driver.preview_s=1.2"


@dataclass(frozen=True, kw_only=True)
class VehicleConfig(VehicleParameters):
    """A whole vehicle file: the car, and its properties that controllers know."""

    single_track: SingleTrackParameters
    """Single-track model of the car, for controllers."""
    two_track: TwoTrackParameters | None = None
    """Further properties for estimators; a car without this table has no estimator."""
    controllers: ControllerParameters = field(default_factory=ControllerParameters)
    """Gains and limits."""
    KEY_HINTS: ClassVar = VehicleParameters.KEY_HINTS | {"driver": _DRIVER_HINT}


@dataclass(frozen=True)
class Car:
    """A car, ready to be put on a road.

    Attributes:
        config: The vehicle file.
        mjcf: The model file.
        tyres: Tyres of the front and of the rear axle.
        new_tyres: The tyres without the factors of the vehicle file.
        overrides: Changes of the vehicle file.
        files: Name -> content of all its files, to be kept with a recording.
    """

    config: VehicleConfig
    mjcf: Path
    tyres: tuple[TyreParameters, TyreParameters]
    new_tyres: tuple[TyreParameters, TyreParameters]
    overrides: dict[str, Any] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the vehicle."""
        return self.config.name

    def with_ideal_sensors(self) -> Car:
        """Return the car with ideal sensors, like measuring equipment."""
        return replace(self, config=replace(self.config, sensors=Sensors()))

    def on(self, road: Road | None = None, timestep_s: float = DEFAULT_TIMESTEP_S) -> Vehicle:
        """Build the car in the engine, at rest in static equilibrium.

        Args:
            road: Friction and grade; level and dry by default.
            timestep_s: Step of the engine, 0.1 to 5 ms [s].

        Raises:
            ParameterError: the step is out of range.
            ModelError: the MJCF does not compile, lacks a part, or has no static equilibrium.
        """
        checked_number("timestep_s", timestep_s, TIMESTEP_RANGE_S)
        content = {name: text for name, text in self.files.items() if name.startswith("mjcf/")}
        return Vehicle(self.mjcf, self.config, self.tyres, Road() if road is None else road, timestep_s, content)


def load_car(vehicle: FileOrTable = "compact", overrides: Mapping[str, Any] | None = None) -> Car:
    """Read and check a car.

    Args:
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key -> value, such as `factors.mass` or `vehicle.tyres.rear`.

    Examples:
        >>> from activesteer.road.road import Road
        >>> from activesteer.scenario import load_car
        >>> car = load_car("compact", {"load.payload_kg": 200.0}).on(Road(mu=0.5))
        >>> round(float(car.model.body_mass.sum()))
        1630
    """
    changes = plain(overrides)
    listed = [Override(key, tuple(key.removeprefix("vehicle.").split(".")), value) for key, value in changes.items()]
    return replace(car_with(vehicle, listed), overrides=changes)


def car_with(vehicle: FileOrTable, overrides: list[Override]) -> Car:
    """Read a car with overrides of the vehicle file only; see `load_car`."""
    table, source, folder, files = read_table(vehicle, "vehicle", find_vehicle, ParameterError)
    known = table.get("single_track")
    table, source = applied(VehicleConfig, table, source, overrides)
    if table.get("single_track") == IDENTIFY and isinstance(known, Mapping):
        # The word alone stands for the key `source` of the table.
        table["single_track"] = {**known, "source": IDENTIFY}
    config = build(VehicleConfig, table, source)
    mjcf = _find_file(config.mjcf, folder, models_dir() / "mjcf", source, ("mjcf",), ModelError)
    front, rear = (
        _find_file(name, folder, models_dir() / "tyres", source, ("tyres", axle), TyreFileError)
        for axle, name in (("front", config.tyres.front), ("rear", config.tyres.rear))
    )
    files |= {f"tyres/{path.name}": read_bytes(path, TyreFileError) for path in (front, rear)}
    model = mjcf.parent.name.encode("utf-8", "backslashreplace").decode()
    files |= {f"mjcf/{model}/{name}": text for name, text in model_files(mjcf).items()}
    front_tyre = _tyre(front, config)
    new = front_tyre, front_tyre if rear == front else _tyre(rear, config)
    return Car(config, mjcf, config.factors.on_tyres(*new), new, files=files)


def _tyre(path: Path, config: VehicleConfig) -> TyreParameters:
    return replace(load_tir(path), conventions=config.tyres.conventions)


def read_table(
    given: FileOrTable, part: str, find: Any, error: type[ActiveSteerError]
) -> tuple[dict[str, Any], Source, Path | None, dict[str, bytes]]:
    """Read the table of a manoeuvre, vehicle or driver, and add its name.

    Args:
        given: Name, path, or the table itself.
        part: `maneuver`, `vehicle` or `driver`.
        find: Function from a name or path to the file.
        error: Class of the errors.

    Returns:
        The table, its source, the folder of its file, and the file by name. A given table has no folder and no file.

    Raises:
        ActiveSteerError: the file is not found or cannot be read; of class `error`.
    """
    if isinstance(given, Mapping):
        return {"name": part, **given}, Source(f"{part} given as a table", error=error), None, {}
    if not isinstance(given, (str, os.PathLike)):
        raise error(f"a {part} is a name, a path or a table, not {shown(given)}", value=given)
    path = find(given)
    table, source = read_toml(path, error)
    table.setdefault("name", path.stem)
    return table, source, path.parent, {f"{part}.toml": source.text.encode()}


def _find_file(
    name: str,
    own: Path | None,
    folder: Path,
    source: Source,
    key: tuple[str, ...],
    error: type[ModelError] | type[TyreFileError],
) -> Path:
    """Find a file of a vehicle file: beside the vehicle file, among the package's models, or by its own path."""
    beside = () if own is None else (own / name,)
    for candidate in (*beside, folder / name, user_path(name, error)):
        if is_file(candidate):
            return candidate
    suffix = Path(name).suffix
    present = [str(path.relative_to(folder)) for path in folder.rglob("*") if not suffix or path.suffix == suffix]
    raise replace(source, error=error).fail(
        key,
        f"there is no file {shown(name)} in {folder.parent.name}/{folder.name}; {nearest_names(name, present)}",
        name,
        present,
    )
