"""A resolved scenario, and its changes during a run."""

from __future__ import annotations

import functools
import hashlib
import json
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any, Final, TypeGuard

import numpy as np

from activesteer.config import (
    Source,
    build,
    check_overruled,
    field_in_unit,
    field_path,
    key_hint,
    key_paths,
    leaves,
    merged,
    to_table,
)
from activesteer.config.faults import fault_table
from activesteer.controllers import ControllerParameters, ControllerSetup
from activesteer.core.conventions import GRAVITY_MPS2
from activesteer.core.files import user_path
from activesteer.driver import DriverParameters, DriverSetup
from activesteer.errors import ManeuverError, ParameterError, RecordingError, nearest_names
from activesteer.maneuver import Maneuver, build_maneuver, maneuver_class
from activesteer.maneuver.base import with_files
from activesteer.plugins import Plugin
from activesteer.recording import Recording
from activesteer.resources import DEFAULT_DRIVER, find_maneuver
from activesteer.road.road import Road
from activesteer.scenario.car import (
    CarSpec,
    ChosenDriver,
    FileOrTable,
    VehicleConfig,
    battery_power_W,
    car_with,
    driver_with,
    estimator_setup,
    read_table,
    split_axles,
)
from activesteer.scenario.overrides import (
    Override,
    applied,
    check_gains,
    gain_paths,
    own_controllers,
    own_path,
    own_values,
    plain,
)
from activesteer.vehicle.parameters import PowertrainLimits


@dataclass(frozen=True)
class Scenario:
    """A manoeuvre, a car and a driver, resolved and ready to run.

    Attributes:
        maneuver: The manoeuvre.
        car: The car.
        driver: The driver.
        overrides: Changes of their files.
        files: Name -> content of all files, to be kept with the recording.
        user_parameters: Overrides of the parameters of users' controllers: class -> name -> value.
    """

    maneuver: Maneuver
    car: CarSpec
    driver: ChosenDriver
    overrides: dict[str, Any] = field(default_factory=dict)
    files: dict[str, bytes] = field(default_factory=dict)
    user_parameters: dict[str, dict[str, Any]] = field(default_factory=dict)

    @functools.cached_property
    def digest(self) -> str:
        """Digest of the resolved parameters, equal for equal inputs."""
        return hashlib.sha256(json.dumps(describe(self), sort_keys=True, default=str).encode()).hexdigest()

    def controller_setup(self, timestep_s: float) -> ControllerSetup:
        """Return the properties of the car that controllers may use."""
        car, replaced = self.car.config, frozenset(map(".".join, gain_paths(self.overrides).values()))
        return ControllerSetup(
            car.single_track, car.controllers, car.steering.ratio, timestep_s, replaced, estimator_setup(self.car),
            self.user_parameters, split_axles(car.motors), battery_power_W(car.battery),
        )  # fmt: skip

    def driver_setup(
        self, timestep_s: float, rack_per_steering_wheel_m: float | None, wheel_radius_m: float
    ) -> DriverSetup:
        """Return the properties of the car that drivers may use."""
        car = self.car.config
        return DriverSetup(
            car.single_track, self.driver.parameters, car.steering.ratio, car.steering.steering_wheel_limit_rad,
            rack_per_steering_wheel_m, PowertrainLimits(car.drive), wheel_radius_m, timestep_s,
            self.driver.user_parameters,
        )  # fmt: skip


_PARTS: Final = ("maneuver", "vehicle", "driver")


