"""The key results against a stored baseline: a result that changes is renewed on purpose (tools/renew_baseline.py)."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from activesteer.recording import Recording
from tools.renew_baseline import differences, key_metrics

BASELINE = Path(__file__).parent / "baseline.json"


def test_no_result_has_changed_unnoticed(runs: dict[str, dict[str, Recording]]) -> None:
    stored = json.loads(BASELINE.read_text(encoding="utf-8"))
    changed = differences(stored, key_metrics(runs))
    assert not changed, "renew with tools/renew_baseline.py and enter it under 'Results changed':\n" + "\n".join(
        changed
    )


def test_a_changed_and_a_missing_value_are_noticed() -> None:
    stored = {"slalom ars": {"ay_peak_abs_mps2": 7.0, "yaw_rate_rms_radps": 0.2}}
    assert differences(stored, stored) == []
    [line] = differences(stored, {"slalom ars": {"ay_peak_abs_mps2": 7.2, "yaw_rate_rms_radps": 0.2}})
    assert "slalom ars: ay_peak_abs_mps2: 7 -> 7.2" in line
    [line] = differences(stored, {"slalom ars": {"ay_peak_abs_mps2": 7.0}})
    assert "yaw_rate_rms_radps" in line


@pytest.mark.parametrize("value", [math.nan, 1.0])
def test_a_value_that_appears_or_vanishes_is_noticed(value: float) -> None:
    other = 1.0 if math.isnan(value) else math.nan
    assert differences({"a b": {"x_m": value}}, {"a b": {"x_m": other}})
