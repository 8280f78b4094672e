"""The benchmark of the manoeuvres detects each key metric that drifts, appears or vanishes."""

from __future__ import annotations

import json
import math

import pytest

from activesteer.analysis.metrics import EVALUATIONS
from activesteer.cli import main
from activesteer.errors import RecordingError
from activesteer.studies import benchmark
from activesteer.studies.benchmark import Benchmark, BenchmarkRun, drifts, read_baseline, write_baseline
from tests.raising import raises


def driven(**changed: float) -> Benchmark:
    """Return a slalom whose key metrics are all 2, except for the changed ones."""
    metrics = {metric.name: 2.0 for metric in EVALUATIONS["slalom"].key_metrics} | changed
    return Benchmark([BenchmarkRun("slalom", "slalom", "ars", 10.0, 0.25, metrics)], {"slalom": 0.5}, 400_000_000)


def test_unchanged_metrics_do_not_drift():
    assert drifts(driven(), driven().key_metrics()) == []


@pytest.mark.parametrize(("value", "found"), [(2.019, 0), (2.021, 1), (1.981, 0), (1.979, 1)])
def test_a_drift_begins_at_one_per_cent(value, found):
    assert len(drifts(driven(track_amplitude_m=value), driven().key_metrics())) == found


def test_a_count_has_no_tolerance():
    [drift] = drifts(driven(cones_hit=3.0), driven().key_metrics())
    assert (drift.metric, drift.old, drift.new, drift.tolerance) == ("cones_hit", 2.0, 3.0, 0.0)
    assert str(drift).startswith("slalom, ars: cones hit 2 -> 3 (tolerance 0")


def test_a_drift_is_told_in_display_units():
    [drift] = drifts(driven(sideslip_peak_abs_rad=math.radians(90.0)), driven().key_metrics())
    assert "sideslip peak abs 114.592 -> 90.000 (tolerance 1.15 deg)" in str(drift)


@pytest.mark.parametrize("value", [math.nan, 1.0])
def test_a_value_that_becomes_or_ceases_to_be_undefined_drifts(value):
    other = 1.0 if math.isnan(value) else math.nan
    [drift] = drifts(driven(speed_loss_mps=value), driven(speed_loss_mps=other).key_metrics())
    assert drift.metric == "speed_loss_mps"


def test_undefined_on_both_sides_is_unchanged():
    assert drifts(driven(speed_loss_mps=math.nan), driven(speed_loss_mps=math.nan).key_metrics()) == []


def test_a_metric_a_controller_or_a_manoeuvre_that_only_one_side_has_drifts():
    stored = driven().key_metrics()
    stored["slalom"]["ars"] |= {"gone_m": 1.0}
    stored["slalom"]["afs"] = {"track_amplitude_m": 1.0}
    stored["parking"] = {"none": {"speed_end_mps": 0.0}}
    found = [(drift.maneuver, drift.controller, drift.metric, drift.new) for drift in drifts(driven(), stored)]
    assert found == [
        ("slalom", "ars", "gone_m", None),
        ("slalom", "afs", "track_amplitude_m", None),
        ("parking", "none", "speed_end_mps", None),
    ]
    assert len(drifts(driven(), {})) == 10


def test_a_baseline_is_read_as_it_was_written(tmp_path):
    path = write_baseline(driven(speed_loss_mps=math.nan), tmp_path / "baseline.json")
    assert json.loads(path.read_text())["slalom"]["ars"]["speed_loss_mps"] is None
    assert drifts(driven(speed_loss_mps=math.nan), read_baseline(path)) == []


@pytest.mark.parametrize("text", ["", "[1]", '{"slalom": 1}', '{"slalom": {"ars": {"x_m": "far"}}}'])
def test_a_damaged_baseline_is_an_error(tmp_path, text):
    path = tmp_path / "baseline.json"
    path.write_text(text)
    with raises(RecordingError, file=str(path)):
        read_baseline(path)


def test_the_shipped_baseline_has_every_key_metric_of_all_runs():
    stored = read_baseline()
    assert {name: list(systems) for name, systems in stored.items()} == {
        name: list(systems) for name, systems in benchmark.DRIVEN.items()
    }
    for systems in stored.values():
        assert all(len(metrics) == 10 for metrics in systems.values())


def test_the_summary_names_the_drift_and_the_search():
    text = benchmark.as_markdown(driven(), drifts(driven(), driven(cones_hit=0.0).key_metrics()))
    assert "1 of 10 key metrics drift" in text
    assert "- slalom, ars: cones hit 0 -> 2" in text
    assert "| times real time | - | 40 |" in text
    assert "Search of the steering amplitude 0.50 s" in text


def test_the_command_ends_with_1_and_tells_old_new_and_tolerance(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(benchmark, "bench_maneuvers", lambda: driven(cones_hit=1.0))
    monkeypatch.setattr(benchmark, "read_baseline", lambda: driven().key_metrics())
    summary = tmp_path / "summary.md"
    assert main(["bench", "--maneuvers", "--json", "-o", str(summary)]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["drifts"] == [
        {"maneuver": "slalom", "controller": "ars", "metric": "cones_hit", "old": 2.0, "new": 1.0, "tolerance": 0.0}
    ]
    assert told["runs"][0]["real_time_factor"] == 40.0
    assert "1 of 10 key metrics drift" in summary.read_text()


@pytest.mark.parametrize(
    ("words", "key"),
    [(["--renew"], "--renew"), (["-o", "x.md"], "--output"), (["--maneuvers", "--rounds", "2"], "--rounds")],
)
def test_an_option_without_effect_is_refused(words, key, capsys):
    assert main(["bench", *words]) == 1
    assert key in capsys.readouterr().err
