"""Appearance of the car for viewers, against the engine."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from activesteer.drawing.car_model import links_of, primitives_of, scene_of
from activesteer.resources import models_dir


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(models_dir() / "mjcf" / "compact" / "compact.xml"))


def moved(model: mujoco.MjModel, rng: np.random.Generator) -> mujoco.MjData:
    """Return the car at another place, steered, with its wheels in bump."""
    data = mujoco.MjData(model)
    mujoco.mj_integratePos(model, data.qpos, rng.normal(scale=0.02, size=model.nv), 1.0)
    mujoco.mj_forward(model, data)
    return data


def ends(model: mujoco.MjModel, data: mujoco.MjData, points: tuple) -> list[np.ndarray]:
    bodies = [model.body(name).id for name, _ in points]
    return [
        data.xpos[body] + data.xmat[body].reshape(3, 3) @ point for body, (_, point) in zip(bodies, points, strict=True)
    ]


def test_the_ends_of_a_link_are_as_far_apart_as_the_engine_says(
    model: mujoco.MjModel, rng: np.random.Generator
) -> None:
    data = moved(model, rng)
    spatial = 0
    for link in links_of(model):
        start, end = ends(model, data, link.points)
        if link.name[0] == "f" and link.kind != "link":
            continue  # along the strut, a fixed tendon: its length is no distance
        assert np.linalg.norm(end - start) == pytest.approx(
            float(data.ten_length[model.tendon(link.name).id]), rel=1e-9
        )
        spatial += 1
    assert spatial == 6 + 10 + 4


def test_a_front_spring_gets_shorter_as_the_wheel_moves_up(model: mujoco.MjModel) -> None:
    (spring,) = [link for link in links_of(model) if link.name == "fl_spring"]
    assert spring.kind == "spring"
    data = mujoco.MjData(model)
    lengths = []
    for travel_m in (-0.03, 0.0, 0.03):
        data.qpos[model.joint("fl_jounce").qposadr[0]] = travel_m
        mujoco.mj_forward(model, data)
        start, end = ends(model, data, spring.points)
        lengths.append(np.linalg.norm(end - start))
    assert np.allclose(np.diff(lengths), -0.03, atol=1e-3)


def test_every_link_spring_and_damper_is_there_once(model: mujoco.MjModel) -> None:
    links = links_of(model)
    kinds = [link.kind for link in links]
    assert (kinds.count("link"), kinds.count("spring"), kinds.count("damper")) == (16, 4, 4)
    assert len({link.name for link in links}) == len(links)
    assert all(link.radius_m > 0.0 for link in links)


def test_solids_belong_to_bodies_and_come_before_the_links(model: mujoco.MjModel) -> None:
    solids = primitives_of(model)
    assert {solid.body for solid in solids} <= {model.body(index).name for index in range(1, model.nbody)}
    assert scene_of(model) == (*solids, *links_of(model))


def test_solids_behind_a_plane_of_the_world_are_drawn() -> None:
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><geom type='plane' size='9 9 1'/><body name='cube'><geom type='box' size='1 2 3'/></body>"
        "</worldbody></mujoco>"
    )
    (cube,) = primitives_of(model)
    assert (cube.body, cube.size_m) == ("cube", (2.0, 4.0, 6.0))
