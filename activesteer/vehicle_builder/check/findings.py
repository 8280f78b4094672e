"""Findings of a check: one line each, with the value, the usual range, and advice."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal

Level = Literal["ok", "warning", "error"]
_ROUNDING: Final = 1e-7
"""Smallest value that is not printed as 0."""


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
        wide = max((len(finding.what) for finding in self.findings), default=0)
        value = max((len(finding.value) for finding in self.findings if len(finding.value) < 30), default=0)
        lines, topic = [], ""
        for finding in self.findings:
            if finding.topic != topic:
                topic = finding.topic
                lines += ["", topic] if lines else [topic]
            usual = f"usual: {finding.usual}" if finding.usual else ""
            lines.append(f"  {finding.level:7}  {finding.what:{wide}}  {finding.value:{value}}  {usual}".rstrip())
            if finding.advice:
                lines.append(f"           -> {finding.advice}")
        errors, warnings = self.count("error"), self.count("warning")
        return "\n".join([*lines, "", f"{self.vehicle}: {errors} errors, {warnings} warnings, {self.count('ok')} ok"])


@dataclass(frozen=True)
class Usual:
    """Usual and possible range of a value."""

    low: float
    high: float
    minimum: float = -math.inf
    maximum: float = math.inf

    def level(self, value: float) -> Level:
        """Return the level of a value: warning outside the usual range, error outside the possible range."""
        if not self.minimum <= value <= self.maximum:
            return "error"
        return "ok" if self.low <= value <= self.high else "warning"

    def __str__(self) -> str:
        """Return the usual range as text."""
        return f"{self.low:g} to {self.high:g}"


def judged(topic: str, what: str, value: float, unit: str, usual: Usual, advice: str) -> Finding:
    """Return a finding about a number.

    Args:
        topic: Topic.
        what: Subject.
        value: The number; nan counts as a warning.
        unit: Unit.
        usual: Usual and possible range.
        advice: Advice for a value outside.
    """
    unit = "" if unit == "-" else unit
    level: Level = "warning" if math.isnan(value) else usual.level(value)
    shown = 0.0 if abs(value) < _ROUNDING else value
    words = "none" if math.isnan(value) else f"{shown:.4g} {unit}".strip()
    return Finding(topic, what, level, words, f"{usual} {unit}".strip(), "" if level == "ok" else advice)