def resolve(
    maneuver: FileOrTable,
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    driver: Any = DEFAULT_DRIVER,
    controllers: Sequence[Any] = (),
) -> Scenario:
    """Read and check all inputs of a run.

    Args:
        maneuver: Name, path, or table of a manoeuvre; or path of a recording (`.mcap`), whose inputs are driven.
        vehicle: Name, path, or table of a vehicle.
        overrides: Dotted key -> value, such as `speed_kmh`, `road.mu` or `controllers.ars.limit_deg`. Start the key
            with `maneuver.` or `vehicle.` if both have it, and with `driver.` for keys of the driver. Parameters of
            your own code have keys such as `controllers.YawBeta.k_beta` and `driver.Cautious.preview_s`. The key
            `driver` replaces the driver, the key `fault` the faults: tables, or strings such as `rear:stuck@2.0`,
            separated by spaces.
        driver: Name, path or table of a driver, or your own code; see `driver_spec`.
        controllers: Controllers whose parameters `overrides` may set, as for `simulate`; needed for your own code only.

    Raises:
        ManeuverError: the manoeuvre is not found or wrong.
        RecordingError: the recording cannot be read, or lacks steering or speed.
        DriverError: the driver is not found or wrong.
        ParameterError: the vehicle is not found or wrong, or an override names a key that does not exist.
        ModelError: the model file is not found.
        TyreFileError: a tyre file is not found or wrong.

    Examples:
        >>> from activesteer.scenario import resolve
        >>> scenario = resolve("double_lane_change", overrides={"speed_kmh": 72, "factors.mass": 1.1})
        >>> scenario.maneuver.speed_mps, scenario.car.config.factors.mass
        (20.0, 1.1)
        >>> scenario.maneuver.course.path.length_m > 100.0
        True
    """
    given = maneuver
    if is_recording(maneuver):
        file = user_path(maneuver, RecordingError)
        given = open_loop_of(Recording.open(file, recover=True), file.stem)  # of a damaged file up to the damage
    table, source, folder, files = read_table(given, "maneuver", find_maneuver, ManeuverError)
    kind = maneuver_class(table, source)
    if folder is not None:
        # A given table may come from a recording, which holds both an input and the value derived from it.
        check_overruled(kind, table, source, leaves(table))
    changes = plain(overrides)
    if isinstance(faults := changes.get("fault"), str):
        changes["fault"] = [fault_table(text) for text in faults.split()]
    driver = changes.pop("driver", driver)
    sorted_out: dict[str, list[Override]] = {part: [] for part in (*_PARTS, "controllers")}
    owned = own_controllers(controllers) if any(map(own_path, changes)) else {}
    for key, value in changes.items():
        part, path = part_of(key, kind, owned)
        sorted_out[part].append(Override(key, tuple(path), value))
    of_file = table
    table, source = applied(kind, table, source, sorted_out["maneuver"])
    car = car_with(vehicle, sorted_out["vehicle"])
    if any(field.name == "vehicle_width_m" for field in fields(kind)):
        table = {"vehicle_width_m": car.config.width_m, **table}
    table, csv_files = with_files(kind, table, folder, source)
    who = driver_with(driver, sorted_out["driver"])
    own = own_values(sorted_out["controllers"], owned)
    made_from = {**files, **csv_files, **car.files, **who.files}
    built = build_maneuver(table, source)
    if is_recording(maneuver):
        built = build_maneuver(led(table, car.on(built.ground).steering_lag_s), source)
    changed = [field_path(kind, override.path) for override in sorted_out["maneuver"]]
    return Scenario(_with_changes_in_title(built, of_file, changed), car, who, changes, made_from, own)


_IN_TITLES: Final[dict[tuple[str, ...], tuple[str, str, float]]] = {
    ("steer", "steering_wheel_rad"): (r"[\d.]+ [Ag]\b", "{:.3g} deg", math.pi / 180.0),
    ("steer", "amplitude_factor"): (r"[\d.]+ A\b", "{:.3g} A", 1.0),
    ("steer", "lateral_acceleration_mps2"): (r"[\d.]+ g\b", "{:.3g} g", GRAVITY_MPS2),
    ("turn", "steering_wheel_rad"): (r"[\d.]+ m/s²", "{:.3g} deg", math.pi / 180.0),
    ("turn", "lateral_acceleration_mps2"): (r"[\d.]+ m/s²", "{:.3g} m/s²", 1.0),
    ("cones", "spacing_m"): (r"[\d.]+ m\b", "{:.3g} m", 1.0),
    ("road", "mu"): (r"\b(dry|slippery)\b", "friction {:.3g}", 1.0),
}
"""Pattern of a value in a title, text of a driven value, and unit of this text in SI, by field of a manoeuvre."""


