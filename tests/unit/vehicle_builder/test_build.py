"""Cars made from tables: the compact again, other suspensions, and the values of their tables."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from activesteer.errors import ModelError, ParameterError, TyreFileError
from activesteer.resources import models_dir
from activesteer.rigs.kc import KcResult, kinematics_compliance
from activesteer.vehicle.statics import mass_properties
from activesteer.vehicle_builder import NewVehicle, build, new_vehicle
from tests.bench import on_the_bench
from tests.raising import raises
from tests.unit.vehicle_builder.tables import COMPACT, WISHBONE, changed


@pytest.fixture(scope="module")
def cars(tmp_path_factory: pytest.TempPathFactory) -> dict[str, NewVehicle]:
    """Return the compact made from its own hardpoints, and a car with wishbones and assumed values."""
    tables, folder = {"again": COMPACT, "saloon": WISHBONE}, tmp_path_factory.mktemp("cars")
    return {name: new_vehicle(name, table, folder / name) for name, table in tables.items()}


@pytest.fixture(scope="module")
def again(cars: dict[str, NewVehicle]) -> KcResult:
    return kinematics_compliance(cars["again"].vehicle_file)


@pytest.mark.parametrize("sweep", ["parallel_travel", "opposite_travel", "parallel_kinematic", "lateral_in_phase",
                                   "longitudinal_patch", "aligning_in_phase", "steering_rolling"])  # fmt: skip
def test_the_compacts_hardpoints_give_the_compacts_toe_and_camber(again: KcResult, sweep: str) -> None:
    """Within 0.01 deg over +-80 mm and full lock: spring forces and wheel angles come from a new trim, not from a
    copy."""
    for angle in ("toe_rad", "camber_rad"):
        one, two = (getattr(result.curves[sweep], angle) for result in (on_the_bench(), again))
        assert np.degrees(np.abs(one - two)).max() < 0.01, angle


@pytest.mark.parametrize(
    ("axle", "name", "share"),
    [("front", "wheel_rate", 2e-3), ("rear", "wheel_rate", 2e-3), ("front", "side_force_toe", 5e-3),
     ("rear", "side_force_toe", 5e-3), ("front", "longitudinal_compliance_centre", 5e-3),
     ("front", "steering_ratio", 1e-3), ("front", "ackermann", 5e-3), ("car", "body_bounce_frequency", 1e-3),
     ("car", "body_roll_damping", 2e-3), ("rear", "wheel_hop_frequency", 1e-3), ("car", "roll_gradient", 2e-3)],
)  # fmt: skip
def test_the_compacts_numbers_come_back(again: KcResult, axle: str, name: str, share: float) -> None:
    assert again[axle, name] == pytest.approx(on_the_bench()[axle, name], rel=share)


def test_what_is_left_of_the_whole_car_is_the_compacts_chassis(cars: dict[str, NewVehicle]) -> None:
    found = cars["again"].trimmed.chassis
    model = mujoco.MjModel.from_xml_path(str(models_dir() / "mjcf" / "compact" / "compact.xml"))
    chassis = model.body("chassis").id
    assert found.mass_kg == pytest.approx(model.body_mass[chassis], abs=1e-3)
    np.testing.assert_allclose(found.cg_m, model.body_ipos[chassis], atol=1e-6)
    # Principal axes are those of the vehicle; the engine sorts them by size.
    np.testing.assert_allclose(sorted(found.inertia_kgm2), sorted(model.body_inertia[chassis]), atol=0.05)


def test_the_whole_car_weighs_what_was_asked_for(cars: dict[str, NewVehicle]) -> None:
    body = mass_properties(mujoco.MjModel.from_xml_path(str(cars["again"].folder / "again.xml")))
    assert body.mass_kg == pytest.approx(1430.0, abs=0.01)
    np.testing.assert_allclose(np.diag(body.inertia_kgm2), [530.0, 2100.0, 2200.0], atol=0.05)


def test_a_wheel_rate_a_ratio_and_static_angles_are_met(tmp_path: Path) -> None:
    table = changed(
        COMPACT, tmp_path, ("spring_rate_Npm = 24730", "wheel_rate_Npm = 30000"),
        ("spring_rate_Npm = 26650", "ride_frequency_Hz = 1.5"), ("ratio = 15.814", "ratio = 13.5"),
        ("toe_deg = 0.0506", "toe_deg = -0.1"), ("camber_deg = -0.4979", "camber_deg = -1.2"),
    )  # fmt: skip
    result = kinematics_compliance(new_vehicle("asked", table, tmp_path / "asked").vehicle_file)
    assert result["front", "wheel_rate"] == pytest.approx(30.0, rel=1e-3)
    assert result["rear", "ride_frequency"] == pytest.approx(1.5, rel=2e-3)
    assert result["front", "steering_ratio"] == pytest.approx(13.5, rel=1e-3)
    assert result["front", "static_toe"] == pytest.approx(-0.1, abs=1e-3)
    assert result["front", "static_camber"] == pytest.approx(-1.2, abs=1e-3)
    assert abs(float(result.measured.vehicle.data.qpos[2])) < 0.01


def test_an_anti_roll_bar_adds_the_roll_stiffness_that_is_asked_for(tmp_path: Path) -> None:
    """Within 5 %, because the roll stiffness includes the change of the wheel rate with load; tyres rigid."""
    stiffness = []
    for number, bars in enumerate(((0, 0), (26000, 14000))):
        table = changed(
            COMPACT, tmp_path, ("anti_roll_bar_Npm = 11750", f"anti_roll_bar_Nmprad = {bars[0]}"),
            ("anti_roll_bar_Npm = 7350", f"anti_roll_bar_Nmprad = {bars[1]}"),
        )  # fmt: skip
        result = kinematics_compliance(new_vehicle("bars", table, tmp_path / str(number)).vehicle_file)
        stiffness.append([result[axle, "roll_stiffness"] for axle in ("front", "rear")])
    assert np.subtract(stiffness[1], stiffness[0]) == pytest.approx([26.0, 14.0], rel=0.05)


def test_a_stiff_top_mount_leaves_the_camber_to_the_links(tmp_path: Path) -> None:
    """By hand: 1 kN at the road loads the mount, 0.67 m above the ball joint, with 0.19 / 0.67 kN across the strut."""
    table = changed(
        COMPACT, tmp_path, ("radial_Npm = 3e5", "radial_Npm = 1e9"), ("axial_Npm = 1.2e6", "axial_Npm = 1e9")
    )
    stiff = kinematics_compliance(new_vehicle("stiff", table, tmp_path / "stiff").vehicle_file)
    given = on_the_bench()["front", "side_force_camber"] - stiff["front", "side_force_camber"]
    assert given == pytest.approx(np.degrees(1e3 * 0.19 / 0.67 / 3e5 / 0.67), rel=0.1)


@pytest.mark.parametrize(
    ("key", "value"), [("front.top_mount.rod_mass_kg", 1.0), ("rear.top_mount.radial_Npm", 3e5)]
)  # a strut has `strut_mass_kg`; a damper between two joints has no force across its axis
def test_a_key_that_does_not_apply_to_a_top_mount_is_refused(tmp_path: Path, key: str, value: float) -> None:
    axle, _, name = key.split(".")
    table = changed(COMPACT, tmp_path, (f"[{axle}.top_mount]", f"[{axle}.top_mount]\n{name} = {value}"))
    with raises(ParameterError, key=key):
        new_vehicle("refused", table, tmp_path / "refused")


def test_tie_rods_ahead_of_the_axle_turn_the_rack_round(tmp_path: Path) -> None:
    table = changed(
        COMPACT, tmp_path, ("[-146, 360, 254.5]", "[146, 360, 254.5]"), ("[-126, 698, 249.5]", "[126, 726, 249.5]")
    )
    made = new_vehicle("ahead", table, tmp_path / "ahead")
    model = mujoco.MjModel.from_xml_path(str(made.folder / "ahead.xml"))
    np.testing.assert_array_equal(model.joint("rack").axis, [0.0, 1.0, 0.0])
    sweep = kinematics_compliance(made.vehicle_file).curves["steering_rolling"]
    assert (sweep.steer_rad[-1, :2] > 0.3).all()
    assert sweep.rack_m[-1] > 0.05


@pytest.mark.parametrize("rear", ["multilink", "double_wishbone"])
def test_every_suspension_stands_and_has_one_way_to_travel(
    cars: dict[str, NewVehicle], tmp_path: Path, rear: str
) -> None:
    made = cars["saloon"]
    if rear == "double_wishbone":
        lines = [
            line
            for line in WISHBONE.read_text().splitlines()
            if not line.startswith(("rear.upper", "rear.lat", "rear.trail", "rear.toe", "rear.spring_on"))
        ]
        front = [line for line in lines if line.startswith(("front.uca", "front.lca", "front.tie_rod"))]
        for line in front:
            key, x, y, z = line.split(",")
            key = key.replace("front.", "rear.").replace("tie_rod", "toe_link")
            lines.append(f"{key}, {float(x) - 2776}, {y}, {z}")
        lines = [line.replace("rear.type, multilink", "rear.type, double_wishbone") for line in lines]
        table = tmp_path / "both.csv"
        # The damper of the multilink stands on the knuckle; here, too.
        text = "\n".join([*lines, "rear.spring_on, lca"])
        table.write_text(
            text.replace("rear.spring_outer,        -2690, 570, 160", "rear.spring_outer, -2776, 600, 140")
        )
        made = new_vehicle("car", table, tmp_path / "car")
    result = kinematics_compliance(made.vehicle_file)
    assert result["car", "left_right_difference"] < 1e-6
    assert result["rear", "ride_frequency"] == pytest.approx(1.35, rel=2e-3)
    assert result["front", "ride_frequency"] == pytest.approx(1.2, abs=0.003)
    assert result["front", "steering_ratio"] == pytest.approx(15.5, abs=0.02)
    assert result["front", "damper_ratio"] == pytest.approx(0.518, abs=0.003)
    model = result.measured.vehicle.model
    for corner in CORNERS:
        left, right = f"{corner[0]}l", f"{corner[0]}r"
        np.testing.assert_array_equal(model.site(f"{left}_wheel_centre").pos, model.site(f"{right}_wheel_centre").pos)


def test_front_arm_geometry_is_chronos(tmp_path: Path) -> None:
    """Chrono's generic sedan with its front tie rod: an independent calculation of bump steer gives -35.95 deg/m."""
    table = changed(
        WISHBONE, tmp_path, ("front.tie_rod_inner,   -200, 392,  320", "front.tie_rod_inner,   -200, 392,  296"),
        ("front.tie_rod_outer,   -150, 708,  296", "front.tie_rod_outer,   -150, 742,  296"),
    )  # fmt: skip
    result = kinematics_compliance(new_vehicle("raw", table, tmp_path / "raw").vehicle_file)
    assert result["front", "bump_steer"] == pytest.approx(-35.95, abs=0.1)


