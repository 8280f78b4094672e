"""A test runner with prescribed runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from activesteer.scenario import FileOrTable, resolve
from activesteer.standards.standard import StandardRun, StandardRunner
from activesteer.studies.engine.workers import Workers

Driven = Callable[[str, Mapping[str, Any]], Mapping[str, float] | str | StandardRun]
"""Series, case -> metrics, or why there are none; a whole run where channels are looked at."""


class PrescribedRunner(StandardRunner):
    """A test runner that returns prescribed runs and records the requests."""

    def __init__(self, driven: Driven, changed: Mapping[str, Any] | None = None) -> None:
        super().__init__("", "compact", "typical", "none", changed or {}, None, Workers(), lambda *_: None)
        self.driven = driven
        self.asked: dict[str, list[dict[str, Any]]] = {}

    def drive(
        self,
        series: str,
        maneuver: FileOrTable,
        cases: Sequence[Mapping[str, Any]],
        overrides: Mapping[str, Any] | None = None,
        curves: Sequence[str] = (),
    ) -> list[StandardRun]:
        # Every case must be one that can be driven.
        resolve(maneuver, self.vehicle, {**(overrides or {}), **self.overrides, **cases[0]})
        self.asked.setdefault(series, []).extend(dict(case) for case in cases)
        return [_run(case, self.driven(series, case)) for case in cases]


def _run(case: Mapping[str, Any], found: Mapping[str, float] | str | StandardRun) -> StandardRun:
    if isinstance(found, StandardRun):
        return found
    return StandardRun(case, {}, {}, found) if isinstance(found, str) else StandardRun(case, found, {}, "")
