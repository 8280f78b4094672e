"""Changes of a scenario while it runs: what can change, and what cannot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any, Final, Literal, NamedTuple

from activesteer.config import Source, build, field_path, merged, to_table
from activesteer.controllers import ControllerParameters
from activesteer.driver import DriverParameters
from activesteer.errors import ManeuverError, ParameterError
from activesteer.maneuver import Maneuver
from activesteer.plugins import Plugin
from activesteer.road.road import Road
from activesteer.scenario.overrides import check_gains, own_controllers, own_values, plain
from activesteer.scenario.scenario import Scenario, part_of

Part = Literal["road", "maneuver", "controller", "driver"]
_CAN: Final = (
    "these keys can: road.mu and the other frictions of the road, the speed and the inputs of the manoeuvre, "
    "controllers.*, driver.*; a fault is set with Simulation.fail"
)
_FRICTION: Final = ("mu", "mu_left", "mu_right", "patches")
_FIXED: Final = ("kind", "name", "title", "duration_s", "settle_s", "fault", "road")
_CONTROL_UNIT: Final = ("interval_s", "bus_delay_s")
_SAMPLES: Final = 200
"""Instants at which the effect of a change on the rest of the manoeuvre is looked for."""


class Change(NamedTuple):
    """A changed scenario."""

    part: Part
    scenario: Scenario


def changed(scenario: Scenario, key: str, value: Any, controller: Plugin, time_s: float) -> Change:
    """Change one key of a scenario that runs with a controller, at a time of the run [s]."""
    value = plain({key: value})[key]
    part, path = part_of(key, type(scenario.maneuver), own_controllers([controller]))
    overrides = {**scenario.overrides, key: value}
    if part == "controllers":
        known = (
            scenario.user_parameters.get(path[0], {}) | own_values({key: value}, own_controllers([controller]))[path[0]]
        )
        return Change(
            "controller",
            replace(scenario, user_parameters={**scenario.user_parameters, path[0]: known}, overrides=overrides),
        )
    if part == "driver":
        return Change("driver", replace(scenario, driver=_driver(scenario, path, value), overrides=overrides))
    if part == "vehicle":
        if path[0] != "controllers" or len(path) < 2 or path[1] in _CONTROL_UNIT:
            raise _cannot(key, "it is built into the car")
        check_gains({key: value}, [controller])
        car = scenario.car
        gains = _with(ControllerParameters, to_table(car.config.controllers), path[1:], value, path[:1])
        car = replace(car, config=replace(car.config, controllers=gains))
        return Change("controller", replace(scenario, car=car, overrides=overrides))
    before = scenario.maneuver
    if path[0] == "road":
        road = _with(Road, to_table(before.road), path[1:], value, path[:1]) if path[1:] else before.road
        held = [field.name for field in fields(Road) if field.name not in _FRICTION]
        if any(getattr(road, name) != getattr(before.road, name) for name in held) or road == before.road:
            raise _cannot(key, "only the friction of a road can" if road != before.road else "the value is the same")
        if len(road.areas()) != len(before.road.areas()):
            raise _cannot(key, "the road has no such area; give it at the start, with the friction of the road")
        return Change("road", replace(scenario, maneuver=_same_course(before, road=road), overrides=overrides))
    if path[0] in _FIXED:
        raise _cannot(key, "it belongs to the start of the run")
    return Change(
        "maneuver", replace(scenario, maneuver=_maneuver(before, key, path, value, time_s), overrides=overrides)
    )


def _cannot(key: str, reason: str) -> ParameterError:
    return ParameterError(f"cannot change during a run: {reason}; {_CAN}", key=key)


def _with(cls: type[Any], table: Mapping[str, Any], path: list[str], value: Any, above: list[str]) -> Any:
    """Build a dataclass from a table with one key replaced."""
    source = Source("", error=ParameterError, overridden=frozenset({".".join((*above, *path))}))
    return build(cls, merged(cls, table, path, value, source, above), source, above)


def _driver(scenario: Scenario, path: list[str], value: Any) -> Any:
    who = scenario.driver
    if not who.plugin.is_builtin and path[0] == who.plugin.key and path[1:]:
        values = {**who.user_parameters.get(path[0], {}), **who.plugin.own_values({".".join(path[1:]): value})}
        return replace(who, user_parameters={**who.user_parameters, path[0]: values})
    if not who.plugin.is_builtin:
        raise ParameterError(f"has no effect: {who.plugin.name} drives", key=".".join(("driver", *path)), value=value)
    return replace(who, parameters=_with(DriverParameters, to_table(who.parameters), path, value, ["driver"]))


def _maneuver(before: Maneuver, key: str, path: list[str], value: Any, time_s: float) -> Maneuver:
    """Return a manoeuvre with a changed input, which must have an effect on the rest of the run."""
    field_path(type(before), path)
    after: Maneuver = _with(type(before), to_table(before), path, value, [])
    if after.search is not None:
        raise _cannot(key, "the steering angle for it is searched for before the run")
    one, other = before.course, after.course
    if one is not None and (other is None or one.to_table() != other.to_table()):
        raise _cannot(key, "it moves the course")
    after = _same_course(before, of=after)
    rest = (time_s + (before.duration_s - time_s) * index / _SAMPLES for index in range(_SAMPLES))
    if all(after.setpoint(instant) == before.setpoint(instant) for instant in rest):
        raise ManeuverError("has no effect on the rest of the run", key=key, value=value)
    return after


def _same_course(before: Maneuver, of: Maneuver | None = None, **values: Any) -> Maneuver:
    """Return a manoeuvre with the very course of another one, so that a driver stays on his path."""
    after = replace(before, **values) if of is None else of
    if "_course" in before.__dict__:
        vars(after)["_course"] = before.__dict__["_course"]
    return after
