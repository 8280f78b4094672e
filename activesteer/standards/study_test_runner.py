"""test runner of a standard: series of runs on the study engine, in one set of workers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from activesteer.scenario import FileOrTable, Scenario, resolve
from activesteer.standards.fault_circle import fault_circles
from activesteer.standards.standard import StandardRun
from activesteer.studies.engine import runs
from activesteer.studies.engine.study import study
from activesteer.studies.engine.workers import Workers


@dataclass(frozen=True)
class StudyTestRunner:
    """A car with a controller and a driver.

    Attributes:
        standard: Name of the standard.
        vehicle: Name, path or table of the vehicle.
        driver: Name, path or table of the driver, or the file of a driver plug-in.
        controller: Name or file of the controller.
        overrides: Overrides of the car: dotted key -> value.
        folder: Folder for the studies, which can be resumed; None if they are not kept.
        workers: Processes that make the runs.
        progress: Called with the series, number of finished runs, and number of all runs.
    """

    standard: str
    vehicle: FileOrTable
    driver: FileOrTable
    controller: str
    overrides: Mapping[str, Any]
    folder: Path | None
    workers: Workers
    progress: Callable[[str, int, int], None]

    def scenario(self, maneuver: FileOrTable, overrides: Mapping[str, Any] | None = None) -> Scenario:
        """See `TestRunner`."""
        changes = {**(overrides or {}), **self.overrides}
        return resolve(maneuver, self.vehicle, changes, self.driver, [self.controller])

    def drive(
        self,
        series: str,
        maneuver: FileOrTable,
        cases: Sequence[Mapping[str, Any]],
        overrides: Mapping[str, Any] | None = None,
        curves: Sequence[str] = (),
    ) -> list[StandardRun]:
        """See `TestRunner`."""
        table = study(
            {
                "title": f"{self.standard}: {series}",
                "maneuvers": [maneuver],
                "vehicles": [self.vehicle],
                "driver": self.driver,
                "controllers": [self.controller],
                "overrides": {**(overrides or {}), **self.overrides},
                "design": {"kind": "list", "cases": [dict(case) for case in cases]},
                **({"curves": list(curves)} if curves else {}),
            },
            output=None if self.folder is None else self.folder / series,
            workers=self.workers,
            progress=lambda counted: self.progress(series, counted.done, counted.total),
        )
        return [_run(row, case) for row, case in zip(table.to_pylist(), cases, strict=True)]

    def fault_circles(self) -> list[dict[str, Any]]:
        """See `TestRunner`. The runs are not kept."""
        return fault_circles(
            self.controller, self.vehicle, self.overrides, self.driver, self.workers,
            lambda done, total: self.progress("fault_circles", done, total),
        )  # fmt: skip


def _run(row: Mapping[str, Any], case: Mapping[str, Any]) -> StandardRun:
    told = {*case, "run", "sample"}
    return StandardRun(
        case,
        {name: value for name, value in row.items() if isinstance(value, float) and name not in told},
        {
            name.removeprefix(runs.CURVE): np.asarray(value, dtype=np.float64)
            for name, value in row.items()
            if name.startswith(runs.CURVE) and value is not None
        },
        "" if row["status"] == runs.Status.OK else row["error"] or row["status"],
    )
