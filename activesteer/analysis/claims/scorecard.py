"""All claims with their verdicts: passed, failed, or known not to be reproduced."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

from activesteer.analysis.claims.judge import SCENARIO_OF, SCENARIOS, SYSTEMS, Claim
from activesteer.analysis.claims.stored import (
    LITERATURE,
    NOT_REPRODUCED,
    PAPER,
    ClaimProportion,
    Population,
    not_reproduced,
    read_setting,
    stored_population,
)
from activesteer.files import finite
from activesteer.metric_table import recorded_metric
from activesteer.theory.proportions import ProportionVerdict, percent


class Verdict(StrEnum):
    """Verdict of a claim."""

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
    # proportion of the stored population in which it holds; None without a population
    proportion: ClaimProportion | None = None


@dataclass(frozen=True)
class Scorecard:
    """Claims with their verdicts."""

    judged: tuple[Judged, ...]  # all of them, in the order given
    population: Population | None = None  # the stored population of the car; None without one
    setting: str = LITERATURE  # setting of the runs; see `stored`

    @property
    def exit_status(self) -> int:
        """1 if a claim fails that is not listed, else 0."""
        return int(any(item.verdict is Verdict.FAILED for item in self.judged))

    def to_json(self) -> dict[str, Any]:
        """Return the scorecard as JSON values. An undefined number (nan) is None."""
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
                    "population": None if item.proportion is None else item.proportion.to_json(),
                }
                for item in self.judged
            ],
            "verdicts": {verdict.value: self._count(verdict) for verdict in Verdict},
            "population": None
            if self.population is None
            else {"samples": self.population.samples, "seed": self.population.seed},
        }

    def to_text(self) -> str:
        """Return the scorecard for a terminal: number, verdict, text, then the values, in degrees and km/h."""
        beside = any(item.proportion is not None for item in self.judged)
        lines = [f"    {'nominal':<14}  population"] if beside else []
        for claim, verdict, reason, proportion in self.judged:
            short = {Verdict.FAILED: "FAILED", Verdict.UNEXPECTED: "passed!"}.get(verdict, verdict.value)
            held = " " * 23 if beside else ""
            if proportion is not None:
                held = f"{percent(proportion.share):>4} %  {proportion.verdict.value:<13}  "
            lines.append(f"{claim.id}  {short:<14}  {held}{claim.text}")
            lines += [f"{'':20}{line}" for line in number_lines(claim.values)]
            if claim.obstacle:
                lines.append(f"{'':20}nothing is proved: {claim.obstacle}")
            if verdict is Verdict.UNEXPECTED:
                lines.append(f"{'':20}listed in {NOT_REPRODUCED.name}; remove it from there")
            elif reason:
                lines.append(f"{'':20}because: {reason}")
        counts = [f"{self._count(verdict)} {verdict.value}" for verdict in Verdict if self._count(verdict)]
        lines.append(f"{len(self.judged)} claims: {', '.join(counts)}")
        if beside and self.population is not None:
            lines.append(f"in {self.population.samples} other cars, roads and drivers, with 95 % confidence:")
            lines += [f"{'':2}{verdict.value:<13}  {names}" for verdict, names in self.by_proportion().items()]
        return "\n".join(lines)

    def by_proportion(self) -> dict[ProportionVerdict, str]:
        """Return the numbers of the claims by verdict of the population, with the factor of the largest influence."""
        proportions = [item.proportion for item in self.judged if item.proportion is not None]
        return {
            verdict: ", ".join(
                f"{proportion.id} ({proportion.depends_on})" if verdict is ProportionVerdict.DEPENDS else proportion.id
                for proportion in proportions
                if proportion.verdict is verdict
            )
            for verdict in ProportionVerdict
            if any(proportion.verdict is verdict for proportion in proportions)
        }

    def _count(self, verdict: Verdict) -> int:
        return sum(item.verdict is verdict for item in self.judged)


def scorecard(
    claims: Iterable[Claim],
    vehicle: str = "",
    *,
    known: Mapping[str, str] | None = None,
    population: Population | None = None,
    setting: str = LITERATURE,
) -> Scorecard:
    """Judge claims with the vehicle's list of claims that are not reproduced, and its stored population."""
    # `known`, number -> reason, replaces the list, and `population` the stored one. The paper's setting has a list of
    # its own and no population.
    if setting == PAPER:
        known, vehicle = read_setting(PAPER).fails, ""
    reasons = not_reproduced(vehicle) if known is None else known
    stored = population or stored_population(vehicle)
    judged = (
        Judged(claim, _verdict(claim, reasons), reasons.get(claim.id, ""), stored.of(claim.id) if stored else None)
        for claim in claims
    )
    return Scorecard(tuple(judged), stored, setting)


def _verdict(claim: Claim, known: Mapping[str, str]) -> Verdict:
    if claim.passed:
        return Verdict.UNEXPECTED if claim.id in known else Verdict.PASSED
    return Verdict.NOT_REPRODUCED if claim.id in known else Verdict.FAILED


def number_lines(values: Mapping[str, float]) -> list[str]:
    """Return the values of a claim, in degrees and km/h: a line for each metric, the systems beside each other."""
    by_metric: dict[str, list[tuple[str, float]]] = {}
    for name, value in values.items():
        system, _, metric = name.partition("_")
        known = system in SYSTEMS
        by_metric.setdefault(metric if known else name, []).append((system if known else "", value))
    lines = []
    for metric, pairs in by_metric.items():
        shown = recorded_metric(metric)
        numbers = "  ".join(f"{system} {_number(value * shown.unit.factor)}".strip() for system, value in pairs)
        lines.append(f"{shown.label}: {numbers} {shown.unit_name}".rstrip())
    return lines


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3g}"
