"""The rig against independent solutions of its problem, and the car against its targets."""

from __future__ import annotations

import functools
import math
import re
import shutil
import tomllib
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from activesteer.core.conventions import CORNERS, GRAVITY_MPS2, Array
from activesteer.resources import models_dir
from activesteer.rigs.kc.held_car import MOUNT_ENDINGS, Case, HeldCar
from activesteer.scenario import load_car
from activesteer.vehicle import Vehicle
from activesteer.vehicle_builder.corner_motion import corner_motion
from tests.bench import on_the_bench
from tests.physics.rigid_links import FRONT_LINKS, REAR_LINKS, Pose, RigidCorner
from tests.physics.static_corner import PINION_M, StaticCorner

TRAVEL_M = np.linspace(-0.08, 0.08, 17)
STIFFER = 100.0


def vehicle() -> Vehicle:
    return load_car("compact").on()


def is_link(name: str) -> bool:
    return name[3:] in FRONT_LINKS + REAR_LINKS or name == "steering_column" or name.endswith(MOUNT_ENDINGS)


@functools.cache
def stiff_vehicle() -> Vehicle:
    """Return the car with links, top mounts and steering column a hundred times stiffer, unloaded at the same place."""
    car = vehicle()
    for tendon in range(car.model.ntendon):
        if is_link(car.model.tendon(tendon).name):
            car.model.tendon_stiffness[tendon] *= STIFFER
            if car.model.tendon(tendon).name.endswith(MOUNT_ENDINGS):
                car.model.tendon_lengthspring[tendon] /= STIFFER
            car.model.tendon_stiffnesspoly[tendon] *= STIFFER
    return car


class Travel:
    """Wheel poses of a car over parallel travel, in chassis axes."""

    def __init__(self, car: Vehicle) -> None:
        self.held = HeldCar(car)
        chassis = self.held.model.body("chassis").id
        self.chassis_m = self.held.origin_m
        self.turn = self.held.data.xmat[chassis].reshape(3, 3).copy()
        self.centre_m = np.empty((TRAVEL_M.size, 4, 3))
        self.axle = np.empty((TRAVEL_M.size, 4, 3))
        self.contact_m = np.empty((TRAVEL_M.size, 4, 3))
        self.load_N = np.empty((TRAVEL_M.size, 4))
        for row, height in enumerate(TRAVEL_M):
            self.held.equilibrium(Case(height_m=np.full(4, height)))
            self.load_N[row] = self.held.load_N
            for corner in range(4):
                pose = self.held.wheel(corner)
                self.centre_m[row, corner] = self.turn.T @ (pose.centre_m - self.chassis_m)
                self.axle[row, corner] = self.turn.T @ pose.rotation[:, 1]
                self.contact_m[row, corner] = self.turn.T @ (pose.contact_m - self.chassis_m)


@functools.cache
def stiff_travel() -> Travel:
    return Travel(stiff_vehicle())


@pytest.mark.parametrize("corner", CORNERS)
def test_stiff_links_move_the_wheel_as_rigid_ones_do(corner: str) -> None:
    travel = stiff_travel()
    index = CORNERS.index(corner)
    rigid = RigidCorner(travel.held.model, corner)
    poses = rigid.solve(travel.centre_m[:, index, 2])
    axle = travel.axle[:, index]
    toe = np.degrees(np.arctan2(-axle[:, 0], axle[:, 1]))
    camber = np.degrees(np.arcsin(axle[:, 2]))
    assert toe == pytest.approx([pose.steer_deg for pose in poses], abs=0.01)
    assert camber == pytest.approx([np.degrees(np.arcsin(pose.axle[2])) for pose in poses], abs=0.01)
    radius = float(travel.held.radius_m[index])
    across = [pose.contact_m(radius)[1] for pose in poses]
    # Track is that of both wheels, which are mirror images.
    assert 2.0 * travel.contact_m[:, index, 1] == pytest.approx(2.0 * np.array(across), abs=1e-4)


