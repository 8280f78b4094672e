"""A car and its driver, read from their files and checked before the car is built.

A car has a vehicle file, MJCF, tyres and overrides.

The engine trusts its input: a few bytes can request a height field, a texture or copies of a body that fill the memory
or take minutes. A car needs much less, so this module limits the sizes and names the limit in its message.
"""

from __future__ import annotations

import functools
import hashlib
import math
import os
import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Final, NamedTuple
from xml.etree import ElementTree

import numpy as np

from activesteer.config import Range, Source, build, checked_number, find_file, read_toml, to_table
from activesteer.controllers import ControllerParameters, SingleTrackParameters
from activesteer.controllers.parameters import SplitAxle
from activesteer.core.conventions import DEFAULT_TIMESTEP_S
from activesteer.core.files import is_file, read_bytes, why_no_file
from activesteer.driver import DriverParameters, driver_spec, is_driver_file
from activesteer.errors import (
    ActiveSteerError,
    DriverError,
    ModelError,
    ParameterError,
    TyreFileError,
    shown,
)
from activesteer.estimation import EstimatorSetup, KnownTyre
from activesteer.estimation.setup import GRID
from activesteer.plugins import Plugin
from activesteer.resources import DEFAULT_DRIVER, find_driver_file, find_vehicle, models_dir
from activesteer.road.road import Road
from activesteer.scenario.overrides import Override, applied, plain
from activesteer.sensors import Sensors
from activesteer.theory.single_track import IDENTIFY, TwoTrackParameters
from activesteer.tyre.evaluation import MagicFormula
from activesteer.tyre.file.tir import load_tir
from activesteer.tyre.tyre_parameters import TyreParameters
from activesteer.vehicle import Vehicle, VehicleParameters
from activesteer.vehicle.electric_actuators import AXLES, Battery, Motors

_MAX_XML_BYTES: Final = 4_000_000
_MAX_FILES: Final = 50
_MAX_ELEMENTS: Final = 20_000
_MAX_DEPTH: Final = 100
_MAX_ASSET_BYTES: Final = 50_000_000
_MAX_PIXELS: Final = 20_000_000
"""Largest number of pixels of a texture, or of samples of a height field."""
_MAX_COPIES: Final = 1000
"""Largest number of copies by `replicate`, `composite` and `flexcomp`, over all levels."""
_MAX_NUMBER: Final = 1e5
"""Largest number in an attribute of _COUNTS."""
_MAX_MEMORY: Final = 1e9
"""Largest memory that a model reserves for the engine [bytes]."""
_BYTES: Final = {"K": 2.0**10, "M": 2.0**20, "G": 2.0**30, "T": 2.0**40, "P": 2.0**50, "E": 2.0**60}
_COUNTS: Final = {
    "size": None,
    "numeric": ("size",),
    "option": (
        "iterations",
        "ls_iterations",
        "noslip_iterations",
        "ccd_iterations",
        "sdf_iterations",
        "sdf_initpoints",
    ),
    "mesh": ("maxhullvert",),
}
"""Attributes of each element with amounts of memory or numbers of iterations, or None for all attributes."""
_COPYING: Final = ("replicate", "composite", "flexcomp")
_COMMENT: Final = re.compile(r"<!--.*?-->", re.DOTALL)
_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?")


