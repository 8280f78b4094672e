"""Content of a .rrd file, read with rerun's reader."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from activesteer.core.signals import Channel
from activesteer.drawing.panels import MOTION, panels_in
from activesteer.drawing.wheel_angles import SLICES, factors, tips_beside
from activesteer.errors import PlaybackError
from activesteer.playback import runs_of, save
from activesteer.playback.course import extent, map_bounds
from activesteer.playback.plots import views
from activesteer.recording import Recording
from activesteer.road.course import Footprint
from tests.raising import raises
from tests.unit.playback import synthetic
from tests.unit.playback.rrd import Rrd
from tests.unit.playback.synthetic import COURSE, circle


def saved(folder: Path, recordings: Mapping[str, Recording], **options: Any) -> Rrd:
    path = folder / "out.rrd"
    save(runs_of(recordings), path, **options)
    return Rrd(path)


def test_every_body_moves_as_it_was_recorded(tmp_path: Path) -> None:
    recording = circle()
    rrd = saved(tmp_path, {"ars": recording})
    for index, body in enumerate(recording.poses.names):
        entity = f"/ars/scene/car/{body}"
        assert np.allclose(rrd.time_s(entity), recording.poses.time_s)
        at = rrd.numbers(entity, "Transform3D:translation")[:, 0]
        assert np.allclose(at, recording.poses.positions_m[:, index], atol=1e-5)
        turn = rrd.numbers(entity, "Transform3D:quaternion")[:, 0]
        assert np.allclose(turn[:, [3, 0, 1, 2]], recording.poses.quaternions[:, index], atol=1e-6)
        assert any(name.startswith(f"{entity}/solid/") for name in rrd.entities)


def test_the_wheels_spin_and_steer(tmp_path: Path) -> None:
    rrd = saved(tmp_path, {"ars": circle()})
    wheel, chassis = (
        Rotation.from_quat(rrd.numbers(f"/ars/scene/car/{body}", "Transform3D:quaternion")[:, 0])
        for body in ("fl_wheel", "chassis")
    )
    step = (wheel[1:] * wheel[:-1].inv()).magnitude()
    assert np.allclose(step, 0.01 * synthetic.SPEED_MPS / synthetic.WHEEL_RADIUS_M, rtol=0.01)
    axis = chassis.inv().apply(wheel.apply((0.0, 1.0, 0.0)))
    assert np.allclose(np.arctan2(-axis[:, 0], axis[:, 1]), synthetic.STEER_RAD, atol=1e-5)


def test_the_camera_follows_and_stays_level(tmp_path: Path) -> None:
    recording = circle()
    rrd = saved(tmp_path, {"ars": recording})
    at = rrd.numbers("/ars/chase", "Transform3D:translation")[:, 0]
    assert np.allclose(at[:, :2], recording.poses.positions_m[:, 0, :2], atol=1e-5)
    assert not at[:, 2].any()
    turn = Rotation.from_quat(rrd.numbers("/ars/chase", "Transform3D:quaternion")[:, 0]).as_rotvec()
    assert np.allclose(turn[:, :2], 0.0, atol=1e-7)
    # The middle of the axles, 1.35 m behind the front axle, moves at this angle to the heading.
    slip = math.atan(1.35 / synthetic.RADIUS_M)
    assert turn[150, 2] == pytest.approx(recording["yaw_rad"][1500] - slip, abs=2e-3)
    assert np.all(np.abs(turn[:, 2] - recording["yaw_rad"][::10]) < 0.1)


def test_links_reach_from_body_to_body_and_springs_are_as_long_as_their_ends_are_apart(tmp_path: Path) -> None:
    recording = circle()
    rrd = saved(tmp_path, {"ars": recording})
    centres = rrd.numbers("/ars/scene/links", "Cylinders3D:centers")
    lengths = rrd.numbers("/ars/scene/links", "Cylinders3D:lengths")
    turns = rrd.numbers("/ars/scene/links", "Cylinders3D:quaternions")
    chassis = Rotation.from_quat(recording.poses.quaternions[:, 0], scalar_first=True)
    for number, (x, y) in enumerate(synthetic.WHEELS.values()):
        inner = recording.poses.positions_m[:, 0] + chassis.apply((x, 0.5 * y, 0.25))
        outer = recording.poses.positions_m[:, number + 1]
        assert np.allclose(centres[:, number], 0.5 * (inner + outer), atol=1e-5)
        along = Rotation.from_quat(turns[:, number]).apply((0.0, 0.0, 1.0)) * lengths[:, number, None]
        assert np.allclose(np.abs(along), np.abs(outer - inner), atol=1e-5)
        top = recording.poses.positions_m[:, 0] + chassis.apply((x, 0.8 * y, 0.8))
        corner = list(synthetic.WHEELS)[number]
        scale = rrd.numbers(f"/ars/scene/springs/{corner}_spring", "Transform3D:scale")[:, 0]
        assert np.allclose(scale[:, 2], np.linalg.norm(top - outer, axis=1), atol=1e-5)
        assert (scale[:, :2] == 1.0).all()


def test_wedges_stand_beside_the_car_and_are_ten_times_as_wide_as_the_angles(tmp_path: Path) -> None:
    recording = circle()
    rrd = saved(tmp_path, {"ars": recording})
    factor = factors([recording])
    assert factor == (10, 10, 10, 10)
    points = rrd.numbers("/ars/car_frame/wheel_angles/wedge", "Mesh3D:vertex_positions").reshape(-1, 4, SLICES + 2, 3)
    assert len(points) == pytest.approx(0.5 * len(recording.poses.time_s), abs=1)
    tips = points[:, :, 0, :2]
    assert np.allclose(tips, tips_beside(Footprint()), atol=1e-5)  # of a recording that does not give the car's size
    turned = points[:, :, -1, :2] - tips
    angle = np.arctan2(turned[..., 1], turned[..., 0])
    assert np.allclose(angle, [10.0 * synthetic.STEER_RAD] * 2 + [0.0] * 2, atol=1e-5)
    labels = rrd.column("/ars/car_frame/wheel_angles/angle", "Points3D:labels")[-1]
    assert labels == ["5.7 deg left, x10", "5.7 deg left, x10", "", ""]


def test_the_plan_shows_every_car_nose_up_with_its_wheels_turned(tmp_path: Path) -> None:
    rrd = saved(tmp_path, {"none": circle(0.2), "ars": circle(0.2)})
    left = rrd.numbers("/plan/1_none/body", "LineStrips2D:strips")[0, 0]
    right = rrd.numbers("/plan/2_ars/body", "LineStrips2D:strips")[0, 0]
    assert left[:, 0].max() < right[:, 0].min()  # beside each other
    assert left[:, 1].min() == pytest.approx(-Footprint().front_m)  # the second axis points down
    rays = rrd.numbers("/plan/2_ars/wedges", "LineStrips2D:strips")[-1].reshape(4, -1, 2, 2)
    along = rays[:, -1, 1] - rays[:, -1, 0]
    assert np.allclose(np.arctan2(-along[:, 0], -along[:, 1]), [10.0 * synthetic.STEER_RAD] * 2 + [0.0] * 2, atol=1e-5)


def test_plots_are_in_degrees_and_hold_the_recorded_values(tmp_path: Path) -> None:
    recording = circle()
    (run,) = runs_of({"ars": recording})
    rrd = saved(tmp_path, {"ars": recording})
    for channel, factor in (("yaw_rate_radps", math.degrees(1.0)), ("ay_mps2", 1.0), ("rear_steer_rad", 180 / math.pi)):
        values = rrd.numbers(f"/ars/plots/{channel}", "Scalars:scalars")[:, 0]
        assert np.allclose(values, run.recording[channel] * factor)
        assert np.allclose(rrd.time_s(f"/ars/plots/{channel}"), run.recording.time_s)
    together = rrd.numbers("/ars/plots/tyre_fy_N", "Scalars:scalars")
    assert together.shape == (len(run.recording), 4)
    assert together == pytest.approx(1e-3 * synthetic.FY_N)  # kN


def test_what_sensors_say_stands_in_the_plot_of_the_truth(tmp_path: Path) -> None:
    ideal = circle()
    said = Channel("measured_yaw_rate_radps", "rad/s", "", "measured")
    values = np.column_stack([ideal.values, np.full(len(ideal), 0.3)])
    real = Recording([*ideal.channels, said], ideal.time_s, values, poses=ideal.poses, metadata=ideal.metadata)
    path = "/ars/plots/measured_yaw_rate_radps"
    assert path not in saved(tmp_path, {"ars": ideal}).entities
    assert saved(tmp_path, {"ars": real}).numbers(path, "Scalars:scalars") == pytest.approx(math.degrees(0.3))
    yaw_rate = next(plot for plot in panels_in(MOTION) if plot.title.startswith("Yaw rate"))
    (view,) = views([yaw_rate], list(runs_of({"ars": real})))
    assert path in str(view.contents)


def test_an_angle_that_nobody_asked_for_is_not_plotted(tmp_path: Path) -> None:
    """The elastic deflection of the superposition hinge is not an added angle."""
    rrd = saved(tmp_path, {"ars": circle()})
    assert "/ars/plots/rear_steer_rad" in rrd.entities
    assert "/ars/plots/superposition_rad" not in rrd.entities


def test_several_runs_share_a_file_each_with_a_ghost(tmp_path: Path) -> None:
    rrd = saved(tmp_path, {"none": circle(0.5), "ars": circle(0.7)})
    for name in ("1_none", "2_ars"):
        assert f"/{name}/plots/yaw_rate_radps" in rrd.entities
        assert f"/map/{name}/car" in rrd.entities
    assert len(rrd.blueprints) == 1


def test_a_ghost_is_the_same_body_and_fades_where_a_car_is(tmp_path: Path) -> None:
    car = {"car": {"width_m": 1.8, "wheelbase_m": 2.6, "tyre_width_m": [0.2, 0.2]}}
    here = circle(0.5, car)
    drifted = here.poses.positions_m.copy()
    drifted[:, :, 1] += np.linspace(0.0, 2.0, len(drifted))[:, None]
    there = Recording(
        here.channels, here.time_s, here.values, poses=here.poses._replace(positions_m=drifted),
        metadata=here.metadata, scene=here.scene,
    )  # fmt: skip
    rrd = saved(tmp_path, {"none": here, "ars": there})
    body, ghost = (f"/2_ars/scene/car/chassis/{part}/paint" for part in ("solid", "ghost/1_none"))
    assert rrd.column(ghost, "Mesh3D:vertex_positions") == rrd.column(body, "Mesh3D:vertex_positions")
    alpha = rrd.numbers(ghost, "Mesh3D:albedo_factor")[:, 0].astype(int) & 255
    apart = np.interp(rrd.time_s(ghost), here.poses.time_s, np.linspace(0.0, 2.0, len(drifted)))
    assert (alpha[apart < 0.2] == 0).all()
    assert (np.diff(alpha) >= 0).all()
    assert 0 < alpha[apart > 1.0].min() < 128
    assert "/1_none/scene/car/chassis/ghost/1_none/paint" not in rrd.entities


def test_course_and_patches_of_other_friction_are_drawn(tmp_path: Path) -> None:
    road = {"mu": 0.9, "patches": [{"start_m": 5.0, "end_m": 20.0, "mu": 0.3, "side": "right"}]}
    metadata = {"course": COURSE, "maneuver": {"title": "A circle", "road": road}}
    recording = circle(metadata=metadata)
    rrd = saved(tmp_path, {"ars": recording})
    path = rrd.numbers("/map/path", "LineStrips2D:strips")[0, 0]
    assert np.allclose(path[:, 1], [-value for value in COURSE["path"]["y_m"]])  # left is up on the map
    assert {"/course/path", "/course/lanes", "/course/cones", "/map/cones", "/road/surface"} <= rrd.entities
    (patch,) = rrd.numbers("/road/patch_0_mu_30_percent", "Mesh3D:vertex_positions")
    assert patch[:, 0].min() == 5.0
    assert patch[:, 0].max() == 20.0
    assert patch[:, 1].max() == 0.0
    plain = saved(tmp_path, {"ars": circle()})
    assert not any(entity.startswith(("/course", "/road/patch")) for entity in plain.entities)


def test_the_map_is_framed_on_cars_and_course_not_on_a_path_that_goes_on_for_ever() -> None:
    runs = runs_of({"ars": circle(metadata={"course": COURSE})})
    least_x, most_x, least_y, most_y = extent(runs)
    assert least_x == 0.0
    assert 28.0 < most_x < 50.0
    assert least_y == -1.0  # a cone
    (low_x, high_x), (low_y, high_y) = map_bounds(runs)
    assert low_x < least_x < most_x < high_x
    assert low_y < -most_y < -least_y < high_y


def test_the_car_on_the_map_is_where_it_was_with_its_wheels_steered(tmp_path: Path) -> None:
    recording = circle()
    rrd = saved(tmp_path, {"ars": recording})
    strokes = rrd.numbers("/map/ars/car", "LineStrips2D:strips")
    assert strokes.shape[1:] == (8, 2, 2)
    wheel = strokes[:, 4] * (1.0, -1.0)  # front left, back in the axes of the world
    assert np.allclose(wheel.mean(axis=1), recording.poses.positions_m[:, 1, :2], atol=1e-4)
    along = wheel[:, 1] - wheel[:, 0]
    angle = np.unwrap(np.arctan2(along[:, 1], along[:, 0]))
    assert np.allclose(angle, recording["yaw_rad"][::10] + synthetic.STEER_RAD, atol=1e-4)


def test_a_recording_without_some_channels_or_links_shows_the_rest(tmp_path: Path) -> None:
    whole = circle()
    kept = [channel for channel in whole.channels if channel.name in ("yaw_rate_radps", "fl_tyre_fz_N")]
    values = np.column_stack([whole[channel.name] for channel in kept])
    rrd = saved(tmp_path, {"ars": Recording(kept, whole.time_s, values, poses=whole.poses)})
    assert "/ars/plots/yaw_rate_radps" in rrd.entities
    assert "/ars/scene/car/chassis" in rrd.entities
    assert not any("tyres" in entity or "links" in entity for entity in rrd.entities)


def test_a_run_that_diverged_is_shown_up_to_its_end(tmp_path: Path) -> None:
    whole = circle()
    values = whole.values.copy()
    values[-200:] = np.nan
    positions = whole.poses.positions_m.copy()
    positions[-20:] = np.nan
    metadata = {"complete": False, "error": "SimulationDiverged: boom"}
    broken = Recording(
        whole.channels, whole.time_s, values, poses=whole.poses._replace(positions_m=positions), metadata=metadata,
        scene=whole.scene,
    )  # fmt: skip
    rrd = saved(tmp_path, {"ars": broken})
    for entity, component in (
        ("/ars/scene/car/chassis", "Transform3D:translation"),
        ("/ars/scene/tyres/force", "Arrows3D:vectors"),
        ("/ars/scene/links", "Cylinders3D:centers"),
    ):
        assert np.isfinite(rrd.numbers(entity, component)).all()
    assert "boom" in rrd.column("/summary", "TextDocument:text")[0][0]


@pytest.mark.parametrize("kind", ["folder is missing", "is a folder"])
def test_a_file_that_cannot_be_written_is_named(tmp_path: Path, kind: str) -> None:
    path = tmp_path / ("missing" if kind == "folder is missing" else "") / "out.rrd"
    if kind == "is a folder":
        path.mkdir()
    with raises(PlaybackError, value=path):
        save(runs_of({"ars": circle(0.1)}), path)


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    with raises(PlaybackError, value=tmp_path / "out.txt"):
        save(runs_of({"ars": circle(0.1)}), tmp_path / "out.txt")
    assert not list(tmp_path.iterdir())


def test_faults_and_limits_are_warnings_at_their_time(tmp_path: Path) -> None:
    fault = {"part": "rear", "kind": "offset", "start_s": 1.0, "end_s": 2.0, "size_rad": math.radians(1.5)}
    recording = circle(metadata={"maneuver": {"name": "circle", "fault": [fault, "no table", {"start_s": 99.0}]}})
    limited = np.zeros(len(recording))
    limited[[*range(500, 700), *range(710, 800), 2500]] = 1.0
    table = [*recording.channels, Channel("rl_steer_saturated", "", "", "vehicle")]
    recording = Recording(
        table, recording.time_s, np.column_stack([recording.values, limited]), poses=recording.poses,
        metadata=recording.metadata, scene=recording.scene,
    )  # fmt: skip
    rrd = saved(tmp_path, {"ars": recording})
    said = [text[0] for text in rrd.column("/ars/warnings", "TextLog:text")]
    limit = ["rl steer at its limit", "rl steer no longer at its limit"]
    assert said == [*limit[:1], *limit[1:], "FAULT rear: offset 1.5 deg", "rear: offset 1.5 deg is over", *limit]
    assert np.allclose(rrd.time_s("/ars/warnings"), [0.5, 0.8, 1.0, 2.0, 2.5, 2.51])
    assert "/ars/warnings" not in saved(tmp_path, {"ars": circle()}).entities
