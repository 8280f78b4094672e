"""Tables of the documentation: claims, errors of the estimator, keys of manoeuvre files.

The column of the nominal run follows `not_reproduced.toml`, which a test compares with the runs. The proportions are
those of the stored population.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import itertools
import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from activesteer import simulate
from activesteer.analysis.claims.judge import SCENARIO_OF, SCENARIOS, STATEMENTS, Kind
from activesteer.analysis.claims.scorecard import PAPER, not_reproduced, read_setting
from activesteer.config import Range, dataclass_in, element_of, spellings
from activesteer.controllers import load_controller
from activesteer.maneuver import KINDS
from activesteer.maneuver.base import Maneuver
from tools.make_setting import AROUND
from tools.population_results import Population, read_population
from tools.proportions import percent

DOCS: Final = Path(__file__).parents[1] / "docs"
CLAIMS_PAGE: Final = DOCS / "claims.md"
OTHER_CLAIMS_PAGE: Final = DOCS / "claims_other_cars.md"
VEHICLE: Final = "compact"
SENSORS: Final = "sensors.preset"
PRESETS: Final = ("ideal", "production")
HOLDS: Final = "\N{CHECK MARK} holds"
FAILS: Final = "\N{BALLOT X} fails"
REPRODUCED: Final = "\N{CHECK MARK} reproduced"
NOT_REPRODUCED: Final = "\N{NOT EQUAL TO} not reproduced"


def claims_table() -> list[str]:
    """Return the verdicts as lines of Markdown: first claims only about the systems, then claims with a driver."""
    known, population = not_reproduced(VEHICLE), read_population("population")
    fails = read_setting(PAPER).fails
    lines = []
    for kind in Kind:
        lines += [f"**{kind.value.capitalize()}**", ""]
        lines += [
            "| | claim | paper's setting | driver from literature | population, % | ideal, production sensors, % | "
            "holds more often with |",
            "|---|---|---|---|---|---|---|",
        ]
        for statement in STATEMENTS.values():
            if SCENARIOS[SCENARIO_OF[statement.id]].kind is kind:
                nominal = NOT_REPRODUCED if statement.id in known else REPRODUCED
                paper = FAILS if statement.id in fails else HOLDS
                cells = (statement.id, statement.text, paper, nominal, *_proportion(population, statement.id))
                lines.append("| " + " | ".join(cells) + " |")
        lines.append("")
    return lines[:-1]


def around_setting() -> list[str]:
    """Return the shares of the claims in the populations around the paper's setting, as lines of Markdown."""
    fails, found = read_setting(PAPER).fails, [read_population(name) for name in AROUND]
    if any(one is None for one in found):
        return []
    samples = found[0].samples if found[0] else 0
    lines = [
        f"Each cell gives the percentage of {samples} samples in which the claim holds, with its 95 % interval. The "
        "two values after the semicolon are for ideal and for production sensors.",
        "",
        "| | paper's setting | car, road and speed vary | driver, cones, gains, band and reference vary too |",
        "|---|---|---|---|",
    ]
    for claim in STATEMENTS:
        shares = [
            f"{verdict.partition(': ')[2]}; {sensors}"
            for verdict, sensors, _ in (_proportion(one, claim) for one in found)
        ]
        lines.append("| " + " | ".join((claim, FAILS if claim in fails else HOLDS, *shares)) + " |")
    means = [sum(claim.share for claim in one.claims) / len(one.claims) for one in found if one]
    counts = f"{len(STATEMENTS) - len(fails)} of {len(STATEMENTS)}"
    return [*lines, f"| mean | {counts} | {' | '.join(map(percent, means))} |"]


def summary() -> list[str]:
    """Return the number of claims that hold in each scenario, as lines of Markdown."""
    known, population, fails = not_reproduced(VEHICLE), read_population("population"), read_setting(PAPER).fails
    lines = [
        "| scenario | the paper's claims | paper's setting | driver from literature | population, ideal sensors | "
        "population, production sensors |",
        "|---|---|---|---|---|---|",
    ]
    for scenario in [*dict.fromkeys(SCENARIO_OF.values()), ""]:
        own = [claim for claim, name in SCENARIO_OF.items() if scenario in ("", name)]
        shares = [_mean(population, own, f"{SENSORS} = {preset}") for preset in PRESETS]
        counts = (sum(claim not in listed for claim in own) for listed in (fails, known))
        cells = (scenario.replace("_", " ") or "all", len(own), *counts, *shares)
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return lines


