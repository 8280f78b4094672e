"""The scorecard of the claims, and the stored settings and reasons for claims that are not reproduced.

A claim is passed, failed, or known not to be reproduced.

A setting holds what the paper leaves open, as numbers with ranges and reasons. `literature` is the nominal car with a
driver from published ranges; it changes nothing. `paper` was selected by the verdicts of the claims (`activesteer tune
match_paper`), within ranges that were written down before: it shows under which conditions the paper's statements hold
together, and is no evidence for them.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.analysis.claims.judge import SCENARIO_OF, SCENARIOS, SYSTEMS, Claim, Scenario
from activesteer.analysis.source import RecordingLike, entry
from activesteer.config import build, read_toml
from activesteer.core.files import finite
from activesteer.core.metric_table import Form, recorded_metric
from activesteer.errors import ParameterError, nearest_names

LITERATURE: Final = "literature"
PAPER: Final = "paper"
SETTINGS: Final = {PAPER: "paper's setting", LITERATURE: "driver from literature"}
"""Titles of the settings, by name."""
VEHICLE: Final = "compact"
"""Car of the paper's setting."""
NOT_REPRODUCED: Final = Path(__file__).parent / "not_reproduced.toml"
_NO_SETTING: Final = frozenset({"vehicle", "duration_s", "settle_s", "title"})
"""Keys that may differ from the paper's: these keys of the manoeuvre, and the whole car."""


@dataclass(frozen=True)
class Number:
    """A number of a setting, with its nominal value and its allowed range."""

    key: str
    """Dotted key, as for `--set`."""
    value: float | str
    """Value of the number in this setting."""
    nominal: float | str
    """Value of the number in the setting `literature`."""
    reason: str
    """Source of the range."""
    low: float | None = None
    """Lower end of the range that was allowed."""
    high: float | None = None
    """Upper end of the range."""
    maneuvers: tuple[str, ...] = ()
    """Manoeuvres in which the number has an effect, empty for all."""


@dataclass(frozen=True)
class Setting:
    """A setting of car, driver and manoeuvres, as read from its file."""

    title: str = ""
    """Title in one line."""
    numbers: tuple[Number, ...] = ()
    """Numbers that differ from the nominal car, driver and manoeuvre."""
    fails: dict[str, str] = field(default_factory=dict)
    """Reason for each statement that does not hold, by its number."""

    def overrides(self, scenario: str) -> dict[str, Any]:
        """Return the overrides of a scenario."""
        return {
            number.key: number.value for number in self.numbers if not number.maneuvers or scenario in number.maneuvers
        }


@functools.cache
def read_setting(name: str) -> Setting:
    """Return a setting of the package, `paper` or `literature`."""
    if name not in SETTINGS:
        problem = f"there is no setting {name!r}; {nearest_names(name, SETTINGS)}"
        raise ParameterError(problem, key="--setting", value=name, allowed=tuple(SETTINGS))
    if name == LITERATURE:
        return Setting()
    table, source = read_toml(Path(__file__).parent / f"{name}_setting.toml", ParameterError)
    return build(Setting, table, source)


def setting_of(recording: RecordingLike) -> str:
    """Return the name of a run's setting, empty if it matches no setting of the package."""
    name, overrides = entry(recording, "maneuver", "name"), recording.metadata.get("overrides") or {}
    if name not in SCENARIOS or not isinstance(overrides, Mapping):
        return ""
    if not overrides:
        return LITERATURE
    return PAPER if dict(overrides) == read_setting(PAPER).overrides(name) else ""


def claims_for(recording: RecordingLike) -> Scenario | None:
    """Return the scenario whose claims apply to a run, or None if there is none."""
    # The name of its manoeuvre counts, and for the two open-loop manoeuvres also its kind: a user's step steer is a
    # step steer. The paper has no claims about a manoeuvre with other settings, except those of `setting_of`; any car
    # and any duration are judged.
    vehicle = recording.metadata.get("vehicle")
    harmless = {*_NO_SETTING, *(vehicle if isinstance(vehicle, Mapping) else ())}
    keys = recording.metadata.get("overrides") or ()
    changed = any(key.removeprefix("maneuver.").partition(".")[0] not in harmless for key in keys)
    if changed and setting_of(recording) != PAPER:
        return None
    name, kind = (entry(recording, "maneuver", key) for key in ("name", "kind"))
    return SCENARIOS.get(name if name in SCENARIOS or kind not in {"step_steer", "sine_with_dwell"} else kind)


def not_reproduced(vehicle: str) -> dict[str, str]:
    """Return the claims that are not reproduced with a vehicle, each with its reason."""
    return read_toml(NOT_REPRODUCED, ParameterError)[0].get(vehicle, {})