def model_files(mjcf: Path) -> dict[str, bytes]:
    """Read an MJCF file, its included files, and the files of its meshes, textures and height fields."""
    files: dict[str, bytes] = {}
    elements = 0
    waiting, assets, folders = [mjcf], {}, {mjcf.parent}
    while waiting:
        path = waiting.pop()
        if (name := _name(path, mjcf)) in files:
            continue
        files[name] = read_bytes(path, ModelError, _MAX_XML_BYTES)
        read = _contents(files[name], name)
        if path == mjcf and read.root != "mujoco":
            raise ModelError("is not an MJCF file: its first element is not <mujoco>", file=name)
        elements += read.elements
        if elements > _MAX_ELEMENTS or len(files) > _MAX_FILES:
            raise _too_large(name)
        waiting += [_included(file, path, mjcf, name) for file in read.included]
        assets |= dict.fromkeys(read.assets, name)
        folders |= {mjcf.parent / folder for folder in read.folders}
    for file, name in assets.items():
        for path in (folder / asked for folder in folders for asked in (file, Path(file).name)):
            if os.path.lexists(path):
                found = _check_asset(path, name)
                files[f"{_name(path, mjcf)}.sha256"] = hashlib.sha256(found).hexdigest().encode()
    return files


class _Contents(NamedTuple):
    root: str  # tag of the first element
    elements: int
    included: tuple[str, ...]  # files
    assets: tuple[str, ...]  # files of meshes, textures, height fields and skins
    folders: tuple[str, ...]  # folders of assets


@functools.lru_cache(maxsize=32)  # a study reads the same few files for each of its runs
def _contents(data: bytes, name: str) -> _Contents:
    """Read one file of a model, and check the sizes that it requests from the engine."""
    root, elements = _parsed(data, name), 0
    included, assets, folders = [], [], []
    for element, copies, depth in _walk(root):
        elements += 1
        if elements > _MAX_ELEMENTS or depth > _MAX_DEPTH:
            raise _too_large(name)
        if element.tag == "include":
            included.append(element.get("file", ""))
        else:
            _check(element, copies, name)
            assets += [file for key, file in element.items() if key.startswith("file") and file]
        if element.tag == "compiler":
            folders += [element.get(key, "") for key in ("meshdir", "texturedir", "assetdir")]
    return _Contents(root.tag, elements, tuple(included), tuple(assets), tuple(folders))


def _too_large(name: str) -> ModelError:
    return ModelError(
        f"the model has more than {_MAX_ELEMENTS} elements, {_MAX_DEPTH} levels or {_MAX_FILES} files", file=name
    )


def _name(path: Path, mjcf: Path) -> str:
    try:
        name = path.relative_to(mjcf.parent).as_posix()
    except ValueError:  # beside or above the model's folder
        name = path.name
    return name.encode("utf-8", "backslashreplace").decode()


def _parsed(data: bytes, name: str) -> ElementTree.Element:
    text = _COMMENT.sub("", data.decode("utf-8", "replace").removeprefix("\ufeff"))
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ModelError("an MJCF file must not have a DOCTYPE or entities", file=name)
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as reason:
        # Report the position only: the content may be confidential.
        line = getattr(reason, "position", (None,))[0]
        raise ModelError("is not valid XML", file=name, line=line) from reason


def _walk(root: ElementTree.Element) -> Iterator[tuple[ElementTree.Element, float, int]]:
    """Yield every element with the number of its copies and its depth."""
    stack = [(root, 1.0, 0)]
    while stack:
        element, copies, depth = stack.pop()
        if element.tag in _COPYING:
            for number in _numbers(element.get("count", "1")):
                copies *= max(1.0, number)
        yield element, copies, depth
        stack += [(child, copies, depth + 1) for child in element]


def _numbers(text: str) -> list[float]:
    return [float(found) for found in _NUMBER.findall(text)]


def _included(file: str, path: Path, mjcf: Path, name: str) -> Path:
    for folder in (mjcf.parent, path.parent):
        if is_file(folder / file):
            return folder / file
    raise ModelError(f"the included file {shown(file)} {why_no_file(mjcf.parent / file)}", file=name, value=file)


