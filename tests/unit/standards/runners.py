"""A test runner with prescribed runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from activesteer.maneuver import Maneuver
from activesteer.scenario import FileOrTable
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
        self.maneuvers: dict[str, list[Maneuver]] = {}

    def drive(
        self,
        series: str,
        maneuver: FileOrTable,
        cases: Sequence[Mapping[str, Any]],
        overrides: Mapping[str, Any] | None = None,
        curves: Sequence[str] = (),
    ) -> list[StandardRun]:
        # Every case must be one that can be driven.
        found = [self.scenario(maneuver, {**(overrides or {}), **case}).maneuver for case in cases]
        self.maneuvers.setdefault(series, []).extend(found)
        self.asked.setdefault(series, []).extend(dict(case) for case in cases)
        return [self.run_of(series, case, each) for case, each in zip(cases, found, strict=True)]

    def run_of(self, series: str, case: Mapping[str, Any], maneuver: Maneuver) -> StandardRun:
        """Return the prescribed run of a case; subclasses may compute its channels from the manoeuvre."""
        found = self.driven(series, case)
        if isinstance(found, StandardRun):
            return found
        return StandardRun(case, {}, {}, found) if isinstance(found, str) else StandardRun(case, found, {}, "")
