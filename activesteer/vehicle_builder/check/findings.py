"""What a check finds: one line each, with its value, what is usual, and what to do."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal

Level = Literal["ok", "warning", "error"]
_ROUNDING: Final = 1e-7
"""What is smaller is printed as 0."""


@dataclass(frozen=True)
class Finding:
    """One line of the report.

    Attributes:
        topic: parts, geometry, standing, riding, kinematics, steering, tyres.
        what: What was looked at.
        level: How it is.
        value: Its value, with unit, as words where it is no number.
        usual: What is usual; empty where there is nothing to say.
        advice: What to do; empty where all is well.
    """

    topic: str
    what: str
    level: Level
    value: str
    usual: str = ""
    advice: str = ""


@dataclass(frozen=True)
class CheckReport:
    """All that was found.

    Attributes:
        vehicle: Name of the car.
        findings: The lines.
    """

    vehicle: str
    findings: tuple[Finding, ...]

    def count(self, level: Level) -> int:
        """How many findings are of a level."""
        return sum(finding.level == level for finding in self.findings)

    def __getitem__(self, what: str) -> Finding:
        """The finding whose `what` is this text."""
        return next(finding for finding in self.findings if finding.what == what)

    def as_table(self) -> dict[str, Any]:
        """The report as JSON values."""
        return {
            "vehicle": self.vehicle,
            "errors": self.count("error"),
            "warnings": self.count("warning"),
            "findings": [asdict(finding) for finding in self.findings],
        }

    def table(self) -> str:
        """For people: what is wrong has its advice below it."""
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
    """What a value usually is, and what it cannot be."""

    low: float
    high: float
    minimum: float = -math.inf
    maximum: float = math.inf

    def level(self, value: float) -> Level:
        """How a value is: warning outside the usual range, error beyond what is possible."""
        if not self.minimum <= value <= self.maximum:
            return "error"
        return "ok" if self.low <= value <= self.high else "warning"

    def __str__(self) -> str:
        """As it is said in the report."""
        return f"{self.low:g} to {self.high:g}"


def judged(topic: str, what: str, value: float, unit: str, usual: Usual, advice: str) -> Finding:
    """A finding about a number.

    Args:
        topic: Its topic.
        what: What it is.
        value: It; nan counts as a warning.
        unit: Its unit.
        usual: What it usually is.
        advice: What to do where it is not.
    """
    unit = "" if unit == "-" else unit
    level: Level = "warning" if math.isnan(value) else usual.level(value)
    shown = 0.0 if abs(value) < _ROUNDING else value
    words = "none" if math.isnan(value) else f"{shown:.4g} {unit}".strip()
    return Finding(topic, what, level, words, f"{usual} {unit}".strip(), "" if level == "ok" else advice)
