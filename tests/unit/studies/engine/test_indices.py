"""Indices of a metric that is a known function of its factors."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.studies.engine.analysis import indices
from activesteer.studies.engine.design import draw
from activesteer.studies.engine.factors import Factor

pytest.importorskip("SALib")
WIDE = Factor(uniform=(1.0, 3.0), key="wide")
NARROW = Factor(uniform=(0.0, 1.0), key="narrow")
IDLE = Factor(uniform=(5.0, 6.0), key="idle")
FACTORS = [WIDE, NARROW, IDLE]


def found(kind, samples, factors=FACTORS, rows=None):
    """Return name and value of each index of 3 wide + narrow, by factor."""
    columns = {key: values[:rows] for key, values in draw(factors, kind, samples, 1).columns.items()}
    values = 3.0 * np.array(columns["wide"]) + np.array(columns["narrow"])
    return {(index.factor, index.name): index.value for index in indices(kind, factors, columns, values)}


def test_morris_effects_of_a_plane_are_its_slopes_over_the_ranges():
    assert found("morris", 10) == pytest.approx(
        {("wide", "mu*"): 6.0, ("narrow", "mu*"): 1.0, ("idle", "mu*"): 0.0}, abs=1e-9
    )


def test_sobol_indices_of_a_sum_are_the_parts_of_its_variance():
    expected = {"wide": 36.0 / 37.0, "narrow": 1.0 / 37.0, "idle": 0.0}
    for (factor, _), value in found("saltelli", 256).items():
        assert value == pytest.approx(expected[factor], abs=0.05)


def test_any_sample_of_42_runs_gives_first_order_indices_and_a_smaller_one_none():
    expected = {"wide": 36.0 / 37.0, "narrow": 1.0 / 37.0, "idle": 0.0}
    values = found("latin_hypercube", 400)
    assert {name for _, name in values} == {"S1"}
    for (factor, _), value in values.items():
        assert value == pytest.approx(expected[factor], abs=0.15)
    assert found("latin_hypercube", 42)
    assert found("latin_hypercube", 41) == {}


@pytest.mark.parametrize(("kind", "samples", "rows"), [("saltelli", 64, 64 * 5 - 7), ("morris", 10, 38)])
def test_runs_of_an_unfinished_block_are_left_out(kind, samples, rows):
    values = found(kind, samples, rows=rows)
    assert max(values, key=lambda key: values[key])[0] == "wide"
    assert len(values) == (6 if kind == "saltelli" else 3)
