"""The factor with the largest influence on an outcome."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tools.dependence import strongest

Factors = dict[str, NDArray[np.float64]]


@pytest.fixture
def factors(rng: np.random.Generator) -> Factors:
    return {name: rng.uniform(low, high, 400) for name, low, high in (("a", 0.9, 1.1), ("b", -50.0, 0.0), ("c", 0, 1))}


def test_a_threshold_is_found_with_its_direction(factors: Factors) -> None:
    found = strongest(factors, factors["b"] > -25.0)
    assert found is not None
    assert (found.factor, found.direction) == ("b", 1)
    less = strongest(factors, factors["a"] < 1.05)
    assert less is not None
    assert (less.factor, less.direction) == ("a", -1)


def test_a_line_explains_three_quarters_of_a_step_in_the_middle() -> None:
    even = np.linspace(-1.0, 1.0, 2000)
    found = strongest({"even": even}, even > 0.0)
    assert found is not None
    assert found.explained == pytest.approx(0.75, abs=1e-3)


def test_a_best_middle_is_found(factors: Factors) -> None:
    found = strongest(factors, np.abs(factors["c"] - 0.5) < 0.2)
    assert found is not None
    assert (found.factor, found.direction) == ("c", 0)


def test_the_stronger_of_two_is_named(factors: Factors) -> None:
    found = strongest(factors, 3.0 * (factors["c"] - 0.5) + (factors["b"] + 25.0) / 50.0 > 0.0)
    assert found is not None
    assert found.factor == "c"


def test_chance_names_a_factor_in_one_of_twenty_cases_at_most(rng: np.random.Generator) -> None:
    named = 0
    for _ in range(200):
        columns = {name: rng.random(100) for name in "abcde"}
        named += strongest(columns, rng.random(100) < 0.3) is not None
    # 10 are expected of 200; 21 and more in less than one case of a thousand.
    assert named <= 20


@pytest.mark.parametrize("number", [0, 1, 400])
def test_nothing_depends_where_nothing_differs(factors: Factors, number: int) -> None:
    assert strongest({key: values[:number] for key, values in factors.items()}, [True] * number) is None


def test_a_factor_that_is_not_varied_explains_nothing(factors: Factors) -> None:
    outcome = factors["b"] > -20.0
    assert strongest({**factors, "d": np.ones(400)}, outcome) == strongest(factors, outcome)


def test_too_few_samples_allow_no_answer(factors: Factors) -> None:
    few = {key: values[:12] for key, values in factors.items()}
    assert strongest(few, few["b"] > -25.0) is None
