"""The stored populations and comparisons, and their pages: see `tools/renew.py`.

The stored population has 250 samples, which take a quarter of an hour on two idle processors.
"""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from activesteer.analysis.claims.judge import SCENARIO_OF, SCENARIOS, STATEMENTS, SYSTEMS, Claim, Kind
from activesteer.analysis.claims.scorecard import PAPER, read_setting
from activesteer.commands.terminal import Progress
from activesteer.core.files import atomic_write, make_folder, write_text
from activesteer.core.metric_table import metric
from activesteer.errors import StudyError
from activesteer.resources import find_study, studies_dir
from activesteer.studies.engine.plan import Plan
from activesteer.studies.engine.runs import CLAIM, DISTANCE, drive
from activesteer.studies.engine.store import RESULTS
from activesteer.studies.engine.study import study
from activesteer.studies.engine.study_file import label_of, read_study
from activesteer.studies.engine.workers import in_parallel
from tools.make_setting import AROUND
from tools.population_results import (
    NONE,
    REQUIRED,
    STUDY,
    SUMMARY,
    UNITS,
    Change,
    Population,
    SystemEffect,
    population,
    population_study,
    read_population,
    summarise,
)
from tools.proportions import percent
from tools.tables import NOT_REPRODUCED, REPRODUCED

DOCS: Final = Path(__file__).resolve().parent.parent / "docs"
PAGE: Final = DOCS / "population.md"
COMPARISON_PAGE: Final = DOCS / "controller_results.md"
BEGIN: Final = "<!-- the table is written by tools/renew.py comparison -->\n"
END: Final = "<!-- end of the table -->\n"
COMPARED: Final = ("none", "esc", "lqr", "integrated")
"""Controllers of the comparison, unless others are given."""
RUNS: Final = "runs.parquet"
_KEPT: Final = ("sample", "maneuver", "controller", "status")
PRODUCTION: Final = "sensors.preset = production"
"""Key of the samples with the sensors of production cars."""
_HEAD: Final = """# The population

This page shows how often each [claim](claims.md) holds if car, road, driver, line, gains and sensors vary.
[Varied quantities](#varied-quantities) gives the ranges.

`activesteer study population` drives {samples} variations of the {vehicle} through the paper's five scenarios. Each
variation is driven without control, with `ars` and with `afs`, which gives {runs} runs in total. The package stores the
results (`studies/population/`). `tools/renew.py population` renews the results and this page.

## Proportion of samples in which each claim holds

The 95 % interval (Wilson) of the proportion decides the verdict:

- A claim *holds* if the interval is above 80 %.
- A claim *does not hold* if the interval is below 20 %.
- All other claims *depend* on the variation.

Half of the samples have ideal sensors, and half have the sensors of a production car. The column after the verdict
gives the proportion with production sensors.

The last column names the factor with the largest effect on the verdict, and the fraction of the variance that it
explains. The fraction comes from a regression on each factor and its square. The cell is empty if no factor is
significant.

Claims without a driver concern open-loop manoeuvres, where the steering wheel follows a table.

| | claim | driver | nominal | holds in | 95 % interval | verdict | with production sensors | holds more often with |
|---|---|---|---|---|---|---|---|---|
"""
_SYSTEMS: Final = """
## Effect of each system

A car is *lost* in any of these cases: its sideslip angle exceeds 20 deg (it spins), its body leaves the lanes, or it
misses a cone of the slalom. A car is *saved* if it is lost without control but not with a system. It is *spoiled* if it
is lost only with the system. *Spins* gives the numbers of cars that spin without and with the system. Changes are
relative to the same sample without control. They are given as the median, with the range of 90 % of the samples in
brackets.

| scenario | system | lost without it | of these, saved | not lost without it | of these, spoiled | spins | changes |
|---|---|---|---|---|---|---|---|
"""
_FACTORS: Final = """
## Varied quantities

The samples are a Sobol' sequence over the ranges below. The runs without control, with `ars` and with `afs` use the
same samples. Controllers and driver do not know the varied values.

```toml
{factors}
```

The variations were driven with {versions}.
"""