def test_the_rigid_solution_is_sensitive_to_what_it_checks() -> None:
    """The tests above detect a hardpoint moved by 2 mm, so their curves are sensitive."""
    travel = stiff_travel()
    rigid = RigidCorner(travel.held.model, "fl")
    rigid.inner[2, 2] += 0.002
    rigid.lengths = np.linalg.norm(rigid.outer - rigid.inner, axis=1)
    poses = rigid.solve(travel.centre_m[:, 0, 2])
    toe = np.degrees(np.arctan2(-travel.axle[:, 0, 0], travel.axle[:, 0, 1]))
    assert np.abs(toe - [pose.steer_deg for pose in poses]).max() > 0.05


def test_a_car_with_a_hinge_has_no_screw_to_sweep() -> None:
    assert on_the_bench().curves
    assert "rear_steering_bump" not in on_the_bench().curves


@pytest.mark.parametrize("corner", ["fl", "rl"])
def test_wheel_rate_by_virtual_work(corner: str) -> None:
    """Load = (spring force x di/dz + weight of the unsprung parts) / contact point's rise; the rate is its slope."""
    travel = stiff_travel()
    model = travel.held.model
    rigid = RigidCorner(model, corner)
    index = CORNERS.index(corner)
    standing = float(np.interp(0.0, TRAVEL_M, travel.centre_m[:, index, 2]))
    step = 0.005
    heights = [standing + step * count for count in range(-2, 3)]
    poses = rigid.solve(heights)
    radius = float(travel.held.radius_m[index])
    energy = np.array([spring_energy_J(model, rigid, pose, corner) for pose in poses])
    rise = np.array([pose.contact_m(radius)[2] for pose in poses])
    energy += np.array([weight_energy_J(model, rigid, pose, corner) for pose in poses])
    # The work of the pad is the energy that spring and weight gain.
    load = np.diff(energy) / np.diff(rise)
    rate = (load[-1] - load[0]) / (3.0 * step)
    near = np.abs(TRAVEL_M) < 0.011
    measured = np.polyfit(TRAVEL_M[near], travel.load_N[near, index], 1)[0]
    assert measured == pytest.approx(rate, rel=0.01)
    assert travel.load_N[TRAVEL_M.size // 2, index] == pytest.approx(load.mean(), rel=0.005)


def spring_energy_J(model: mujoco.MjModel, rigid: RigidCorner, pose: Pose, corner: str) -> float:
    tendon = model.tendon(f"{corner}_spring").id
    rate, rest = float(model.tendon_stiffness[tendon]), float(model.tendon_lengthspring[tendon, 0])
    if rigid.strut is not None:
        top, axis = rigid.strut
        # How far the top mount moved along the strut's axis, as the knuckle sees it.
        length = -float(axis @ (pose.rotation.T @ (top - rigid.point(pose, top)))) * -1.0
    else:
        ends = [hardpoint(model, f"{corner}_spring_{end}") for end in ("inner", "outer")]
        length = float(np.linalg.norm(rigid.point(pose, ends[1]) - ends[0]))
    return 0.5 * rate * (length - rest) ** 2


def weight_energy_J(model: mujoco.MjModel, rigid: RigidCorner, pose: Pose, corner: str) -> float:
    total = 0.0
    for part in ("knuckle", "carrier", "wheel"):
        if corner.startswith("f") and part == "carrier":
            continue
        body = model.body(f"{corner}_{part}")
        # The wheel's frame is at its centre, the others' at the vehicle's origin.
        at = rigid.centre_m if part == "wheel" else body.ipos
        total += float(body.mass[0]) * GRAVITY_MPS2 * rigid.point(pose, at)[2]
    return total


def hardpoint(model: mujoco.MjModel, name: str) -> Array:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return data.site_xpos[model.site(name).id] - data.xpos[model.body("chassis").id]


@pytest.mark.parametrize(("axle", "corner"), [("front", "fl"), ("rear", "rl")])
def test_side_force_compliance_is_that_of_the_links_stiffness_matrix(axle: str, corner: str) -> None:
    motion, toe, camber = StaticCorner(HeldCar(vehicle()), corner).under_side_force()
    result = on_the_bench()
    assert result[axle, "lateral_compliance_centre"] == pytest.approx(motion, rel=0.02)
    assert result[axle, "side_force_toe"] == pytest.approx(toe, rel=0.02)
    assert result[axle, "side_force_camber"] == pytest.approx(camber, rel=0.02)


def test_left_and_right_mirror_each_other() -> None:
    result = on_the_bench()
    assert result["car", "left_right_difference"] == pytest.approx(0.0, abs=1e-6)
    for name in ("parallel_travel", "lateral_opposed", "longitudinal_patch", "aligning_opposed"):
        sweep = result.curves[name]
        for values in (sweep.toe_rad, sweep.camber_rad):
            assert values[:, 0::2] == pytest.approx(values[:, 1::2], abs=1e-8)
    for name in ("opposite_travel", "lateral_in_phase", "aligning_in_phase", "steering_rolling"):
        sweep = result.curves[name]
        assert sweep.toe_rad[:, 0::2] == pytest.approx(sweep.toe_rad[::-1, 1::2], abs=1e-8)


def moved_hardpoint(folder: Path, file: str, site: str, axis: int, by_m: float) -> dict:
    """Return the compact with one hardpoint of each side moved equally in x and z."""
    source = models_dir() / "mjcf" / "compact"
    target = folder / "car"
    if not target.exists():
        shutil.copytree(source, target)
    path = target / file
    text = path.read_text(encoding="utf-8")
    for side in "lr":
        pattern = re.compile(rf'(<site name="[fr]{side}_{site}" pos=")([^"]+)"')
        assert len(pattern.findall(text)) == 1

        def change(match: re.Match[str]) -> str:
            place = [float(value) for value in match.group(2).split()]
            place[axis] += by_m
            return f'{match.group(1)}{" ".join(map(str, place))}"'

        text = pattern.sub(change, text)
    path.write_text(text, encoding="utf-8")
    table = tomllib.loads((models_dir() / "vehicles" / "compact.toml").read_text(encoding="utf-8"))
    return {**table, "name": "changed", "mjcf": str(target / "compact.xml")}


def bump_slopes(changed: dict) -> tuple[Array, Array]:
    """Return toe and camber of the left wheels of a changed car [deg/m], front and rear, over +-15 mm."""
    held = HeldCar(load_car(changed).on())
    axles = []
    for height in (-0.015, 0.015):
        held.equilibrium(Case(height_m=np.full(4, height)))
        axles.append(np.array([held.wheel(corner).rotation[:, 1] for corner in (0, 2)]))
    toe, camber = (np.degrees((axles[1] - axles[0])[:, axis]) / 0.03 for axis in (0, 2))
    return toe, -camber


def test_a_higher_tie_rod_end_at_the_rack_turns_the_wheel_in_in_bump(tmp_path: Path) -> None:
    """Behind the axle, a rod that slopes down outwards pushes the wheel's rear edge out in bump."""
    toe, _ = bump_slopes(moved_hardpoint(tmp_path, "steering.xml", "tie_rod_inner", 2, 0.03))
    assert toe[0] > 5.0
    assert on_the_bench()["front", "bump_steer"] < 0.0


def test_an_upper_link_that_falls_inwards_gains_camber(tmp_path: Path) -> None:
    """The outer end of an upper link that rises outwards moves inwards in bump, together with the wheel's top."""
    design = on_the_bench()["rear", "bump_camber"]
    lower = moved_hardpoint(tmp_path, "rear_axle.xml", "camber_link_inner", 2, -0.05)
    assert bump_slopes(lower)[1][1] < design - 3.0
    higher = moved_hardpoint(tmp_path, "rear_axle.xml", "camber_link_inner", 2, 0.10)
    assert bump_slopes(higher)[1][1] > design + 3.0


def test_forces_turn_wheels_the_way_they_push() -> None:
    result = on_the_bench()
    for axle in ("front", "rear"):
        assert result[axle, "aligning_steer"] > 0.0
        assert result[axle, "lateral_compliance_patch"] > 0.0
        assert result[axle, "lateral_compliance_patch"] > result[axle, "lateral_compliance_centre"]
        assert result[axle, "side_force_camber"] > 0.0  # pushed inwards at its foot, a wheel leans out
        assert result[axle, "braking_wind_up"] > 0.0  # a braked wheel takes its knuckle along
    # The front wheels' steering axis meets the road ahead of the contact point: a side force turns the wheel out.
    assert result["front", "caster_trail"] > 0.0 > result["front", "side_force_toe"]


def test_side_force_goes_to_the_body_at_the_roll_centre() -> None:
    """By virtual work, the height from forces equals the height from the path of the contact point in roll.

    In parallel travel, the load of spring and bar on the elastic top mount is another, and the path differs by 2 mm.
    """
    sweep = on_the_bench().curves["opposite_travel"]
    near = np.abs(sweep.x) < 0.0151
    for axle, wheel in (("front", 0), ("rear", 2)):
        path = sweep.contact_m[near, wheel]
        by_path = 1e3 * np.polyfit(path[:, 2], path[:, 1], 1)[0] * sweep.contact_m[sweep.zero, wheel, 1]
        assert on_the_bench()[axle, "roll_centre_height_by_force"] == pytest.approx(by_path, abs=0.5)
        assert on_the_bench()[axle, "roll_centre_height"] == pytest.approx(by_path, abs=3.0)


def support(corner: str) -> float:
    """Return forward over upward motion of the locked wheel's contact point with rigid links, near static ride."""
    held = stiff_travel().held
    rigid = RigidCorner(held.model, corner)
    index = CORNERS.index(corner)
    standing = float(np.interp(0.0, TRAVEL_M, stiff_travel().centre_m[:, index, 2]))
    down, up = rigid.solve([standing - 0.005, standing + 0.005])
    design = rigid.solve([rigid.centre_m[2]])[0].contact_m(float(held.radius_m[index]))
    low, high = (rigid.point(pose, design) for pose in (down, up))
    return float((high - low)[0] / (high - low)[2])


@pytest.mark.parametrize("corner", ["fl", "rl"])
def test_longitudinal_force_lifts_by_the_slope_of_the_patchs_path(corner: str) -> None:
    """Virtual work: at fixed height, the vertical pad force responds to a longitudinal force by the path's slope."""
    held = HeldCar(stiff_vehicle())
    loads = []
    for force in (-500.0, 500.0):
        held.equilibrium(Case(patch_N=np.outer(np.ones(4), [force, 0.0, 0.0])))
        loads.append(held.load_N[CORNERS.index(corner)])
    assert (loads[1] - loads[0]) / 1000.0 == pytest.approx(-support(corner), abs=0.003)


def test_anti_dive_and_anti_lift_are_those_of_rigid_links() -> None:
    result = on_the_bench()
    brakes = result.measured.vehicle.parameters.brakes
    share = brakes.front_torque_Nm / (brakes.front_torque_Nm + brakes.rear_torque_Nm)
    lever = result["car", "wheelbase"] / result["car", "cg_height"]
    assert result["front", "anti_dive"] == pytest.approx(100.0 * share * lever * support("fl"), abs=0.5)
    assert result["rear", "anti_lift"] == pytest.approx(-100.0 * (1.0 - share) * lever * support("rl"), abs=0.5)


@pytest.mark.parametrize("axle", ["front", "rear"])
def test_roll_stiffness_is_that_of_springs_and_bar(axle: str) -> None:
    """t^2 / 2 x (wheel rate + 2 x bar x ratio^2): the bar's rate is per difference of damper travel.

    At a strut it acts on the travel of the tube, that is of damper and top mount: rigid links give it.
    """
    result = on_the_bench()
    model = result.measured.vehicle.model
    bar = float(model.tendon_stiffness[model.tendon(f"{axle}_anti_roll_bar").id])
    ratio = corner_motion(model, "fl")[0]["fl_damper"] if axle == "front" else 1.0
    rate = 1e3 * result[axle, "wheel_rate"] + 2.0 * bar * ratio**2
    track = 1e-3 * result[axle, "track"]
    assert 1e3 * result[axle, "roll_stiffness"] == pytest.approx(0.5 * rate * track**2, rel=0.02)


def test_steering_ratio_and_rack_belong_to_the_pinion() -> None:
    """Rack per turn is the pinion's circumference minus column deflection; ratio x steer is the wheel angle."""
    result = on_the_bench()
    assert result["front", "rack_travel"] == pytest.approx(2e3 * math.pi * PINION_M, rel=0.01)
    sweep = result.curves["steering_rolling"]
    right, left = np.interp([-0.1, 0.1], sweep.x, sweep.steer_rad[:, :2].mean(axis=1))
    assert 0.2 / (left - right) == pytest.approx(result["front", "steering_ratio"], rel=0.01)
    assert left > 0.0 > right


def test_at_rest_the_wheels_lag_behind_the_steering_wheel() -> None:
    rolling, left, right = (
        on_the_bench().curves[name].steer_rad[:, :2].mean(axis=1)
        for name in ("steering_rolling", "steering_at_rest_left", "steering_at_rest_right")
    )
    assert (left < rolling).all()
    assert (rolling < right).all()
    assert on_the_bench()["front", "parking_lost_angle"] > 5.0


def test_steering_axes_are_those_of_the_hardpoints() -> None:
    """At the front the line through ball joint and top mount, at the rear the hinge."""
    car = vehicle()
    result = on_the_bench()
    ball, top = hardpoint(car.model, "fl_lca_front_outer"), hardpoint(car.model, "fl_spring_inner")
    along = top - ball
    # The standing car is pitched by 0.005 deg against its design position.
    assert result["front", "caster"] == pytest.approx(math.degrees(math.atan2(-along[0], along[2])), abs=0.02)
    assert result["front", "kingpin_inclination"] == pytest.approx(
        math.degrees(math.atan2(-along[1], along[2])), abs=0.02
    )
    hinge = car.model.joint("rl_steer").axis
    assert result["rear", "caster"] == pytest.approx(math.degrees(math.atan2(-hinge[0], hinge[2])), abs=0.02)
    assert result["rear", "kingpin_inclination"] == pytest.approx(
        math.degrees(math.atan2(-hinge[1], hinge[2])), abs=0.02
    )


def test_bounce_and_pitch_are_those_of_the_plane_model_on_ride_rates() -> None:
    """Expected are the two frequencies of a rigid body on two springs, without the linearisation."""
    result = on_the_bench()
    rates = np.array([2e3 * result[axle, "ride_rate"] for axle in ("front", "rear")])
    arms = np.array([1.0, -1.0]) * result["car", "wheelbase"] * 1e-3
    share = result["car", "front_load_fraction"] / 100.0
    arms *= [1.0 - share, share]
    model = on_the_bench().measured.vehicle.model
    unsprung = sum(float(model.body_subtreemass[model.body(f"{corner}_knuckle").id]) for corner in CORNERS)
    mass = result["car", "mass"] - unsprung
    inertia = float(model.body_inertia[model.body("chassis").id, 1])
    stiffness = np.array([[rates.sum(), -rates @ arms], [-rates @ arms, rates @ arms**2]])
    squares = np.linalg.eigvals(np.diag([1.0 / mass, 1.0 / inertia]) @ stiffness)
    slow, fast = np.sort(np.sqrt(squares)) / (2.0 * np.pi)
    assert result["car", "body_bounce_frequency"] == pytest.approx(slow, rel=0.05)
    assert result["car", "body_pitch_frequency"] == pytest.approx(fast, rel=0.08)


def test_roll_gradient_is_that_of_springs_and_roll_centres() -> None:
    """The body rolls on its springs about the roll axis, the whole car on its tyres about the road.

    Springs carry the moment of the sprung mass about the roll axis, tyres that of the whole car about the road, both
    with the part that the weight adds as the car leans (Gillespie 1992, ch. 6). Left out: the unsprung masses, which
    load the springs a little because their wheels camber.
    """
    result = on_the_bench()
    model = result.measured.vehicle.model
    chassis = model.body("chassis").id
    share = result["car", "front_load_fraction"] / 100.0
    axis = 1e-3 * (share * result["front", "roll_centre_height"] + (1.0 - share) * result["rear", "roll_centre_height"])
    sprung = float(model.body_mass[chassis]) * (float(result.measured.vehicle.data.xipos[chassis, 2]) - axis)
    whole = result["car", "mass"] * result["car", "cg_height"] * 1e-3
    axles = list(zip(("front", "rear"), result.measured.tyres, strict=True))
    springs = sum(1e3 * result[axle, "roll_stiffness"] for axle, _ in axles)
    tyres = sum(0.5 * tyre.vertical_Npm * (1e-3 * result[axle, "track"]) ** 2 for axle, tyre in axles)
    flexibility = sprung / springs + whole / tyres
    gradient = math.degrees(flexibility / (1.0 - GRAVITY_MPS2 * flexibility)) * GRAVITY_MPS2
    assert result["car", "roll_gradient"] == pytest.approx(gradient, rel=0.07)


def test_braking_pitch_is_that_of_load_transfer_and_anti_features() -> None:
    """Load transfer m a h / l: fully on the tyres; on the springs without the part of the links (Gillespie, ch. 7)."""
    result = on_the_bench()
    transfer_N = result["car", "mass"] * GRAVITY_MPS2 * result["car", "cg_height"] / result["car", "wheelbase"]
    moved_m = 0.0
    for axle, anti, tyre in zip(("front", "rear"), ("anti_dive", "anti_lift"), result.measured.tyres, strict=True):
        carried = 1.0 - result[axle, anti] / 100.0
        moved_m += transfer_N * (carried / (2e3 * result[axle, "wheel_rate"]) + 0.5 / tyre.vertical_Npm)
    nose_down = math.degrees(1e3 * moved_m / result["car", "wheelbase"])
    assert result["car", "braking_pitch_gradient"] == pytest.approx(nose_down, rel=0.05)


def test_roll_understeer_follows_from_the_toe_of_both_wheels() -> None:
    """Toe-out in bump at the front and toe-in in bump at the rear both cause understeer."""
    result = on_the_bench()
    assert result["front", "roll_steer_outer"] < 0.0 < result["front", "roll_understeer"]
    assert result["rear", "roll_steer_outer"] > 0.0
    assert result["rear", "roll_understeer"] > 0.0


@pytest.mark.parametrize(("axle", "first"), [("front", 0), ("rear", 2)])
def test_a_side_force_behind_the_contact_point_is_a_force_and_a_moment(axle: str, first: int) -> None:
    """30 mm of trail as a moment on both wheels, not combined from two sweeps."""
    held = HeldCar(vehicle())
    force = np.array([0.0, -500.0, 0.0])
    toe = []
    for sign in (1.0, -1.0):
        case = Case(
            patch_N=sign * np.outer(np.ones(4), force),
            moment_Nm=sign * np.outer(np.ones(4), np.cross([-0.03, 0.0, 0.0], force)),
        )
        held.equilibrium(case)
        axis = held.wheel(first).rotation[:, 1]
        toe.append(math.degrees(math.atan2(axis[0], axis[1])))
    assert on_the_bench()[axle, "side_force_toe_with_trail"] == pytest.approx(toe[0] - toe[1], abs=0.005)


def test_the_contact_point_is_the_lowest_of_the_wheel() -> None:
    held = HeldCar(vehicle())
    held.equilibrium(Case("contact", steering_wheel_rad=6.0))
    for corner in range(4):
        pose = held.wheel(corner)
        spoke = pose.contact_m - pose.centre_m
        turns = np.linspace(0.0, 2.0 * np.pi, 721)
        rim = np.array([Rotation.from_rotvec(turn * pose.rotation[:, 1]).apply(spoke) for turn in turns])
        assert spoke @ pose.rotation[:, 1] == pytest.approx(0.0, abs=1e-12)
        assert np.linalg.norm(spoke) == pytest.approx(held.radius_m[corner])
        assert rim[:, 2].min() == pytest.approx(spoke[2], abs=1e-9)
