"""Reference data of the package in `models/reference/NAME`; a README there explains them."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.core.conventions import Array
from activesteer.core.files import is_file, is_folder, read_text, shown_path
from activesteer.core.limits import MAX_CSV_BYTES
from activesteer.errors import ParameterError, nearest_names, shown
from activesteer.resources import models_dir

Table = dict[str, Array]

_ENDING: Final = "_reference.csv"


@dataclass(frozen=True)
class ReferenceData:
    """Reference data of a car from another code.

    Attributes:
        name: Name of the folder.
        vehicle: The same car in this package.
        code: The other code, with its version.
        point_from_cg_m: Point of the other code's motion, from our `cg` site, chassis axes [m].
        folder: Folder of the files.
        folders: Folders of runs; the first folder that contains a run counts.
        notes: Differences between the codes, and which code is right.
        study_run: Step steer for the comparison of conventions and step sizes.
    """

    name: str
    vehicle: str
    code: str
    point_from_cg_m: tuple[float, float, float]
    folder: Path
    folders: tuple[Path, ...]
    notes: tuple[str, ...] = ()
    study_run: str = ""

    @classmethod
    def load(cls, name: str = "sedan", more: Path | None = None) -> ReferenceData:
        """Load the reference data.

        Args:
            name: Folder in `models/reference`.
            more: Folder with further runs NAME.csv in the same columns.

        Raises:
            ParameterError: a folder does not exist.
        """
        home = models_dir() / "reference"
        folder = home / name
        names = [path.parent.name for path in home.glob("*/reference.toml")]
        if name not in names:
            known = sorted(path.name for path in home.iterdir() if is_folder(path))  # includes measured circles
            raise ParameterError(
                f"there is no reference named {shown(name)}; {nearest_names(name, known)}", value=name, allowed=known
            )
        if more is not None and not is_folder(more):
            raise ParameterError(f"the folder of reference runs {shown_path(more)} does not exist", value=more)
        table: dict[str, Any] = tomllib.loads((folder / "reference.toml").read_text(encoding="utf-8"))
        x, y, z = table["point_from_cg_m"]
        folders = (folder / "runs",) if more is None else (more, folder / "runs")
        notes = tuple(table.get("notes", ()))
        study = table.get("study_run", "")
        return cls(name, table["vehicle"], table["code"], (x, y, z), folder, folders, notes, study)

    def table(self, name: str) -> Table:
        """Return the columns of a numeric CSV file of the folder."""
        return read_table(self.folder / f"{name}.csv")

    def texts(self, name: str) -> list[dict[str, str]]:
        """Return the rows of a CSV file of the folder, as text."""
        header, *lines = (self.folder / f"{name}.csv").read_text(encoding="utf-8").splitlines()
        return [dict(zip(header.split(","), line.split(","), strict=True)) for line in lines]

    @property
    def runs(self) -> list[str]:
        """Sorted names of all defined runs."""
        return sorted(path.stem for path in (self.folder / "runs").glob("*.toml"))

    def maneuver(self, run: str) -> Path:
        """Return the manoeuvre file of a run."""
        return self.folder / "runs" / f"{run}.toml"

    def run(self, run: str) -> Table | None:
        """Return the columns of a run of the other code; None without a reference."""
        for folder in self.folders:
            for path in (folder / f"{run}.csv", folder / f"{run}{_ENDING}"):
                if is_file(path):
                    return read_table(path)
        return None


def read_table(path: Path) -> Table:
    """Read the columns of a numeric CSV file.

    Raises:
        ParameterError: the file cannot be read.
    """
    first, *lines = read_text(path, ParameterError, MAX_CSV_BYTES).split("\n")
    header = first.strip().split(",")
    try:
        values = np.loadtxt(lines, delimiter=",", ndmin=2)
    except ValueError as reason:
        raise ParameterError(f"cannot read the reference {shown_path(path)}: {reason}") from reason
    if values.shape[1] != len(header):
        problem = f"{len(header)} names and {values.shape[1]} columns"
        raise ParameterError(f"cannot read the reference {shown_path(path)}: {problem}")
    return {name: values[:, column] for column, name in enumerate(header)}
