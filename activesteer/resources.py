"""Find the models, manoeuvres and studies, in a checkout, in an editable install and in an installed wheel.

In a wheel they travel inside the package, in `_data/`; in a checkout they lie beside the package, at the top.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

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
from activesteer.files import is_file, is_folder, user_path, why_no_file

_PACKAGE = Path(__file__).resolve().parent

DEFAULT_DRIVER: Final = "typical"
"""Who drives where nobody is named."""


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
    """The directory with `mjcf/`, `vehicles/`, `tyres/`, `drivers/` and `controllers/`.

    Returns:
        Absolute path of an existing directory.

    Raises:
        ModelError: the installation is incomplete.
    """
    return _data_dir("models", ModelError)


def maneuvers_dir() -> Path:
    """The directory with the manoeuvre files.

    Returns:
        Absolute path of an existing directory.

    Raises:
        ManeuverError: the installation is incomplete.
    """
    return _data_dir("maneuvers", ManeuverError)


def studies_dir() -> Path:
    """The directory with the study files.

    Returns:
        Absolute path of an existing directory.

    Raises:
        StudyError: the installation is incomplete.
    """
    return _data_dir("studies", StudyError)


def list_maneuvers() -> list[str]:
    """Names of the manoeuvres that come with the package, sorted."""
    return _names(maneuvers_dir())


def list_vehicles() -> list[str]:
    """Names of the vehicles that come with the package, sorted."""
    return _names(models_dir() / "vehicles")


def list_studies() -> list[str]:
    """Names of the studies that come with the package, sorted."""
    return _names(studies_dir())


def list_drivers() -> list[str]:
    """Names of the drivers that come with the package, sorted."""
    return _names(models_dir() / "drivers")


def list_controller_variants() -> list[str]:
    """Names of the controller variants that come with the package, sorted."""
    return _names(models_dir() / "controllers")


def find_driver_file(name_or_path: str | os.PathLike[str]) -> Path:
    """The file of a driver.

    Args:
        name_or_path: A name from `list_drivers`, or the path of a .toml file; see `find_maneuver`.

    Returns:
        Path of an existing file.

    Raises:
        DriverError: there is no such driver or file; the message names the nearest ones.
    """
    return _find(name_or_path, models_dir() / "drivers", "driver", DriverError)


def find_controller_variant(name_or_path: str | os.PathLike[str]) -> Path:
    """The file of a controller variant.

    Args:
        name_or_path: A name from `list_controller_variants`, or the path of a .toml file; see `find_maneuver`.

    Returns:
        Path of an existing file.

    Raises:
        ControllerError: there is no such variant or file; the message names the nearest ones.
    """
    return _find(name_or_path, models_dir() / "controllers", "controller", ControllerError)


def find_maneuver(name_or_path: str | os.PathLike[str]) -> Path:
    """The file of a manoeuvre.

    Args:
        name_or_path: A name from `list_maneuvers`, or the path of a .toml file. A string is a path if it contains a
            separator or ends in `.toml`.

    Returns:
        Path of an existing file.

    Raises:
        ManeuverError: there is no such manoeuvre or file; the message names the nearest ones.
    """
    return _find(name_or_path, maneuvers_dir(), "manoeuvre", ManeuverError)


def find_vehicle(name_or_path: str | os.PathLike[str]) -> Path:
    """The parameter file of a vehicle.

    Args:
        name_or_path: A name from `list_vehicles`, or the path of a .toml file or of the folder that it is in. A string
            is a path if it contains a separator or ends in `.toml`, or is no vehicle's name and a folder has it.

    Returns:
        Path of an existing file.

    Raises:
        ParameterError: there is no such vehicle or file; the message names the nearest ones.
    """
    if name_or_path not in list_vehicles() and is_folder(folder := user_path(name_or_path, ParameterError)):
        name_or_path = _vehicle_in(folder)
    return _find(name_or_path, models_dir() / "vehicles", "vehicle", ParameterError)


def _vehicle_in(folder: Path) -> Path:
    """The vehicle file of a folder: that of the folder's name, or the only one there is."""
    names = [name for name in _names(folder) if name != "table"]  # what `vehicle new` keeps of its input
    name = folder.resolve().name
    if name in names:
        return folder / f"{name}.toml"
    if len(names) == 1:
        return folder / f"{names[0]}.toml"
    raise ParameterError(
        f"which vehicle file of {folder} is meant? There are: {', '.join(names) or 'none'}", value=folder, allowed=names
    )


def check_own(file: Path) -> None:
    """Refuse to change a file that belongs to an installed package.

    Args:
        file: The file.

    Raises:
        ParameterError: it does.
    """
    if file.resolve().is_relative_to(_PACKAGE) or {"site-packages", "dist-packages"} & set(file.resolve().parts):
        raise ParameterError(f"{file} belongs to an installed package; copy it to a place of your own", value=file)


def find_study(name_or_path: str | os.PathLike[str]) -> Path:
    """The file of a study.

    Args:
        name_or_path: Name of a study that comes with the package, or the path of a .toml file; see `find_maneuver`.

    Returns:
        Path of an existing file.

    Raises:
        StudyError: there is no such study or file; the message names the nearest ones.
    """
    return _find(name_or_path, studies_dir(), "study", StudyError)


def _names(directory: Path) -> list[str]:
    try:
        return sorted(file.stem for file in directory.iterdir() if file.suffix == ".toml")
    except (OSError, ValueError):  # no folder, or none that may be looked into
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