def _mean(population: Population | None, claims: Sequence[str], at: str) -> str:
    """Return the mean share of claims at a value of a choice, in words."""
    found = [claim.at[at] for claim in population.claims if claim.id in claims] if population else []
    return f"{percent(sum(found) / len(found))} %" if found else ""


def _proportion(population: Population | None, number: str) -> tuple[str, str, str]:
    claims = () if population is None else population.claims
    found = next((claim for claim in claims if claim.id == number), None)
    if found is None:
        return "", "", ""
    interval = f"{percent(found.low)} to {percent(found.high)}"
    sensors = ", ".join(percent(found.at[f"{SENSORS} = {preset}"]) for preset in PRESETS)
    return f"{found.verdict.value}: {percent(found.share)} ({interval})", sensors, found.words


CLAIMS_PARTS: Final = {
    CLAIMS_PAGE: {"counts": summary, "table": claims_table},
    OTHER_CLAIMS_PAGE: {"shares": around_setting},
}
"""Page of the claims -> name of each generated table -> function that writes its lines."""


def claims_page(page: Path) -> str:
    """Return the text of a page of the claims with its tables renewed."""
    text = page.read_text(encoding="utf-8")
    for name, write in CLAIMS_PARTS[page].items():
        verb = "is" if name == "table" else "are"
        begin = f"<!-- the {name} {verb} written by tools/renew.py claims -->\n"
        end = f"<!-- end of the {name} -->\n"
        before, _, rest = text.partition(begin)
        _, _, after = rest.partition(end)
        text = f"{before}{begin}\n" + "\n".join(write()) + f"\n\n{end}{after}"
    return text


ESTIMATION_PAGE: Final = Path(__file__).resolve().parent.parent / "docs" / "estimation.md"
ESTIMATION_BEGIN: Final = "<!-- the table is written by tools/renew.py estimation -->\n"
ESTIMATION_END: Final = "<!-- end of the table -->\n"
ESTIMATION_SYSTEMS: Final = ("none", "ars", "afs")
ESTIMATION_RUNS: Final = (
    *((scenario, system) for scenario in ("step_steer", "slalom", "double_lane_change", "double_lane_change_low_mu",
                                          "sine_with_dwell") for system in ESTIMATION_SYSTEMS),
    *((scenario, "none") for scenario in ("severe_lane_change", "brake_in_turn", "split_mu_braking",
                                          "straight_braking")),
)  # fmt: skip
"""The paper's five scenarios with its systems, and some harder ones."""
SLOWEST_MPS: Final = 5.0
LARGEST_SIDESLIP_RAD: Final = np.radians(8.0)
"""Slower samples, and samples with a larger sideslip angle, do not count."""
_ESTIMATION_HEAD: Final = (
    "| | | peak sideslip | error, RMS | error, peak | standard deviation "
    "| speed error, RMS | error, peak | NEES | NIS |",
    "|---|---|---|---|---|---|---|---|---|---|",
    "| | | deg | deg | deg | deg | % | % | expected 1 | expected 2 |",
)


def estimation_row(scenario: str, system: str) -> str:
    """Return the estimation_row of one run: a system drives, and an estimator runs alongside on the same sensors."""
    innovations: list[float] = []

    class Watched:
        def __init__(self, setup: Any) -> None:
            self.system, self.estimator = load_controller(system, setup), setup.estimator()

        def step(self, command: Any, measurement: Any) -> Any:
            estimate = self.estimator.step(measurement)
            innovations.append(self.estimator.innovation)
            return self.system.step(command, measurement)._replace(estimate=estimate)

    run = simulate(scenario, Watched, overrides={"sensors.preset": "production"})
    speed_mps, sideslip_rad = run["vx_mps"], run["sideslip_rad"]
    rolls = speed_mps > SLOWEST_MPS
    counts = rolls & (abs(sideslip_rad) < LARGEST_SIDESLIP_RAD)
    error_rad = (run["estimated_sideslip_rad"] - sideslip_rad)[counts]
    std_rad = run["estimated_sideslip_std_rad"][counts]
    speed_error = run["estimated_speed_mps"][counts] / speed_mps[counts] - 1.0
    squared = np.array(innovations[-len(speed_mps) :])[counts]
    angles_deg = np.degrees([abs(sideslip_rad[rolls]).max(), _rms(error_rad), abs(error_rad).max(), _rms(std_rad)])
    cells = [
        f"{angles_deg[0]:.2g}",
        *(f"{angle_deg:.2f}" for angle_deg in angles_deg[1:]),
        *(f"{100.0 * share:.2f}" for share in (_rms(speed_error), abs(speed_error).max())),
        f"{np.mean((error_rad / std_rad) ** 2):.2f}",
        f"{squared.mean():.2f}",
    ]
    return f"| {scenario.replace('_', ' ')} | `{system}` | " + " | ".join(cells) + " |"


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def estimation_page(text: str) -> str:
    """Drive the runs and return the page with their table in its place."""
    lines = [*_ESTIMATION_HEAD]
    for scenario, system in ESTIMATION_RUNS:
        lines.append(estimation_row(scenario, system))
        print(lines[-1], flush=True)
    before, _, rest = text.partition(ESTIMATION_BEGIN)
    _, _, after = rest.partition(ESTIMATION_END)
    return f"{before}{ESTIMATION_BEGIN}" + "\n".join(lines) + f"\n{ESTIMATION_END}{after}"


