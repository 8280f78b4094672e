"""Write the table of claims into docs/claims.md: `python tools/make_claims_table.py`; a test holds it to that.

The column of the nominal run follows `not_reproduced.toml`, which another test compares with the runs. The proportions
are those of the stored population.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from activesteer.analysis.claims.judge import Kind
from activesteer.analysis.claims.statements import SCENARIO_OF, SCENARIOS, STATEMENTS
from activesteer.analysis.claims.stored import PAPER, not_reproduced, read_setting, stored_population
from activesteer.analysis.claims.stored import Population as StoredPopulation
from activesteer.theory.proportions import percent
from tools.make_setting import AROUND
from tools.population_results import Population, read_population

PAGE: Final = Path(__file__).parents[1] / "docs" / "claims.md"
BEGIN: Final = "<!-- the table is written by tools/make_claims_table.py -->\n"
END: Final = "<!-- end of the table -->\n"
VEHICLE: Final = "compact"
SENSORS: Final = "sensors.preset"
PRESETS: Final = ("ideal", "production")
HOLDS: Final = "\N{CHECK MARK} holds"
FAILS: Final = "\N{BALLOT X} fails"
REPRODUCED: Final = "\N{CHECK MARK} reproduced"
NOT_REPRODUCED: Final = "\N{NOT EQUAL TO} not reproduced"


def table() -> str:
    """Return the table in Markdown: statements about the systems alone, then statements with a driver."""
    known, population = not_reproduced(VEHICLE), stored_population(VEHICLE)
    fails = read_setting(PAPER).fails
    lines = [*summary(), ""]
    for kind in Kind:
        lines += [f"**{kind.value.capitalize()}**", ""]
        lines += [
            "| | statement | paper's setting | human driver | population, % | ideal, production sensors, % | "
            "depends most on |",
            "|---|---|---|---|---|---|---|",
        ]
        for statement in STATEMENTS.values():
            if SCENARIOS[SCENARIO_OF[statement.id]].kind is kind:
                nominal = NOT_REPRODUCED if statement.id in known else REPRODUCED
                paper = FAILS if statement.id in fails else HOLDS
                cells = (statement.id, statement.text, paper, nominal, *_proportion(population, statement.id))
                lines.append("| " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join([*lines, *around_setting()])


def around_setting() -> list[str]:
    """Return the shares of the statements in the populations around the paper's setting, as lines of Markdown."""
    fails, found = read_setting(PAPER).fails, [read_population(name) for name in AROUND]
    if any(one is None for one in found):
        return []
    samples = found[0].samples if found[0] else 0
    lines = [
        f"**Around the paper's setting**: % of {samples} samples with the 95 % interval; behind the semicolon % with "
        "ideal and with production sensors",
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
    return [*lines, f"| mean | {counts} | {' | '.join(map(percent, means))} |", ""]


def summary() -> list[str]:
    """Return the statements that hold, by scenario, as lines of Markdown."""
    known, population, fails = not_reproduced(VEHICLE), stored_population(VEHICLE), read_setting(PAPER).fails
    lines = [
        "| scenario | the paper's statements | paper's setting | human driver | population, ideal sensors | "
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


def _mean(population: Population | StoredPopulation | None, claims: Sequence[str], at: str) -> str:
    """Return the mean share of claims at a value of a choice, in words."""
    found = [claim.at[at] for claim in population.claims if claim.id in claims] if population else []
    return f"{percent(sum(found) / len(found))} %" if found else ""


def _proportion(population: Population | StoredPopulation | None, number: str) -> tuple[str, str, str]:
    found = None if population is None else population.of(number)
    if found is None:
        return "", "", ""
    interval = f"{percent(found.low)} to {percent(found.high)}"
    sensors = ", ".join(percent(found.at[f"{SENSORS} = {preset}"]) for preset in PRESETS)
    return f"{found.verdict.value}: {percent(found.share)} ({interval})", sensors, found.words


def page(text: str) -> str:
    """Return the page with the table in its place."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table()}{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
