"""Gauges on the frames: title, time, and values of each car."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from activesteer.core.units import quantity_of
from activesteer.drawing.cars import SLOWEST_MPS, bytes_of
from activesteer.drawing.panels import FILM, Line, panels_in
from activesteer.recording import Recording

_PANEL: Final = (16, 18, 22, 190)
"""Background colour of texts."""
_WHITE: Final = (245, 246, 248)
_GREY: Final = (176, 181, 189)
_LEGIBLE: Final = 0.85
"""Smallest scale at which texts can be read: letters of 8 pixels."""
# The sizes below are pixels of a frame of 640 x 480.
_ROW: Final = 19.0
_TEXT: Final = 12.5
_SMALL: Final = 10.5
_GAP: Final = 7.0
_BASE: Final = 0.73
"""Height of the line on which texts stand, relative to their row."""
LARGEST_SHARE: Final = 0.1
"""Largest fraction of the frame that gauges may cover."""
_SMALLEST: Final = 0.4
_PLAIN: Final = str.maketrans("\N{MINUS SIGN}\N{EN DASH}\N{SUPERSCRIPT TWO}\N{MULTIPLICATION SIGN}", "--2x")
"""Characters for which Pillow's own font has no glyph, and would draw a box, with those drawn instead."""
_WIDEST: Final = {"speed_mps": "188.8", "sideslip_rad": "-18.8", "steering_wheel_rad": "-188"}

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont
Dialled = Sequence[Sequence["Dials"]]
"""Runs of each pane, from left to right."""


class Dials(NamedTuple):
    """The gauges of one run."""

    recording: Recording
    label: str  # name of the run
    colour: str  # colour of its car, `#rrggbb`

    def value(self, channel: str, time_s: float) -> float:
        """Return a channel at a time, or nan if unknown."""
        if channel not in self.recording or (channel == "sideslip_rad" and not self._moves(time_s)):
            return math.nan
        return float(np.interp(time_s, self.recording.time_s, self.recording[channel]))

    def _moves(self, time_s: float) -> bool:
        return self.value("speed_mps", time_s) > SLOWEST_MPS

    def has(self, line: Line) -> bool:
        """Return whether the run has the signal of a line."""
        return line.channel in self.recording and line.of(self.recording) is not None


