"""Search for a controller by name, or in a user's file."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Final, Protocol

import numpy as np

from activesteer.config import Range, field_path, leaves
from activesteer.controllers.no_control import NoControl
from activesteer.controllers.parameters import ControllerParameters, ControllerSetup
from activesteer.controllers.registry import IN_EXAMPLES, UNIT_READS, WITHOUT_FILE, is_read
from activesteer.controllers.variant import read_variant
from activesteer.core.signals import NO_BRAKES, NO_TORQUES, ActuatorCommand, DriverCommand, Estimate, Measurement
from activesteer.errors import ControllerError, ParameterError, shown
from activesteer.plugins import Declared, Kind, Plugin, declared_in, find
from activesteer.resources import list_controller_variants


class Controller(Protocol):
    """Interface of a controller: one method, called once every step of the simulation.

    Examples:
        >>> import activesteer
        >>> class CounterSteer:
        ...     def __init__(self, gain=0.1):
        ...         self.gain = gain
        ...
        ...     def step(self, command, measurement):
        ...         angle_rad = -self.gain * command.front_steer_demand_rad
        ...         return activesteer.ActuatorCommand(rear_steer_demand_rad=angle_rad)
        >>> recording = activesteer.simulate("step_steer", controller=CounterSteer(gain=0.05))
        >>> recording.metrics["rear_steer_steady_state_rad"] < 0.0 < recording.metrics["front_steer_steady_state_rad"]
        True
    """

    def step(self, command: DriverCommand, measurement: Measurement) -> ActuatorCommand:
        """Return the command to the actuators for the next step."""
        ...


_MAX_ANGLE_RAD: Final = 1.0
"""Largest angle of a command; a larger one is treated as a mistake, such as degrees [rad]."""

_MAX_TORQUE_NM: Final = 1e5
"""Largest torque of a command: more than any brake or engine has [N m]."""
_OF_WHEELS: Final = ("brake_torque_demand_Nm", "wheel_torque_demand_Nm")
"""Fields of a command with a torque for each wheel."""
_MAX_PRESSURE_PA: Final = 1e8
"""Largest pressure difference of a command: more than any brake gets [Pa]."""


@dataclass(frozen=True)
class _ControllerKind(Kind):
    """Kind of block for controllers. The four wheel torques form one field."""

    def completed(self, command: Any, name: str, setup: Any, said: str) -> ActuatorCommand:
        """Return a command after a check of its fields other than plain numbers."""
        for field in _OF_WHEELS:
            torques = getattr(command, field)
            if torques is NO_BRAKES or torques is NO_TORQUES:
                continue
            if not _are_torques(torques):
                needed = f"four finite torques of at most {_MAX_TORQUE_NM:g} Nm, fl fr rl rr, are needed"
                raise self.fail(name, f"{said} {field} = {shown(torques)}; {needed}", torques)
            # A list or an array is allowed, but the native step takes a tuple.
            if not isinstance(torques, tuple):
                command = command._replace(**{field: tuple(torques)})
        if command.estimate is not None and not _is_estimate(command.estimate):
            problem = f"{said} estimate = {shown(command.estimate)}; an activesteer.Estimate is needed"
            raise self.fail(name, problem, command.estimate, Estimate)
        return command


def _is_estimate(given: Any) -> bool:
    real = float, int, np.floating, np.integer
    numbers = isinstance(given, Estimate) and all(isinstance(value, real) for value in given)
    return numbers and len([float(value) for value in given]) == len(Estimate._fields)


def _are_torques(torques: Any) -> bool:
    try:
        fl, fr, rl, rr = torques
        return all(abs(float(torque)) <= _MAX_TORQUE_NM for torque in (fl, fr, rl, rr))
    except (TypeError, ValueError):
        return False


CONTROLLER: Final = _ControllerKind(
    word="controller",
    table="controllers",
    example="my_file.py:MyController",
    inputs="command, measurement",
    built_in=WITHOUT_FILE,
    result=ActuatorCommand,
    ranges={
        "rear_steer_demand_rad": Range(-_MAX_ANGLE_RAD, _MAX_ANGLE_RAD),
        "superposition_demand_rad": Range(-_MAX_ANGLE_RAD, _MAX_ANGLE_RAD),
        "drive_torque_change_Nm": Range(-_MAX_TORQUE_NM, _MAX_TORQUE_NM),
        "side_difference_Pa": Range(0.0, _MAX_PRESSURE_PA),
    },
    error=ControllerError,
    unchecked=(*_OF_WHEELS, "estimate"),
    data=list_controller_variants,
    reserved=tuple(field.name for field in fields(ControllerParameters)),
)
"""Rules that all controllers follow."""


def controller_spec(given: Any) -> Plugin:
    """Find a controller by its name, its file or its code.

    Args:
        given: Name of a controller or variant, or path of a variant file; or a user's own code:
            `path/to/file.py:ClassName`, a class, an object, a factory.

    Raises:
        ControllerError: there is no such controller.
    """
    if is_variant(given):
        variant = read_variant(given)
        return Plugin(CONTROLLER, variant.name, variant.name, variant, variant.gains, variant.files, is_builtin=True)
    if isinstance(given, str) and given in IN_EXAMPLES:
        raise ControllerError(f"{given!r} is an example now; use -c {IN_EXAMPLES[given]}", value=given)
    return find(given, CONTROLLER)


def is_variant(given: Any) -> bool:
    """Return whether a controller is given as data: a variant's name or file."""
    return CONTROLLER.is_data(given)