def _with_changes_in_title(built: Maneuver, of_file: Mapping[str, Any], changed: Sequence[tuple[str, ...]]) -> Maneuver:
    """Return the manoeuvre with the actual values in its title."""
    title = built.title
    if title != of_file.get("title"):
        return built
    said = f"{of_file.get('speed_kmh', math.nan):g} km/h"
    title = re.sub(rf"\b{said}", f"{3.6 * built.speed_mps:.4g} km/h", title)
    for path in filter(_IN_TITLES.__contains__, changed):
        pattern, words, size = _IN_TITLES[path]
        if isinstance(value := functools.reduce(getattr, path, built), float):
            title = re.sub(pattern, words.format(value / size), title, count=1)
    return built if title == built.title else replace(built, title=title)


def check_parts(overrides: Mapping[str, Any], scenario: Scenario, parts: Sequence[str]) -> None:
    """Check the overrides of a command that sets the manoeuvre or the driver itself."""
    for key, value in overrides.items():
        part, path = part_of(key, type(scenario.maneuver))
        part = "vehicle" if part == "controllers" else part
        if part not in parts and path[0] != "road":
            allowed, word = [*parts, "road"], {"maneuver": "manoeuvre"}.get(part, part)
            raise ParameterError(
                f"belongs to the {word}, which this command sets; keys of {' and '.join(allowed)} can be changed",
                key=key, value=value, allowed=allowed, overridden=True,
            )  # fmt: skip


def part_of(
    key: str, kind: type[Maneuver], owned: Mapping[str, Sequence[Plugin]] | None = None
) -> tuple[str, list[str]]:
    """Return the part of the scenario that an override changes, and its key; `owned` checks users' parameters."""
    first, *rest = key.split(".")
    own = own_path(key)
    if own is not None and (owned is None or own[0] in owned):
        return "controllers", [*own]
    if first in _PARTS and rest:
        return first, rest
    holders = holders_of(key, kind)
    if len(holders) == 1:
        return holders[0], [first, *rest]
    if holders:
        raise ParameterError(
            f"both manoeuvre and vehicle have this key; use maneuver.{key} or vehicle.{key}", key=key, overridden=True
        )
    paths = {"maneuver": key_paths(kind), "vehicle": key_paths(VehicleConfig)}
    known = [f"{part}.{path}" for part in paths for path in paths[part]]
    known += [*paths["maneuver"], *paths["vehicle"]]
    known += [f"driver.{path}" for path in key_paths(DriverParameters)]
    for name, (plugin, *_) in (owned or {}).items():
        known += [f"controllers.{name}.{parameter}" for parameter in plugin.declared]
    help_ = key_hint(kind, key) or key_hint(VehicleConfig, key) or nearest_names(key, known)
    if own is not None and not owned:
        help_ += f" A parameter of your own class {own[0]} needs this class as a controller"
    raise ParameterError(
        f"neither manoeuvre nor vehicle nor driver has such a key; {help_}", key=key, allowed=known, overridden=True
    )


@functools.lru_cache(1024)
def holders_of(key: str, kind: type[Maneuver]) -> tuple[str, ...]:
    """Return the parts of a scenario (`maneuver`, `vehicle`) in which a key exists."""
    dotted, of_part = key + ".", {"maneuver": key_paths(kind), "vehicle": key_paths(VehicleConfig)}
    return tuple(
        part
        for part, paths in of_part.items()
        if any(f"{path}.".startswith(dotted) or dotted.startswith(f"{path}.") for path in paths)
    )


def value_of(scenario: Scenario, key: str, controllers: Sequence[Any] = ()) -> Any:
    """Return the value of a key of the manoeuvre, the vehicle or the driver, in the unit of the key (see `resolve`)."""
    part, path = part_of(key, type(scenario.maneuver))
    if part == "controllers":
        if path[0] not in (owned := own_controllers(controllers)):
            raise ParameterError("no controller here has such a parameter", key=key)
        return owned[path[0]][0].value_of(path[1], scenario.user_parameters)
    who = scenario.driver
    if part == "driver" and (name := who.plugin.own_parameter(path)):
        return who.plugin.value_of(name, who.user_parameters)
    value: Any = {"maneuver": scenario.maneuver, "vehicle": scenario.car.config, "driver": who.parameters}[part]
    factor = 1.0
    for name in path:
        if isinstance(value, tuple) and name.isdigit() and int(name) < len(value):
            value = value[int(name)]
            continue
        names = [field.name for field in fields(value)] if is_dataclass(value) else []
        field_name, factor = field_in_unit(name, names)
        if field_name is None:
            raise ParameterError(f"{name} has no value in this manoeuvre, vehicle or driver", key=key)
        value = getattr(value, field_name)
    return value / factor if factor != 1.0 else value


