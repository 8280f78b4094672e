"""`activesteer compare FOLDER` and `fit FOLDER`."""

from __future__ import annotations

from pathlib import Path

import pytest


def test_a_new_folder_is_made_once(call, tmp_path: Path) -> None:
    assert "validation.toml" in call("compare", "--new", "mine").out
    told = call("compare", "--new", "mine")
    assert told.status == 1
    assert "is not empty" in told.err


@pytest.mark.slow
def test_the_example_is_predicted_and_fitted(call) -> None:
    call("compare", "--new", "mine")
    predicted = call("compare", "mine", "--json", "--jobs", "1").json
    assert predicted["fitted"] is None
    assert {row["stage"] for row in predicted["quantities"]} == {"predicted"}
    told = call("fit", "mine", "-o", "page", "--jobs", "1")
    assert told.status == 0
    assert Path("page/page.html").stat().st_size > 10_000
    # The front tyres of the example are 10 % softer than those of the car.
    assert "factors.front_cornering_stiffness" in told.out