def _check(element: ElementTree.Element, copies: float, name: str) -> None:
    """Check the sizes that an element requests from the engine."""
    tag = element.tag
    if copies > _MAX_COPIES:
        raise _too_much(f"<{tag}> makes {copies:.3g} copies", _MAX_COPIES, name)
    if tag in ("hfield", "texture"):
        sides = ("nrow", "ncol") if tag == "hfield" else ("width", "height")
        pixels = 1.0
        for side in sides:
            pixels *= max([1.0, *map(abs, _numbers(element.get(side, "")))])
        if pixels > _MAX_PIXELS:
            raise _too_much(f"<{tag}> has {pixels:.3g} points", _MAX_PIXELS, name)
    if tag in _COUNTS:
        attributes = _COUNTS[tag] or tuple(element.keys())
        for attribute in attributes:
            text = element.get(attribute, "").strip()
            maximum = max(map(abs, _numbers(text)), default=0.0)
            if attribute == "memory":
                if maximum * _BYTES.get(text[-1:].upper(), 1.0) > _MAX_MEMORY:
                    raise _too_much(f"<{tag} memory={shown(text)}>", _MAX_MEMORY, name)
            elif maximum > _MAX_NUMBER:
                raise _too_much(f"<{tag} {attribute}={shown(text)}>", _MAX_NUMBER, name)


def _check_asset(path: Path, name: str) -> bytes:
    data = read_bytes(path, ModelError, _MAX_ASSET_BYTES)
    if data.startswith(b"\x89PNG") and len(data) > 24:
        width, height = struct.unpack(">II", data[16:24])
        if width * height > _MAX_PIXELS:
            raise _too_much(f"the image {shown(path.name)} has {width * height:.3g} pixels", _MAX_PIXELS, name)
    return data


def _too_much(what: str, maximum: float, name: str) -> ModelError:
    return ModelError(f"{what}; a car needs at most {maximum:g}", file=name, allowed=maximum)


TIMESTEP_RANGE_S: Final = Range(1e-4, 5e-3)
"""Steps of the engine for which a car with stiff links is stable and accurate [s]."""
FileOrTable = str | os.PathLike[str] | Mapping[str, Any]


_DRIVER_HINT: Final = "a vehicle file has no driver: see models/drivers, --driver and --set driver.preview_s=1.2"


@dataclass(frozen=True, kw_only=True)
class VehicleConfig(VehicleParameters):
    """A complete vehicle file: the car, and the properties that controllers know."""

    single_track: SingleTrackParameters
    """Single-track model of the car, for controllers."""
    two_track: TwoTrackParameters | None = None
    """Further properties for estimators. A car without this table has no estimator."""
    controllers: ControllerParameters = field(default_factory=ControllerParameters)
    """Gains and limits of the controllers."""
    KEY_HINTS: ClassVar = VehicleParameters.KEY_HINTS | {"driver": _DRIVER_HINT}