KEYS_PAGE: Final = Path(__file__).resolve().parent.parent / "docs" / "manoeuvre_keys.md"
_KEYS_HEAD: Final = """# Keys of a manoeuvre file

This page lists all keys that a manoeuvre's TOML file may have, by `kind`. `--set KEY=VALUE` and `overrides` take the
same keys. You may give a key in any of the listed units; defaults and ranges are in the first unit. `needed` inside a
table means that the key is needed if the table is given. `N` is the number of an entry, from 0. `tools/renew.py keys`
writes this page from the classes that read the files.
"""


def keys_page() -> str:
    """Return the page as it should be."""
    common = {field.name for field in dataclasses.fields(Maneuver)}
    parts = [_KEYS_HEAD, "## All kinds\n", *_key_table(Maneuver)]
    for kind, cls in KINDS.items():
        first = (inspect.getdoc(cls) or "").splitlines()[0]
        parts += [f"\n## {kind}\n", f"{first}\n", *_key_table(cls, without=common)]
    page = "\n".join(parts) + "\n"
    return page.replace("[m/s2]", "[m/s²]").replace("[m3]", "[m³]")


def _key_table(cls: type, without: set[str] | None = None) -> list[str]:
    return ["| key | default | allowed | meaning |", "|---|---|---|---|", *_key_rows(cls, "", without or set())]


def _key_rows(cls: Any, prefix: str, without: set[str]) -> list[str]:
    plain, hints = typing.get_type_hints(cls), typing.get_type_hints(cls, include_extras=True)
    meanings = _meanings(cls)
    rows: list[str] = []
    for field in dataclasses.fields(cls):
        if field.name in without and not prefix:
            continue
        hint = plain[field.name]
        if (inner := dataclass_in(hint)) is not None:
            rows += _key_rows(inner, f"{prefix}{field.name}.", without)
            continue
        if (inner := element_of(hint)) is not None:
            rows += _key_rows(inner, f"{prefix}{field.name}.N.", without)
            continue
        keys = ", ".join(f"`{prefix}{spelling}`" for spelling in spellings(field.name))
        default = "needed" if _needed(field) else f"`{_default(field)}`"
        cells = (keys, default, _allowed(hints[field.name]), meanings.get(field.name, ""))
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return rows


def _needed(field: dataclasses.Field[Any]) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _default(field: dataclasses.Field[Any]) -> str:
    value = field.default if field.default is not dataclasses.MISSING else field.default_factory()  # type: ignore[misc]
    if value is None or value == "":
        return "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _allowed(hint: Any) -> str:
    if words := [word for option in (hint, *typing.get_args(hint)) for word in _words(option)]:
        return ", ".join(f"`{word}`" for word in words)
    ranges = [extra for extra in getattr(hint, "__metadata__", ()) if isinstance(extra, Range)]
    for inner in typing.get_args(hint):
        ranges += [extra for extra in getattr(inner, "__metadata__", ()) if isinstance(extra, Range)]
    return str(ranges[0]) if ranges else ""


def _words(hint: Any) -> tuple[Any, ...]:
    return typing.get_args(hint) if typing.get_origin(hint) is typing.Literal else ()


def _meanings(cls: type) -> dict[str, str]:
    """Text under each field, of the class and of those that it builds on."""
    found: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        if not dataclasses.is_dataclass(base):
            continue
        body = ast.parse(inspect.getsource(base)).body[0].body  # type: ignore[attr-defined]
        for statement, text in itertools.pairwise(body):
            if isinstance(statement, ast.AnnAssign) and isinstance(text, ast.Expr):
                found[ast.unparse(statement.target)] = " ".join(str(ast.literal_eval(text.value)).split())
    return found
