"""Findings for good cars, and for cars with one error."""

from __future__ import annotations

import functools
import re
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from activesteer.errors import ParameterError
from activesteer.vehicle_builder import CheckReport, check_vehicle, new_vehicle
from activesteer.vehicle_builder.check import Finding
from tests.raising import raises
from tests.unit.vehicle_builder.tables import COMPACT, WISHBONE, changed

Damage = Callable[..., CheckReport]


@functools.cache
def compact() -> CheckReport:
    return check_vehicle("compact")


@pytest.mark.parametrize(
    ("levels", "told"),
    [
        (("ok",), "0 errors, 0 warnings, 1 ok"),
        (("error", "warning", "ok"), "1 error, 1 warning, 1 ok"),
        (("error", "error", "warning", "warning"), "2 errors, 2 warnings, 0 ok"),
    ],
)
def test_the_last_line_counts_the_findings(levels, told):
    report = CheckReport("mine", tuple(Finding("parts", "one", level, "1") for level in levels))
    assert report.table().splitlines()[-1] == f"mine: {told}"


@pytest.fixture(scope="module")
def good() -> Path:
    """Folder of a good car."""
    return new_vehicle("car", COMPACT, Path(tempfile.mkdtemp()) / "car").folder


@pytest.fixture
def damaged(good: Path, tmp_path: Path) -> Damage:
    """Check a copy of the car with one text of a file replaced."""

    def check(file: str, *changes: tuple[str, str]) -> CheckReport:
        folder = tmp_path / "car"
        shutil.copytree(good, folder)
        text = (folder / file).read_text()
        for old, new in changes:
            text, count = re.subn(old, new, text)
            assert count > 0, old
        (folder / file).write_text(text)
        return check_vehicle(folder)

    return check


def test_the_compact_has_nothing_wrong() -> None:
    assert [finding for finding in compact().findings if finding.level != "ok"] == []
    assert len(compact().findings) > 60


def test_a_made_car_has_nothing_wrong_and_the_worked_example_says_what_the_check_says(tmp_path: Path) -> None:
    report = check_vehicle(new_vehicle("saloon", WISHBONE, tmp_path / "saloon").vehicle_file)
    assert [finding for finding in report.findings if finding.level != "ok"] == []
    page = (Path(__file__).resolve().parents[3] / "docs" / "own_car.md").read_text(encoding="utf-8")
    for what in ("front bump steer, + toe-in", "Ackermann share at 20 deg"):
        assert report[what].value in page
    assert report.table().splitlines()[-1] in page


def test_values_are_those_of_the_rig_and_of_the_standing_car() -> None:
    assert compact()["front wheel rate"].value == "23.97 N/mm"
    assert compact()["share of the weight at the front"].value == "58.97 %"
    assert compact()["rear wheel hop"].value == "14.03 Hz"


def test_every_line_that_is_not_ok_says_what_to_do(damaged: Damage) -> None:
    report = damaged("car.toml", (r"ratio = 15.814", "ratio = 12"))
    bad = [finding for finding in report.findings if finding.level != "ok"]
    assert [finding.what for finding in bad] == ["ratio in the vehicle file, compared with the measured ratio"]
    assert all(finding.advice for finding in bad)
    assert "activesteer" not in bad[0].value
    assert bad[0].advice in " ".join(report.table().split())


@pytest.mark.slow
def test_a_point_on_the_wrong_side(damaged: Damage) -> None:
    report = damaged("front_axle.xml", (r'("fl_lca_front_inner" pos="-0.015) 0.365', r"\1 -0.365"))
    assert report["points on the side of their wheel"].value == "no: fl_lca_front_inner"
    assert report["right side mirrors the left side"].level == "error"


@pytest.mark.slow
def test_one_side_edited_alone(damaged: Damage) -> None:
    report = damaged("front_axle.xml", (r'("fl_lca_front_inner" pos="-0.015 0.365) 0.2055', r"\1 0.2155"))
    assert report["points on the side of their wheel"].level == "ok"
    assert report["right side mirrors the left side"].value == "no: fl_lca_front_inner"
    assert report["left against right in travel"].level == "error"


@pytest.mark.slow
def test_inner_and_outer_point_exchanged(damaged: Damage) -> None:
    report = damaged(
        "rear_axle.xml",
        (r'(r[lr]_camber_link_inner" pos=")-2.7265 (-?)0.37 0.4615', r"\1-2.657 \g<2>0.665 0.47"),
        (r'(r[lr]_camber_link_outer" pos=")-2.657 (-?)0.665 0.47', r"\1-2.7265 \g<2>0.37 0.4615"),
    )
    assert report["inner ends further in than outer ends"].value == "no: rl_camber_link"


