"""A benchmark of the paper's manoeuvres and of those in phases: key metrics against a stored baseline, time and memory.

The baseline, `maneuver_baseline.json` beside this file, is shipped with the package: it holds the key metrics of each
scenario and system as they were when it was last renewed on purpose.
"""

from __future__ import annotations

import json
import math
import resource
import time
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Final, NamedTuple

from activesteer.analysis.claims import SCENARIOS, SYSTEMS
from activesteer.analysis.metrics import EVALUATIONS, evaluation_of
from activesteer.errors import ActiveSteerError, RecordingError
from activesteer.files import read_text, write_json
from activesteer.metric_table import Metric, recorded_metric
from activesteer.recording import Recording
from activesteer.scenario import resolve
from activesteer.simulation.amplitude_store import searched_anew
from activesteer.simulation.preparation import prepared
from activesteer.simulation.runner import run_scenario

BASELINE: Final = Path(__file__).with_name("maneuver_baseline.json")

DRIVEN: Final = {
    **dict.fromkeys((*SCENARIOS, "fishhook", "j_turn", "brake_in_turn_release"), SYSTEMS),
    "start_stop": ("none",),
}
"""Manoeuvre -> controllers that drive it."""

Baseline = dict[str, dict[str, dict[str, float]]]
"""Manoeuvre -> controller -> name of the metric -> value [SI], nan where the run does not define one."""


class BenchmarkRun(NamedTuple):
    """One manoeuvre driven with one controller.

    The simulated time includes settling; the wall time lasts from building the car to the metrics. The key metrics [SI]
    are in the order of their declaration.
    """

    maneuver: str
    kind: str
    controller: str
    simulated_s: float
    wall_s: float
    metrics: dict[str, float]

    @property
    def real_time_factor(self) -> float:
        """Simulated time over wall time."""
        return self.simulated_s / self.wall_s


class Benchmark(NamedTuple):
    """The runs of a benchmark.

    Attributes:
        runs: All runs, by manoeuvre, then by controller.
        search_s: Manoeuvre whose steering amplitude is found by driving -> time of that search [s].
        peak_memory_B: Largest memory that this process has held so far [B].
    """

    runs: list[BenchmarkRun]
    search_s: dict[str, float]
    peak_memory_B: int

    def key_metrics(self) -> Baseline:
        """Return the key metrics of all runs, rounded to six digits."""
        found: Baseline = {}
        for run in self.runs:
            rounded = {name: float(f"{value:.6g}") for name, value in run.metrics.items()}
            found.setdefault(run.maneuver, {})[run.controller] = rounded
        return found


class Drift(NamedTuple):
    """A key metric [SI] that differs from the baseline by more than its tolerance; None where a side has none."""

    maneuver: str
    controller: str
    metric: str
    old: float | None
    new: float | None
    tolerance: float

    def __str__(self) -> str:
        """Return one line with old and new value and the tolerance, in display units."""
        metric = recorded_metric(self.metric)
        old, new = ("missing" if value is None else metric.text(value) for value in (self.old, self.new))
        tolerance = f"{self.tolerance * metric.unit.factor:.3g} {metric.unit.name}".removesuffix(" -")
        return f"{self.maneuver}, {self.controller}: {metric.label} {old} -> {new} (tolerance {tolerance})"


