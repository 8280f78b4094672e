"""Tables of a K&C rig: names, units, signs and sides of a laboratory, hysteresis, and impossible values."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer.errors import ParameterError
from activesteer.vehicle_builder import new_vehicle
from activesteer.vehicle_builder.kc_tables import KcTables, Samples, check_signs, read_kc, smoothed, unusual
from tests.raising import raises
from tests.unit.vehicle_builder.tables import COMPACT

TRAVEL_MM = np.linspace(-60.0, 60.0, 25)


def write(folder: Path, name: str, columns: dict[str, np.ndarray]) -> None:
    rows = [",".join(f"{value:.8g}" for value in row) for row in np.array(list(columns.values())).T]
    (folder / f"{name}.csv").write_text("\n".join([",".join(columns), *rows]), encoding="utf-8")


def axle(folder: Path, **changes: np.ndarray) -> KcTables:
    columns = {
        "left_travel [mm]": TRAVEL_MM, "left_toe [min]": -0.3 * TRAVEL_MM, "left_camber [deg]": -0.5 - 0.02 * TRAVEL_MM,
    }  # fmt: skip
    write(folder, "rear_parallel_travel", columns | changes)
    return read_kc(folder, ["rear"])


def test_units_become_si(tmp_path: Path) -> None:
    samples = axle(tmp_path).tests["rear"]["parallel_travel"]
    assert samples.x[-1] == pytest.approx(0.06)
    assert np.degrees(samples.channels["toe"][-1]) == pytest.approx(-0.3)


def test_names_and_signs_of_a_laboratory_are_translated(tmp_path: Path) -> None:
    write(tmp_path, "rear_parallel_travel", {"Z_L": TRAVEL_MM, "Delta_L": 0.005 * TRAVEL_MM, "Gamma_L": TRAVEL_MM})
    names = '"Z_L" = "left_travel [mm]"\n"Delta_L" = "left_toe [deg]"\n"Gamma_L" = "left_camber [min]"\n'
    (tmp_path / "names.toml").write_text(f"[names]\n{names}[signs]\ntoe = -1\n", encoding="utf-8")
    samples = read_kc(tmp_path, ["rear"]).tests["rear"]["parallel_travel"]
    assert np.degrees(samples.channels["toe"][-1]) == pytest.approx(-0.3)


def test_the_right_wheel_is_the_left_one_in_a_mirror(tmp_path: Path) -> None:
    """A force to the left pushes the left wheel outwards and the right wheel inwards."""
    axle(tmp_path)
    force = np.linspace(-3000.0, 3000.0, 13)
    sides = {"left_centre_outwards [mm]": 1e-4 * force, "right_centre_outwards [mm]": -1e-4 * force}
    write(tmp_path, "rear_side_force", {"force [N]": force, **sides})
    samples = read_kc(tmp_path, ["rear"]).tests["rear"]["side_force"]
    np.testing.assert_allclose(samples.channels["centre_outwards"], 1e-7 * samples.x, atol=1e-12)


def test_the_middle_of_a_hysteresis_loop_is_found() -> None:
    x = np.concatenate([np.linspace(-1.0, 1.0, 101), np.linspace(1.0, -1.0, 101)])
    y = x**3 + 0.1 * np.sign(np.concatenate([np.ones(101), -np.ones(101)]))
    at = np.linspace(-0.95, 0.95, 20)
    np.testing.assert_allclose(smoothed(x, y, at), at**3, atol=1e-3)


def test_samples_that_lie_close_together_at_one_place_are_smoothed() -> None:
    x = np.concatenate([[-1.0, -0.5], np.linspace(0.99, 1.0, 9)])
    np.testing.assert_allclose(smoothed(x, 2.0 * x, np.linspace(-1.0, 1.0, 5)), np.linspace(-2.0, 2.0, 5), atol=1e-9)


def test_a_column_without_unit_or_side_is_an_error(tmp_path: Path) -> None:
    with raises(ParameterError, key="toe [deg]"):
        axle(tmp_path, **{"toe [deg]": TRAVEL_MM})
    with raises(ParameterError, key="left_caster"):
        axle(tmp_path, **{"left_caster": TRAVEL_MM})


@pytest.mark.parametrize(
    ("name", "text", "fields"),
    [
        ("rear_parallel_travel.csv", "", {"file": "rear_parallel_travel.csv"}),
        ("rear_parallel_travel.csv", "# nothing\n", {"file": "rear_parallel_travel.csv"}),
        (
            "rear_side_force.csv",
            "force [N],left_toe [deg],left_toe [deg]\n1,2,3\n",
            {"key": "left_toe [deg]", "line": 1},
        ),
        ("rear_side_force.csv", "force [N],left_toe [deg]\n1,0\n2,NaN\n", {"key": "left_toe [deg]", "line": 3}),
        ("rear_side_force.csv", "force [N],left_toe [deg]\n1,0\n2,off\n", {"key": "left_toe [deg]", "line": 3}),
        ("rear_side_force.csv", "force [kN],left_toe [deg]\n-3000,0\n3000,0\n", {"key": "force [kN]"}),
        ("rear_side_force.csv", "force [N],left_toe [deg]\n-3000,1e30\n3000,0\n", {"key": "left_toe [deg]"}),
        ("rear_side_force.csv", "force [N],left_toe [deg]\n" + 3 * "-3000,0\n3000,0\n", {"key": "force"}),
        (
            "rear_side_force.csv",
            "force [N],left_toe [deg]\n" + "".join(f"{f}e-9,0\n" for f in range(-3, 4)),
            {"key": "force"},
        ),
        ("rear_sideforce.csv", "", {"file": "rear_sideforce.csv"}),
        (
            "rear_side_force.toml",
            f'"force [N]" = [-1.0, 1.0]\n"left_toe [deg]" = [0, {"9" * 400}]',
            {"key": "left_toe [deg]"},
        ),
        ("names.toml", "names = 3\n", {"key": "names"}),
        ("names.toml", "[names]\nZ_L = 3\n", {"key": "names.Z_L"}),
    ],
)
def test_a_damaged_table_is_an_error_that_says_where(
    tmp_path: Path, name: str, text: str, fields: dict[str, Any]
) -> None:
    axle(tmp_path)
    (tmp_path / name).write_text(text, encoding="utf-8")
    with raises(ParameterError, **fields):
        read_kc(tmp_path, ["rear"])


def test_semicolons_and_decimal_commas_are_read(tmp_path: Path) -> None:
    wanted = axle(tmp_path).tests["rear"]["parallel_travel"]
    file = tmp_path / "rear_parallel_travel.csv"
    file.write_text(file.read_text(encoding="utf-8").replace(",", ";").replace(".", ","), encoding="utf-8")
    read = read_kc(tmp_path, ["rear"]).tests["rear"]["parallel_travel"]
    np.testing.assert_array_equal([read.x, *read.channels.values()], [wanted.x, *wanted.channels.values()])


def test_what_goes_against_the_force_is_an_error() -> None:
    force = np.linspace(-3000.0, 3000.0, 13)
    with raises(ParameterError, key="toe"):
        check_signs({"aligning_moment": Samples(force / 20.0, {"toe": 1e-4 * force}, "rear_aligning_moment.csv")})


def test_toe_out_in_bump_at_the_rear_is_asked_about(tmp_path: Path) -> None:
    questions = list(unusual("rear", axle(tmp_path).tests["rear"]))
    assert len(questions) == 1
    assert "toe-out in bump at the rear" in questions[0]


def test_measurements_without_an_axle_for_them_are_an_error(tmp_path: Path) -> None:
    with raises(ParameterError, key="--kc", value=tmp_path):
        new_vehicle("mine", COMPACT, tmp_path / "mine", kc=tmp_path)
