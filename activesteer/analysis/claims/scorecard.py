"""The scorecard of the claims, and what the package stores about them: settings, reasons and populations.

A claim is passed, failed, or known not to be reproduced.

A setting holds what the paper leaves open, as numbers with ranges and reasons. `literature` is the nominal car with a
driver from published ranges; it changes nothing. `paper` was selected by the verdicts of the claims (`activesteer tune
match_paper`), within ranges that were written down before: it shows under which conditions the paper's statements hold
together, and is no evidence for them.

A population holds the proportions in which the claims hold for other cars, roads and drivers, which `activesteer study
population` drives. A nominal verdict is printed with the proportion. Its bands, from 10 to 90 % of the runs, are drawn
behind a nominal curve.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from activesteer.analysis.claims.judge import SCENARIO_OF, SCENARIOS, STATEMENTS, SYSTEMS, Claim, Scenario
from activesteer.analysis.source import RecordingLike
from activesteer.config import Source, build, read_toml
from activesteer.core.conventions import Array
from activesteer.core.files import finite, reading
from activesteer.core.metric_table import recorded_metric
from activesteer.errors import ParameterError, StudyError, nearest_names
from activesteer.resources import DEFAULT_DRIVER, studies_dir
from activesteer.theory.proportions import ProportionVerdict, percent, proportion_verdict

LITERATURE: Final = "literature"
PAPER: Final = "paper"
SETTINGS: Final = {PAPER: "paper's setting", LITERATURE: "driver from literature"}
"""Name of a setting -> its title."""
VEHICLE: Final = "compact"
"""Car of the paper's setting."""
NOT_REPRODUCED: Final = Path(__file__).parent / "not_reproduced.toml"
SUMMARY: Final = "summary.json"
NO_FACTOR: Final = "none"
"""Name in place of a factor if no factor is significant."""
_NO_SETTING: Final = frozenset({"vehicle", "duration_s", "settle_s", "title"})
"""Keys that may differ from the paper's: these keys of the manoeuvre, and the whole car."""


@dataclass(frozen=True)
class Number:
    """A number of a setting."""

    key: str
    """Dotted key, as for `--set`."""
    value: float | str
    """Its value in this setting."""
    nominal: float | str
    """Its value in the setting `literature`."""
    reason: str
    """Source of the range."""
    low: float | None = None
    """Lower end of the range that was allowed."""
    high: float | None = None
    """Upper end of the range."""
    maneuvers: tuple[str, ...] = ()
    """Manoeuvres in which it acts, or empty for all."""


@dataclass(frozen=True)
class Setting:
    """A setting file."""

    title: str = ""
    """One line for people."""
    numbers: tuple[Number, ...] = ()
    """Everything that differs from the nominal car, driver and manoeuvre."""
    fails: dict[str, str] = field(default_factory=dict)
    """Number of each statement that does not hold -> reason."""

    def overrides(self, scenario: str) -> dict[str, Any]:
        """Return the overrides of a scenario."""
        return {
            number.key: number.value for number in self.numbers if not number.maneuvers or scenario in number.maneuvers
        }


@functools.cache
def read_setting(name: str) -> Setting:
    """Return a setting of the package, `paper` or `literature`."""
    if name not in SETTINGS:
        raise ParameterError(nearest_names(name, SETTINGS), key="--setting", value=name, allowed=tuple(SETTINGS))
    if name == LITERATURE:
        return Setting()
    table, source = read_toml(Path(__file__).parent / f"{name}_setting.toml", ParameterError)
    found = build(Setting, table, source)
    _check_reasons(found.fails, source, "fails")
    return found


def setting_of(recording: RecordingLike) -> str:
    """Return the name of the setting in which a run was made, or empty if it has other overrides or is of the user."""
    maneuver, overrides = recording.metadata.get("maneuver"), recording.metadata.get("overrides") or {}
    name = maneuver.get("name") if isinstance(maneuver, Mapping) else None
    if name not in SCENARIOS or not isinstance(overrides, Mapping):
        return ""
    if not overrides:
        return LITERATURE
    return PAPER if dict(overrides) == read_setting(PAPER).overrides(str(name)) else ""


def claims_for(recording: RecordingLike) -> Scenario | None:
    """Return the scenario that checks the paper's claims about the manoeuvre of a run, or None if it has none."""
    # The name of its manoeuvre counts, and for the two open-loop manoeuvres also its kind: a user's step steer is a
    # step steer. The paper has no claims about a manoeuvre with other settings, except those of `setting_of`; any car
    # and any duration are judged.
    maneuver, vehicle = recording.metadata.get("maneuver"), recording.metadata.get("vehicle")
    if not isinstance(maneuver, Mapping):
        return None
    harmless = {*_NO_SETTING, *(vehicle if isinstance(vehicle, Mapping) else ())}
    keys = recording.metadata.get("overrides") or ()
    changed = any(key.removeprefix("maneuver.").partition(".")[0] not in harmless for key in keys)
    if changed and setting_of(recording) != PAPER:
        return None
    name, kind = maneuver.get("name"), maneuver.get("kind")
    return SCENARIOS.get(str(name if name in SCENARIOS or kind not in {"step_steer", "sine_with_dwell"} else kind))


def not_reproduced(vehicle: str, path: Path = NOT_REPRODUCED) -> dict[str, str]:
    """Return the claims that are not reproduced with a vehicle."""
    table, source = read_toml(path, ParameterError)
    for name, reasons in table.items():
        _check_reasons(reasons, source, name)
    return dict(table.get(vehicle, {}))


