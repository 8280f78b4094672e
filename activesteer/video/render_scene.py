"""Scene of a film: a MuJoCo model without physics, whose bodies are moved one by one.

The scene is built from the solids in a recording, not from the MJCF that the recording also holds. So no file is
compiled, and a ghost car consists of the same solids, drawn transparent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import mujoco
import numpy as np

from activesteer.core.conventions import Array, yaw_of
from activesteer.drawing.cars import CHASSIS, BodySurface, dressed, share_seen, shares_of
from activesteer.errors import PlaybackError
from activesteer.recording import Primitive, ScenePart
from activesteer.road.course import Course, Footprint
from activesteer.road.drawn import DrawnSurface
from activesteer.road.road import Road
from activesteer.video.road import add_areas, add_course, add_edges, add_road

_SHADED_BELOW: Final = 0.2
_CUTAWAY_SHADE: Final = 0.3
"""Opacity of a shell below which it is darker, and its brightness then: a bright one would tint the tyres behind it."""
_GHOST_OPACITY: Final = 0.35
"""Opacity of a ghost's solid relative to the same solid of an opaque car."""
_SHADOW: Final = "shadow"
_SHADOW_OPACITY: Final = 0.62
_SHADOW_SIZE: Final = 1.15
"""Size of the shadow relative to the car; a shadow cast by the light would triple the rendering time."""
_SHADOW_FADES: Final = 0.3
"""Share of the shadow's width and length in which it fades, on either side."""

_BASE: Final = """
<mujoco>
  <option><flag contact="disable" gravity="disable"/></option>
  <visual>
    <!-- The haze hides the far end of the road. It has the colour of the sky at the horizon; the default is white. -->
    <rgba haze="0.59 0.695 0.81 1"/>
    <headlight ambient="0.42 0.42 0.42" diffuse="0.32 0.32 0.32" specular="0.05 0.05 0.05"/>
    <global offwidth="{width}" offheight="{height}"/>
    <!-- Lengths in units of the extent below: 0.3 m and 600 m. -->
    <map znear="0.075" zfar="150"/>
    <!-- Round parts are small; with the usual 28 x 16 faces each they would cost a third of a picture. -->
    <quality shadowsize="0" offsamples="4" numslices="20" numstacks="6" numquads="2"/>
  </visual>
  <asset>
    <texture type="skybox" builtin="gradient" rgb1="0.82 0.87 0.91" rgb2="0.36 0.52 0.72" width="64" height="384"/>
  </asset>
  <statistic center="0 0 0.5" extent="4"/>
  <worldbody>
    <light name="sun" type="directional" pos="0 0 20" dir="0.35 0.25 -1" diffuse="0.62 0.6 0.56" specular="0.2 0.2 0.2"
      castshadow="false"/>
  </worldbody>
</mujoco>
"""


class FilmedCar(NamedTuple):
    """A car in the scene: its parts, bodies, colours and opacity."""

    parts: tuple[ScenePart, ...]  # parts of the car
    bodies: tuple[str, ...]  # names of its bodies, in the order of the poses
    colour: str = "#3b75b8"  # colour of its shell, `#rrggbb`
    shell_opacity: float = 1.0  # opacity of its shell, 0 to 1
    ghost: bool = False  # whether all of the car is transparent
    size: Footprint = Footprint()  # determines its bodywork and wheels


class RenderScene:
    """Scene of road, course and cars, for a renderer or a viewer."""

    def __init__(
        self,
        cars: Sequence[FilmedCar],
        course: Course | None = None,
        road: Road | None = None,
        size: tuple[int, int] = (640, 480),
        drawn: DrawnSurface | None = None,
        paths: Sequence[Array] = (),
    ) -> None:
        """Build the scene, with edges along the cars' paths [m] on a straight road."""
        try:
            spec = mujoco.MjSpec.from_string(_BASE.format(width=size[0], height=size[1]))
            add_road(spec, road or Road(), drawn)
            add_areas(spec, road or Road())
            if course is not None:
                add_course(spec, course)
            if paths:
                add_edges(spec, paths)
            _add_shadow_material(spec)
            for number, car in enumerate(cars):
                _add_car(spec, car, f"{number}/")
            self.model = spec.compile()
        except (ValueError, KeyError, TypeError) as reason:
            raise PlaybackError(f"car, course or road of the recording cannot be drawn: {reason!r}") from reason
        self.data = mujoco.MjData(self.model)
        self._mocap = [
            np.array([self._mocap_id(f"{number}/{body}") for body in car.bodies]) for number, car in enumerate(cars)
        ]
        self._chassis = [car.bodies.index(CHASSIS) for car in cars]
        self._shadow = [self._mocap_id(f"{number}/{_SHADOW}") for number in range(len(cars))]
        self._opacity = self.model.geom_rgba[:, 3].copy(), self.model.tendon_rgba[:, 3].copy()
        self._ghosts = [(number, *self._drawn(number)) for number, car in enumerate(cars) if car.ghost]
        mujoco.mj_forward(self.model, self.data)

    def _drawn(self, car: int) -> tuple[list[int], list[int]]:
        """Return the indices of a car's geoms and tendons."""
        model, prefix = self.model, f"{car}/"
        geoms = [index for index in range(model.ngeom) if model.body(model.geom_bodyid[index]).name.startswith(prefix)]
        return geoms, [index for index in range(model.ntendon) if model.tendon(index).name.startswith(prefix)]

    def _mocap_id(self, body: str) -> int:
        return int(self.model.body_mocapid[self.model.body(body).id])

    def place(self, car: int, positions_m: Array, quaternions: Array) -> None:
        """Place a car, before `update` applies it."""
        data, chassis = self.data, self._chassis[car]
        data.mocap_pos[self._mocap[car]] = positions_m
        data.mocap_quat[self._mocap[car]] = quaternions
        half = 0.5 * yaw_of(quaternions[chassis])
        data.mocap_pos[self._shadow[car]] = positions_m[chassis, 0], positions_m[chassis, 1], 0.0
        data.mocap_quat[self._shadow[car]] = np.cos(half), 0.0, 0.0, np.sin(half)

    def update(self) -> None:
        """Update all geometry attached to the bodies, and fade out a ghost near its car."""
        chassis = [self.data.mocap_pos[mocap[index]] for mocap, index in zip(self._mocap, self._chassis, strict=True)]
        for ghost, geoms, tendons in self._ghosts:
            apart = min(float(np.linalg.norm(chassis[ghost] - chassis[other])) for other in range(ghost))
            share = share_seen(apart)
            self.model.geom_rgba[geoms, 3] = share * self._opacity[0][geoms]
            self.model.tendon_rgba[tendons, 3] = share * self._opacity[1][tendons]
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        mujoco.mj_tendon(self.model, self.data)