def driven(options: argparse.Namespace, controllers: Sequence[str] | None, name: str) -> tuple[Population, Path]:
    """Drive a population or what is missing of it, and return its results and the folder of its runs."""
    output = options.output or Path("build", name)
    with Progress("population", quiet=False) as progress:
        found = population(options.samples, controllers, output=output, jobs=options.jobs, progress=progress.count)
    return found, output


def page(found: Population) -> str:
    """Return the page of a population."""
    lines = find_study(STUDY).read_text(encoding="utf-8").splitlines()
    factors = "\n".join(lines[lines.index("[factors]") : lines.index("[design]") - 1])
    head = _HEAD.format(samples=found.samples, vehicle=found.vehicle, runs=15 * found.samples)
    versions = ", ".join(f"{name} {version}" for name, version in found.versions.items())
    results = "\n".join(_claims(found)) + "\n" + _SYSTEMS + "\n".join(_systems(found)) + "\n"
    return head + results + _FACTORS.format(factors=factors, versions=versions)


def comparison_page(text: str, found: Population | None) -> str:
    """Return the page of the controllers' results with the table of a comparison in its place.

    Args:
        text: The page.
        found: Results of the comparison; None if none is stored.
    """
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    lines = ["The package stores no comparison yet; `tools/renew.py comparison` makes one."]
    return f"{before}{BEGIN}" + "\n".join(lines if found is None else _comparison(found)) + f"\n{END}{after}"


def _comparison(found: Population) -> list[str]:
    names = found.controllers
    versions = ", ".join(f"{name} {version}" for name, version in found.versions.items())
    totals = [found.total(name) for name in names]
    every = found.samples * len(found.vehicle.split(", ")) * (1 + len(names))
    lines = [
        f"{found.samples} samples on each of {found.vehicle}; seed {found.seed}; driven with {versions}.",
        f"{found.failed} of {every} runs are left out. Either the friction is too low for their turn, or the car's "
        "rear axle cannot take a screw actuator.",
        "",
        *_head("runs with harm", names),
    ]
    for scenario in dict.fromkeys(effect.scenario for effect in found.systems):
        own = [effect for effect in found.systems if effect.scenario == scenario]
        lines.append(_row(scenario.replace("_", " "), [str(effect.harmed) for effect in own]))
    lines.append(_row("**all scenarios**", [str(total.harmed) for total in totals]))
    lines.append(_row("the same, with all stops counted", [str(total.harmed_anywhere) for total in totals]))
    lines.append(
        _row(
            "runs with harm, of the cars that do not spin without control",
            [str(total.harmed_unspun) for total in totals],
        )
    )
    lines.append(_row("pairs of runs", [str(total.harmed.number) for total in totals]))
    lines.append(_row("saved, of the cars lost without control", [str(total.saved) for total in totals]))
    lines.append(
        _row("lost with the controller, of the cars not lost without control", [str(total.spoiled) for total in totals])
    )
    lines += ["", *_head("by car", names)]
    for vehicle in dict.fromkeys(effect.vehicle for effect in found.cars):
        own = [effect for effect in found.cars if effect.vehicle == vehicle]
        lines.append(_row(f"**{vehicle}**: runs with harm", [str(effect.harmed) for effect in own]))
        lines.append(_row("the same, with all stops counted", [str(effect.harmed_anywhere) for effect in own]))
        for text, measures in _WORST.items():
            lines.append(_row(text, [_worst(effect, measures) for effect in own]))
    against = [
        (
            f"{effect.vehicle}, `{effect.controller}`",
            str(effect.harmed_anywhere),
            *(_worst(effect, measures) for measures in _WORST.values()),
        )
        for effect in found.against_required
    ]
    if against:
        lines += ["", *_head(f"compared with `{REQUIRED}` instead of `{NONE}`", ["runs with harm", *_WORST], "")]
        lines += [_row(head, cells) for head, *cells in against]
    caption = "Harmed and saved runs, and the largest additional deviation, by scenario and controller"
    return [*lines, "", f"![{caption}](pictures/comparison_population.png)"]


_WORST: Final = {
    "largest additional deviation, m": ("lane", "path"),
    "largest increase in stopping distance, m": ("stopping",),
    "the same for cars that leave their line, m": ("stopping_elsewhere",),
    "largest increase in final heading, deg": ("heading",),
}
"""Row of the table -> measures of harm. A car off the line leaves its line without control."""