def describe(scenario: Scenario) -> dict[str, Any]:
    """Return the resolved parameters as plain tables that describe the same scenario."""
    return {
        "maneuver": to_table(scenario.maneuver),
        "vehicle": to_table(scenario.car.config),
        "driver": scenario.driver.to_table(),
        "overrides": dict(scenario.overrides),
        **({"controllers": scenario.user_parameters} if scenario.user_parameters else {}),
    }


_CAN: Final = (
    "these keys can: road.mu and the other frictions of the road, the speed and the inputs of the manoeuvre, "
    "controllers.*, driver.*; a fault is set with Simulation.fail"
)
_FRICTION: Final = ("mu", "mu_left", "mu_right", "patches")
_FIXED: Final = ("kind", "name", "title", "duration_s", "settle_s", "fault", "road")
_CONTROL_UNIT: Final = ("interval_s", "bus_delay_s")
_SAMPLES: Final = 200
"""Times at which the effect of a change on the rest of the manoeuvre is checked."""


def changed(scenario: Scenario, key: str, value: Any, controller: Plugin, time_s: float) -> tuple[str, Scenario]:
    """Change a key, and return the block to create again (`controller`, `driver` or "") and the changed scenario."""
    value = plain({key: value})[key]
    owned = own_controllers([controller])
    part, path = part_of(key, type(scenario.maneuver), owned)
    scenario = replace(scenario, overrides={**scenario.overrides, key: value})
    if part == "controllers":
        known = scenario.user_parameters
        own = own_values([Override(key, tuple(path), value)], owned)[path[0]]
        return "controller", replace(scenario, user_parameters={**known, path[0]: known.get(path[0], {}) | own})
    if part == "driver":
        return "driver", replace(scenario, driver=_driver(scenario, path, value))
    if part == "vehicle":
        if path[0] != "controllers" or len(path) < 2 or path[1] in _CONTROL_UNIT:
            raise _cannot(key, "it is built into the car")
        check_gains({key: value}, [controller])
        car = scenario.car
        gains = _with(ControllerParameters, to_table(car.config.controllers), path[1:], value, path[:1])
        return "controller", replace(scenario, car=replace(car, config=replace(car.config, controllers=gains)))
    before = scenario.maneuver
    if path[0] == "road":
        road = _with(Road, to_table(before.road), path[1:], value, path[:1]) if path[1:] else before.road
        held = [field.name for field in fields(Road) if field.name not in _FRICTION]
        if any(getattr(road, name) != getattr(before.road, name) for name in held) or road == before.road:
            raise _cannot(key, "only the friction of a road can" if road != before.road else "the value is the same")
        if len(road.areas()) != len(before.road.areas()):
            raise _cannot(key, "the road has no such area; define it before the run, with the friction of the road")
        return "", replace(scenario, maneuver=_same_course(before, replace(before, road=road)))
    if path[0] in _FIXED:
        raise _cannot(key, "it belongs to the start of the run")
    return "", replace(scenario, maneuver=_maneuver(before, key, path, value, time_s))


def _cannot(key: str, reason: str) -> ParameterError:
    return ParameterError(f"cannot change during a run: {reason}; {_CAN}", key=key)


def _with(cls: type[Any], table: Mapping[str, Any], path: list[str], value: Any, above: list[str]) -> Any:
    """Build a dataclass from a table in which one key is replaced."""
    source = Source("", error=ParameterError, overridden=frozenset({".".join((*above, *path))}))
    return build(cls, merged(cls, table, path, value, source, above), source, above)


