"""Makes the stored results anew: `python tools/renew_baseline.py`, then enter what it prints in CHANGELOG.md.

Every scenario of the paper is driven with every system; the metrics go to tests/reproduction/baseline.json.
What has changed by more than the tolerance is printed.
"""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

BASELINE: Final = Path(__file__).parents[1] / "tests" / "reproduction" / "baseline.json"

RELATIVE: Final = 0.01
"""A metric has changed when it differs by more than this share of its stored value and by more than the floor."""
FLOORS: Final = {"_rad": 2e-4, "_radps": 1e-3, "_mps2": 0.02, "_mps": 0.02, "_m": 0.01, "_s": 0.005, "_share": 0.01}
"""Smallest difference that counts, by the unit at the end of a metric's name; 0.02 for any other."""


def key_metrics(runs: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """The metrics of all runs, rounded to what is worth keeping.

    Args:
        runs: Scenario -> system -> recording.

    Returns:
        "<scenario> <system>" -> metric -> value, five digits.
    """
    return {
        f"{scenario} {system}": {name: _rounded(value) for name, value in recording.metrics.items()}
        for scenario, systems in runs.items()
        for system, recording in systems.items()
    }


def differences(stored: Mapping[str, Mapping[str, float]], found: Mapping[str, Mapping[str, float]]) -> list[str]:
    """What differs by more than the tolerance, a line each; empty where nothing does."""
    lines = []
    for run in [*stored, *(run for run in found if run not in stored)]:
        before, after = stored.get(run, {}), found.get(run, {})
        for name in [*before, *(name for name in after if name not in before)]:
            old, new = before.get(name), after.get(name)
            if old is None or new is None or not _same(name, old, new):
                lines.append(f"{run}: {name}: {_told(old)} -> {_told(new)}")
    return lines


def _same(name: str, old: float, new: float) -> bool:
    if math.isnan(old) or math.isnan(new):
        return math.isnan(old) and math.isnan(new)
    floor = next((value for suffix, value in FLOORS.items() if name.endswith(suffix)), 0.02)
    return abs(new - old) <= max(RELATIVE * abs(old), floor)


def _told(value: float | None) -> str:
    return "missing" if value is None else f"{value:.4g}"


def _rounded(value: float) -> float:
    return float(f"{value:.5g}")


def main() -> None:
    """Drives everything and writes the file."""
    from activesteer.studies.reproduction import reproduce  # noqa: PLC0415 - the tests import this module for its comparison

    stored = json.loads(BASELINE.read_text(encoding="utf-8")) if BASELINE.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        found = key_metrics(reproduce(folder).recordings())
    for line in differences(stored, found):
        print(f"- {line}")
    BASELINE.write_text(json.dumps(found, indent=1, allow_nan=True) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