def test_links_that_pass_through_each_other(damaged: Damage) -> None:
    # The toe link's inner end behind the spring link's: the two cross.
    report = damaged(
        "rear_axle.xml", (r'(r[lr]_toe_link_inner" pos=")-2.525 (-?)0.36 0.233', r"\1-2.9 \g<2>0.36 0.2123")
    )
    assert report["links that cross"].level == "warning"
    assert "rl_spring_link and rl_toe_link" in report["links that cross"].value


def test_a_missing_sensor_and_actuator_are_both_named(damaged: Damage) -> None:
    report = damaged("car.xml", (r'<gyro name="cg_gyro" site="cg"/>', ""), (r'<motor name="rl_drive".*/>', ""))
    told = {finding.what: finding for finding in report.findings if finding.level == "error"}
    assert set(told) == {"sensor cg_gyro", "actuator rl_drive"}


def test_a_link_without_an_end_does_not_compile(damaged: Damage) -> None:
    report = damaged("rear_axle.xml", (r'<site name="rl_toe_link_inner".*/>', ""))
    assert report.count("error") == 1
    assert "rl_toe_link_inner" in report.findings[-1].advice


def test_two_links_that_do_the_same(damaged: Damage) -> None:
    report = damaged(
        "rear_axle.xml",
        (r'(r[lr]_trailing_upper_inner" pos=")-2.217 (-?)0.57 0.4535', r"\1-2.187 \g<2>0.6015 0.231"),
        (r'(r[lr]_trailing_upper_outer" pos=")-2.597 (-?)0.655 0.465', r"\1-2.577 \g<2>0.67 0.175"),
    )
    assert report["rear links hold the wheel"].level == "error"
    assert "2 degrees of freedom; exactly 1 is required" in report["rear links hold the wheel"].advice


@pytest.mark.slow
def test_springs_of_the_wrong_length(damaged: Damage) -> None:
    report = damaged("car.xml", (r'(stiffness="24730" springlength=)"0.160\d*"', r'\1"0.1465"'))
    finding = report["front wheel travel from the design position"]
    assert finding.level == "warning"
    assert float(finding.value.split()[0]) == pytest.approx(14.0, abs=1.0)


def test_a_rack_that_steers_the_wrong_way(damaged: Damage) -> None:
    report = damaged("car.xml", (r'axis="0 -1 0" range', 'axis="0 1 0" range'))
    assert report["left turn of the steering wheel steers left"].level == "error"
    assert report["steering ratio"].level == "error"


def test_a_damper_that_pushes(damaged: Damage) -> None:
    report = damaged("car.toml", (r"force_N = \[-1750", "force_N = [1750"))
    assert report["front damper resists its motion"].level == "error"


@pytest.mark.slow
def test_a_damper_of_absurd_force(damaged: Damage) -> None:
    report = damaged("car.toml", (r"(force_N = \[-1750.* 0(?:\.0)?), 60(?:\.0)?,", r"\1, 6e7,"))
    finding = report["front damper, steepest slope of its curve"]
    assert (finding.level, finding.value) == ("error", "1.2e+09 N s/m")
    assert report["rear damper, steepest slope of its curve"].level == "ok"


def test_bump_steer_of_a_tie_rod_at_the_wrong_height(tmp_path: Path) -> None:
    table = changed(
        WISHBONE, tmp_path, ("front.tie_rod_inner,   -200, 392,  320", "front.tie_rod_inner,   -200, 392,  296"),
        ("front.tie_rod_outer,   -150, 708,  296", "front.tie_rod_outer,   -150, 742,  296"),
    )  # fmt: skip
    report = check_vehicle(new_vehicle("raw", table, tmp_path / "raw").folder)
    bad = {finding.what for finding in report.findings if finding.level != "ok"}
    assert bad == {"front bump steer, + toe-in", "Ackermann share at 20 deg"}
    assert report.count("error") == 0


@pytest.mark.slow
def test_a_tyre_that_is_too_small(damaged: Damage, tmp_path: Path) -> None:
    report = damaged(
        "car.xml",
        (r'(name="chassis">\s+<freejoint.*/>\s+<!--.*-->\s+<inertial pos="[^"]*" mass=)"1266.6"', r'\1"2600"'),
    )
    assert report["front highest valid load over the static load"].level == "warning"
    assert report["mass that controllers know, compared with the model"].level == "warning"


def test_a_car_that_does_not_exist(tmp_path: Path) -> None:
    with raises(ParameterError, value="compakt"):
        check_vehicle("compakt")
    with raises(ParameterError, value=tmp_path, allowed=[]):
        check_vehicle(tmp_path)
