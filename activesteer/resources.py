"""Models, manoeuvres and studies of the package, in a checkout or an installation.

In a wheel they are inside the package, in `_data/`; in a checkout they are next to the package.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

from activesteer.core.files import is_file, is_folder, user_path, why_no_file
from activesteer.errors import (
    ActiveSteerError,
    ControllerError,
    DriverError,
    ManeuverError,
    ModelError,
    ParameterError,
    StudyError,
    nearest_names,
    shown,
)

_PACKAGE = Path(__file__).resolve().parent

DEFAULT_DRIVER: Final = "typical"
"""Default driver."""


def _data_dir(name: str, error: type[ActiveSteerError]) -> Path:
    inside, beside = _PACKAGE / "_data" / name, _PACKAGE.parent / name
    for candidate in (inside, beside):
        if candidate.is_dir():
            return candidate
    raise error(
        f"the {name} that belong to activesteer are missing: neither {inside} nor {beside} is a directory",
        value=name,
        allowed=(inside, beside),
    )


def models_dir() -> Path:
    """Return the folder with `mjcf/`, `vehicles/`, `tyres/`, `drivers/` and `controllers/`."""
    return _data_dir("models", ModelError)


def maneuvers_dir() -> Path:
    """Return the folder of the manoeuvre files."""
    return _data_dir("maneuvers", ManeuverError)


def studies_dir() -> Path:
    """Return the folder of the study files."""
    return _data_dir("studies", StudyError)


def list_maneuvers() -> list[str]:
    """Return the names of the manoeuvres of the package, sorted."""
    return _names(maneuvers_dir())


def list_vehicles() -> list[str]:
    """Return the names of the vehicles of the package, sorted."""
    return _names(models_dir() / "vehicles")


def list_studies() -> list[str]:
    """Return the names of the studies of the package, sorted."""
    return _names(studies_dir())


def list_drivers() -> list[str]:
    """Return the names of the drivers of the package, sorted."""
    return _names(models_dir() / "drivers")


def list_controller_variants() -> list[str]:
    """Return the names of the controller variants of the package, sorted."""
    return _names(models_dir() / "controllers")


def find_driver_file(name_or_path: str | os.PathLike[str]) -> Path:
    """Return the file of a driver by its name or path (see `find_maneuver`)."""
    return _find(name_or_path, models_dir() / "drivers", "driver", DriverError)


def find_controller_variant(name_or_path: str | os.PathLike[str]) -> Path:
    """Return the file of a controller variant by its name or path (see `find_maneuver`)."""
    return _find(name_or_path, models_dir() / "controllers", "controller", ControllerError)


def find_maneuver(name_or_path: str | os.PathLike[str]) -> Path:
    """Return the file of a manoeuvre.

    Args:
        name_or_path: A name of the package, or the path of a .toml file. A string is a path if it contains a separator
            or ends in `.toml`.

    Raises:
        ManeuverError: there is no such manoeuvre or file (another class for the other kinds); the message names similar
            ones.
    """
    return _find(name_or_path, maneuvers_dir(), "manoeuvre", ManeuverError)


def find_vehicle(name_or_path: str | os.PathLike[str]) -> Path:
    """Return the parameter file of a vehicle.

    Args:
        name_or_path: A name of the package, or the path of a .toml file or of its folder. A string is a path if it
            contains a separator, ends in `.toml`, or is a folder and not a name of the package.

    Raises:
        ParameterError: there is no such vehicle or file; the message names similar ones.
    """
    if name_or_path not in list_vehicles() and is_folder(folder := user_path(name_or_path, ParameterError)):
        name_or_path = _vehicle_in(folder)
    return _find(name_or_path, models_dir() / "vehicles", "vehicle", ParameterError)


def _vehicle_in(folder: Path) -> Path:
    """Return the vehicle file of a folder: the file with the name of the folder, or the only one."""
    names = [name for name in _names(folder) if name != "table"]  # the input of `vehicle new`
    name = folder.resolve().name
    if name in names:
        return folder / f"{name}.toml"
    if len(names) == 1:
        return folder / f"{names[0]}.toml"
    raise ParameterError(
        f"the folder {folder} needs one vehicle file; it has: {', '.join(names) or 'none'}", value=folder, allowed=names
    )


def check_own(file: Path) -> None:
    """Reject a change to a file of an installed package.

    Raises:
        ParameterError: the file belongs to one.
    """
    if file.resolve().is_relative_to(_PACKAGE) or {"site-packages", "dist-packages"} & set(file.resolve().parts):
        raise ParameterError(f"{file} belongs to an installed package; copy it first", value=file)


def find_study(name_or_path: str | os.PathLike[str]) -> Path:
    """Return the file of a study by its name or path (see `find_maneuver`)."""
    return _find(name_or_path, studies_dir(), "study", StudyError)


def _names(directory: Path) -> list[str]:
    try:
        return sorted(file.stem for file in directory.iterdir() if file.suffix == ".toml")
    except (OSError, ValueError):  # no folder, or no permission
        return []


def _find(name_or_path: str | os.PathLike[str], directory: Path, kind: str, error: type[ActiveSteerError]) -> Path:
    text = os.fsdecode(name_or_path)
    separators = [separator for separator in (os.sep, os.altsep) if separator]
    is_path = not isinstance(name_or_path, str) or text.endswith(".toml") or any(s in text for s in separators)
    if is_path:
        path = user_path(text, error)
        if is_file(path):
            return path
        help_ = f"in {shown(path.parent)}: {nearest_names(path.stem, _names(path.parent))}"
        raise error(f"{kind} file {shown(path)} {why_no_file(path)}; {help_}", value=text)
    file = directory / f"{text}.toml"
    if is_file(file):
        return file
    known = _names(directory)
    raise error(f"no {kind} is named {shown(text)}; {nearest_names(text, known)}", value=text, allowed=known)