def _add_car(spec: mujoco.MjSpec, car: FilmedCar, prefix: str) -> None:
    bodies = {name: spec.worldbody.add_body(name=prefix + name, mocap=True) for name in car.bodies}
    solids = [part for part in car.parts if isinstance(part, Primitive) and part.body in bodies]
    parts, panels = dressed(car.parts, car.size)
    for panel in panels:
        if panel.body in bodies:
            _add_panel(spec, bodies[panel.body], panel, car, f"{prefix}{panel.body}/{panel.name}")
    for part in parts:
        if isinstance(part, Primitive):
            if part.body in bodies:
                _add_solid(bodies[part.body], part, car)
        elif all(body in bodies for body, _ in part.points):
            rgba = (*part.rgba[:3], part.rgba[3] * _opacity(car))
            tendon = spec.add_tendon(name=f"{prefix}{part.name}", width=part.radius_m, rgba=rgba)
            for number, (body, point) in enumerate(part.points):
                site = f"{prefix}{part.name}/{number}"
                bodies[body].add_site(name=site, pos=point, group=4)
                tendon.wrap_site(site)
    _add_shadow(spec, f"{prefix}{_SHADOW}", [solid for solid in solids if solid.body == CHASSIS], car)


def _opacity(car: FilmedCar) -> float:
    """Return the opacity of the solids of a car relative to an opaque car."""
    return _GHOST_OPACITY if car.ghost else 1.0


def _add_panel(spec: mujoco.MjSpec, body: mujoco.MjsBody, panel: BodySurface, car: FilmedCar, name: str) -> None:
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert, mesh.userface = panel.vertices_m.ravel(), panel.faces.ravel()
    mesh.usernormal, mesh.userfacenormal = panel.normals.ravel(), panel.faces.ravel()
    rgb = panel.rgb or shares_of(car.colour)
    if panel.shell and car.shell_opacity < _SHADED_BELOW:
        rgb = tuple(_CUTAWAY_SHADE * value for value in rgb)
    opacity = (car.shell_opacity if panel.shell else 1.0) * _opacity(car)
    body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, rgba=(*rgb, opacity))


def _add_solid(body: mujoco.MjsBody, solid: Primitive, car: FilmedCar) -> None:
    kinds = {
        "box": mujoco.mjtGeom.mjGEOM_BOX,
        "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
        "sphere": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    }
    half = np.multiply(solid.size_m, 0.5)
    body.add_geom(
        type=kinds[solid.kind],
        size=(half[0], half[2], 0.0) if solid.kind == "cylinder" else half,
        pos=solid.position_m,
        quat=solid.quaternion,
        rgba=(*solid.rgba[:3], solid.rgba[3] * _opacity(car)),
    )


def _add_shadow_material(spec: mujoco.MjSpec) -> None:
    """Add the material of the shadows, opaque in the middle and transparent at the edges."""
    away = np.abs(np.linspace(-1.0, 1.0, 64))
    inside = np.clip((1.0 - away) / _SHADOW_FADES, 0.0, 1.0)
    faded = inside**2 * (3.0 - 2.0 * inside)
    pixels = np.zeros((64, 64, 4), np.uint8)
    pixels[..., 3] = 255.0 * np.outer(faded, faded)
    texture = spec.add_texture(name=_SHADOW, type=mujoco.mjtTexture.mjTEXTURE_2D, width=64, height=64, nchannel=4)
    texture.data = pixels.tobytes()
    material = spec.add_material(name=_SHADOW, specular=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = _SHADOW


def _add_shadow(spec: mujoco.MjSpec, name: str, hull: Sequence[Primitive], car: FilmedCar) -> None:
    """Add the shadow below the chassis, on the road with the heading of the car."""
    body = spec.worldbody.add_body(name=name, mocap=True)
    if not hull:
        return
    low = np.min([np.subtract(solid.position_m, np.multiply(solid.size_m, 0.5)) for solid in hull], axis=0)
    high = np.max([np.add(solid.position_m, np.multiply(solid.size_m, 0.5)) for solid in hull], axis=0)
    half_m = 0.5 * _SHADOW_SIZE * (high - low)
    # Tyres seen through the body would be dark on a dark background.
    opacity = _SHADOW_OPACITY * car.shell_opacity * _opacity(car)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), 0.03),
        size=(half_m[0], half_m[1], 1.0),
        material=_SHADOW,
        rgba=(1.0, 1.0, 1.0, opacity),
    )
