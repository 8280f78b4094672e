"""What is written over the picture: run, time, and of each car speed, steering wheel, sideslip and added angles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from activesteer.quantities import quantity_of
from activesteer.recording import Recording

_HEIGHT: Final = 480.0
"""Sizes below are pixels of a picture of this height; others are scaled with it."""
_PANEL: Final = (16, 18, 22, 165)
_WHITE: Final = (245, 246, 248, 255)
_GREY: Final = (176, 181, 189, 255)
_YELLOW: Final = (255, 205, 70, 255)
_ROW: Final = 62.0
_MIN_ANGLE_RAD: Final = math.radians(0.005)
"""An added angle that never reaches it is not shown: the car has no such steering [rad]."""
MIN_SPEED_MPS: Final = 1.0
"""Below it the direction of motion says nothing, and so neither does the sideslip [m/s]."""
_SIDE: Final = 3
"""Pictures in the gauges are drawn this much larger and then shrunk: Pillow's lines have hard edges."""


READINGS: Final = tuple(
    quantity_of(channel)
    for channel in ("speed_mps", "steering_wheel_rad", "sideslip_rad", "rear_steer_rad", "superposition_rad")
)
"""What is written out."""
_ADDED: Final = ("rear_steer_rad", "superposition_rad")


class Dials(NamedTuple):
    """What the gauges show of one run.

    Attributes:
        recording: The run.
        label: What it is called.
        colour: The colour of its car, `#rrggbb`.
    """

    recording: Recording
    label: str
    colour: str

    def value(self, channel: str, time_s: float) -> float:
        """A channel at an instant; nan where it is not recorded."""
        if channel not in self.recording:
            return math.nan
        return float(np.interp(time_s, self.recording.time_s, self.recording[channel]))


class Gauges:
    """Draws them over pictures of one size."""

    def __init__(self, dials: Sequence[Dials], title: str, size: tuple[int, int]) -> None:
        """Chooses fonts and what is to be shown.

        Args:
            dials: The runs, from top to bottom.
            title: What stands above the picture.
            size: Width and height of the pictures [pixels].
        """
        self._dials = list(dials)
        self._title = title
        self._size = size
        # Rows are as wide as 640 x 480 pixels let them be; a narrow or flat picture gets smaller ones.
        self._scale = min(size[1] / _HEIGHT, size[0] / 640.0)
        self._fonts = {points: _font(points * self._scale) for points in (12, 14, 24)}
        self._readings = [
            reading
            for reading in READINGS
            if reading.channel not in _ADDED or any(_used(dial.recording, reading.channel) for dial in self._dials)
        ]

    def draw(self, pixels: NDArray[np.uint8], time_s: float, note: str = "") -> NDArray[np.uint8]:
        """Draws them over a picture.

        Args:
            pixels: The picture, shape (height, width, 3); it stays as it is.
            time_s: The instant [s].
            note: What stands beside the time, such as a slower speed.

        Returns:
            The picture with gauges, of the same shape.
        """
        picture = Image.fromarray(np.ascontiguousarray(pixels))
        row = round(_ROW * self._scale)
        heights = round(26 * self._scale), row * len(self._dials)
        self._paste(picture, self._headline(time_s, note, heights[0]), 0)
        panel = Image.new("RGBA", (self._size[0], heights[1]), _PANEL)
        for number, dial in enumerate(self._dials):
            self._row(panel, dial, time_s, number * row)
        self._paste(picture, panel, self._size[1] - heights[1])
        return np.asarray(picture)

    @staticmethod
    def _paste(picture: Image.Image, layer: Image.Image, top: int) -> None:
        picture.paste(layer, (0, top), layer)

    def _headline(self, time_s: float, note: str, height: int) -> Image.Image:
        layer = Image.new("RGBA", (self._size[0], height), _PANEL)
        pen, font, margin = ImageDraw.Draw(layer), self._fonts[14], round(10 * self._scale)
        right = f"{note}  {time_s:.2f} s" if note else f"{time_s:.2f} s"
        room = self._size[0] - 3 * margin - font.getlength(right)
        title = self._title
        while title and font.getlength(title) > room:
            title = title[:-2].rstrip(" .,…") + "…" if len(title) > 2 else ""
        pen.text((margin, height / 2), title, _WHITE, font, anchor="lm")
        pen.text((self._size[0] - margin, height / 2), right, _WHITE, font, anchor="rm")
        return layer

    def _row(self, panel: Image.Image, dial: Dials, time_s: float, top: int) -> None:
        """One run: its name above its numbers, beside them wheel and car as they stand."""
        scale, pen = self._scale, ImageDraw.Draw(panel)
        margin, row = 10 * scale, _ROW * scale
        pen.rectangle((0, top, 4 * scale, top + row - 1), dial.colour)
        pen.text(
            (margin, top + 4 * scale), dial.label, _YELLOW if len(self._dials) == 1 else dial.colour, self._fonts[12]
        )
        icon = round(44 * scale)
        steering_wheel = dial.value("steering_wheel_rad", time_s)
        sideslip = dial.value("sideslip_rad", time_s)
        moving = dial.value("speed_mps", time_s) > MIN_SPEED_MPS
        wheel = _steering_wheel(steering_wheel if math.isfinite(steering_wheel) else 0.0, icon)
        car = _drifting_car(
            sideslip if math.isfinite(sideslip) and moving else None,
            [dial.value(channel, time_s) for channel in ("front_steer_rad", "rear_steer_rad")],
            icon,
        )
        left = panel.width - 2 * icon - 2 * round(8 * scale)
        panel.alpha_composite(wheel, (left, top + round(9 * scale)))
        panel.alpha_composite(car, (left + icon + round(8 * scale), top + round(9 * scale)))
        column = (left - margin) / len(self._readings)
        for number, reading in enumerate(self._readings):
            x = margin + number * column
            value = dial.value(reading.channel, time_s)
            if reading.channel == "sideslip_rad" and not moving:
                value = math.nan
            text = reading.value_text(value)
            pen.text((x, top + row - 18 * scale), text, _WHITE, self._fonts[24], anchor="ls")
            after = x + self._fonts[24].getlength(text) + 2 * scale
            pen.text((after, top + row - 18 * scale), reading.unit.name, _GREY, self._fonts[14], anchor="ls")
            pen.text((x, top + row - 4 * scale), reading.short, _GREY, self._fonts[12], anchor="ls")


