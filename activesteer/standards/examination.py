"""Test by a standard: drive and evaluate each controller, and write the result."""

from __future__ import annotations

import datetime
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from activesteer.files import file_word
from activesteer.scenario import FileOrTable, check_gains, check_parts, read_by, resolve
from activesteer.standards.catalogue import standard_of
from activesteer.standards.proving_ground import ProvingGround
from activesteer.standards.standard import Findings, NoResult, Standard
from activesteer.studies.engine.factor_values import label_of
from activesteer.studies.engine.run_identity import versions
from activesteer.studies.engine.workers import workers_for


@dataclass(frozen=True)
class Examination:
    """Result of a test.

    Attributes:
        standard: The standard.
        vehicle: Name of the vehicle.
        driver: Name of the driver.
        overrides: Overrides of the user.
        findings: Controller -> findings.
        versions: Versions of the program and its libraries.
        date: Date of the test [UTC].
    """

    standard: Standard
    vehicle: str
    driver: str
    overrides: Mapping[str, Any]
    findings: Mapping[str, Findings]
    versions: Mapping[str, str]
    date: datetime.date

    @property
    def failed(self) -> list[str]:
        """Controllers whose car breaks a limit or cannot be tested."""
        return [name for name, found in self.findings.items() if found.passed is False or found.error]

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {
            "standard": self.standard.name,
            "edition": self.standard.edition,
            "vehicle": self.vehicle,
            "driver": self.driver,
            "overrides": dict(self.overrides),
            "versions": dict(self.versions),
            "controllers": {name: found.values | {"summary": found.summary} for name, found in self.findings.items()},
        }


def examine(
    name: str,
    controllers: Sequence[str] = ("none",),
    vehicle: FileOrTable = "compact",
    overrides: Mapping[str, Any] | None = None,
    *,
    driver: FileOrTable | None = None,
    output: str | os.PathLike[str] | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[str, str, int, int], None] | None = None,
) -> Examination:
    """Drive and evaluate a standard, one of `catalogue.STANDARDS`, with each controller separately.

    Overrides may change car, driver and road; the standard defines the manoeuvres, and the driver if none is given. The
    runs in the folder can be resumed; without a folder, they are not kept. `progress` is called with controller,
    series, finished runs, and all runs.
    """
    standard = standard_of(name)
    driver = standard.driver if driver is None else driver
    given = dict(overrides or {})
    check_parts(given, resolve("straight_line", vehicle, given, driver, controllers), ("vehicle", "driver"))
    check_gains(given, controllers)
    found = {}
    with workers_for(jobs, scheduler=scheduler) as workers:
        for controller in controllers:
            label = label_of(controller)
            folder = None if output is None else Path(output) / "runs" / file_word(label)

            def tell(series: str, done: int, total: int, label: str = label) -> None:
                if progress is not None:
                    progress(label, series, done, total)

            read = read_by(given, controller)
            ground = ProvingGround(standard.name, vehicle, driver, controller, read, folder, workers, tell)
            try:
                found[label] = standard.examine(ground)
            except NoResult as reason:
                found[label] = Findings.without_result(reason)
    today = datetime.datetime.now(tz=datetime.UTC).date()
    return Examination(standard, label_of(vehicle), label_of(driver), given, found, versions(), today)