def _worst(effect: SystemEffect, measures: Sequence[str]) -> str:
    """Return the largest growth of the measures in their unit, undefined if the car is lost."""
    values = [value for value in map(effect.worst, measures) if not math.isnan(value)]
    if not values:
        return "-"
    worst = max(values) * UNITS[measures[0]].factor
    return f"{worst:.2f}" if math.isfinite(worst) else "lost"


def _head(text: str, names: Iterable[str], mark: str = "`") -> list[str]:
    cells = [f"{mark}{name}{mark}" for name in names]
    return [_row(text, cells), "|---|" + "---|" * len(cells)]


def _row(head: str, cells: Iterable[str]) -> str:
    return f"| {head} | " + " | ".join(cells) + " |"


def _claims(found: Population) -> list[str]:
    return [
        f"| {claim.id} | {STATEMENTS[claim.id].text} | "
        f"{'yes' if SCENARIOS[SCENARIO_OF[claim.id]].kind is Kind.DRIVER else ''} | "
        f"{REPRODUCED if claim.passed else NOT_REPRODUCED} | {percent(claim.share)} % | {percent(claim.low)} to "
        f"{percent(claim.high)} % | **{claim.verdict.value}** | "
        f"{f'{percent(claim.at[PRODUCTION])} %' if PRODUCTION in claim.at else ''} | "
        f"{f'{claim.words}, {percent(claim.explained)} %' if claim.words else ''} |"
        for claim in found.claims
    ]


def _systems(found: Population) -> list[str]:
    return [
        f"| {effect.scenario} | {effect.controller} | {effect.saved.number} | {effect.saved.count} | "
        f"{effect.spoiled.number} | {effect.spoiled.count} | {effect.spun_without}, {effect.spun} | "
        f"{'; '.join(map(_change, effect.changes))} |"
        for effect in found.systems
    ]


def _change(change: Change) -> str:
    shown = metric(change.metric)
    low, median, high = (_number(shown.unit.factor * value) for value in (change.low, change.median, change.high))
    return f"{f'{shown.label} {median} {shown.unit_name}'.rstrip()} ({low} to {high})"


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:+.2g}" if abs(value) >= 0.005 else "0"


def store_summary(found: Population, name: str) -> Path:
    """Store the results of a population or a comparison with the package, without the medians of all metrics.

    Args:
        found: The results.
        name: Folder to write, in the folder of the study files; see `read_population`.

    Returns:
        The file.

    Raises:
        StudyError: the file cannot be written.
    """
    folder = make_folder(studies_dir() / name, StudyError)
    text = json.dumps(replace(found).to_json(), indent=1)
    return write_text(folder / SUMMARY, f"{text}\n", StudyError)


def store_population(found: Population, study_folder: Path) -> list[Path]:
    """Store a population with the package.

    Args:
        found: Results of the population.
        study_folder: Folder of its finished study.

    Returns:
        The files written.

    Raises:
        StudyError: the study is not finished, or a file cannot be written.
    """
    results = study_folder / RESULTS
    if not results.is_file():
        raise StudyError(f"{study_folder} holds no finished study; resume it")
    table = pq.read_table(results)
    about = {b"vehicle": found.vehicle.encode()}
    paths = [store_summary(found, STUDY)]
    folder = paths[0].parent
    with atomic_write(folder / RUNS, StudyError) as path:
        pq.write_table(_in_short(table).replace_schema_metadata(about), path, compression="zstd", compression_level=19)
    return [*paths, folder / RUNS]


def stored_runs() -> pa.Table:
    """Return the runs of the package's population with their factors.

    Raises:
        StudyError: the package stores no population.
    """
    folder = studies_dir() / STUDY
    summary = read_population(STUDY)
    if summary is None or not (folder / RUNS).is_file():
        raise StudyError(f"{folder} holds no population; make one with tools/renew.py population")
    table = pq.read_table(folder / RUNS)
    table = table.append_column("vehicle", pa.array([summary.vehicle] * len(table)))
    samples = population_study(summary.samples, summary.seed).samples()[0]
    places = table["sample"].to_numpy()
    for key, values in samples.columns.items():
        table = table.append_column(key, pa.array(np.asarray(values)[places]))
    return table


