"""A test runner with prescribed runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from activesteer.scenario import FileOrTable, Scenario, resolve
from activesteer.standards.standard import StandardRun

Driven = Callable[[str, Mapping[str, Any]], Mapping[str, float] | str | StandardRun]
"""Series, case -> metrics, or why there are none; a whole run where channels are looked at."""


@dataclass
class PrescribedRunner:
    """A test runner that returns prescribed runs and records the requests."""

    driven: Driven
    vehicle: FileOrTable = "compact"
    changed: dict[str, Any] = field(default_factory=dict)
    asked: dict[str, list[dict[str, Any]]] = field(default_factory=dict)

    def scenario(self, maneuver: FileOrTable, overrides: Mapping[str, Any] | None = None) -> Scenario:
        return resolve(maneuver, self.vehicle, {**(overrides or {}), **self.changed})

    def drive(
        self,
        series: str,
        maneuver: FileOrTable,
        cases: Sequence[Mapping[str, Any]],
        overrides: Mapping[str, Any] | None = None,
        curves: Sequence[str] = (),
    ) -> list[StandardRun]:
        # Every case must be one that can be driven.
        resolve(maneuver, self.vehicle, {**(overrides or {}), **self.changed, **cases[0]})
        self.asked.setdefault(series, []).extend(dict(case) for case in cases)
        return [_run(case, self.driven(series, case)) for case in cases]

    def fault_circles(self) -> list[dict[str, Any]]:
        raise NotImplementedError


def _run(case: Mapping[str, Any], found: Mapping[str, float] | str | StandardRun) -> StandardRun:
    if isinstance(found, StandardRun):
        return found
    return StandardRun(case, {}, {}, found) if isinstance(found, str) else StandardRun(case, found, {}, "")
