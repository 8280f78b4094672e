"""The driver of a scenario: a driver file with overrides, or a user's code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from activesteer.config import build, to_table
from activesteer.driver import DriverParameters, driver_spec, is_driver_file
from activesteer.errors import DriverError
from activesteer.plugins import Plugin
from activesteer.resources import DEFAULT_DRIVER, find_driver_file
from activesteer.scenario.car import read_table
from activesteer.scenario.overrides import Override, applied


@dataclass(frozen=True)
class ChosenDriver:
    """The driver of a scenario.

    Attributes:
        plugin: Plugin that creates the driver.
        parameters: The driver file; for a user's code the file of the default driver, which the code can read.
        files: Name -> content of all files, to be kept with a recording.
        user_parameters: Overrides of the parameters of a user's code: class -> name -> value.
    """

    plugin: Plugin
    parameters: DriverParameters
    files: Mapping[str, bytes]
    user_parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def to_table(self) -> dict[str, Any]:
        """Return the table that is recorded: the driver file, or the parameters of a user's code."""
        table = to_table(self.parameters)
        if self.plugin.is_builtin:
            return table
        return {
            "name": self.plugin.name,
            "parameters": self.plugin.parameters_with(self.user_parameters),
            "setup": table,
        }

    def for_searches(self) -> ChosenDriver:
        """Return the driver of searches before a run: the package's code, which follows the setpoint."""
        table = {"name": self.parameters.name}
        return replace(self, plugin=driver_spec(table))


def driver_with(given: Any, overrides: list[Override]) -> ChosenDriver:
    """Read a driver, or a user's code, with overrides of the driver file only."""
    plugin, is_file = driver_spec(given), is_driver_file(given)
    table, source, _, files = read_table(given if is_file else DEFAULT_DRIVER, "driver", find_driver_file, DriverError)
    of_code = {} if is_file else {one.path[1:]: one for one in overrides if one.path[0] == plugin.key and one.path[1:]}
    table, source = applied(DriverParameters, table, source, [one for one in overrides if one not in of_code.values()])
    parameters = build(DriverParameters, table, source)
    if is_file:
        return ChosenDriver(plugin, parameters, files)
    values = plugin.own_values({".".join(path): one.value for path, one in of_code.items()}) if of_code else {}
    return ChosenDriver(plugin, parameters, {**files, **plugin.files}, {plugin.key: values} if values else {})
