"""The table of metrics: display units, one column for each run."""

from __future__ import annotations

import math

from activesteer.analysis import step_response
from activesteer.analysis.tables import comparison
from tests.unit.analysis.synthetic import step_steer


def test_values_stand_under_their_run():
    text = comparison({"none": {"roll_peak_rad": math.radians(2.0)}, "ars": {"roll_peak_rad": math.radians(-1.5)}})
    head, row = text.splitlines()
    assert head.split() == ["none", "ars"]
    assert row.split() == ["roll", "peak", "deg", "2.000", "-1.500"]
    for label, value in (("none", "2.000"), ("ars", "-1.500")):
        assert head.index(label) + len(label) == row.index(value) + len(value)


def test_what_does_not_exist_is_a_dash_and_what_is_missing_a_blank():
    text = comparison({"a": {"ay_lag_s": math.nan, "step_time_s": 1.0}, "b": {"ay_lag_s": 2.0}})
    _, first, second = text.splitlines()
    assert first.split() == ["lateral", "acceleration", "lag", "s", "-", "2.000"]
    assert second.split() == ["step", "time", "s", "1.000"]


def test_table_of_real_metrics_has_a_line_for_each():
    values = step_response.step_response_metrics(step_steer())
    assert len(comparison({"none": values}).splitlines()) == len(values) + 1


def test_a_car_that_has_turned_round_has_lost_metrics_but_its_verdicts_remain():
    spun = {"sideslip_peak_abs_rad": math.pi, "ay_rms_mps2": 3.0, "stays_in_lanes": 0.0, "steering_wheel_rms_rad": 1.0}
    fine = {**spun, "sideslip_peak_abs_rad": 0.5, "stays_in_lanes": 1.0}
    rows = {line.split()[0]: line.split()[-2:] for line in comparison({"none": spun, "ars": fine}).splitlines()[1:]}
    assert rows["sideslip"] == ["lost", "28.648"]
    assert rows["lateral"] == ["lost", "3.000"]
    assert rows["stays"] == ["no", "yes"]
    assert rows["steering"] == ["57.296", "57.296"]


def test_a_friction_utilisation_above_1_is_explained():
    assert "combined slip" in comparison({"none": {"friction_utilisation_max": 1.06}}).splitlines()[-1]
    assert len(comparison({"none": {"friction_utilisation_max": 0.9}}).splitlines()) == 2
