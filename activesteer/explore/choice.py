"""Checked choices of the page: names from lists, numbers for keys with a slider."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from activesteer.config import Source, build
from activesteer.controllers import CONTROLLERS
from activesteer.errors import ParameterError, nearest_names, shown
from activesteer.resources import (
    DEFAULT_DRIVER,
    list_controller_variants,
    list_drivers,
    list_maneuvers,
    list_vehicles,
)

MAX_CONTROLLERS: Final = 3
_OWN_CODE: Final = re.compile(r"[\w.-]+\.py:\w+(\?[\w=.&+-]*)?")
_SOURCE: Final = Source("the message of the page", error=ParameterError)


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A run, or a drive by hand, as the page chose it."""

    maneuver: str
    """Manoeuvre, or course of a drive."""
    vehicle: str = "compact"
    """Car."""
    driver: str = DEFAULT_DRIVER
    """Driver; a drive by hand needs none."""
    controllers: tuple[str, ...] = ("none",)
    """Controllers, at most `MAX_CONTROLLERS`."""
    dragging: bool = False
    """Whether a slider is being moved: the amplitude of the steering wheel is then held."""


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

    def choice(self, message: Mapping[str, Any], courses: Mapping[str, Any] | None = None) -> Choice:
        """Read a message of the page.

        Args:
            message: The message, without its numbers.
            courses: Names that stand for the manoeuvre; those of the package by default.
        """
        chosen = build(Choice, message, _SOURCE)
        names = self.names()
        if not 1 <= len(chosen.controllers) <= MAX_CONTROLLERS:
            raise ParameterError(
                f"has {len(chosen.controllers)} names; 1 to {MAX_CONTROLLERS} are allowed", key="controllers"
            )
        self._check("maneuver", chosen.maneuver, list(courses) if courses else names["maneuvers"], r".+\.toml")
        self._check("vehicle", chosen.vehicle, names["vehicles"], r".+\.toml")
        self._check("driver", chosen.driver, names["drivers"], r".+\.toml")
        for controller in chosen.controllers:
            self._check("controllers", controller, names["controllers"], _OWN_CODE.pattern)
        return chosen

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
        if not (self.path / file).is_file():
            raise ParameterError(f"is {shown(name)}, but {self.path} has no file {file}", key=key, value=name)

    def located(self, name: str) -> str:
        """Return a name as the simulation takes it: a file with its folder."""
        return str(self.path / name) if ".toml" in name or ".py:" in name else name


def numbers(values: object, allowed: Mapping[str, tuple[float, float]]) -> dict[str, float]:
    """Return the values of sliders.

    Args:
        values: Key -> number, from the page.
        allowed: Key -> least and greatest number.
    """
    if not isinstance(values, Mapping):
        raise ParameterError(f"is {shown(values)}; a number for each changed key is needed", key="values")
    found: dict[str, float] = {}
    for key, value in values.items():
        if key not in allowed:
            raise ParameterError(f"has no slider; {nearest_names(str(key), allowed)}", key=str(key), value=value)
        low, high = allowed[key]
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise ParameterError(f"is {shown(value)}; a number is needed", key=key, value=value)
        if not low <= value <= high:
            raise ParameterError(
                f"is {value:g}, must be {low:g} to {high:g}", key=key, value=value, allowed=(low, high)
            )
        found[key] = float(value)
    return found
