"""Contents of a recording apart from its rows: everything needed to repeat and to draw the run."""

from __future__ import annotations

import functools
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final, NamedTuple

import mujoco
import numpy as np

from activesteer.plugins import Plugin
from activesteer.recording import Link, McapWriter, Primitive, Recording, ScenePart
from activesteer.road.drawn import DrawnSurface, places_to_draw
from activesteer.road.surface import surface_of
from activesteer.scenario import Scenario, describe
from activesteer.signals import Channel
from activesteer.simulation.recorder import Recorder
from activesteer.simulation.sampled_controller import about
from activesteer.vehicle import Vehicle
from activesteer.version import __version__

_KINDS: Final = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "sphere",
}


def scene_of(model: mujoco.MjModel) -> tuple[ScenePart, ...]:
    """Return the solids of a car in the frames of their bodies, and the links, springs and dampers between bodies."""
    return (*primitives_of(model), *links_of(model))


def primitives_of(model: mujoco.MjModel) -> tuple[Primitive, ...]:
    """Return the visible geoms of all bodies but the world as simple solids, in the frames of their bodies.

    A capsule becomes a cylinder of the same length; meshes and planes are left out.
    """
    solids = []
    for index in range(model.ngeom):
        body = int(model.geom_bodyid[index])
        kind = int(model.geom_type[index])
        if body == 0 or kind not in _KINDS:
            continue
        size = model.geom_size[index]
        if _KINDS[kind] == "box" or kind == int(mujoco.mjtGeom.mjGEOM_ELLIPSOID):
            extents = 2.0 * size
        elif _KINDS[kind] == "sphere":
            extents = np.full(3, 2.0 * size[0])
        else:
            extents = np.array([2.0 * size[0], 2.0 * size[0], 2.0 * size[1]])
        solids.append(
            Primitive(
                model.body(body).name,
                _KINDS[kind],
                tuple(extents.tolist()),
                tuple(model.geom_pos[index].tolist()),
                tuple(model.geom_quat[index].tolist()),
                tuple(model.geom_rgba[index].tolist()),
            )
        )
    return tuple(solids)


def links_of(model: mujoco.MjModel) -> tuple[Link, ...]:
    """Return the tendons that run straight from site to site, in the order of the model.

    A tendon named `..._spring` or `..._damper` is a spring or damper; others are links. A fixed tendon has no shape of
    its own (the front springs and dampers lie along the strut). It is drawn between the sites `NAME_inner` and
    `NAME_outer` if the model has them.
    """
    links = []
    for index in range(model.ntendon):
        name = model.tendon(index).name
        first = int(model.tendon_adr[index])
        wraps = slice(first, first + int(model.tendon_num[index]))
        if (model.wrap_type[wraps] == int(mujoco.mjtWrap.mjWRAP_SITE)).all():
            sites = [int(site) for site in model.wrap_objid[wraps]]
        else:
            ends = (f"{name}_inner", f"{name}_outer")
            sites = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, end) for end in ends]
            if -1 in sites:
                continue
        kind = name.rpartition("_")[2]
        links.append(
            Link(
                name,
                kind if kind in ("spring", "damper") else "link",
                tuple(
                    (model.body(model.site_bodyid[site]).name, tuple(model.site_pos[site].tolist())) for site in sites
                ),
                float(model.tendon_width[index]),
                tuple(model.tendon_rgba[index].tolist()),
            )
        )
    return tuple(links)


_BEYOND_M: Final = 30.0
"""Length of road that is drawn beyond the distance at the speed of the manoeuvre [m]."""


class RunContext(NamedTuple):
    """Contents of a recording apart from its rows.

    Attributes:
        channels: The table of channels.
        body_names: Bodies whose poses are recorded.
        metadata: Resolved parameters, versions.
        files: Manoeuvre, vehicle, model and tyre files, and the code of a user's controller and driver.
        scene: Appearance of the car.
    """

    channels: tuple[Channel, ...]
    body_names: tuple[str, ...]
    metadata: dict[str, Any]
    files: dict[str, bytes]
    scene: tuple[ScenePart, ...]

    @classmethod
    def of(cls, scenario: Scenario, vehicle: Vehicle, controller: Plugin) -> RunContext:
        """Return the context of a run of a scenario, before the run."""
        metadata = {
            "controller": controller.name,
            **(
                {"controller_parameters": values}
                if (values := controller.parameters_with(scenario.user_parameters))
                else {}
            ),
            **describe(scenario),
            **about(controller, scenario.car.config.controllers, vehicle.timestep_s),
            "car": vehicle.dimensions(),
            "timestep_s": vehicle.timestep_s,
            "versions": _versions(),
        }
        if (course := scenario.maneuver.course) is not None:
            metadata["course"] = course.to_table()
        road = scenario.maneuver.ground
        if (surface := surface_of(road)) is not None:
            length_m = abs(scenario.maneuver.speed_mps) * scenario.maneuver.duration_s + _BEYOND_M
            s_m, d_m = places_to_draw(road, length_m)
            places = np.meshgrid(s_m, d_m, indexing="ij")
            z_m = surface.at(*(place.ravel() for place in places))[:, 0].reshape(len(s_m), len(d_m))
            metadata["surface"] = DrawnSurface(s_m, d_m, z_m).to_table()
        files = {**scenario.files, **controller.files}
        return cls(vehicle.channels.channels, vehicle.body_names, metadata, files, scene_of(vehicle.model))

    def recording(self, recorder: Recorder) -> Recording:
        """Return the recording of a recorder that keeps all rows."""
        time_s, values, poses = recorder.result()
        return Recording(
            self.channels, time_s, values, poses=poses, metadata=self.metadata, attachments=self.files, scene=self.scene
        )

    def writer(self, path: Path) -> McapWriter:
        """Open a file for the rows."""
        return McapWriter(path, self.channels, self.body_names, self.metadata, self.files, self.scene)


@functools.cache
def _versions() -> dict[str, str]:
    found = {"activesteer": __version__, "python": platform.python_version(), "platform": platform.platform()}
    for package in ("mujoco", "numpy", "numba"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "unknown"
    return found
