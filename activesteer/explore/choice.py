"""Checked choices of the page: names from lists, numbers for keys with a slider."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from activesteer.controllers import CONTROLLERS
from activesteer.errors import ParameterError, nearest_names, shown
from activesteer.explore.messages import Choice
from activesteer.files import is_file
from activesteer.resources import (
    list_controller_variants,
    list_drivers,
    list_maneuvers,
    list_vehicles,
)

_OWN_CODE: Final = re.compile(r"[\w.-]+\.py:\w+(\?[\w=.&+-]*)?")


class Folder:
    """Names that the page may use: those of the package, and files directly in one folder."""

    def __init__(self, path: Path) -> None:
        """Take the folder."""
        self.path = path

    def names(self) -> dict[str, list[str]]:
        """Return the names of manoeuvres, vehicles, drivers and controllers."""
        return {
            "maneuvers": list_maneuvers(),
            "vehicles": list_vehicles(),
            "drivers": list_drivers(),
            "controllers": list(dict.fromkeys([*CONTROLLERS, *list_controller_variants()])),
        }

    def check(self, choice: Choice, courses: Mapping[str, Any] | None = None) -> None:
        """Check the names of a choice."""
        names = self.names()
        self._check("maneuver", choice.maneuver, list(courses) if courses else names["maneuvers"], r".+\.toml")
        self._check("vehicle", choice.vehicle, names["vehicles"], r".+\.toml")
        self._check("driver", choice.driver, names["drivers"], r".+\.toml")
        for controller in choice.controllers:
            self.check_controller(controller)

    def check_controller(self, name: str) -> None:
        """Check the name of a controller, as `check` does."""
        self._check("controllers", name, self.names()["controllers"], _OWN_CODE.pattern)

    def _check(self, key: str, name: str, known: list[str], own: str) -> None:
        """Check that a name is known, or that of a file directly in the folder."""
        if name in known:
            return
        file = name.partition(":")[0]
        if not re.fullmatch(own, name) or Path(file).name != file:
            raise ParameterError(
                f"is {shown(name)}; {nearest_names(name, known)}, or name a file in {self.path} without a folder",
                key=key, value=name,
            )  # fmt: skip
        if not is_file(self.path / file):
            raise ParameterError(f"is {shown(name)}, but {self.path} has no file {file}", key=key, value=name)

    def located(self, name: str) -> str:
        """Return a name as the simulation takes it: a file with its folder."""
        return str(self.path / name) if ".toml" in name or ".py:" in name else name


def check_numbers(values: Mapping[str, float], allowed: Mapping[str, tuple[float, float]]) -> None:
    """Check the values of sliders."""
    for key, value in values.items():
        if key not in allowed:
            raise ParameterError(f"has no slider; {nearest_names(key, allowed)}", key=key, value=value)
        low, high = allowed[key]
        if not low <= value <= high:
            raise ParameterError(
                f"is {value:g}, must be {low:g} to {high:g}", key=key, value=value, allowed=(low, high)
            )
