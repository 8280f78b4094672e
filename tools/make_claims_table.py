"""Write the table of claims into docs/claims.md: `python tools/make_claims_table.py`; a test holds it to that.

The column of the nominal run follows `not_reproduced.toml`, which another test compares with the runs. The proportions
are those of the stored population.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from activesteer.analysis.claims import STATEMENTS, Kind, not_reproduced
from activesteer.analysis.claims.population import Population, stored_population
from activesteer.theory.proportions import percent

PAGE: Final = Path(__file__).parents[1] / "docs" / "claims.md"
BEGIN: Final = "<!-- the table is written by tools/make_claims_table.py -->\n"
END: Final = "<!-- end of the table -->\n"
VEHICLE: Final = "compact"


def table() -> str:
    """Return the table in Markdown: statements about the systems alone, then statements with a driver."""
    known, population = not_reproduced(VEHICLE), stored_population(VEHICLE)
    lines = []
    for kind in Kind:
        lines += [f"**{kind.value.capitalize()}**", ""]
        lines += ["| | statement | nominal run | population | depends most on |", "|---|---|---|---|---|"]
        for statement in STATEMENTS.values():
            if statement.kind is kind:
                nominal = "not reproduced" if statement.id in known else "reproduced"
                cells = (statement.id, statement.text, nominal, *_proportion(population, statement.id))
                lines.append("| " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines)


def _proportion(population: Population | None, number: str) -> tuple[str, str]:
    found = None if population is None else population.of(number)
    if found is None:
        return "", ""
    interval = f"{percent(found.low)} to {percent(found.high)}"
    return f"{found.verdict.value}: {percent(found.share)} ({interval})", found.words


def page(text: str) -> str:
    """Return the page with the table in its place."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{table()}{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