class Gauges:
    """Title and time of a frame, and a row of values for each run of its panes."""

    def __init__(self, panes: Dialled, title: str, size: tuple[int, int], note: str = "") -> None:
        """Choose the fonts and the values of the gauges."""
        self._panes, self._size = panes, size
        self._title, self._note = title.translate(_PLAIN), note.translate(_PLAIN)
        self._every = [dial for pane in panes for dial in pane]
        lines = [line for panel in panels_in(FILM) for line in panel.lines_in(FILM)]
        self._readings = [quantity_of(line.channel) for line in lines if any(dial.has(line) for dial in self._every)]
        # A small frame shows fewer values rather than small ones.
        while self._largest_scale() < _LEGIBLE and len(self._readings) > 1:
            self._readings.pop()

    def _largest_scale(self) -> float:
        """Set and return the largest scale at which the gauges fit and leave enough of the frame visible."""
        width, high = self._size[0] / len(self._panes), self._size[1] / 480.0
        scale = max(min(high, math.sqrt(width / 640.0 * high)), _LEGIBLE)
        most = LARGEST_SHARE * self._size[0] * self._size[1]
        while scale > _SMALLEST and (self._fit(scale) > most or self._columns[-1] > width):
            scale *= 0.97
        return scale

    def _fit(self, scale: float) -> float:
        """Set the sizes for a scale, and return the covered area [pixels]."""
        self._row, self._gap = max(1, round(_ROW * scale)), _GAP * scale
        self._text, self._small = _font(_TEXT * scale), _font(_SMALL * scale)
        places = [max(self._text.getlength(dial.label) for dial in self._every) + 2.5 * self._gap]
        for reading in self._readings:
            value = self._text.getlength(_WIDEST.get(reading.channel, "-8.88"))
            name = self._small.getlength(f"{reading.short} {reading.unit.name}")
            places.append(places[-1] + name + value + 3.2 * self._gap)
        self._columns = [round(place) for place in places]
        head = min(self._text.getlength(f"888.88 s{self._title}{self._note}") + 6.0 * self._gap, self._size[0])
        return self._row * (self._columns[-1] * len(self._every) + head)

    def draw(self, pixels: NDArray[np.uint8], time_s: float) -> NDArray[np.uint8]:
        """Draw the gauges over a frame."""
        picture = Image.fromarray(np.ascontiguousarray(pixels))
        end = self._gap
        layer = Image.new("RGBA", (self._size[0], self._row), _PANEL)
        for text, colour in ((f"{time_s:.2f} s", _WHITE), (self._title, _WHITE), (self._note, _GREY)):
            if text:
                _write(layer, (end, _BASE * self._row), text, colour, self._text)
                end += self._text.getlength(text) + 2.0 * self._gap
        layer = layer.crop((0, 0, min(round(end - self._gap), self._size[0]), self._row))
        picture.paste(layer, (0, 0), layer)
        for number, pane in enumerate(self._panes):
            rows = Image.new("RGBA", (self._columns[-1], self._row * len(pane)), _PANEL)
            for place, dial in enumerate(pane):
                self._draw_row(rows, dial, time_s, place * self._row)
            picture.paste(rows, (number * self._size[0] // len(self._panes), self._size[1] - rows.height), rows)
        return np.asarray(picture)

    def _draw_row(self, layer: Image.Image, dial: Dials, time_s: float, top: int) -> None:
        """Draw the row of one run: its name, then its values."""
        gap, base, colour = self._gap, top + _BASE * self._row, bytes_of(dial.colour)
        ImageDraw.Draw(layer).rectangle((0, top, 0.6 * gap, top + self._row - 1), colour)
        _write(layer, (1.4 * gap, base), dial.label, colour, self._text)
        for x, end, reading in zip(self._columns[:-1], self._columns[1:], self._readings, strict=True):
            found = dial.value(reading.channel, time_s)
            value = reading.value_text(found) if math.isfinite(found) else "-"
            unit_at = end - 2.0 * gap - self._small.getlength(reading.unit.name)
            _write(layer, (x, base), reading.short, _GREY, self._small)
            _write(layer, (unit_at - 0.7 * gap, base), value, _WHITE, self._text, "rs")
            _write(layer, (unit_at, base), reading.unit.name, _GREY, self._small)


class LargeSideslip:
    """Name and sideslip angle of each run, large enough for a small image."""

    def __init__(self, panes: Dialled, size: tuple[int, int]) -> None:
        """Choose the fonts."""
        self._panes, self._size = panes, size
        self._name, self._number = _font(0.05 * size[1]), _font(0.16 * size[1])

    def draw(self, pixels: NDArray[np.uint8], time_s: float) -> NDArray[np.uint8]:
        """Draw names and numbers over a frame (see `Gauges.draw`)."""
        picture = Image.fromarray(np.ascontiguousarray(pixels))
        width, row, gap = self._size[0] // len(self._panes), round(0.25 * self._size[1]), round(0.03 * self._size[1])
        for pane, dials in enumerate(self._panes):
            for number, dial in enumerate(dials):
                layer = Image.new("RGBA", (width, row), _PANEL)
                value = abs(math.degrees(dial.value("sideslip_rad", time_s)))
                words = f"{value:.0f}°" if math.isfinite(value) else "-"
                _write(layer, (gap, 0.4 * row), dial.label, bytes_of(dial.colour), self._name)
                _write(layer, (gap, 0.78 * row), "sideslip angle", _GREY, self._name)
                _write(layer, (width - gap, 0.75 * row), words, _WHITE, self._number, "rs")
                picture.paste(layer, (pane * width, self._size[1] - row * (len(dials) - number)), layer)
        return np.asarray(picture)


def _write(
    layer: Image.Image,
    place: tuple[float, float],
    text: str,
    colour: tuple[int, int, int],
    face: Font,
    anchor: str = "ls",
) -> None:
    """Draw a label at a position [pixels], in characters that the font has."""
    ImageDraw.Draw(layer).text(place, text.translate(_PLAIN), colour, face, anchor)


@lru_cache(maxsize=100)
def _font(points: float) -> Font:
    """Return the font of all labels in a size [pixels]."""
    return ImageFont.load_default(max(6.0, points))
