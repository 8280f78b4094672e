"""Drives the population anew, or what is missing of it, keeps what came of it with the package, and writes its page.

    python tools/renew_population.py [-o DIR] [--samples N] [--jobs N]

500 samples take half an hour on two idle processors; it can be interrupted and called again. A folder that
`activesteer reproduce --population N -o DIR` has finished is taken as it is. tools/make_claims_table.py is to be called
afterwards.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Final

from activesteer.analysis.claims import STATEMENTS, Kind
from activesteer.analysis.claims.population import Change, Population, percent
from activesteer.commands.progress import RunCounter
from activesteer.quantities import metric_label
from activesteer.resources import find_study
from activesteer.studies.population import STUDY, population
from activesteer.studies.population_store import store_population

PAGE: Final = Path(__file__).resolve().parent.parent / "docs" / "population.md"
PRODUCTION: Final = "sensors.preset = production"
"""The share of the samples behind sensors of production cars."""
_HEAD: Final = """# The population

`activesteer reproduce --population {samples} --seed {seed}` drives {samples} variations of the {vehicle}, its road, its
driver, his line and the gains through the paper's five scenarios with all three systems: {runs} runs. What came of them
belongs to the package (`studies/population/`), stands beside every nominal verdict that `activesteer reproduce` prints,
and behind the curves of the figures (10 to 90 % of the runs). `tools/renew_population.py` renews it and this page. It
was driven with {versions}.

## What is varied

A Sobol' sequence over the ranges below, the same for the three systems. Controllers and driver are not told.

```toml
{factors}
```

## In which share each claim holds

*Holds* is said where the 95 % interval (Wilson) lies above 80 %, *does not hold* where it lies below 20 %, and else
*depends*. Half of the samples have ideal sensors, half those of a production car; the share among the latter stands
behind the verdict. The last column is the factor that explains most of the verdict by regression on every factor and
its square, and how much of its variance; it is empty where none explains more than chance would. A claim without the
driver is one about the open-loop manoeuvres, where the steering wheel follows a table.

| | what is claimed | driver | nominal | holds in | 95 % interval | verdict | with production sensors | more often |
|---|---|---|---|---|---|---|---|---|
"""
_SYSTEMS: Final = """
## What each system does

A car is lost where its sideslip goes beyond 20 deg (it spins), where its body leaves the lanes, and where it misses a
cone of the slalom. Changes are against the same sample without control: median, and the range of 90 % of the samples.

| scenario | | lost without | of these saved | fine without | of these spoiled | spin without, with | changes |
|---|---|---|---|---|---|---|---|
"""


def page(found: Population) -> str:
    """The page of a population."""
    lines = find_study(STUDY).read_text(encoding="utf-8").splitlines()
    factors = "\n".join(lines[lines.index("[factors]") : lines.index("[design]") - 1])
    head = _HEAD.format(
        samples=found.samples, seed=found.seed, vehicle=found.vehicle, runs=15 * found.samples, factors=factors,
        versions=", ".join(f"{name} {version}" for name, version in found.versions.items()),
    )  # fmt: skip
    return head + "\n".join(_claims(found)) + "\n" + _SYSTEMS + "\n".join(_systems(found)) + "\n"


def _claims(found: Population) -> list[str]:
    return [
        f"| {claim.id} | {STATEMENTS[claim.id].text} | {'yes' if STATEMENTS[claim.id].kind is Kind.DRIVER else ''} | "
        f"{'passes' if claim.passed else 'fails'} | {percent(claim.share)} % | {percent(claim.low)} to "
        f"{percent(claim.high)} % | **{claim.verdict.value}** | "
        f"{f'{percent(claim.at[PRODUCTION])} %' if PRODUCTION in claim.at else ''} | "
        f"{f'{claim.words}, {percent(claim.explained)} %' if claim.words else ''} |"
        for claim in found.claims
    ]


def _systems(found: Population) -> list[str]:
    return [
        f"| {effect.scenario} | {effect.controller} | {effect.lost_without} | {effect.saved} | {effect.fine_without} | "
        f"{effect.spoiled} | {effect.spun_without}, {effect.spun} | {'; '.join(map(_change, effect.changes))} |"
        for effect in found.systems
    ]


def _change(change: Change) -> str:
    words, unit, factor = metric_label(change.metric)
    low, median, high = (_number(factor * value) for value in (change.low, change.median, change.high))
    return f"{words} {median}{'' if unit == '-' else f' {unit}'} ({low} to {high})"


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:+.2g}" if abs(value) >= 0.005 else "0"


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("build/population"), metavar="DIR")
    parser.add_argument("--samples", type=int, metavar="N", help="default: that of studies/population.toml")
    parser.add_argument("--jobs", type=int, metavar="N")
    options = parser.parse_args()
    with RunCounter("population", quiet=False) as counter:
        found = population(options.samples, output=options.output, jobs=options.jobs, progress=counter)
    print(found.to_text())
    for path in store_population(found, options.output):
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")
    PAGE.write_text(page(found), encoding="utf-8")


if __name__ == "__main__":
    main()