def test_the_keyframe_is_where_the_car_stands(cars: dict[str, NewVehicle]) -> None:
    model = mujoco.MjModel.from_xml_path(str(cars["again"].folder / "again.xml"))
    assert model.key("static_ride").id == 0
    assert model.key_qpos.shape[1] == model.nq
    assert abs(model.key_qpos[0, 2]) < 5e-3


@pytest.mark.parametrize("name", ["again", "saloon"])
def test_the_scene_stands_in_any_viewer(cars: dict[str, NewVehicle], name: str) -> None:
    model = mujoco.MjModel.from_xml_path(str(cars[name].folder / "scene.xml"))
    data = mujoco.MjData(model)
    for _ in range(1000):
        mujoco.mj_step(model, data)
    assert sum(warning.number for warning in data.warning) == 0
    assert np.abs(data.qpos[:3]).max() < 0.03
    assert np.abs(data.qvel[:6]).max() < 0.05


def test_the_readme_names_what_was_assumed_and_only_that(cars: dict[str, NewVehicle]) -> None:
    assert not cars["again"].assumptions
    made = cars["saloon"]
    text = (made.folder / "README.md").read_text()
    keys = {item.key for item in made.assumptions}
    assert {"front.links.uca_front", "mass.inertia_kgm2", "rear.knuckle_mass_kg", "brakes"} <= keys
    assert not any(key.startswith(("mass.total", "steering.ratio", "front.ride_frequency")) for key in keys)
    for item in made.assumptions:
        assert f"| `{item.key}` | {item.value} | {item.rule} |" in text


