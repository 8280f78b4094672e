"""Sky: a dome around the cars, bright at the horizon.

MuJoCo's own sky box fills the whole frame before the road covers nearly all of it. In software rendering that takes a
sixth of the time of a frame.
"""

from __future__ import annotations

from typing import Final

import mujoco
import numpy as np

SKY: Final = "sky"
"""Name of the body that must move along with the cars."""
_RADIUS_M: Final = 560.0
"""Radius of the dome [m], less than the far clipping distance of a frame."""
_ELEVATIONS_DEG: Final = (-3.0, 0.0, 1.0, 4.0, 12.0, 30.0, 60.0, 90.0)
"""Elevations of the rings of vertices; the lowest is below the horizon, because the road does not quite reach it."""
_SIDES: Final = 24
_HORIZON: Final = (0.82, 0.87, 0.91)
_ABOVE: Final = (0.36, 0.52, 0.72)
_BRIGHT_TO: Final = 0.4
"""Height, relative to the radius, at which the colour is halfway between horizon and zenith."""
_PIXELS: Final = 64
_INSET: Final = 1.0 / _PIXELS
"""Margin that keeps texture coordinates off the last pixels, which would blend with the opposite edge."""


def add_sky(spec: mujoco.MjSpec) -> None:
    """Add the sky.

    Args:
        spec: The model.
    """
    around = np.linspace(0.0, 2.0 * np.pi, _SIDES + 1)
    up, turn = np.meshgrid(np.radians(_ELEVATIONS_DEG), around, indexing="ij")
    corners = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], axis=-1).reshape(-1, 3)
    row, side = np.meshgrid(np.arange(len(_ELEVATIONS_DEG) - 1), np.arange(_SIDES), indexing="ij")
    first = (row * (_SIDES + 1) + side).ravel()
    above = first + _SIDES + 1
    # The dome is seen from inside.
    faces = np.concatenate([np.stack([first, above, first + 1], 1), np.stack([first + 1, above, above + 1], 1)])
    height = np.maximum(corners[:, 2], 0.0)
    mesh = spec.add_mesh(name=SKY, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert, mesh.userface = (_RADIUS_M * corners).ravel(), faces.ravel()
    mesh.usertexcoord, mesh.userfacetexcoord = (
        np.stack([np.full_like(height, 0.5), _INSET + (1.0 - 2.0 * _INSET) * height], 1).ravel(),
        faces.ravel(),
    )
    share = np.linspace(0.0, 1.0, _PIXELS)[:, None] / _BRIGHT_TO
    colours = np.add(_ABOVE, (np.array(_HORIZON) - _ABOVE) / (1.0 + share))
    texture = spec.add_texture(name=SKY, type=mujoco.mjtTexture.mjTEXTURE_2D, width=_PIXELS, height=_PIXELS, nchannel=3)
    pixels = np.repeat(np.rint(255.0 * colours)[:, None], _PIXELS, axis=1)
    texture.data = pixels.astype(np.uint8).tobytes()
    material = spec.add_material(name=SKY, emission=1.0, specular=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = SKY
    body = spec.worldbody.add_body(name=SKY, mocap=True)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=SKY, material=SKY, contype=0, conaffinity=0)
