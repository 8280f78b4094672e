"""The baseline detects each key metric that drifts, appears or vanishes."""

from __future__ import annotations

import json
import math

import pytest

from activesteer.analysis.metrics import KEY_METRICS
from activesteer.errors import RecordingError
from tests.raising import raises
from tools import baseline
from tools.baseline import drifts, read_baseline, tolerance_of, write_baseline

RUN = "slalom", "ars"


def driven(**changed: float) -> dict[tuple[str, str], dict[str, float]]:
    """Return a slalom whose key metrics are all 2, except for the changed ones."""
    return {RUN: dict.fromkeys(KEY_METRICS["slalom"], 2.0) | changed}


def test_unchanged_metrics_do_not_drift():
    assert drifts(driven(), driven()) == []


@pytest.mark.parametrize(("value", "found"), [(2.019, 0), (2.021, 1), (1.981, 0), (1.979, 1)])
def test_a_drift_begins_at_one_per_cent(value, found):
    assert len(drifts(driven(track_amplitude_m=value), driven())) == found


def test_the_tolerance_of_a_key_metric_grows_with_its_value():
    assert tolerance_of("ay_peak_abs_mps2", 0.5) == 0.02
    assert tolerance_of("ay_peak_abs_mps2", -8.0) == pytest.approx(0.08)
    assert tolerance_of("cones_hit", 300.0) == 0.0


def test_a_count_has_no_tolerance():
    [drift] = drifts(driven(cones_hit=3.0), driven())
    assert (drift.metric, drift.old, drift.new, drift.tolerance) == ("cones_hit", 2.0, 3.0, 0.0)
    assert str(drift).startswith("slalom, ars: cones hit 2 -> 3 (tolerance 0")


def test_a_drift_is_told_in_display_units():
    [drift] = drifts(driven(sideslip_peak_abs_rad=math.radians(90.0)), driven())
    assert "largest sideslip angle 114.592 -> 90.000 (tolerance 1.15 deg)" in str(drift)


@pytest.mark.parametrize("value", [math.nan, 1.0])
def test_a_value_that_becomes_or_ceases_to_be_undefined_drifts(value):
    other = 1.0 if math.isnan(value) else math.nan
    [drift] = drifts(driven(speed_loss_mps=value), driven(speed_loss_mps=other))
    assert drift.metric == "speed_loss_mps"


def test_undefined_on_both_sides_is_unchanged():
    assert drifts(driven(speed_loss_mps=math.nan), driven(speed_loss_mps=math.nan)) == []


def test_a_metric_a_controller_or_a_manoeuvre_that_only_one_side_has_drifts():
    stored = driven(gone_m=1.0) | {("slalom", "afs"): {"track_amplitude_m": 1.0}}
    stored["parking", "none"] = {"speed_end_mps": 0.0}
    found = [(*drift.run, drift.metric, drift.new) for drift in drifts(driven(), stored)]
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


def test_the_stored_baseline_has_every_key_metric_of_all_runs():
    stored = read_baseline()
    assert list(stored) == [(name, system) for name, systems in baseline.DRIVEN.items() for system in systems]
    assert all(len(metrics) == 10 for metrics in stored.values())
