"""Controllers over a population: the same samples for all, their counts, and their description."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from activesteer.analysis.claims.population import Population, SystemEffect
from activesteer.cli import main
from activesteer.errors import ParameterError, StudyError
from activesteer.metric_table import SIDESLIP_PEAKS
from activesteer.studies.engine.factor_values import FactorValues, label_of
from activesteer.studies.engine.study_file import StudyFile, read_study
from activesteer.studies.paper import population as module
from activesteer.studies.paper.comparison_population import (
    comparison_json,
    comparison_text,
    population_targets,
)
from activesteer.studies.paper.population import STEERING_EFFORT, summarise
from activesteer.studies.paper.population_studies import SCENARIOS, comparison_study, population_study
from activesteer.theory.proportions import Proportion
from tests.raising import raises

NAMES = ("none", "ars", "afs", "esc", "lqr")
SPIN_RAD = 1.0


def made_up(**peaks: list[float | None]) -> Population:
    """Peaks of the sideslip in samples of a sine with dwell [rad]; None if the run did not finish."""
    planned = comparison_study(tuple(peaks), 8)
    samples = planned.samples()[0]
    rows = [
        {
            "run": 0, "sample": sample, "maneuver": "sine_with_dwell", "vehicle": "compact", "controller": name,
            **samples[sample], "status": "failed" if peak is None else "ok", "error": "", "sideslip_peak_abs_rad": peak,
        }
        for name, values in peaks.items()
        for sample, peak in enumerate(values)
    ]  # fmt: skip
    return summarise(pa.Table.from_pylist(rows), planned)


def effect_of(found: Population, controller: str) -> SystemEffect:
    [effect] = [effect for effect in found.systems if effect.controller == controller]
    return effect


def test_the_best_of_the_references_is_taken_sample_by_sample():
    found = made_up(
        none=[SPIN_RAD, SPIN_RAD, 0.1, 0.1],
        ars=[0.10, 0.30, 0.05, 0.05],
        afs=[0.20, 0.20, 0.05, 0.05],
        esc=[0.30, 0.10, 0.05, 0.05],
        lqr=[0.09, 0.11, 0.05, SPIN_RAD],
    )
    lqr = effect_of(found, "lqr")
    assert lqr.lower == Proportion(1, 4)  # as low is not lower
    assert lqr.saved == Proportion(2, 2)
    assert lqr.spoiled == Proportion(1, 2)
    assert effect_of(found, "ars").lower == Proportion(0, 0)
    assert lqr.median_change(SIDESLIP_PEAKS) == pytest.approx((-0.89 - 0.05) / 2.0)
    assert math.isnan(lqr.median_change([STEERING_EFFORT]))
    assert [target.passed for target in population_targets(found)] == [False, False]


def test_a_run_that_did_not_end_is_lower_than_nothing_and_all_are_lower_than_it():
    found = made_up(none=[0.1, 0.1], ars=[None, 0.1], afs=[None, 0.1], esc=[None, 0.1], lqr=[5.0, None])
    lqr = effect_of(found, "lqr")
    assert lqr.lower == Proportion(1, 2)
    assert lqr.spoiled == Proportion(2, 2)
    assert found.failed == 4


def test_shares_at_the_bounds_meet_the_targets():
    found = made_up(none=[0.3] * 5, ars=[0.2] * 5, afs=[0.2] * 5, esc=[0.2] * 5, lqr=[0.1, 0.1, 0.1, 0.1, 0.3])
    assert [target.passed for target in population_targets(found)] == [True, True]
    assert "lqr  passed  peak of the sideslip below the lowest of ars, afs, esc in 80 % (38 to 96)" in comparison_text(
        found
    )


def test_what_is_stored_is_what_was_found():
    found = made_up(none=[0.3], ars=[0.2], afs=[0.2], esc=[0.2], lqr=[0.1])
    table = json.loads(json.dumps(comparison_json(found), allow_nan=False))
    again = Population.from_json(table)
    assert again == found
    assert again.total("lqr").lower == Proportion(1, 1)
    assert {(row["scenario"], row["controller"], row["metric"]) for row in table["table"]} == {
        ("sine_with_dwell", name, "sideslip_peak_abs_rad") for name in NAMES
    }
    with raises(StudyError, cause=KeyError):
        Population.from_json({"claims": []})


def test_the_factors_are_those_of_the_population_without_gains_and_with_sensors_of_production_cars():
    planned, other = comparison_study(NAMES, 4), population_study(4)
    left_out = {key for key in other.keys if key.startswith("controllers.")} | {"sensors.preset"}
    assert set(planned.keys) == set(other.keys) - left_out
    assert planned.overrides == {"sensors.preset": "production"}
    values, step = FactorValues(planned), SCENARIOS.index("step_steer_120_kmh")
    assert values.overrides(step, 0, {"speed_kmh": 1.05}) == {"speed_kmh": pytest.approx(126.0)}
    assert [label_of(maneuver) for maneuver in planned.maneuvers] == list(SCENARIOS)


def test_without_what_the_others_are_compared_with_nothing_is_driven():
    with raises(ParameterError, key="--controllers", allowed=["none", "esc"]):
        comparison_study(("ars", "afs", "lqr"), 4)


@pytest.fixture
def only_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the fastest scenario, in which driver and lanes have no effect."""
    study = comparison_study

    def shortened(*given: Any) -> StudyFile:
        table = study(*given).to_table()
        table["maneuvers"] = [item for item in table["maneuvers"] if not isinstance(item, str)]
        table["factors"] = {
            key: value
            for key, value in table["factors"].items()
            if "maneuvers" not in value and not key.startswith("driver.")
        }
        return read_study(table)

    monkeypatch.setattr(module, "comparison_study", shortened)


@pytest.mark.usefixtures("only_a_step")
def test_command_goes_on_with_its_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    arguments = ["reproduce", "--controllers", "none,ars,afs,esc", "--population", "1", "--jobs", "1"]
    arguments += ["-o", str(tmp_path / "study")]
    assert main([*arguments, "--json", "--figures"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert {(row["scenario"], row["controller"]) for row in first["table"]} == {
        ("step_steer_120_kmh", name) for name in ("none", "ars", "afs", "esc")
    }
    assert Path(first.pop("figures")[0]).stat().st_size > 5_000
    assert main([*arguments, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == first
    assert main(arguments) == 0
    text = capsys.readouterr().out
    assert "all scenarios" in text
    assert max(map(len, text.splitlines())) <= 100
