"""End card of a film: title and results over the last frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from activesteer.drawing.cars import bytes_of
from activesteer.video.lettering import PANEL, WHITE, font, text_scale, write

_TITLE, _TEXT, _LINE, _MARGIN, _BAR = 17.0, 12.0, 20.0, 16.0, 5.0
_SHADE: Final = (*PANEL[:3], 225)


def end_card(
    title: str, lines: Sequence[str], colours: Sequence[str], size: tuple[int, int]
) -> Callable[[NDArray[np.uint8]], NDArray[np.uint8]]:
    """Draw the end card.

    Args:
        title: Title of the film.
        lines: Results, a line for each run, then other lines.
        colours: Colours of the runs, `#rrggbb`.
        size: Width and height of the frames [pixels].

    Returns:
        Function that draws the card over a frame.
    """
    scale = text_scale(size)
    margin, line, bar = (value * scale for value in (_MARGIN, _LINE, _BAR))
    large, text = font(_TITLE * scale), font(_TEXT * scale)
    room = size[0] - 4.0 * margin - 2.0 * bar
    heads = _wrapped(title, lambda part: large.getlength(part) <= size[0] - 4.0 * margin) or [""]
    above = margin + (0.6 + len(heads)) * line
    rows = [
        (part, colour if number == 0 else "")
        for words, colour in zip(lines, [*colours, *[""] * len(lines)], strict=False)
        for number, part in enumerate(_wrapped(words, lambda part: text.getlength(part) <= room))
    ]
    height = min(round(above + line * len(rows) + margin), size[1])
    card = Image.new("RGBA", (max(round(size[0] - 2.0 * margin), 1), height), _SHADE)
    for number, head in enumerate(heads):
        write(card, (margin, margin + (number + 0.5) * line), head, WHITE, large)
    pen = ImageDraw.Draw(card)
    for number, (words, colour) in enumerate(rows):
        top = above + number * line
        if colour:
            pen.rectangle((margin, top + 0.1 * line, margin + bar, top + 0.9 * line), (*bytes_of(colour), 255))
        write(card, (margin + 2.0 * bar, top + 0.5 * line), words, WHITE, text)
    at = (size[0] - card.width) // 2, (size[1] - card.height) // 2

    def lay_over(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        picture = Image.fromarray(np.ascontiguousarray(pixels))
        picture.paste(card, at, card)
        return np.asarray(picture)

    return lay_over


def _wrapped(words: str, fits: Callable[[str], bool]) -> list[str]:
    rows: list[str] = []
    for word in words.split():
        if rows and fits(f"{rows[-1]} {word}"):
            rows[-1] += f" {word}"
        else:
            rows.append(word)
    return rows