@dataclass(frozen=True)
class CarSpec:
    """A car, ready to be put on a road."""

    config: VehicleConfig  # the vehicle file
    mjcf: Path  # the model file
    tyres: tuple[TyreParameters, TyreParameters]  # tyres of the front and of the rear axle
    new_tyres: tuple[TyreParameters, TyreParameters]  # the tyres without the factors of the vehicle file
    # name -> content of all its files, to be kept with a recording
    files: dict[str, bytes] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the vehicle."""
        return self.config.name

    def with_ideal_sensors(self) -> CarSpec:
        """Return the car with ideal sensors, like measuring equipment."""
        return replace(self, config=replace(self.config, sensors=Sensors()))

    def on(self, road: Road | None = None, timestep_s: float = DEFAULT_TIMESTEP_S) -> Vehicle:
        """Build the car in the engine, at rest in static equilibrium."""
        checked_number("timestep_s", timestep_s, TIMESTEP_RANGE_S)
        content = {name: text for name, text in self.files.items() if name.startswith("mjcf/")}
        return Vehicle(self.mjcf, self.config, self.tyres, Road() if road is None else road, timestep_s, content)


def load_car(vehicle: FileOrTable = "compact", overrides: Mapping[str, Any] | None = None) -> CarSpec:
    """Read and check a car.

    Examples:
        >>> from activesteer.road.road import Road
        >>> from activesteer.scenario import load_car
        >>> car = load_car("compact", {"load.payload_kg": 200.0}).on(Road(mu=0.5))
        >>> round(float(car.model.body_mass.sum()))
        1630
    """
    listed = [
        Override(key, tuple(key.removeprefix("vehicle.").split(".")), value) for key, value in plain(overrides).items()
    ]
    return car_with(vehicle, listed)


def car_with(vehicle: FileOrTable, overrides: list[Override]) -> CarSpec:
    """Read a car with overrides of the vehicle file only (see `load_car`)."""
    table, source, folder, files = read_table(vehicle, "vehicle", find_vehicle, ParameterError)
    known = table.get("single_track")
    table, source = applied(VehicleConfig, table, source, overrides)
    if table.get("single_track") == IDENTIFY and isinstance(known, Mapping):
        # The word alone stands for the key `source` of the table.
        table["single_track"] = {**known, "source": IDENTIFY}
    config = build(VehicleConfig, table, source)
    beside = () if folder is None else (folder,)
    of_model, of_tyres = (replace(source, error=error) for error in (ModelError, TyreFileError))
    mjcf = find_file(config.mjcf, (*beside, models_dir() / "mjcf"), "**/*.xml", of_model, ("mjcf",))
    front, rear = (
        find_file(name, (*beside, models_dir() / "tyres"), "*.tir", of_tyres, ("tyres", axle))
        for axle, name in (("front", config.tyres.front), ("rear", config.tyres.rear))
    )
    files |= {f"tyres/{path.name}": read_bytes(path, TyreFileError) for path in (front, rear)}
    model = mjcf.parent.name.encode("utf-8", "backslashreplace").decode()
    files |= {f"mjcf/{model}/{name}": text for name, text in model_files(mjcf).items()}
    read = {
        path: replace(load_tir(path), conventions=config.tyres.conventions) for path in dict.fromkeys((front, rear))
    }
    new = read[front], read[rear]
    return CarSpec(config, mjcf, config.factors.on_tyres(*new), new, files=files)


def read_table(
    given: FileOrTable, part: str, find: Any, error: type[ActiveSteerError]
) -> tuple[dict[str, Any], Source, Path | None, dict[str, bytes]]:
    """Read the table of a manoeuvre, vehicle or driver, and add its name."""
    if isinstance(given, Mapping):
        return {"name": part, **given}, Source(f"{part} given as a table", error=error), None, {}
    if not isinstance(given, (str, os.PathLike)):
        raise error(f"a {part} is a name, a path or a table, not {shown(given)}", value=given)
    path = find(given)
    table, source = read_toml(path, error)
    table.setdefault("name", path.stem)
    return table, source, path.parent, {f"{part}.toml": source.text.encode()}


@dataclass(frozen=True)
class ChosenDriver:
    """The driver of a scenario."""

    plugin: Plugin
    # the driver file; for a user's code the file of the default driver, which the code can read
    parameters: DriverParameters
    files: Mapping[str, bytes]  # name -> content of all files, to be kept with a recording
    # overrides of the parameters of a user's code: class -> name -> value
    user_parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def to_table(self) -> dict[str, Any]:
        """Return the driver as a table for the recording: its file, or the parameters of a user's code."""
        table = to_table(self.parameters)
        if self.plugin.is_builtin:
            return table
        return {
            "name": self.plugin.name,
            "parameters": self.plugin.parameters_with(self.user_parameters),
            "setup": table,
        }

    def for_searches(self) -> ChosenDriver:
        """Return the driver for searches before a run, which follows the setpoint."""
        table = {"name": self.parameters.name}
        return replace(self, plugin=driver_spec(table))