def _used(recording: Recording, channel: str) -> bool:
    if channel not in recording:
        return False
    values = np.abs(recording[channel])
    return bool(np.max(values[np.isfinite(values)], initial=0.0) >= _MIN_ANGLE_RAD)


def _steering_wheel(angle_rad: float, side: int) -> Image.Image:
    """The steering wheel as the driver sees it, a mark at its top."""
    n = side * _SIDE
    picture = Image.new("RGBA", (n, n))
    pen, centre, radius = ImageDraw.Draw(picture), n / 2, 0.45 * n

    def rim(angle: float, fraction: float) -> tuple[float, float]:
        """A point at an angle from the top, left positive."""
        return centre - fraction * radius * math.sin(angle), centre - fraction * radius * math.cos(angle)

    for spoke in (-math.pi / 2, math.pi / 2, math.pi):
        pen.line((centre, centre, *rim(angle_rad + spoke, 0.95)), _GREY, round(0.07 * n))
    box = (centre - radius, centre - radius, centre + radius, centre + radius)
    pen.ellipse(box, outline=_WHITE, width=round(0.08 * n))
    hub = 0.1 * n
    pen.ellipse((centre - hub, centre - hub, centre + hub, centre + hub), _GREY)
    pen.line((*rim(angle_rad, 0.78), *rim(angle_rad, 1.06)), _YELLOW, round(0.1 * n))
    return picture.resize((side, side), Image.Resampling.BOX)


def _drifting_car(sideslip_rad: float | None, steer_rad: Sequence[float], side: int) -> Image.Image:
    """The car from above with its wheels as they are turned, and an arrow: where it goes; upwards is straight ahead."""
    n = side * _SIDE
    picture = Image.new("RGBA", (n, n))
    pen, centre = ImageDraw.Draw(picture), n / 2

    def at(x: float, y: float) -> tuple[float, float]:
        """Picture of a point of the car, x forward, y left, in fractions of the side."""
        return centre - y * n, centre - x * n

    pen.polygon([at(0.3, 0.13), at(0.3, -0.13), at(-0.3, -0.13), at(-0.3, 0.13)], (90, 120, 160, 255))
    for x, angle in zip((0.19, -0.19), steer_rad, strict=True):
        turned = angle if math.isfinite(angle) else 0.0
        along = 0.085 * math.cos(turned), 0.085 * math.sin(turned)
        for y in (0.16, -0.16):
            ends = at(x + along[0], y + along[1]), at(x - along[0], y - along[1])
            pen.line((*ends[0], *ends[1]), _WHITE, round(0.055 * n))
    if sideslip_rad is not None:
        cos, sin = math.cos(sideslip_rad), math.sin(sideslip_rad)
        tip, neck = 0.48, 0.34
        pen.line((centre, centre, *at(neck * cos, neck * sin)), _YELLOW, round(0.05 * n))
        head = [(tip, 0.0), (neck, 0.07), (neck, -0.07)]
        pen.polygon([at(x * cos - y * sin, x * sin + y * cos) for x, y in head], _YELLOW)
    return picture.resize((side, side), Image.Resampling.BOX)


def _font(points: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(max(6.0, points))
