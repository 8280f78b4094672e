"""The complete comparison of a car with the reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from activesteer.conventions import DEFAULT_TIMESTEP_S
from activesteer.errors import ParameterError
from activesteer.files import json_text, make_folder, replacing, write_text
from activesteer.road.road import Road
from activesteer.scenario import load_car
from activesteer.simulation.runner import simulate
from activesteer.studies.engine.task_queue import in_parallel
from activesteer.validation.comparison import Comparison, to_json
from activesteer.validation.kinematics import Curves, compare_kinematics
from activesteer.validation.our_runs import compare_run
from activesteer.validation.reference import ReferenceData, Table
from activesteer.validation.reference_columns import reference_columns
from activesteer.validation.static import compare_static
from activesteer.validation.tyre_grid import compare_tyre

_FRICTION: Final = 0.9
"""Friction of the road in all reference runs."""
_WRITTEN_EVERY_S: Final = 0.005


@dataclass(frozen=True)
class Validation:
    """Result of the comparison.

    Attributes:
        reference: The reference data.
        comparisons: All numbers.
        curves: The sweeps of the rig.
        runs: Our columns of every run, including runs without a reference.
        references: Columns of the reference, for the runs that have one.
    """

    reference: ReferenceData
    comparisons: list[Comparison]
    curves: list[Curves]
    runs: dict[str, Table]
    references: dict[str, Table]

    @property
    def outside(self) -> list[Comparison]:
        """Comparisons outside their tolerance."""
        return [comparison for comparison in self.comparisons if comparison.inside is False]

    @property
    def judged(self) -> int:
        """Number of comparisons with a tolerance."""
        return sum(comparison.inside is not None for comparison in self.comparisons)


def validate(
    reference: str = "sedan",
    *,
    more: Path | None = None,
    timestep_s: float = DEFAULT_TIMESTEP_S,
    unknown_runs: bool = True,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> Validation:
    """Compare a car with the same car in another multibody code.

    Args:
        reference: Folder in `models/reference`.
        more: Folder with further reference runs NAME.csv in the same columns.
        timestep_s: Step of our simulation [s].
        unknown_runs: Drive also the runs without a reference.
        jobs: Number of processes; by default the number of processors.
        scheduler: See `in_parallel`.
        progress: Called with the finished fraction and the name of the next step.

    Returns:
        The comparisons.

    Raises:
        ActiveSteerError: reference or car is missing or wrong, or a run failed.
    """
    data = ReferenceData.load(reference, more)
    references = {run: table for run in data.runs if (table := data.run(run)) is not None}
    driven = data.runs if unknown_runs else list(references)

    def report(done: int, what: str) -> None:
        if progress is not None:
            progress(done / (len(driven) + 2), what)

    report(0, "rig")
    car = load_car(data.vehicle)
    vehicle = car.on(Road(mu=_FRICTION), timestep_s)
    rows, curves = compare_kinematics(vehicle, data)
    report(1, "static")
    comparisons = [*compare_static(vehicle, data), *rows, *compare_tyre(car.tyres[0], data)]
    runs = {}
    found = in_parallel(
        _columns,
        [(data, run, timestep_s) for run in driven],
        jobs,
        lambda place, done: report(done + 2, driven[place]),
        scheduler=scheduler,
    )
    for run, columns in zip(driven, found, strict=True):
        runs[run] = columns
        if run in references:
            comparisons += compare_run(run, columns, references[run])
    return Validation(data, comparisons, curves, runs, references)


def _columns(data: ReferenceData, run: str, timestep_s: float) -> Table:
    """Drive a run and return it in the columns of the reference."""
    recording = simulate(data.maneuver(run), vehicle=data.vehicle, timestep_s=timestep_s)
    return reference_columns(recording, data.point_from_cg_m)


def write_json(result: Validation, path: Path) -> Path:
    """Write the comparisons as JSON; see `comparison.to_json`.

    Args:
        result: Result of the comparison.
        path: The file.

    Returns:
        The path.

    Raises:
        ParameterError: the file cannot be written.
    """
    make_folder(path.parent, ParameterError)
    text = json_text(to_json(result.comparisons))
    return write_text(path, text + "\n", ParameterError)


def write_runs(result: Validation, folder: Path) -> list[Path]:
    """Write our runs as CSV files in the columns and signs of the reference.

    Args:
        result: Result of the comparison.
        folder: Output folder; it is created if it does not exist.

    Returns:
        The files.

    Raises:
        ParameterError: a file cannot be written.
    """
    make_folder(folder, ParameterError)
    paths = []
    for run, table in result.runs.items():
        path = folder / f"{run}.csv"
        t = table["t"]
        every = max(1, round(_WRITTEN_EVERY_S / float(t[1] - t[0])))
        rows = np.column_stack(list(table.values()))[::every]
        with replacing(path, ParameterError) as part:
            np.savetxt(part, rows, fmt="%.8g", delimiter=",", header=",".join(table), comments="")
        paths.append(path)
    return paths