def bench_maneuvers() -> Benchmark:
    """Drive the paper's five scenarios and the manoeuvres in phases, one after the other in this process.

    Steering amplitudes are searched anew; the search counts to `search_s` and to no run.

    Raises:
        RecordingError: a run lacks a key metric that is declared for its kind of manoeuvre.
    """
    # The metrics load it at their first use; that is no time of a run.
    import_module("scipy.signal")
    runs, search_s = [], {}
    for name, systems in DRIVEN.items():
        scenario = resolve(name)
        with searched_anew():
            start = time.perf_counter()
            found = prepared(scenario)
            if scenario.maneuver.search is not None:
                search_s[name] = time.perf_counter() - start
        simulated_s = scenario.maneuver.settle_s + scenario.maneuver.duration_s
        for system in systems:
            start = time.perf_counter()
            recording = run_scenario(found, system)
            wall_s = time.perf_counter() - start
            kind = recording.metadata["maneuver"]["kind"]
            runs.append(BenchmarkRun(name, kind, system, simulated_s, wall_s, _key_metrics(recording)))
    # Linux gives kibibytes.
    return Benchmark(runs, search_s, 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


def _key_metrics(recording: Recording) -> dict[str, float]:
    names = [metric.name for metric in evaluation_of(recording).key_metrics]
    missing = [name for name in names if name not in recording.metrics]
    if missing:
        kind = recording.metadata["maneuver"]["kind"]
        raise RecordingError(f"the key metric {missing[0]} is declared for the kind {kind}, but a run has none")
    return {name: recording.metrics[name] for name in names}


def drifts(benchmark: Benchmark, baseline: Baseline) -> list[Drift]:
    """Return the key metrics that differ from the baseline by more than their tolerance.

    Args:
        benchmark: The runs.
        baseline: Key metrics to compare with. A run or metric that only one side has is a drift.
    """
    kinds = {run.maneuver: run.kind for run in benchmark.runs}
    new, found = benchmark.key_metrics(), []
    for maneuver in dict.fromkeys((*baseline, *new)):
        olds, news = baseline.get(maneuver, {}), new.get(maneuver, {})
        for controller in dict.fromkeys((*olds, *news)):
            before, after = olds.get(controller, {}), news.get(controller, {})
            declared = EVALUATIONS[kinds[maneuver]].key_metrics if maneuver in kinds else ()
            found += _differences((maneuver, controller), before, after, {metric.name: metric for metric in declared})
    return found


def _differences(
    run: tuple[str, str], before: Mapping[str, float], after: Mapping[str, float], declared: Mapping[str, Metric]
) -> list[Drift]:
    found = []
    for name in dict.fromkeys((*before, *after)):
        old, new = before.get(name), after.get(name)
        metric = declared.get(name) or recorded_metric(name)
        tolerance = metric.tolerance_of(old) if old is not None and math.isfinite(old) else metric.tolerance
        if old is None or new is None or not _alike(old, new, tolerance):
            found.append(Drift(*run, name, old, new, tolerance))
    return found


def _alike(old: float, new: float, tolerance: float) -> bool:
    if math.isnan(old) or math.isnan(new):
        return math.isnan(old) and math.isnan(new)
    return abs(new - old) <= tolerance


def read_baseline(path: Path = BASELINE) -> Baseline:
    """Return the stored baseline.

    Args:
        path: JSON file that `write_baseline` made; null stands for nan.

    Raises:
        RecordingError: the file is missing or is no baseline; renew it with `activesteer bench --maneuvers --renew`.
    """
    try:
        stored = json.loads(read_text(path, RecordingError))
        return {
            maneuver: {
                controller: {name: math.nan if value is None else float(value) for name, value in metrics.items()}
                for controller, metrics in controllers.items()
            }
            for maneuver, controllers in stored.items()
        }
    except (ValueError, TypeError, AttributeError) as error:
        raise RecordingError("is no baseline of key metrics; renew it with --renew", file=str(path)) from error


def write_baseline(benchmark: Benchmark, path: Path = BASELINE) -> Path:
    """Write the key metrics of a benchmark as the new baseline."""
    return write_json(path, benchmark.key_metrics(), ActiveSteerError)


def search_told(benchmark: Benchmark, maneuver: str) -> str:
    """Return the time of the search for a manoeuvre's steering amplitude in words; empty where nothing is searched."""
    search_s = benchmark.search_s.get(maneuver)
    return "" if search_s is None else f"search of the steering amplitude {search_s:.2f} s"


def as_json(benchmark: Benchmark, found: Sequence[Drift]) -> dict[str, Any]:
    """Return a benchmark and its drifts as JSON values."""
    return {
        "runs": [run._asdict() | {"real_time_factor": run.real_time_factor} for run in benchmark.runs],
        "search_s": benchmark.search_s,
        "peak_memory_B": benchmark.peak_memory_B,
        "drifts": [drift._asdict() for drift in found],
    }


def as_markdown(benchmark: Benchmark, found: Sequence[Drift]) -> str:
    """Return a summary for the page of a continuous-integration run: verdict, drifts, a table for each manoeuvre."""
    checked = sum(len(run.metrics) for run in benchmark.runs)
    verdict = f"{len(found)} of {checked} key metrics drift" if found else f"{checked} key metrics as in the baseline"
    parts = [f"# Benchmark of the manoeuvres\n\n{verdict}; peak memory {benchmark.peak_memory_B / 1e6:.0f} MB."]
    if found:
        parts.append("\n".join(f"- {drift}" for drift in found))
    for maneuver in dict.fromkeys(run.maneuver for run in benchmark.runs):
        runs = [run for run in benchmark.runs if run.maneuver == maneuver]
        rows = [["metric", "unit", *(run.controller for run in runs)], ["---"] * 2 + ["---:"] * len(runs)]
        for name in runs[0].metrics:
            metric = recorded_metric(name)
            rows.append([metric.label, metric.unit.name, *(metric.text(run.metrics[name]) for run in runs)])
        rows.append(["time of the run", "s", *(f"{run.wall_s:.2f}" for run in runs)])
        rows.append(["times real time", "-", *(f"{run.real_time_factor:.0f}" for run in runs)])
        table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
        search = f"{search_told(benchmark, maneuver).capitalize()}.\n\n" if maneuver in benchmark.search_s else ""
        parts.append(f"## {maneuver}\n\n{search}{table}")
    return "\n\n".join(parts) + "\n"