def renew_around(folder: Path, samples: int | None, jobs: int | None) -> None:
    """Drive the populations around the paper's setting, and store their results with the package.

    Args:
        folder: Folder of the studies.
        samples: Number of samples; None for that of the study files.
        jobs: Number of processes.
    """
    fails = read_setting(PAPER).fails
    nominal = [Claim(statement, statement.id not in fails, {}) for statement in STATEMENTS.values()]
    for name in AROUND:
        planned = read_study(name)
        if samples is not None:
            planned = replace(planned, design=replace(planned.design, samples=samples))
        with Progress(name, quiet=False) as progress:
            table = study(planned, output=folder / name, jobs=jobs, progress=progress.count)
        print(store_summary(summarise(table, planned, nominal), name))


def _in_short(table: pa.Table) -> pa.Table:
    factors = population_study().keys
    columns = {}
    for name in table.column_names:
        if name.startswith(CLAIM):
            columns[name] = table[name].cast(pa.int8())
        elif name in _KEPT:
            columns[name] = table[name].cast(pa.int16()) if name == "sample" else table[name].dictionary_encode()
        elif (
            name not in factors
            and not name.startswith(DISTANCE)
            and pa.types.is_floating(table.schema.field(name).type)
        ):
            columns[name] = table[name].cast(pa.float32())
    return pa.table(columns)


def judge_again(changed: dict[str, str], jobs: int | None) -> Population:
    """Judge the stored population again after criteria have changed, and store it.

    Args:
        changed: Number of each changed claim -> number of a claim of the same scenario without which it cannot hold.
        jobs: Number of processes.
    """
    stored = read_population(STUDY)
    path = studies_dir() / STUDY / RUNS
    if stored is None:
        raise StudyError(f"{path.parent} holds no population")
    table = pq.read_table(path)
    rows = table.select(_KEPT[:3]).to_pylist()
    verdicts = {name: table[name].to_pylist() for name in table.column_names if name.startswith(CLAIM)}
    wanted = sorted(
        {
            (row["maneuver"], row["sample"])
            for claim, source in changed.items()
            for row, held in zip(rows, verdicts[f"{CLAIM}{source}"], strict=True)
            if held == 1 and row["maneuver"] == SCENARIO_OF[claim]
        }
    )
    plan = Plan(population_study(stored.samples, stored.seed))
    scenarios = [label_of(item) for item in plan.study.maneuvers]
    firsts = [(scenarios.index(name) * stored.samples + sample) * len(SYSTEMS) for name, sample in wanted]
    tasks = [(plan.settings, plan.requests(range(first, first + len(SYSTEMS)))) for first in firsts]
    driven = dict(zip(wanted, in_parallel(drive, tasks, jobs), strict=True))
    for claim in changed:
        column = verdicts[f"{CLAIM}{claim}"]
        for place, row in enumerate(rows):
            if column[place] is not None:
                found = driven.get((row["maneuver"], row["sample"]))
                column[place] = 0 if found is None else int(found[0][f"{CLAIM}{claim}"])
    for name, column in verdicts.items():
        table = table.set_column(table.column_names.index(name), name, pa.array(column, pa.int8()))
    failed = [float(sum(own[place] == 0 for own in verdicts.values())) for place in range(len(rows))]
    table = table.set_column(table.column_names.index("claims_failed"), "claims_failed", pa.array(failed, pa.float32()))
    with atomic_write(path, StudyError) as target:
        pq.write_table(table, target, compression="zstd", compression_level=19)
    nominal = [Claim(STATEMENTS[claim.id], claim.passed, {}) for claim in stored.claims]
    again = summarise(stored_runs(), population_study(stored.samples, stored.seed), nominal)
    judged = {claim.id: claim for claim in again.claims}
    for before in (claim for claim in stored.claims if claim.id in changed):
        print(f"{before.id}: {percent(before.share)} % before, now {percent(judged[before.id].share)} %")
    kept = tuple(judged[claim.id] if claim.id in changed else claim for claim in stored.claims)
    again = replace(stored, claims=kept)
    print(f"{len(wanted)} samples driven again: {store_summary(again, STUDY)}")
    return again