def system_of(given: str) -> str:
    """Return the registered controller of a variant, or any other name unchanged."""
    return read_variant(given).system if is_variant(given) else given


def keys_read(given: Any) -> frozenset[str]:
    """Return the keys of the table [controllers] that affect a controller; a user's own code may read all of them.

    A dotted key stands for a table of which a controller reads only a part.
    """
    plugin = controller_spec(given)
    if not plugin.is_builtin:
        return frozenset(field.name for field in fields(ControllerParameters))
    return frozenset(plugin.origin.reads) | (frozenset() if plugin.origin is NoControl else UNIT_READS)


def declared_parameters(given: Any, gains: ControllerParameters | None = None) -> dict[str, Declared]:
    """Return the parameters by dotted SI key, without those that a variant or text after a `?` fixes."""
    plugin, table = controller_spec(given), f"{CONTROLLER.table}."
    if not plugin.is_builtin:
        own = plugin.declared.items()
        return {f"{table}{plugin.key}.{name}": each for name, each in own if name not in plugin.parameters}
    fixed = {table + ".".join(field_path(ControllerParameters, path)) for path in leaves(plugin.parameters)}
    keys = [table + key for key in keys_read(plugin)]
    found = declared_in(gains or ControllerParameters(), CONTROLLER.reserved, table)
    return {key: each for key, each in found.items() if key not in fixed and is_read(key, keys)}


def load_controller(given: Any, setup: ControllerSetup) -> Controller:
    """Find and create a controller.

    Args:
        given: See `controller_spec`.
        setup: Properties of the car that the controller may know.

    Returns:
        The controller; a user's own is wrapped so that its errors name file and class.

    Raises:
        ControllerError: there is no such controller, or it cannot be created.
    """
    return controller_spec(given).make(setup)


def interval_s(plugin: Plugin, parameters: ControllerParameters, timestep_s: float) -> float:
    """Return the time between calls [s]: `controllers.interval_s`, else the controller's, else the step."""
    given = parameters.interval_s
    own = getattr(plugin.origin, "interval_s", None)
    if given is None and own is None:
        return timestep_s
    return steps_in("controllers.interval_s", given if given is not None else own, timestep_s, 1) * timestep_s


def steps_in(key: str, value: Any, timestep_s: float, minimum: int) -> int:
    """Return a time as a number of steps."""
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    steps = round(value / timestep_s) if number and 0.0 <= value <= 0.1 else -1
    if steps < minimum or abs(steps * timestep_s - value) > 1e-9:
        raise ParameterError(
            f"is {value!r} s; a whole number of steps ({timestep_s:g} s), 0.1 s at most, is needed",
            key=key,
            value=value,
        )
    return steps