def _check_reasons(reasons: object, source: Source, name: str) -> None:
    if not isinstance(reasons, dict):
        raise source.fail((name,), f"is {reasons!r}; claims and reasons are needed", reasons)
    for number, reason in reasons.items():
        if number not in STATEMENTS:
            raise source.fail((name, number), f"no such claim; {nearest_names(number, STATEMENTS)}", number)
        if not isinstance(reason, str) or not reason.strip():
            raise source.fail((name, number), f"is {reason!r}; the reason in words is needed", reason)


@dataclass(frozen=True)
class ClaimProportion:
    """Proportion of a population in which a claim holds."""

    id: str  # number of the claim
    passed: bool  # whether the claim holds with the nominal car, road and driver
    number: int  # number of samples in which the claim could be judged
    share: float  # proportion of these samples in which it holds; nan for no samples
    low: float  # lower end of the 95 % interval
    high: float  # upper end
    depends_on: str = NO_FACTOR  # key of the factor with the largest influence; `none` if no factor is significant
    explained: float = 0.0  # proportion of the variance that this factor explains
    # 1 if the claim holds more often with more of the factor, -1 with less, 0 in the middle or at the ends
    direction: int = 0
    # value of a choice, such as `sensors.preset = ideal` -> proportion of the samples with this value
    at: Mapping[str, float] = field(default_factory=dict)

    @property
    def verdict(self) -> ProportionVerdict:
        """Verdict of the interval."""
        return proportion_verdict(self.low, self.high)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values."""
        return {**asdict(self), "verdict": self.verdict.value}

    @property
    def words(self) -> str:
        """The factor in words, or empty without a factor."""
        if self.depends_on == NO_FACTOR:
            return ""
        choices = {name: value for name, value in self.at.items() if name.startswith(f"{self.depends_on} = ")}
        if choices:
            return f"with {max(choices, key=lambda name: choices[name])}"
        return f"{('in the middle or at the ends of', 'with more', 'with less')[self.direction]} {self.depends_on}"


class Population(NamedTuple):
    """Stored proportions of a population: number and seed of its samples, its nominal car, its claims in order."""

    samples: int
    seed: int
    vehicle: str
    claims: tuple[ClaimProportion, ...]


def read_claims(table: Mapping[str, Any]) -> tuple[ClaimProportion, ...]:
    """Return the proportions of a stored population. A damaged table raises `StudyError`."""
    try:
        return tuple(
            ClaimProportion(**{key: claim[key] for key in claim if key != "verdict"}) for claim in table["claims"]
        )
    except (KeyError, TypeError) as reason:
        raise StudyError(f"the stored population is damaged: {reason}") from reason


def stored_table(name: str) -> dict[str, Any] | None:
    """Return the results that the package stores of a study, such as `population`, or None if it stores none."""
    path = studies_dir() / name / SUMMARY
    if not path.is_file():
        return None
    with reading(path, StudyError):
        return json.loads(path.read_text(encoding="utf-8"))


@functools.cache
def stored_population(vehicle: str) -> Population | None:
    """Return the population that belongs to the package, or None if no population of this car is stored."""
    table = stored_table("population")
    if table is None or table.get("vehicle") != vehicle:
        return None
    return Population(table["samples"], table["seed"], vehicle, read_claims(table))


TRACK: Final = ("front_axle_x_m", "front_axle_y_m")
"""Channels of the band across the course, y over x."""
BANDS: Final = "bands.parquet"


class Band(NamedTuple):
    """A band of one channel."""

    at: Array  # time [s], or x of the front axle centre [m], shape (n,)
    low: Array  # lower edge, shape (n,)
    high: Array  # upper edge, shape (n,)


def bands_of(recording: RecordingLike) -> Mapping[str, Band]:
    """Return the population's bands for a run."""
    maneuver, vehicle, driver = (_name_of(recording, part) for part in ("maneuver", "vehicle", "driver"))
    if claims_for(recording) is None or recording.metadata.get("overrides") or driver != DEFAULT_DRIVER:
        return {}
    return _stored_bands(vehicle).get((maneuver, str(recording.metadata.get("controller"))), {})


def _name_of(recording: RecordingLike, part: str) -> str:
    table = recording.metadata.get(part)
    return str(table.get("name")) if isinstance(table, Mapping) else ""


@functools.cache
def _stored_bands(vehicle: str) -> dict[tuple[str, str], dict[str, Band]]:
    path = studies_dir() / "population" / BANDS
    if not path.is_file():
        return {}
    import pyarrow.parquet as pq  # noqa: PLC0415 - slow to import

    with reading(path, StudyError):
        table = pq.read_table(path)
    found: dict[tuple[str, str], dict[str, Band]] = {}
    if (table.schema.metadata or {}).get(b"vehicle", b"").decode() != vehicle:
        return found
    for row in table.to_pylist():
        low, high = (np.array(row[edge], dtype=np.float64) for edge in ("low", "high"))
        band = Band(row["start"] + row["step"] * np.arange(len(low)), low, high)
        found.setdefault((row["maneuver"], row["controller"]), {})[row["channel"]] = band
    return found


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
    setting: str = LITERATURE  # setting of the runs; `paper`, `literature` or empty
    obstacle: str = ""  # why claims cannot be judged; empty if they are, or if there are none

    @property
    def counts(self) -> dict[Verdict, int]:
        """Number of claims by verdict, without verdicts of no claim."""
        verdicts = [item.verdict for item in self.judged]
        return {verdict: verdicts.count(verdict) for verdict in Verdict if verdict in verdicts}

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
            "verdicts": {verdict.value: self.counts.get(verdict, 0) for verdict in Verdict},
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
        counts = [f"{count} {verdict.value}" for verdict, count in self.counts.items()]
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
    proportions = {one.id: one for one in stored.claims} if stored else {}
    judged = (
        Judged(claim, _verdict(claim, reasons), reasons.get(claim.id, ""), proportions.get(claim.id))
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
