"""Factors: valid tables, and their values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from activesteer.config import Source
from activesteer.errors import StudyError
from activesteer.studies.engine.factors import Factor, read_factor

SOURCE = Source("study.toml", error=StudyError)
UNIT = (np.arange(20000) + 0.5) / 20000


def factor(**table: object) -> Factor:
    return read_factor("road.mu", table, SOURCE)


@pytest.mark.parametrize(
    ("table", "distribution"),
    [
        ({"uniform": [0.8, 1.0]}, stats.uniform(0.8, 0.2)),
        ({"log_uniform": [0.1, 10]}, stats.loguniform(0.1, 10)),
        ({"normal": [1.0, 0.2], "truncate": [0.9, 1.5]}, stats.truncnorm(-0.5, 2.5, loc=1.0, scale=0.2)),
        ({"normal": [5, 2]}, stats.truncnorm(-3, 3, loc=5, scale=2)),
    ],
)
def test_a_sample_has_its_distribution(table, distribution):
    found = np.array(factor(**table).from_unit(UNIT))
    assert found == pytest.approx(distribution.ppf(UNIT), rel=1e-6)
    assert stats.kstest(found, distribution.cdf).pvalue > 0.99


def test_a_choice_keeps_its_weights():
    found = factor(choice=["a", "b", "c"], weights=[1, 2, 1]).from_unit(UNIT)
    assert [found.count(value) for value in "abc"] == [5000, 10000, 5000]


@pytest.mark.parametrize("unit", [0.0, 1.0])
def test_the_ends_of_the_unit_interval_are_values_too(unit):
    ends = np.array([unit])
    for table in ({"uniform": [1, 2]}, {"normal": [0, 1]}, {"choice": [1, 2]}, {"log_uniform": [1, 2]}):
        made = factor(**table)
        [value] = made.from_unit(ends)
        assert min(abs(value - end) for end in made.extremes) < 1e-9


def test_a_factor_becomes_the_table_that_it_came_from():
    for table in (
        {"grid": [1, 2.5]}, {"choice": ["a", "b"], "weights": [1.0, 3.0]}, {"uniform": [0.0, 1.0]},
        {"normal": [1.0, 0.1], "truncate": [0.8, 1.2]},
        {"uniform": [-0.1, 0.1], "nominal": "plus", "maneuvers": ["slalom"]},
    ):  # fmt: skip
        assert factor(**table).to_table() == table


@pytest.mark.parametrize(
    "table",
    [
        {}, {"gird": [1, 2]}, {"grid": []}, {"grid": 3}, {"grid": "abc"}, {"grid": [1, 1]}, {"uniform": [1]},
        {"uniform": [2, 1]}, {"uniform": [1, 1]}, {"uniform": ["a", "b"]}, {"uniform": [0, float("inf")]},
        {"uniform": [True, False]}, {"log_uniform": [0, 1]}, {"normal": [0, 0]}, {"normal": [0, -1]},
        {"normal": [0, 1], "truncate": [2, 1]}, {"normal": [0, 1], "truncate": [100, 101]},
        {"uniform": [0, 1], "truncate": [0, 1]}, {"uniform": [0, 1], "grid": [1]}, {"choice": [1, 2], "weights": [1]},
        {"choice": [1, 2], "weights": [0, 0]}, {"choice": [1, 2], "weights": [1, -1]},
        {"choice": [1, [2]]}, {"grid": [1, {"a": 1}]}, {"grid": [1, float("nan")]}, {"uniform": [0, 10**400]},
        {"normal": [10**400, 1]},
    ],
)  # fmt: skip
def test_a_wrong_table_is_refused_with_its_key(table):
    with pytest.raises(StudyError) as caught:
        factor(**table)
    assert caught.value.key is not None
    assert caught.value.key.startswith("factors.road.mu")