def test_the_table_in_the_folder_makes_the_same_car_again(cars: dict[str, NewVehicle], tmp_path: Path) -> None:
    one = cars["saloon"]
    two = new_vehicle("saloon", one.folder / "table.csv", tmp_path / "two")
    for file in sorted(one.folder.glob("*.xml")):
        assert file.read_text() == (two.folder / file.name).read_text()


def test_a_tyre_beside_the_table_comes_along(tmp_path: Path) -> None:
    own = (models_dir() / "tyres" / "winter_205_55R16.tir").read_text()
    (tmp_path / "mine.tir").write_text(own)
    table = changed(COMPACT, tmp_path, ("compact_205_55R16.tir", "mine.tir"))
    made = new_vehicle("own", table, tmp_path / "own")
    assert (made.folder / "mine.tir").read_text() == own
    table = changed(COMPACT, tmp_path, ("compact_205_55R16.tir", "wintr_205_55R16.tir"))
    with raises(TyreFileError, key="front.tyre", value="wintr_205_55R16.tir"):
        new_vehicle("own", table, tmp_path / "other")


def test_files_of_an_earlier_car_are_not_replaced_unasked(tmp_path: Path) -> None:
    (tmp_path / "again").mkdir()
    (tmp_path / "again" / "again.xml").touch()
    with raises(ParameterError, value=tmp_path / "again"):
        new_vehicle("again", COMPACT, tmp_path / "again")
    new_vehicle("again", COMPACT, tmp_path / "again", overwrite=True)
    assert (tmp_path / "again" / "again.xml").stat().st_size > 0


