"""Tables: both formats, and all errors at once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from activesteer.errors import ParameterError
from activesteer.vehicle_builder import new_vehicle
from activesteer.vehicle_builder.table import check_points, chosen_kinds, in_vehicle_axes, read_table
from tests.raising import raises
from tests.unit.vehicle_builder.tables import COMPACT, WISHBONE, changed


def problems(path: Path) -> str:
    table, source = read_table(path)
    with pytest.raises(ParameterError) as caught:
        check_points(table, chosen_kinds(table), source)
    return str(caught.value)


def test_csv_and_toml_say_the_same(tmp_path: Path) -> None:
    rows = tmp_path / "rows.csv"
    rows.write_text(
        "name,x,y,z\nunits,mm\nfront.wheel_centre, 0, 762.5, 297.2  # a point\nfront.spring_rate_Npm, 24200\n"
        'front.links.tie_rod.stiffness_Npm, 1e6\nmass.inertia_kgm2, 530, 2100, 2200\nsource, "here, there"\n'
    )
    keys = tmp_path / "keys.toml"
    keys.write_text(
        'units = "mm"\nsource = "here, there"\n[front]\nspring_rate_Npm = 24200\n[front.points]\n'
        "wheel_centre = [0, 762.5, 297.2]\n"
        "[front.links.tie_rod]\nstiffness_Npm = 1e6\n[mass]\ninertia_kgm2 = [530, 2100, 2200]\n"
    )
    assert read_table(rows)[0] == read_table(keys)[0]


def test_points_are_moved_to_metres_and_to_the_origin(tmp_path: Path) -> None:
    path = tmp_path / "moved.csv"
    path.write_text(
        "units, mm\norigin, 1388, 0, -200\nfront.wheel_centre, 1388, 798, 130\nmass.chassis_cg, 0, 0, 200\n"
    )
    table = in_vehicle_axes(read_table(path)[0])
    assert table.front.points["wheel_centre"] == pytest.approx((0.0, 0.798, 0.330))
    assert table.mass.chassis_cg == pytest.approx((-1.388, 0.0, 0.4))


def test_unknown_points_name_the_nearest_and_all_missing_ones_are_listed_at_once(tmp_path: Path) -> None:
    path = changed(
        COMPACT, tmp_path, ("lca_rear_inner =", "lca_reer_inner ="), ("strut_top =", "# "), ("toe_link_outer =", "# ")
    )
    told = problems(path)
    assert "front.points.lca_reer_inner: a mcpherson axle has no such point; did you mean 'lca_rear_inner'" in told
    assert "front.points: a mcpherson axle also needs strut_top, lca_rear_inner" in told
    assert "rear.points: a five_link axle also needs toe_link_outer" in told


def test_points_in_millimetres_where_metres_are_stated(tmp_path: Path) -> None:
    told = problems(changed(COMPACT, tmp_path, ('units = "mm"', 'units = "m"')))
    assert 'are all in mm? then write units = "mm"' in told


def test_a_toml_table_with_the_ending_of_a_csv_file_is_told_its_ending(tmp_path: Path) -> None:
    path = tmp_path / "mine.csv"
    path.write_text('# my car\nunits = "mm"\n')
    with raises(ParameterError, file="mine.csv", line=2) as caught:
        read_table(path)
    assert "needs the ending .toml" in str(caught.value)
    path.write_text("units\n")
    with raises(ParameterError, file="mine.csv", line=1, key="units") as caught:
        read_table(path)
    assert "a line of a .csv file is KEY, VALUE" in str(caught.value)
    assert ".toml" not in str(caught.value)


def test_one_point_in_millimetres_is_named(tmp_path: Path) -> None:
    path = tmp_path / "one.csv"
    text = WISHBONE.read_text().replace("units, mm", "units, m")
    lines = []
    for line in text.splitlines():
        cells = line.split(",")
        if line.startswith(("front.", "rear.")) and len(cells) == 4 and "uca_outer" not in line:
            cells[1:] = [str(float(cell) / 1e3) for cell in cells[1:]]
        lines.append(",".join(cells) if not line.startswith("#") else line)
    path.write_text("\n".join(lines))
    told = problems(path)
    assert "front.points.uca_outer" in told
    assert "are these in mm?" in told


def test_metres_where_millimetres_are_stated(tmp_path: Path) -> None:
    path = tmp_path / "small.csv"
    path.write_text("units, mm\nfront.wheel_centre, 0, 0.762, 0.297\n")
    assert "are they in m?" in problems(path)


def test_points_of_the_right_side_are_named_in_one_line(tmp_path: Path) -> None:
    old = next(line for line in COMPACT.read_text().splitlines() if line.startswith("tie_rod_outer"))
    told = problems(changed(COMPACT, tmp_path, (old, old.replace("[", "[0.0, -1.0, 2.0]  # ", 1))))
    assert ": 1 error: front.points.tie_rod_outer: not on the left side, where y is above 0 mm; y of front" in told
    table, source = read_table(COMPACT)
    moved = replace(table, origin=(0.0, 700.0, 0.0))
    with pytest.raises(ParameterError, match=r": 1 error: .* and \d+ more: not on the left side, .* above 700 mm"):
        check_points(moved, chosen_kinds(moved), source)


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ("spring_rate_Npm = 24730", "spring_rate_Npm = 24.2", "is it in N/mm? then write 24200"),
        ("cg_height_m = 0.545", "cg_height_m = 545", "is it in mm? then write 0.545"),
        ("rack_limit_m = 0.064", "rack_limit_m = 0.0064", "is not a value of a road car"),
    ],
)
def test_other_units_are_recognised(tmp_path: Path, old: str, new: str, hint: str) -> None:
    told = problems(changed(COMPACT, tmp_path, (old, new)))
    assert hint in told
    assert ": 1 error: " in told


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            "spring_rate_Npm = 24730",
            "spring_rate_Npm = 24200\nwheel_rate_Npm = 24000",
            "have the same meaning; give one of them",
        ),
        ('spring_on = "knuckle"', 'spring_on = "spring_lnk"', "did you mean 'spring_link'"),
        ("total_kg = 1430", "", "total_kg (of the whole car) or chassis_kg is needed"),
        ("cg_height_m = 0.545", "", "with total_kg, front_fraction and cg_height_m are needed"),
        ("[front.links.tie_rod]", "[front.links.tierod]", "did you mean 'tie_rod'"),
        ("strut_top = [-87, 575, 860]", "strut_top = [-87, 575]", "front.points.strut_top: 2 numbers given"),
    ],
)
def test_contradictions_are_told(tmp_path: Path, old: str, new: str, told: str) -> None:
    assert told in problems(changed(COMPACT, tmp_path, (old, new)))


def test_unknown_keys_name_file_line_and_nearest(tmp_path: Path) -> None:
    with raises(ParameterError, file="compact.toml", key="front.spring_rte_Npm"):
        read_table(changed(COMPACT, tmp_path, ("spring_rate_Npm = 24730", "spring_rte_Npm = 24200")))
    with raises(ParameterError, file="wishbone.csv", key="mass.totl_kg"):
        read_table(changed(WISHBONE, tmp_path, ("mass.total_kg", "mass.totl_kg")))


def test_a_suspension_that_does_not_exist(tmp_path: Path) -> None:
    with raises(ParameterError, value="mcpherson"):
        new_vehicle("x", COMPACT, tmp_path / "x", rear="mcpherson")
    with raises(ParameterError, file=str(tmp_path / "table.xlsx")):
        new_vehicle("x", tmp_path / "table.xlsx", tmp_path / "x")


def test_another_origin_is_recognised_and_the_right_one_said(tmp_path: Path) -> None:
    path = changed(WISHBONE, tmp_path, ("units, mm", "units, mm\norigin, 500, 0, 0"))
    with raises(ParameterError, key="front.points.wheel_centre"):
        new_vehicle("x", path, tmp_path / "x")
