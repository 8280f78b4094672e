"""The complete comparison of a car with the reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from activesteer.core.conventions import DEFAULT_TIMESTEP_S
from activesteer.core.files import atomic_write, make_folder, shown_path
from activesteer.errors import ParameterError
from activesteer.road.road import Road
from activesteer.scenario import load_car
from activesteer.simulation.runner import simulate
from activesteer.studies.engine.workers import in_parallel
from tests.reference.chrono.comparison import Comparison
from tests.reference.chrono.kinematics import Curves, compare_kinematics
from tests.reference.chrono.our_runs import compare_run
from tests.reference.chrono.reference import ReferenceData, Table, read_table
from tests.reference.chrono.reference_columns import reference_columns
from tests.reference.chrono.static import compare_static
from tests.reference.chrono.tyre_grid import compare_tyre
from tests.reference.chrono.uneven import ROADS, UnevenRun, uneven_runs

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
        more: Folder with further reference runs NAME.csv in the same columns; those on uneven roads are described in
            its `roads.json`.
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
    uneven = {} if more is None else {run.name: run for run in _uneven(data, more)}
    driven: list[str | UnevenRun] = [*(data.runs if unknown_runs else references), *uneven.values()]

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
        lambda place, done: report(done + 2, run if isinstance(run := driven[place], str) else run.name),
        scheduler=scheduler,
    )
    for run, columns in zip(driven, found, strict=True):
        if isinstance(run, UnevenRun):
            runs[run.name], references[run.name] = columns, run.table
            comparisons += run.compare(columns)
            continue
        runs[run] = columns
        if run in references:
            comparisons += compare_run(run, columns, references[run])
    return Validation(data, comparisons, curves, runs, references)


def _uneven(data: ReferenceData, folder: Path) -> list[UnevenRun]:
    """Return the runs on uneven roads of a folder, all of whose files must be understood."""
    for path in sorted(folder.iterdir()):
        if path.suffix != ".csv" and path.name != ROADS and path.suffix != ".md":
            raise ParameterError(
                f"{shown_path(path)} is no reference run: the folder may hold runs NAME.csv, {ROADS} and a README.md",
                value=path.name,
            )
    names = [path.stem.removesuffix("_reference") for path in sorted(folder.glob("*.csv"))]
    roads = {name: read_table(folder / f"{name}.csv") for name in names if name not in data.runs}
    return uneven_runs(folder, data.runs, roads, data.point_from_cg_m[0])


def _columns(data: ReferenceData, run: str | UnevenRun, timestep_s: float) -> Table:
    """Drive a run and return it in the columns of the reference."""
    maneuver = data.maneuver(run) if isinstance(run, str) else run.maneuver(_start_speed_mps(data, run, timestep_s))
    recording = simulate(maneuver, vehicle=data.vehicle, timestep_s=timestep_s)
    return reference_columns(recording, data.point_from_cg_m)


def _start_speed_mps(data: ReferenceData, run: UnevenRun, timestep_s: float) -> float:
    """Return the speed from which our car has the reference's speed after settling; both coast."""
    wanted = float(run.table["vx"][0])
    short = run.maneuver(wanted) | {"duration_s": 0.01}
    settled = reference_columns(simulate(short, vehicle=data.vehicle, timestep_s=timestep_s), data.point_from_cg_m)
    return wanted**2 / float(settled["vx"][0])


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
        with atomic_write(path, ParameterError) as part:
            np.savetxt(part, rows, fmt="%.8g", delimiter=",", header=",".join(table), comments="")
        paths.append(path)
    return paths
