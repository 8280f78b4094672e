"""Proving ground of a standard: series of runs on the study engine, and the angle that they start from."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer.config import Range
from activesteer.errors import RecordingError
from activesteer.scenario import FileOrTable, Scenario, resolve
from activesteer.standards.r79_circle import fault_circles
from activesteer.standards.standard import Ground, NoResult, Run
from activesteer.studies.engine import run_task
from activesteer.studies.engine.study import study
from activesteer.studies.engine.workers import Workers


@dataclass(frozen=True)
class ProvingGround:
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
        """See `Ground`."""
        changes = {**(overrides or {}), **self.overrides}
        return resolve(maneuver, self.vehicle, changes, self.driver, [self.controller])

    def drive(
        self,
        series: str,
        maneuver: FileOrTable,
        cases: Sequence[Mapping[str, Any]],
        overrides: Mapping[str, Any] | None = None,
        curves: Sequence[str] = (),
    ) -> list[Run]:
        """See `Ground`."""
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
        """See `Ground`; the runs are not kept."""
        return fault_circles(
            self.controller, self.vehicle, self.overrides, self.driver, self.workers,
            lambda done, total: self.progress("fault_circles", done, total),
        )  # fmt: skip


def _run(row: Mapping[str, Any], case: Mapping[str, Any]) -> Run:
    told = {*case, "run", "sample"}
    return Run(
        case,
        {name: value for name, value in row.items() if isinstance(value, float) and name not in told},
        {
            name.removeprefix(run_task.CURVE): np.asarray(value, dtype=np.float64)
            for name, value in row.items()
            if name.startswith(run_task.CURVE) and value is not None
        },
        "" if row["status"] == run_task.Status.OK else row["error"] or row["status"],
    )


_RATE_DEGPS: Final = 5.0
"""Rate of the ramp [deg/s]; the car lags by some 0.1 s, which is half a degree."""
_LONGEST_S: Final = 30.0


def steering_wheel_at(ground: Ground, speed_kmh: float, ay_mps2: float) -> float:
    """Return the angle from a slow ramp to the left at constant speed.

    Returns:
        Steering wheel angle, to 0.1 deg [deg].
    """
    [run] = ground.drive(
        f"ramp_{speed_kmh:g}kmh",
        "slowly_increasing_steer",
        [{"speed_kmh": speed_kmh}],
        {"steer.rate_degps": _RATE_DEGPS, "duration_s": _LONGEST_S},
        ("steering_wheel_rad", "ay_mps2"),
    )
    try:
        ay = run["ay_mps2"]
    except RecordingError as reason:
        raise NoResult(f"the slow ramp at {speed_kmh:g} km/h cannot be driven: {reason}") from reason
    if ay.max() < ay_mps2:
        raise NoResult(
            f"the car reaches {ay.max():.3g} m/s2 at {speed_kmh:g} km/h; the test needs {ay_mps2:g} m/s2",
            value=ay.max(), allowed=Range(ay_mps2),
        )  # fmt: skip
    # Apart from noise, the acceleration rises until then.
    end = int(np.argmax(ay >= ay_mps2))
    rising = np.maximum.accumulate(ay[: end + 1])
    return round(math.degrees(float(np.interp(ay_mps2, rising, run["steering_wheel_rad"][: end + 1]))), 1)
