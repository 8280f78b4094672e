"""Friction of the road under each wheel, and its utilisation."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from activesteer.core.conventions import CORNERS
from activesteer.core.path import Path
from activesteer.road.course import Course
from activesteer.road.road import Road, RoadPatch
from activesteer.scenario import load_car
from activesteer.tyre.kernels.magic_formula import steady_state
from activesteer.vehicle import Vehicle
from tests.unit.vehicle.cars import record, tilted_and_moving

LEFT, RIGHT = (0, 2), (1, 3)


def rolling(road: Road) -> Vehicle:
    """Return the car at 20 m/s at the start of a recording: its centre of gravity is at the origin."""
    vehicle = load_car().on(road)
    vehicle.start(20.0)
    return vehicle


def frictions(vehicle: Vehicle) -> list[float]:
    mujoco.mj_forward(vehicle.model, vehicle.data)
    return [record(vehicle, corner, "mu") for corner in CORNERS]


def move(vehicle: Vehicle, x_m: float, y_m: float = 0.0) -> None:
    vehicle.data.qpos[0] += x_m
    vehicle.data.qpos[1] += y_m


def test_a_split_road_is_split_along_the_middle_of_the_car() -> None:
    vehicle = rolling(Road(0.9, mu_left=0.3, mu_right=0.6))
    vehicle.rebase()
    assert frictions(vehicle) == [0.3, 0.6, 0.3, 0.6]
    move(vehicle, 0.0, 1.0)
    assert frictions(vehicle) == [0.3] * 4


def test_one_side_alone_may_differ() -> None:
    vehicle = rolling(Road(0.9, mu_right=0.6))
    vehicle.rebase()
    assert frictions(vehicle) == [0.9, 0.6, 0.9, 0.6]


def test_patch_beats_split_and_the_later_patch_the_earlier() -> None:
    patches = (RoadPatch(-10.0, 10.0, 0.3), RoadPatch(-10.0, 0.0, 0.5, "left"), RoadPatch(100.0, 101.0, 0.1))
    vehicle = rolling(Road(0.9, mu_left=0.8, patches=patches))
    vehicle.rebase()
    # The origin is the centre of gravity: the front wheels are ahead of it, the rear ones behind.
    assert frictions(vehicle) == [0.3, 0.3, 0.5, 0.3]
    move(vehicle, 50.0)
    assert frictions(vehicle) == [0.8, 0.9, 0.8, 0.9]


def test_the_beginning_belongs_to_a_patch_and_the_end_does_not() -> None:
    vehicle = rolling(Road(0.9))
    vehicle.rebase()
    assert frictions(vehicle) == [0.9] * 4
    at = [record(vehicle, corner, "contact_x_m") for corner in CORNERS]
    for start, end, expected in (
        (at[0], at[0] + 1.0, 0.3),
        (np.nextafter(at[0], np.inf), at[0] + 1.0, 0.9),
        (at[0] - 1.0, at[0], 0.9),
    ):
        patched = rolling(Road(0.9, patches=(RoadPatch(start, end, 0.3),)))
        patched.rebase()
        assert frictions(patched)[0] == expected


def test_while_the_car_settles_there_is_one_friction_only() -> None:
    vehicle = rolling(Road(0.9, mu_left=0.3, patches=(RoadPatch(-1e3, 1e3, 0.5),)))
    assert frictions(vehicle) == [0.9] * 4
    vehicle.rebase()
    assert frictions(vehicle) == [0.5] * 4
    vehicle.start(20.0)
    assert frictions(vehicle) == [0.9] * 4


def test_the_road_begins_where_the_recording_does() -> None:
    vehicle = rolling(Road(0.9, patches=(RoadPatch(0.0, 1e3, 0.5),)))
    move(vehicle, 40.0)
    vehicle.rebase()
    assert frictions(vehicle) == [0.5, 0.5, 0.9, 0.9]


def test_the_contact_point_lies_in_the_wheel_plane_below_the_centre(rng: np.random.Generator) -> None:
    vehicle = rolling(Road(0.9))
    tilted_and_moving(vehicle, rng)
    model, data = vehicle.model, vehicle.data
    mujoco.mj_forward(model, data)
    for corner in CORNERS:
        body = model.body(f"{corner}_wheel").id
        axis, centre = data.xmat[body].reshape(3, 3)[:, 1], data.xpos[body]
        contact = np.array([record(vehicle, corner, "contact_x_m"), record(vehicle, corner, "contact_y_m"), 0.0])
        assert abs(axis[2]) > 1e-3
        assert (contact - centre) @ axis == pytest.approx(0.0, abs=1e-12)
        assert (contact - centre) @ np.cross(axis, [0.0, 0.0, 1.0]) == pytest.approx(0.0, abs=1e-12)
        assert np.linalg.norm(contact - centre) == pytest.approx(record(vehicle, corner, "loaded_radius_m"), rel=1e-12)


@pytest.mark.parametrize("mu", [1.0, 0.4])
def test_friction_use_is_that_of_the_formula_s_own_peaks(mu: float, rng: np.random.Generator) -> None:
    given = load_car()
    vehicle = rolling(Road(mu))
    tilted_and_moving(vehicle, rng)
    mujoco.mj_forward(vehicle.model, vehicle.data)
    for corner in CORNERS:
        fx, fy, fz = (record(vehicle, corner, slot) for slot in ("fx_N", "fy_N", "fz_N"))
        gamma = record(vehicle, corner, "inclination_rad")
        tyre = given.tyres[0].mounted_on("LEFT" if corner.endswith("l") else "RIGHT").record
        # The formula ends at the greatest load of the file.
        load = min(fz, tyre["FZMAX"])
        assert load > 100.0
        # Friction does not depend on the slips; the formula wants some all the same.
        mu_x, mu_y = steady_state(tyre, load, 0.01, 0.02, gamma, 250e3, 15.0, mu, 0.0)[5:7]
        use = record(vehicle, corner, "friction_utilisation")
        assert use > 0.02
        assert use == pytest.approx(np.hypot(fx / (mu_x * load), fy / (mu_y * load)), rel=0.02)


def test_along_a_path_friction_follows_the_distance_and_the_side_of_the_path() -> None:
    path = Path.through([0.0, 20.0, 40.0, 60.0], [0.0, 20.0, 40.0, 60.0])  # 45 deg to the left
    patches = (RoadPatch(20.0, 40.0, 0.8, mu_end=0.4), RoadPatch(50.0, 60.0, 0.3, side="left"))
    vehicle = rolling(Road(0.9, patches=patches, along="path").laid(Course(path)))
    vehicle.rebase()
    assert frictions(vehicle) == [0.9] * 4
    move(vehicle, 30.0 * math.sqrt(0.5), 30.0 * math.sqrt(0.5))
    ramp = frictions(vehicle)
    contact = [(record(vehicle, corner, "contact_x_m"), record(vehicle, corner, "contact_y_m")) for corner in CORNERS]
    along = [math.sqrt(0.5) * (x + y) for x, y in contact]
    assert ramp == pytest.approx([0.8 - 0.02 * (s - 20.0) for s in along], abs=1e-6)
    move(vehicle, 25.0 * math.sqrt(0.5), 25.0 * math.sqrt(0.5))
    left_of_path = [y > x for x, y in ((x + 25.0, y + 25.0) for x, y in contact)]
    assert frictions(vehicle) == [0.3 if left else 0.9 for left in left_of_path]
    assert any(left_of_path)
