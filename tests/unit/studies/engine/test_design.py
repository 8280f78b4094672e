"""Designs: the driven combinations of values."""

from __future__ import annotations

import numpy as np
import pytest

from activesteer.errors import StudyError
from activesteer.studies.engine.design import MAX_SAMPLES, draw, read_cases
from activesteer.studies.engine.factors import Factor
from activesteer.studies.engine.study_file import read_study
from tests.raising import raises

SPEED = Factor(grid=(70.0, 80.0, 90.0), key="speed_kmh")
DRIVE = Factor(grid=("hold", "coast"), key="drive")
MU = Factor(uniform=(0.8, 1.0), key="road.mu")
MASS = Factor(uniform=(0.0, 1.0), key="mass")


def test_a_grid_holds_every_combination_once():
    found = draw([SPEED, DRIVE], "grid", 0, 0)
    assert len(found) == 6
    assert {tuple(found[i].values()) for i in range(6)} == {(v, d) for v in SPEED.values for d in DRIVE.values}


def test_every_value_of_a_grid_meets_the_same_sample():
    found = draw([SPEED, MU], "sobol", 8, 1)
    assert len(found) == 24
    columns = np.reshape(found.columns["road.mu"], (3, 8))
    assert (columns == columns[0]).all()
    assert np.unique(columns[0]).size == 8


GRID = {"grid": list(range(1, 101))}
HUGE = [
    ({f"factors.{name}": GRID for name in ("mass", "inertia", "stiffness", "damping", "grip")}, {}, 100**5),
    ({"a": GRID, "b": GRID, "road.mu": {"uniform": [0.8, 1.0]}}, {"samples": 1001}, 100 * 100 * 1001),
    ({"a": {"uniform": [0.0, 1.0]}}, {"kind": "saltelli", "samples": 2**22}, 3 * 2**22),
]


@pytest.mark.parametrize(("factors", "design", "count"), HUGE)
def test_too_many_combinations_are_refused_before_one_is_made(monkeypatch, factors, design, count):
    monkeypatch.setattr("activesteer.studies.engine.study_file.draw", lambda *_: pytest.fail("drawn"))
    with raises(StudyError, key="design", value=count, allowed=MAX_SAMPLES) as refused:
        read_study({"maneuvers": ["step_steer"], "factors": factors, "design": design})
    assert f"= {count} combinations; at most {MAX_SAMPLES}" in str(refused.value)


@pytest.mark.parametrize("kind", ["sobol", "latin_hypercube"])
def test_a_stratified_sample_has_one_point_in_every_stratum(kind):
    found = draw([MU, MASS], kind, 64, 3)
    for key, factor in (("road.mu", MU), ("mass", MASS)):
        unit = (np.array(found.columns[key]) - factor.low) / (factor.high - factor.low)
        assert sorted((unit * 64).astype(int)) == list(range(64))


@pytest.mark.parametrize("kind", ["sobol", "latin_hypercube", "random", "saltelli", "morris"])
def test_the_seed_and_nothing_else_decides_a_sample(kind):
    first, again, other = (draw([MU, MASS], kind, 16, seed).columns for seed in (1, 1, 2))
    assert first == again
    assert first != other


def test_a_sample_that_is_no_power_of_two_has_its_size():
    assert len(draw([MU, MASS], "sobol", 5, 1)) == 5


def test_designs_for_indices_have_the_sizes_that_their_methods_need():
    assert len(draw([MU, MASS], "saltelli", 16, 1)) == 16 * (2 + 2)
    assert len(draw([MU, MASS], "morris", 10, 1)) == 10 * (2 + 1)


def test_samples_of_controllers_that_are_not_paired_differ():
    table = {
        "maneuvers": ["step_steer"], "controllers": ["none", "ars"], "factors": {"road.mu": {"uniform": [0.8, 1.0]}},
        "design": {"samples": 8, "paired": False},
    }  # fmt: skip
    first, second = read_study(table).samples()
    assert not set(first.columns["road.mu"]) & set(second.columns["road.mu"])
    table["design"] = {"samples": 8}
    assert len(read_study(table).samples()) == 1


def test_cases_come_from_a_csv_file(tmp_path):
    path = tmp_path / "cases.csv"
    path.write_text("road.mu,speed_kmh,drive\n0.9,80,coast\n1,,hold\n")
    found = read_cases(path)
    assert [found[0], found[1]] == [
        {"road.mu": 0.9, "speed_kmh": 80, "drive": "coast"}, {"road.mu": 1, "drive": "hold"},
    ]  # fmt: skip


def test_cases_may_come_from_a_spreadsheet_and_a_row_of_empty_cells_is_the_usual_run(tmp_path):
    path = tmp_path / "cases.csv"
    path.write_bytes("\ufeffroad.mu;speed_kmh\r\n0,5;80\r\n;\r\n".encode())
    assert read_cases(path).columns == {"road.mu": [0.5, None], "speed_kmh": [80, None]}


@pytest.mark.parametrize("cell", ["[" * 3000 + "]" * 3000, "9" * 6000, "x" * 200_000])
def test_cell_that_no_value_can_be_is_answered_with_file_and_line(tmp_path, cell):
    path = tmp_path / "cases.csv"
    path.write_text(f'road.mu,title\n1,"{cell}"\n')
    with raises(StudyError, file="cases.csv", line=2) as told:
        read_cases(path)
    assert len(str(told.value)) < 500


@pytest.mark.parametrize(
    ("text", "line"), [("", None), ("road.mu\n", None), ("a,a\n1,2\n", 1), ("a,b\n1\n", 2), (",b\n1,2\n", 1)]
)
def test_a_csv_file_without_cases_is_refused(tmp_path, text, line):
    (tmp_path / "cases.csv").write_text(text)
    with raises(StudyError, file="cases.csv", line=line):
        read_cases(tmp_path / "cases.csv")


@pytest.mark.parametrize(
    "parts",
    [
        {"factors": {"road.mu": {"uniform": [0.8, 1.0]}}},  # without a size
        {"factors": {"road.mu": {"grid": [0.8, 1.0]}}, "design": {"samples": 8}},
        {"factors": {"road.mu": {"grid": [0.8, 1.0]}}, "design": {"kind": "sobol", "samples": 8}},
        {"factors": {"road.mu": {"uniform": [0.8, 1.0]}}, "design": {"kind": "grid"}},
        {"factors": {"road.mu": {"uniform": [0.8, 1.0]}}, "design": {"kind": "sobl", "samples": 8}},
        {"factors": {"road.mu": {"uniform": [0.8, 1.0]}}, "design": {"kind": "saltelli", "samples": 9}},
        {"factors": {"road.mu": {"uniform": [0.8, 1.0]}}, "design": {"samples": 0}},
        {"factors": {"road.mu": {"uniform": [0.8, 1.0]}}, "design": {"samples": 8, "cases": [{"road.mu": 1.0}]}},
        {
            "factors": {"road.mu": {"uniform": [0.8, 1.0]}, "speed_kmh": {"grid": [70, 80]}},
            "design": {"kind": "morris", "samples": 8},
        },
        {"design": {"kind": "list"}},
        {"design": {"cases": []}},
        {"design": {"cases": "nowhere.csv"}},
    ],
)
def test_what_does_not_belong_together_is_refused(parts):
    with raises(StudyError) as refused:
        read_study({"maneuvers": ["step_steer"], **parts})
    assert refused.value.key.split(".")[0] in ("design", "factors")
