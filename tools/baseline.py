"""Drive the paper's scenarios, and compare their key metrics with the stored baseline.

    python tools/baseline.py [--renew]

The exit status is 1 if a key metric has drifted. `--renew` stores the present ones in `tools/baseline.json`.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from activesteer import simulate
from activesteer.analysis.claims.judge import SCENARIOS, SYSTEMS
from activesteer.analysis.metrics import KEY_METRICS, evaluated_kind
from activesteer.core.files import read_text, write_json
from activesteer.core.metric_table import recorded_metric
from activesteer.errors import ActiveSteerError, RecordingError
from activesteer.recording import Recording

BASELINE: Final = Path(__file__).with_name("baseline.json")
"""Key metrics of each run as they were when they were last renewed on purpose."""
DRIVEN: Final = {
    **dict.fromkeys((*SCENARIOS, "fishhook", "j_turn", "brake_in_turn_release"), SYSTEMS),
    "start_stop": ("none",),
}
"""Manoeuvre -> controllers that drive it."""

RELATIVE_TOLERANCE: Final = 0.01
"""Fraction of a value by which it may always differ between two versions of the program."""
_TOLERANCES: Final = {
    "radps": 1e-3, "mps2": 0.02, "rad": 2e-4, "s": 0.005, "srad": 2e-5, "m": 0.01, "mps": 0.02, "radpmps2": 1e-5,
    "1ps": 0.005, "mps2prad": 0.05, "radprad": 0.001, "Hz": 0.02, "Pa": 1e4, "N": 50.0, "J": 100.0, "": 0.01,
}  # fmt: skip
"""SI unit of a metric -> smallest difference between two versions of the program that a reader would notice."""

Run = tuple[str, str]
"""Manoeuvre and controller."""
Metrics = Mapping[Run, Mapping[str, float]]
"""Key metrics of runs [SI], nan where the run does not define one."""


class Drift(NamedTuple):
    """A key metric [SI] that differs from the baseline by more than its tolerance, or None where a side has none."""

    run: Run
    metric: str
    old: float | None
    new: float | None
    tolerance: float

    def __str__(self) -> str:
        """Return one line with old and new value and the tolerance."""
        metric = recorded_metric(self.metric)
        old, new = ("missing" if value is None else metric.text(value) for value in (self.old, self.new))
        tolerance = f"{self.tolerance * metric.unit.factor:.3g} {metric.unit.name}".removesuffix(" -")
        return f"{', '.join(self.run)}: {metric.label} {old} -> {new} (tolerance {tolerance})"


def key_metrics(recording: Recording) -> dict[str, float]:
    """Return the key metrics of a run, rounded to six digits."""
    names = KEY_METRICS[evaluated_kind(recording)]
    if missing := [name for name in names if name not in recording.metrics]:
        raise RecordingError(f"{recording.metadata['maneuver']['name']}: there is no key metric {missing[0]}")
    return {name: float(f"{recording.metrics[name]:.6g}") for name in names}


def tolerance_of(name: str, old: float | None) -> float:
    """Return the difference [SI] from a value that counts as unchanged: 0 for a count."""
    if recorded_metric(name).whole:
        return 0.0
    least = _TOLERANCES.get(name.rpartition("_")[2], _TOLERANCES[""])
    return max(least, RELATIVE_TOLERANCE * abs(old)) if old is not None and math.isfinite(old) else least


def drifts(news: Metrics, olds: Metrics) -> list[Drift]:
    """Return the key metrics that differ from the baseline by more than their tolerance, or that one side lacks."""
    found = []
    for run in dict.fromkeys((*olds, *news)):
        old_ones, new_ones = olds.get(run, {}), news.get(run, {})
        for name in dict.fromkeys((*old_ones, *new_ones)):
            old, new = old_ones.get(name), new_ones.get(name)
            tolerance = tolerance_of(name, old)
            if old is None or new is None or not np.isclose(new, old, rtol=0.0, atol=tolerance, equal_nan=True):
                found.append(Drift(run, name, old, new, tolerance))
    return found


def read_baseline(path: Path = BASELINE) -> dict[Run, dict[str, float]]:
    """Return the stored baseline, nan for null."""
    try:
        return {
            (maneuver, controller): {
                name: math.nan if value is None else float(value) for name, value in metrics.items()
            }
            for maneuver, systems in json.loads(read_text(path, RecordingError)).items()
            for controller, metrics in systems.items()
        }
    except (ValueError, TypeError, AttributeError) as error:
        raise RecordingError("is not a baseline of key metrics; renew it with --renew", file=str(path)) from error


def write_baseline(metrics: Metrics, path: Path = BASELINE) -> Path:
    """Write key metrics as the new baseline."""
    stored: dict[str, dict[str, Mapping[str, float]]] = {}
    for (maneuver, controller), each in metrics.items():
        stored.setdefault(maneuver, {})[controller] = each
    return write_json(path, stored, ActiveSteerError)


def drive(names: Iterable[str] = DRIVEN) -> dict[Run, dict[str, float]]:
    """Drive the runs and return their key metrics."""
    found = {}
    for name in names:
        start = time.perf_counter()
        for controller in DRIVEN[name]:
            found[name, controller] = key_metrics(simulate(name, controller))
        print(f"{name}: {time.perf_counter() - start:.1f} s")
    return found


def main() -> int:
    """Drive, compare or renew, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--renew", action="store_true", help="store the present key metrics as the new baseline")
    renew = parser.parse_args().renew
    olds, news = {} if renew else read_baseline(), drive()
    if renew:
        print(f"renewed {write_baseline(news)}")
        return 0
    found = drifts(news, olds)
    checked = sum(map(len, news.values()))
    print(*found, f"{checked - len(found)} of {checked} key metrics are as in the baseline", sep="\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
