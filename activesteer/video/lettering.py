"""Text over frames: font, colours and size."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Final

from PIL import Image, ImageDraw, ImageFont

Colour = tuple[int, int, int, int]
Font = ImageFont.FreeTypeFont | ImageFont.ImageFont

PANEL: Final = (16, 18, 22, 190)
"""Background colour of texts."""
WHITE: Final = (245, 246, 248, 255)
GREY: Final = (176, 181, 189, 255)

LEGIBLE: Final = 0.85
"""Smallest scale at which texts can be read: letters of 8 pixels."""


def text_scale(size: tuple[int, int]) -> float:
    """Return the scale of texts relative to a frame of 640 x 480, at least so large that they can be read.

    Args:
        size: Width and height of the frames [pixels].
    """
    high = size[1] / 480.0
    return max(min(high, math.sqrt(size[0] / 640.0 * high)), LEGIBLE)


def write(
    layer: Image.Image, place: tuple[float, float], text: str, colour: Colour, face: Font, anchor: str = "lm"
) -> None:
    """Draw a text. Drawn texts are cached, because most recur in the next frame.

    Args:
        layer: Image to draw on.
        place: Position of the anchor [pixels].
        text: The text.
        colour: Colour of the text.
        face: The font.
        anchor: As in Pillow.
    """
    if text:
        drawn, (left, top) = _drawn(text, colour, face, anchor)
        at = round(place[0] + left), round(place[1] + top)
        layer.paste(drawn, at, drawn)


@lru_cache(maxsize=2000)
def _drawn(text: str, colour: Colour, face: Font, anchor: str) -> tuple[Image.Image, tuple[float, float]]:
    left, top, right, bottom = ImageDraw.Draw(Image.new("L", (1, 1))).textbbox((0, 0), text, face, anchor)
    drawn = Image.new("RGBA", (math.ceil(right - left) + 2, math.ceil(bottom - top) + 2), (*colour[:3], 0))
    ImageDraw.Draw(drawn).text((-left, -top), text, colour, face, anchor)
    return drawn, (left, top)


@lru_cache(maxsize=100)
def font(points: float) -> Font:
    """Return the font of all texts over frames in a size [pixels]."""
    return ImageFont.load_default(max(6.0, points))