def _driver(scenario: Scenario, path: list[str], value: Any) -> Any:
    who = scenario.driver
    if name := who.plugin.own_parameter(path):
        values = {**who.user_parameters.get(path[0], {}), **who.plugin.own_values({name: value})}
        return replace(who, user_parameters={**who.user_parameters, path[0]: values})
    if not who.plugin.is_builtin:
        raise ParameterError(f"has no effect: {who.plugin.name} drives", key=".".join(("driver", *path)), value=value)
    return replace(who, parameters=_with(DriverParameters, to_table(who.parameters), path, value, ["driver"]))


def _maneuver(before: Maneuver, key: str, path: list[str], value: Any, time_s: float) -> Maneuver:
    """Return a manoeuvre with a changed input. Reject a change without effect on the rest of the run."""
    field_path(type(before), path)
    after: Maneuver = _with(type(before), to_table(before), path, value, [])
    if after.search is not None:
        raise _cannot(key, "the steering angle for it is searched for before the run")
    one, other = before.course, after.course
    if one is not None and (other is None or one.to_table() != other.to_table()):
        raise _cannot(key, "it moves the course")
    after = _same_course(before, after)
    rest = (time_s + (before.duration_s - time_s) * index / _SAMPLES for index in range(_SAMPLES))
    if all(after.setpoint(instant) == before.setpoint(instant) for instant in rest):
        raise ManeuverError("has no effect on the rest of the run", key=key, value=value)
    return after


def _same_course(before: Maneuver, after: Maneuver) -> Maneuver:
    """Return a manoeuvre with the course object of another manoeuvre, so that a driver stays on the path."""
    if before.course is not None:
        vars(after)["course"] = before.course
    return after


_LONGEST: Final = 200_000
"""Largest number of points of a table. A longer recording is thinned."""
_ON_GROUND: Final = 0.5
"""Smallest speed of a manoeuvre with a moving car [m/s]."""


def is_recording(maneuver: object) -> TypeGuard[str | os.PathLike[str]]:
    """Return whether a manoeuvre is a recording to repeat."""
    return isinstance(maneuver, (str, os.PathLike)) and os.fspath(maneuver).endswith(".mcap")


def led(table: dict[str, Any], lag_s: float) -> dict[str, Any]:
    """Advance the steering demand of a manoeuvre by the lag of the steering [s]."""
    steering = table["steering"]
    return table | {"steering": steering | {"time_s": [time_s - lag_s for time_s in steering["time_s"]]}}


def open_loop_of(recording: Recording, name: str) -> dict[str, Any]:
    """Return the manoeuvre that repeats steering wheel angle or rack travel, brake pedal and speed of a recording."""
    if len(recording) < 2:
        raise RecordingError(f"{name}: {len(recording)} rows are too few to drive", value=len(recording))
    rows = np.arange(0, len(recording), max(1, math.ceil(len(recording) / _LONGEST)))
    time_s = (recording.time_s[rows] - recording.time_s[0]).tolist()

    def values(*names: str) -> tuple[str, list[float]] | None:
        found = next((channel for channel in names if channel in recording), None)
        if found is None:
            return None
        column = np.asarray(recording[found][rows], np.float64)
        if not np.isfinite(column).all():
            raise RecordingError(f"{name}: {found} is not finite everywhere and cannot be driven", value=found)
        return found, column.tolist()

    steering, speed = values("steering_wheel_rad", "rack_m"), values("speed_mps", "vx_mps")
    if steering is None or speed is None:
        missing = "steering_wheel_rad or rack_m" if steering is None else "speed_mps or vx_mps"
        raise RecordingError(f"{name}: to drive a recording, {missing} is needed", value=missing)
    table: dict[str, Any] = {
        "kind": "open_loop",
        "name": name,
        "title": f"inputs of {name}",
        "speed_mps": max(speed[1][0], _ON_GROUND),
        "duration_s": time_s[-1],
        "hold_last": True,
        "steering": {"time_s": time_s, steering[0]: steering[1]},
        "speed": {"time_s": time_s, "speed_mps": speed[1]},
    }
    if (brake := values("brake_pedal")) is not None and any(brake[1]):
        table["brake"] = {"time_s": time_s, "pedal": np.clip(brake[1], 0.0, 1.0).tolist()}
    return table
