"""Checked choices of the page: names from the package or a folder, and numbers for keys with a slider."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from activesteer.config import read_toml
from activesteer.controllers import CONTROLLERS, read_variant
from activesteer.core.files import is_file
from activesteer.errors import ParameterError, nearest_names, shown
from activesteer.explore.messages import Choice
from activesteer.maneuver import KINDS
from activesteer.resources import (
    find_driver_file,
    find_maneuver,
    list_controller_variants,
    list_drivers,
    list_maneuvers,
    list_vehicles,
)

_CODE: Final = r"[^/\\]+\.py:\w+(\?[\w=.&+-]*)?"
_TABLE: Final = r"[^/\\]+\.toml"
_OWN: Final = {
    "maneuvers": _TABLE, "vehicles": rf"(vehicles/(?!\.)[^/\\]+/)?{_TABLE}", "drivers": f"{_TABLE}|{_CODE}",
    "controllers": f"{_TABLE}|{_CODE}",
}  # fmt: skip
"""Forms of the names in the folder, by list. `vehicles/NAME/` is where `activesteer vehicle new` puts a car."""
_TELLING: Final = {"mjcf": "vehicles", "preview_s": "drivers", "system": "controllers"}
"""Lists to which a file belongs, by a key of the file. Manoeuvres have a `kind`."""
_ARGUMENTS: Final = {3: "controllers", 4: "drivers"}
"""Lists to which a class belongs, by the number of arguments of its method `step`, with `self`."""


class Folder:
    """Names that the page may use, from the package and from one folder."""

    def __init__(self, path: Path) -> None:
        """Store the folder."""
        self.path = path

    def names(self) -> dict[str, list[str]]:
        """Return the names of manoeuvres, vehicles, drivers and controllers, with the names in the folder last."""
        names = _of_package()
        files = sorted([*self.path.glob("*.toml"), *self.path.glob("*.py"), *self.path.glob("vehicles/*/*.toml")])
        for file in files:
            with suppress(OSError, ValueError, SyntaxError):  # a broken file is in no list
                for kind, name in _content_of(file):
                    names[kind].append(file.relative_to(self.path).as_posix() + name)
        return names

    def check(self, choice: Choice, courses: Mapping[str, Any] | None = None) -> None:
        """Check the names of a choice."""
        if courses is None:
            self.check_name("maneuver", choice.maneuver)
        elif choice.maneuver not in courses:
            problem = f"there is no course {shown(choice.maneuver)}; {nearest_names(choice.maneuver, courses)}"
            raise ParameterError(problem, key="maneuver", value=choice.maneuver)
        self.check_name("vehicle", choice.vehicle)
        self.check_name("driver", choice.driver)
        for controller in choice.controllers:
            self.check_name("controller", controller)

    def check_name(self, key: str, name: str) -> None:
        """Reject a name that is neither in the package nor a file in the folder."""
        kind = f"{key}s"
        if name in _of_package()[kind]:
            return
        file = name.partition(":")[0]
        if not re.fullmatch(_OWN[kind], name):
            known = nearest_names(name, self.names()[kind])
            raise ParameterError(
                f"there is no {shown(name)}; files in {self.path} are named without a folder; {known}",
                key=key, value=name,
            )  # fmt: skip
        if not is_file(self.path / file):
            raise ParameterError(f"is {shown(name)}, but {self.path} has no file {file}", key=key, value=name)

    def located(self, name: str) -> str:
        """Return a name as the simulation takes it, with the folder for a file."""
        return str(self.path / name) if ".toml" in name or ".py:" in name else name


def _of_package() -> dict[str, list[str]]:
    return {
        "maneuvers": list_maneuvers(),
        "vehicles": list_vehicles(),
        "drivers": list_drivers(),
        "controllers": list(dict.fromkeys([*CONTROLLERS, *list_controller_variants()])),
    }


def titles() -> dict[str, str]:
    """Return the titles of the package's manoeuvres, drivers and controllers, by their names."""
    found = {name: (controller.__doc__ or "").splitlines()[0].rstrip(".") for name, controller in CONTROLLERS.items()}
    found |= {name: read_variant(name).title for name in list_controller_variants()}
    files = {name: find_maneuver(name) for name in list_maneuvers()}
    files |= {name: find_driver_file(name) for name in list_drivers()}
    return found | {name: read_toml(file)[0].get("title", "") for name, file in files.items()}


def _content_of(file: Path) -> Iterator[tuple[str, str]]:
    """Yield the lists that offer a file, and the ending of its name in each list, without executing its code."""
    text = file.read_text("utf-8")
    if file.suffix == ".toml":
        table = tomllib.loads(text)
        kinds = ["maneuvers"] if table.get("kind") in KINDS else [_TELLING[key] for key in _TELLING if key in table]
        yield from ((kind, "") for kind in kinds[:1])
        return
    blocks = ast.parse(text).body if "def step" in text else []
    for block in (block for block in blocks if isinstance(block, ast.ClassDef)):
        for method in block.body:
            if isinstance(method, ast.FunctionDef) and method.name == "step":
                count = len(method.args.posonlyargs) + len(method.args.args)
                if count in _ARGUMENTS:
                    yield _ARGUMENTS[count], f":{block.name}"


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