class Verdict(StrEnum):
    """Verdict of a claim, compared with the list of claims that are not reproduced."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_REPRODUCED = "not reproduced"
    """The claim fails, and is listed as not reproduced."""
    UNEXPECTED = "passed, though listed as not reproduced"
    """The claim passes and must leave the list."""


class Judged(NamedTuple):
    """A claim with its verdict."""

    claim: Claim  # the claim
    verdict: Verdict  # its verdict
    reason: str  # why it is not reproduced; empty for a claim that is not listed


@dataclass(frozen=True)
class Scorecard:
    """Claims with their verdicts, and the setting of their runs."""

    judged: tuple[Judged, ...]  # all of them, in the order given
    setting: str = LITERATURE  # setting of the runs; `paper`, `literature` or empty
    obstacle: str = ""  # why claims cannot be judged; empty if they are, or if there are none

    @property
    def counts(self) -> dict[Verdict, int]:
        """Number of claims for each verdict that occurs."""
        verdicts = [item.verdict for item in self.judged]
        return {verdict: verdicts.count(verdict) for verdict in Verdict if verdict in verdicts}

    @property
    def exit_status(self) -> int:
        """Exit status: 1 if a claim fails without being listed as not reproduced, else 0."""
        return int(any(item.verdict is Verdict.FAILED for item in self.judged))

    def to_json(self) -> dict[str, Any]:
        """Return the scorecard as JSON values, with None for undefined numbers (nan)."""
        return {
            "setting": self.setting,
            "claims": [
                {
                    "id": item.claim.id,
                    "text": item.claim.text,
                    "passed": item.claim.passed,
                    "verdict": item.verdict.value,
                    "reason": item.reason,
                    "values": finite(item.claim.values),
                    "criterion": item.claim.statement.criterion,
                    "kind": SCENARIOS[SCENARIO_OF[item.claim.id]].kind.value,
                    "obstacle": item.claim.obstacle,
                }
                for item in self.judged
            ],
            "verdicts": {verdict.value: self.counts.get(verdict, 0) for verdict in Verdict},
        }

    def to_text(self) -> str:
        """Return the scorecard for a terminal: number, verdict, text and values of each claim, in degrees and km/h."""
        lines = []
        for claim, verdict, reason in self.judged:
            short = {Verdict.FAILED: "FAILED", Verdict.UNEXPECTED: "passed!"}.get(verdict, verdict.value)
            lines.append(f"{claim.id}  {short:<14}  {claim.text}")
            lines += [f"{'':20}{line}" for line in number_lines(claim.values)]
            if claim.obstacle:
                lines.append(f"{'':20}nothing is proved: {claim.obstacle}")
            if verdict is Verdict.UNEXPECTED:
                lines.append(f"{'':20}listed in {NOT_REPRODUCED.name}; remove it from there")
            elif reason:
                lines.append(f"{'':20}because: {reason}")
        counts = [f"{count} {verdict.value}" for verdict, count in self.counts.items()]
        lines.append(f"{len(self.judged)} claims: {', '.join(counts)}")
        return "\n".join(lines)


def scorecard(
    claims: Iterable[Claim], vehicle: str = "", *, known: Mapping[str, str] | None = None, setting: str = LITERATURE
) -> Scorecard:
    """Judge claims with the vehicle's list of claims that are not reproduced."""
    # `known`, number -> reason, replaces the list. The paper's setting has a list of its own.
    if known is None:
        known = read_setting(PAPER).fails if setting == PAPER else not_reproduced(vehicle)
    judged = (Judged(claim, _verdict(claim, known), known.get(claim.id, "")) for claim in claims)
    return Scorecard(tuple(judged), setting)


def _verdict(claim: Claim, known: Mapping[str, str]) -> Verdict:
    if claim.passed:
        return Verdict.UNEXPECTED if claim.id in known else Verdict.PASSED
    return Verdict.NOT_REPRODUCED if claim.id in known else Verdict.FAILED


def number_lines(values: Mapping[str, float]) -> list[str]:
    """Return the values of a claim in degrees and km/h: a line for each metric, with all systems."""
    by_metric: dict[str, list[tuple[str, float]]] = {}
    for name, value in values.items():
        system, _, metric = name.partition("_")
        known = system in SYSTEMS
        by_metric.setdefault(metric if known else name, []).append((system if known else "", value))
    lines = []
    for metric, pairs in by_metric.items():
        shown = recorded_metric(metric)
        texts = [
            shown.text(value) if shown.form is Form.YES_OR_NO else _number(value * shown.unit.factor)
            for _, value in pairs
        ]
        numbers = "  ".join(f"{system} {text}".strip() for (system, _), text in zip(pairs, texts, strict=True))
        lines.append(f"{shown.label}: {numbers} {shown.unit_name}".rstrip())
    return lines


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3g}"