@pytest.mark.parametrize(
    ("changes", 'key'),
    [
        ((("total_kg = 1430", "total_kg = 205"),), 'mass.total_kg'),
        ((("inertia_kgm2 = [530, 2100, 2200]", "inertia_kgm2 = [530, 2100, 3500]"),), 'mass.inertia_kgm2'),
        ((("[-126, 698, 249.5]", "[-12, 698, 249.5]"),), 'front'),
        ((("wheel_spin_inertia_kgm2 = 1.0", "wheel_spin_inertia_kgm2 = 2.0"),), 'front.wheel_spin_inertia_kgm2'),
    ],
)  # fmt: skip
def test_impossible_cars_are_refused_and_leave_nothing_behind(
    tmp_path: Path, changes: tuple[tuple[str, str], ...], key: str
) -> None:
    with raises((ParameterError, ModelError), key=key):
        new_vehicle("bad", changed(COMPACT, tmp_path, *changes), tmp_path / "bad")
    assert not (tmp_path / "bad").exists()


def test_a_disk_that_fills_up_leaves_no_part_of_a_car(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_source: Path, target: Path) -> None:
        target.mkdir()
        (target / "half.xml").write_text("<mujoco")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(build.shutil, "copytree", full)
    with raises(ParameterError):
        build._install(tmp_path, tmp_path / "mine")
    assert list(tmp_path.iterdir()) == []