def driver_with(given: Any, overrides: list[Override]) -> ChosenDriver:
    """Read a driver, or a user's code, with overrides of the driver file only."""
    plugin, is_file = driver_spec(given), is_driver_file(given)
    table, source, _, files = read_table(given if is_file else DEFAULT_DRIVER, "driver", find_driver_file, DriverError)
    of_code = {name: one.value for one in overrides if (name := plugin.own_parameter(one.path))}
    of_file = [one for one in overrides if not plugin.own_parameter(one.path)]
    parameters = build(DriverParameters, *applied(DriverParameters, table, source, of_file))
    values = {plugin.key: plugin.own_values(of_code)} if of_code else {}
    return ChosenDriver(plugin, parameters, {**files, **plugin.files}, values)


def split_axles(motors: Motors) -> tuple[SplitAxle, ...]:
    """Return the axles whose left and right wheels can have different torques, front first."""
    found = []
    for place, axle in zip((0, 2), AXLES, strict=True):
        if not motors.splits(axle):
            continue
        motor, *others = motors.on(axle)
        torque_Nm, difference_Nm = motor.wheel_torque_Nm, 2.0 * motor.wheel_torque_Nm
        if not others:
            difference_Nm = motor.split_torque_Nm or 0.0
            torque_Nm = 0.5 * (torque_Nm + difference_Nm)
        found.append(SplitAxle(place, torque_Nm, motor.power_W, motor.regeneration, difference_Nm, motor.efficiency))
    return tuple(found)


def battery_power_W(battery: Battery) -> tuple[float, float]:
    """Return the largest power that a battery takes from motors and gives to them [W]."""
    charge, discharge = (
        math.inf if limit is None else limit for limit in (battery.charge_power_W, battery.discharge_power_W)
    )
    return charge + battery.auxiliary_power_W, max(discharge - battery.auxiliary_power_W, 0.0)


_LARGEST_SLIP_ANGLE_RAD: Final = np.radians(20.0)
"""Largest slip angle of the grid. Beyond it the force stays constant [rad]."""
_LARGEST_LOAD: Final = 3.0
"""Largest load of the grid, divided by the static load. Beyond it the force stays constant."""
_SPEED_MPS: Final = 20.0
"""Speed at which the tyres are evaluated [m/s]."""


def estimator_setup(car: CarSpec) -> EstimatorSetup | None:
    """Return the properties that estimators may use, or None without a table [two_track]."""
    config, body = car.config, car.config.single_track
    if config.two_track is None:
        return None
    front, rear = (_known(*pair) for pair in zip(car.new_tyres, body.wheel_loads_N, strict=True))
    pressure_Pa = config.brakes.hydraulics.full_pedal_pressure_Pa
    fl, fr, rl, rr = (torque_Nm / pressure_Pa for torque_Nm in config.brakes.torques_Nm)
    air = config.aerodynamics
    return EstimatorSetup(
        body, config.two_track, config.steering.ratio, (front, rear), config.powertrain.wheel_fractions,
        (fl, fr, rl, rr), 0.5 * air.air_density_kgpm3 * air.drag_area_m2, config.sensors,
    )  # fmt: skip


def _known(parameters: TyreParameters, load_N: float) -> KnownTyre:
    """Return a tyre as an estimator knows it, for a static load."""
    tyre = MagicFormula(parameters)
    loads_N, angles_rad = map(np.linspace, (0.0, 0.0), (_LARGEST_LOAD * load_N, _LARGEST_SLIP_ANGLE_RAD), GRID)
    left, right = (
        tyre.evaluate(loads_N[:, np.newaxis], 0.0, sign * angles_rad, vx_mps=_SPEED_MPS).fy_N for sign in (-1.0, 1.0)
    )
    force_N = tuple(map(tuple, (0.5 * (left - right)).tolist()))
    standing = tyre.evaluate(load_N, 0.0, 0.0, vx_mps=_SPEED_MPS)
    return KnownTyre(
        float(angles_rad[1]), float(loads_N[1]), force_N, float(standing.relaxation_length_y_m),
        float(standing.slip_stiffness_N) / load_N, float(standing.effective_radius_m),
    )  # fmt: skip
