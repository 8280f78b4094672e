"""Findings of a check: one line each, with the value, the usual range, and advice."""

from __future__ import annotations

import functools
import math
import textwrap
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal

from activesteer.config import build, read_toml

Level = Literal["ok", "warning", "error"]
_ROUNDING: Final = 1e-7
"""Smallest value that is not printed as 0."""
_WRAPPED: Final = textwrap.TextWrapper(80, subsequent_indent=11 * " ", break_long_words=False)


@dataclass(frozen=True)
class Finding:
    """One line of the report.

    Attributes:
        topic: parts, geometry, standing, riding, kinematics, steering, tyres.
        what: Subject of the finding.
        level: Level: ok, warning or error.
        value: Value with unit, or words.
        usual: Usual range; may be empty.
        advice: Advice; empty without a problem.
    """

    topic: str
    what: str
    level: Level
    value: str
    usual: str = ""
    advice: str = ""


def checked(topic: str, what: str, good: bool, value: str, advice: str) -> Finding:
    """Return the finding about a property that a car must have, with the advice if it has not."""
    return Finding(topic, what, "ok" if good else "error", value, "", "" if good else advice)


@dataclass(frozen=True)
class CheckReport:
    """All findings of a car.

    Attributes:
        vehicle: Name of the car.
        findings: The lines.
    """

    vehicle: str
    findings: tuple[Finding, ...]

    def count(self, level: Level) -> int:
        """Return the number of findings of a level."""
        return sum(finding.level == level for finding in self.findings)

    def __getitem__(self, what: str) -> Finding:
        """Return the finding about a subject."""
        return next(finding for finding in self.findings if finding.what == what)

    def as_table(self) -> dict[str, Any]:
        """Return the report as JSON values."""
        return {
            "vehicle": self.vehicle,
            "errors": self.count("error"),
            "warnings": self.count("warning"),
            "findings": [asdict(finding) for finding in self.findings],
        }

    def table(self) -> str:
        """Return the report as text, with advice below warnings and errors."""
        lines, topic = [], ""
        for finding in self.findings:
            if finding.topic != topic:
                topic = finding.topic
                lines += ["", topic] if lines else [topic]
            usual = f" (usual: {finding.usual})" if finding.usual else ""
            lines += _WRAPPED.wrap(f"  {finding.level:7}  {finding.what}: {finding.value}{usual}")
            if finding.advice:
                lines += _WRAPPED.wrap(f"           -> {finding.advice}")
        errors, warnings = self.count("error"), self.count("warning")
        return "\n".join([*lines, "", f"{self.vehicle}: {errors} errors, {warnings} warnings, {self.count('ok')} ok"])


@dataclass(frozen=True)
class Usual:
    """Usual and possible range of a value. Keys of a table in usual.toml, which has the sources."""

    topic: str
    words: str
    """Name in the report."""
    usual: tuple[float, ...]
    """Lowest and highest usual value. A value outside is a warning."""
    advice: str
    """Advice for a value outside."""
    unit: str = ""
    """Unit, or empty for a pure number or a metric of the rig, which has its own."""
    possible: tuple[float, ...] = (-math.inf, math.inf)
    """Lowest and highest possible value. A value outside is an error."""
    axle: str = ""
    name: str = ""
    """Axle and name of a metric of the rig."""

    def judged(self, value: float, unit: str = "", **words: str) -> Finding:
        """Return the finding about a value. Nan counts as a warning."""
        unit = (self.unit or unit).removesuffix("-")
        level: Level = "warning"
        if not math.isnan(value):
            level = "ok" if self.usual[0] <= value <= self.usual[1] else "warning"
            level = level if self.possible[0] <= value <= self.possible[1] else "error"
        shown = 0.0 if abs(value) < _ROUNDING else value
        said = "none" if math.isnan(value) else f"{shown:.4g} {unit}".strip()
        usual = f"{self.usual[0]:g} to {self.usual[1]:g} {unit}".strip()
        advice = "" if level == "ok" else self.advice
        return Finding(self.topic, self.words.format(**words), level, said, usual, advice)


@dataclass(frozen=True)
class _File:
    metric: tuple[Usual, ...]
    quantity: dict[str, Usual]


@functools.cache
def usual_values() -> _File:
    """Return the usual values of metrics and quantities."""
    return build(_File, *read_toml(Path(__file__).with_name("usual.toml")))


def judged(quantity: str, value: float, **words: str) -> Finding:
    """Return the finding about a quantity of usual.toml (see `Usual.judged`)."""
    return usual_values().quantity[quantity].judged(value, **words)
