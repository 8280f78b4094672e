"""Labels at places in the world, drawn over the frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from activesteer.conventions import Array
from activesteer.video.lettering import PANEL, WHITE, font, text_scale, write
from activesteer.video.markings import Label

_TEXT: Final = 10.5


class Labels:
    """Labels for frames of one size."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Choose the font.

        Args:
            size: Width and height of the frames [pixels].
        """
        self._size = size
        self._scale = text_scale(size)
        self._font = font(_TEXT * self._scale)

    def draw(self, pixels: NDArray[np.uint8], scene: mujoco.MjvScene, labels: Sequence[Label]) -> NDArray[np.uint8]:
        """Draw labels over a frame.

        Args:
            pixels: The frame, shape (height, width, 3); it is not changed.
            scene: The scene of the frame, with its camera.
            labels: The labels; labels outside the frame are left out.
        """
        if not labels:
            return pixels
        picture = Image.fromarray(np.ascontiguousarray(pixels))
        for label in labels:
            at, outside = (pixel_of(scene, place, self._size) for place in (label.place_m, label.outside_m))
            far = np.linalg.norm(label.place_m - scene.camera[0].pos) > label.far_m
            if far or not label.text or at is None or outside is None or not self._has(at):
                continue
            right, down = outside[0] - at[0], outside[1] - at[1]
            sideways = abs(right) >= abs(down)
            anchor = ("l" if right > 0 else "r") + "m" if sideways else "m" + ("t" if down > 0 else "b")
            line = None if label.leads_to_m is None else pixel_of(scene, label.leads_to_m, self._size)
            self._write(picture, at, label.text, anchor, line)
        return np.asarray(picture)

    def _has(self, at: tuple[float, float]) -> bool:
        return 0.0 <= at[0] < self._size[0] and 0.0 <= at[1] < self._size[1]

    def _write(
        self, picture: Image.Image, at: tuple[float, float], text: str, anchor: str, line_to: tuple[float, float] | None
    ) -> None:
        pad = 3.0 * self._scale
        width = round(self._font.getlength(text) + 2 * pad)
        height = round(1.35 * _TEXT * self._scale)
        panel = Image.new("RGBA", (max(width, 1), max(height, 1)), PANEL)
        write(panel, (pad, height / 2), text, WHITE, self._font)
        left = at[0] - {"l": 0.0, "m": 0.5, "r": 1.0}[anchor[0]] * width
        top = at[1] - {"t": 0.0, "m": 0.5, "b": 1.0}[anchor[1]] * height
        # Move a label that an edge would cut until all of it is seen.
        left, top = min(max(left, 0.0), self._size[0] - width), min(max(top, 0.0), self._size[1] - height)
        if line_to is not None:
            pen, thick = ImageDraw.Draw(picture), max(1, round(1.2 * self._scale))
            pen.line([line_to, (min(max(line_to[0], left), left + width), top + height / 2)], WHITE[:3], thick)
        picture.paste(panel, (round(left), round(top)), panel)


def pixel_of(scene: mujoco.MjvScene, place_m: Array, size: tuple[int, int]) -> tuple[float, float] | None:
    """Return the position of a place of the world in the frame.

    Args:
        scene: The scene, with its camera.
        place_m: The place [m], shape (3,).
        size: Width and height of the frame [pixels].

    Returns:
        Columns from the left and rows from the top; None if the place is behind the camera.
    """
    # A scene holds a camera for each eye, a few centimetres apart.
    left, right = scene.camera[0], scene.camera[1]
    eye = 0.5 * (left.pos.astype(np.float64) + right.pos)
    forward, up = left.forward.astype(np.float64), left.up.astype(np.float64)
    away = np.asarray(place_m, np.float64) - eye
    depth = float(away @ forward)
    if depth <= left.frustum_near:
        return None
    per_unit = size[1] / (left.frustum_top - left.frustum_bottom) * left.frustum_near / depth
    x, y = float(away @ np.cross(forward, up)), float(away @ up)
    return 0.5 * size[0] + x * per_unit, 0.5 * size[1] - y * per_unit
