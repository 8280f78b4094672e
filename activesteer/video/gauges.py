"""Gauges over the frames: title, time, and for each car its values and a plan of its wheel angles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from activesteer.core.units import quantity_of
from activesteer.drawing import wheel_angles
from activesteer.drawing.cars import bytes_of
from activesteer.drawing.panels import FILM, PANELS, panels_in
from activesteer.recording import Recording
from activesteer.road.course import Footprint, footprint_of

Colour = tuple[int, int, int, int]
Font = ImageFont.FreeTypeFont | ImageFont.ImageFont

PANEL: Final = (16, 18, 22, 190)
"""Background colour of texts."""
WHITE: Final = (245, 246, 248, 255)
GREY: Final = (176, 181, 189, 255)

LEGIBLE: Final = 0.85
"""Smallest scale at which texts can be read: letters of 8 pixels."""
_YELLOW: Final = (255, 205, 70, 255)
_BODY: Final = (70, 76, 86, 255)
# The sizes below are pixels of a frame of 640 x 480; see `text_scale`.
_TITLE_ROW: Final = 19.0
_ROW: Final = 17.0
_TEXT: Final = 11.5
_SMALL: Final = 9.5
_GAP: Final = 7.0
_TALLEST_PLAN: Final = 0.24
"""Height of a plan as a fraction of the height of the frame, if there is room for it."""
LARGEST_SHARE: Final = 0.1
"""Largest fraction of the frame that gauges may cover."""
_ROWS_SHARE: Final = 0.07
"""Largest fraction of the frame that title and rows may cover, so that there is room for the plans."""
_SMALLEST: Final = 0.4
_PLAN_ASPECT: Final = 1.25
"""Ratio of width to height of a plan with its steering wheel."""
_CAR_AT, _WHEEL_AT, _WHEEL_HEIGHT = 0.64, 0.2, 0.42
"""Middle of the car and of the steering wheel in a plan, relative to its width, and of the latter to its height."""
_WHEEL_RADIUS: Final = 0.165
"""Radius of the steering wheel, relative to the width of a plan."""
_MIN_ANGLE_RAD: Final = math.radians(0.005)
"""A rear or superposition angle that never reaches this limit is not shown: the car has no such steering [rad]."""
MIN_SPEED_MPS: Final = 1.0
"""Speed below which the sideslip angle is meaningless and not shown [m/s]."""
_SIDE: Final = 3
"""Factor by which plans are drawn larger and then scaled down, because Pillow's lines have hard edges."""

READINGS: Final = tuple(quantity_of(line.channel) for panel in panels_in(FILM) for line in panel.lines_in(FILM))
"""Values in a row. A narrow frame shows the first ones only."""
_ADDED: Final = tuple(line.channel for line in PANELS["added"].lines)
_WIDEST: Final = {"speed_mps": "188.8", "sideslip_rad": "-18.8"}


class Dials(NamedTuple):
    """The gauges of one run."""

    recording: Recording
    label: str  # name of the run
    colour: str  # colour of its car, `#rrggbb`

    def value(self, channel: str, time_s: float) -> float:
        """Return a channel at an instant, or nan if it is not recorded."""
        if channel not in self.recording:
            return math.nan
        return float(np.interp(time_s, self.recording.time_s, self.recording[channel]))


class Gauges:
    """Gauges for frames of one size."""

    def __init__(
        self,
        dials: Sequence[Dials],
        title: str,
        size: tuple[int, int],
        note: str = "",
        shown_with: Sequence[Dials] = (),
        *,
        headed: bool = True,
    ) -> None:
        """Choose fonts and values. A pane that is not headed leaves room for the title, so that all panes are alike."""
        self._dials, self._headed = list(dials), headed and bool(title)
        self._title, self._note = title, note
        self._size = size
        self._every = list(shown_with or dials)
        recordings = [dial.recording for dial in self._every]
        self._factors = wheel_angles.factors(recordings)
        self._readings = [
            reading
            for reading in READINGS
            if reading.channel not in _ADDED or any(used(recording, reading.channel) for recording in recordings)
        ]
        # A small frame shows fewer values rather than small ones.
        while (scale := self._largest_scale()) < LEGIBLE and len(self._readings) > 1:
            self._readings.pop()
        left = LARGEST_SHARE * size[0] * size[1] - self._fit(max(scale, _SMALLEST))
        height = min(_TALLEST_PLAN * size[1], math.sqrt(max(left, 0.0) / max(1, len(dials)) / _PLAN_ASPECT))
        self._plan = int(_PLAN_ASPECT * height), int(height)
        # A plan whose words do not fit beside the middle of its car is left out.
        self._has_plans = self._small.getlength("88.8 deg right") < 2.0 * (1.0 - _CAR_AT) * self._plan[0]

    def _largest_scale(self) -> float:
        """Return the largest scale at which the rows fit into the frame, and rows and title into their share of it."""
        width, height = self._size
        covered = self._fit(1.0)
        return min(text_scale(self._size), math.sqrt(_ROWS_SHARE * width * height / covered), width / self._columns[-1])

    def _fit(self, scale: float) -> float:
        """Set the sizes for a scale. Return the area that title and rows cover [pixels]."""
        self._scale = scale
        self._row, self._title_row = max(1, round(_ROW * scale)), max(1, round(_TITLE_ROW * scale))
        self._text, self._small = font(_TEXT * scale), font(_SMALL * scale)
        self._columns = self._places()
        words = self._text.getlength(f"{self._title}  {self._note}  88.88 s") + 4 * _GAP * scale
        return self._columns[-1] * self._row * len(self._dials) + self._title_row * min(words, self._size[0])

    def draw(self, pixels: NDArray[np.uint8], time_s: float) -> NDArray[np.uint8]:
        """Draw the gauges over a frame."""
        picture = Image.fromarray(np.ascontiguousarray(pixels))
        if self._headed:
            self._headline(picture, f"{time_s:.2f} s")
        panel = Image.new("RGBA", (self._columns[-1], self._row * len(self._dials)), PANEL)
        for number, dial in enumerate(self._dials):
            self._readings_of(panel, dial, time_s, number * self._row)
        picture.paste(panel, (0, self._size[1] - panel.height), panel)
        width, height = self._plan
        if self._has_plans:
            first = self._size[0] - len(self._dials) * width
            top = self._size[1] - height - (panel.height if first < panel.width else 0)
            for number, dial in enumerate(self._dials):
                plan = self._plan_of(dial, time_s)
                picture.paste(plan, (first + number * width, top), plan)
        return np.asarray(picture)

    def _places(self) -> list[int]:
        """Return the left edges of the columns of a row, and the right edge of the last one [pixels]."""
        gap = _GAP * self._scale
        places = [max((self._text.getlength(dial.label) for dial in self._every), default=0.0) + 2.5 * gap]
        for reading in self._readings:
            value = self._text.getlength(_WIDEST.get(reading.channel, "-8.88"))
            name = self._small.getlength(f"{reading.short} {reading.unit.name}")
            places.append(places[-1] + name + value + 2.8 * gap)
        return [round(place) for place in places]

    def _headline(self, picture: Image.Image, time: str) -> None:
        gap = round(_GAP * self._scale)
        right = f"{self._note}   {time}" if self._note else time
        room = self._size[0] - 4 * gap - self._text.getlength(right)
        # A title that does not fit is written smaller, and is cut only if it still does not fit.
        letters = self._text if self._text.getlength(self._title) <= room else self._small
        title = self._title
        while title and letters.getlength(title) > room:
            title = f"{title[:-4].rstrip(' .,-')}..." if len(title) > 6 else ""
        # The width is the same at any other time: all figures of this font have the same width.
        ends = gap + letters.getlength(title) + (2 * gap if title else 0)
        if title != self._title:
            ends = max(ends, self._size[0] - gap - self._text.getlength(right))
        width = min(round(ends + self._text.getlength(right) + gap), self._size[0])
        layer = Image.new("RGBA", (width, self._title_row), PANEL)
        write(layer, (gap, self._title_row / 2), title, WHITE, letters)
        write(layer, (ends, self._title_row / 2), right, GREY, self._text)
        picture.paste(layer, (0, 0), layer)

    def _readings_of(self, panel: Image.Image, dial: Dials, time_s: float, top: int) -> None:
        """Draw the row of one run: its name, then its values."""
        gap, middle = _GAP * self._scale, top + self._row / 2
        bar = (*bytes_of(dial.colour), 255)
        ImageDraw.Draw(panel).rectangle((0, top, 0.6 * gap, top + self._row - 1), bar)
        write(panel, (1.4 * gap, middle), dial.label, bar, self._text)
        moving = dial.value("speed_mps", time_s) > MIN_SPEED_MPS
        for x, end, reading in zip(self._columns[:-1], self._columns[1:], self._readings, strict=True):
            value = dial.value(reading.channel, time_s)
            if reading.channel == "sideslip_rad" and not moving:
                value = math.nan
            write(panel, (x, middle), reading.short, GREY, self._small)
            unit_at = end - 2.0 * gap - self._small.getlength(reading.unit.name)
            write(panel, (unit_at - 0.3 * gap, middle), reading.value_text(value), WHITE, self._text, anchor="rm")
            write(panel, (unit_at, middle), reading.unit.name, GREY, self._small)

    def _plan_of(self, dial: Dials, time_s: float) -> Image.Image:
        """Draw the car from above, front up: wheels at enlarged angles, and an arrow along its velocity."""
        width, height = self._plan
        large = Image.new("RGBA", (width * _SIDE, height * _SIDE), PANEL)
        size = footprint_of(dial.recording.metadata) or Footprint()
        angles = wheel_angles.angles_at(dial.recording, time_s)
        plan = wheel_angles.plan(size, angles, self._factors)
        pen, colour = ImageDraw.Draw(large), (*bytes_of(dial.colour), 255)
        # The plan holds the whole car and the wedges ahead of its front wheels.
        per_m = large.height / (size.front_m - size.rear_m + 2.0)
        middle_m = 0.5 * (size.front_m + size.rear_m) + 0.1

        def at(points_m: NDArray[np.float64]) -> list[tuple[float, float]]:
            return [(_CAR_AT * large.width - y * per_m, large.height / 2 - (x - middle_m) * per_m) for x, y in points_m]

        line = max(1, round(0.05 * per_m))
        pen.polygon(at(plan.body), fill=_BODY, outline=colour, width=line)
        for wheel, wedge in zip(plan.wheels, plan.wedges, strict=True):
            pen.polygon(at(wheel), fill=(12, 12, 14, 255), outline=WHITE, width=max(1, line // 2))
            pen.polygon(at(wedge), fill=colour)
            pen.line(at(wedge[:2]), WHITE, line)
        sideslip = dial.value("sideslip_rad", time_s)
        if math.isfinite(sideslip) and dial.value("speed_mps", time_s) > MIN_SPEED_MPS:
            arrow = at(_arrow((-0.5 * size.wheelbase_m, 0.0), sideslip))
            pen.line(arrow[:2], _YELLOW, line)
            pen.polygon(arrow[2:], _YELLOW)
        _draw_steering_wheel(pen, large.size, dial.value("steering_wheel_rad", time_s), colour)
        shrunk = large.resize((width, height), Image.Resampling.BOX)
        for row, wheel, x in ((0.02, 0, 0.0), (0.97, 2, -size.wheelbase_m)):
            mean = wheel_angles.words(float(np.mean(angles[wheel : wheel + 2])))
            write(shrunk, (_CAR_AT * width, row * height), mean, WHITE, self._small, "mt" if row < 0.5 else "mb")
            beside = width - 0.6 * _GAP * self._scale, at(np.array([(x, 0.0)]))[0][1] / _SIDE
            write(shrunk, beside, f"x{self._factors[wheel]}" if mean else "", GREY, self._small, "rm")
        steering = quantity_of("steering_wheel_rad")
        value = steering.value_text(dial.value(steering.channel, time_s))
        below = _WHEEL_AT * width, _WHEEL_HEIGHT * height + (_WHEEL_RADIUS + 0.03) * width
        write(shrunk, below, f"{value} {steering.unit.name}", WHITE, self._small, "mt")
        return shrunk


class LargeSideslip:
    """Name and sideslip angle of each run, legible in a small picture."""

    def __init__(self, dials: Sequence[Dials], size: tuple[int, int]) -> None:
        """Choose the fonts."""
        self._dials, self._size = list(dials), size
        self._name, self._number = font(0.05 * size[1]), font(0.16 * size[1])

    def draw(self, pixels: NDArray[np.uint8], time_s: float) -> NDArray[np.uint8]:
        """Draw names and numbers over a frame (see `Gauges.draw`)."""
        picture = Image.fromarray(np.ascontiguousarray(pixels))
        row = round(0.25 * self._size[1])
        gap = round(0.03 * self._size[1])
        for number, dial in enumerate(self._dials):
            colour = (*bytes_of(dial.colour), 255)
            panel = Image.new("RGBA", (self._size[0], row), PANEL)
            value = abs(math.degrees(dial.value("sideslip_rad", time_s)))
            known = math.isfinite(value) and dial.value("speed_mps", time_s) > MIN_SPEED_MPS
            write(panel, (gap, 0.32 * row), dial.label, colour, self._name)
            write(panel, (gap, 0.7 * row), "sideslip angle", GREY, self._name)
            words = f"{value:.0f}°" if known else "-"
            write(panel, (self._size[0] - gap, 0.5 * row), words, WHITE, self._number, "rm")
            picture.paste(panel, (0, self._size[1] - row * (len(self._dials) - number)), panel)
        return np.asarray(picture)


def _draw_steering_wheel(pen: ImageDraw.ImageDraw, size: tuple[int, int], angle_rad: float, colour: Colour) -> None:
    """Draw a steering wheel with three spokes; the colour marks its top."""
    if not math.isfinite(angle_rad):
        return
    x, y, radius = _WHEEL_AT * size[0], _WHEEL_HEIGHT * size[1], _WHEEL_RADIUS * size[0]
    thick = max(2, round(0.16 * radius))
    box = (x - radius, y - radius, x + radius, y + radius)
    pen.arc(box, 0, 360, WHITE, thick)
    for spoke in (0.0, 0.5 * math.pi, math.pi):
        # Left is positive, and the rows of a picture count downwards.
        sine, cosine = math.sin(spoke - angle_rad), math.cos(spoke - angle_rad)
        pen.line((x, y, x + (radius - 1) * cosine, y + (radius - 1) * sine), WHITE, thick)
    top = -math.degrees(angle_rad) - 90.0
    pen.arc(box, top - 14.0, top + 14.0, colour, round(1.5 * thick))


def _arrow(start: tuple[float, float], angle_rad: float) -> NDArray[np.float64]:
    """Return both ends of the arrow's shaft, then the corners of its head [m], shape (5, 2)."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    shape = np.array([(0.0, 0.0), (1.5, 0.0), (1.9, 0.0), (1.45, 0.2), (1.45, -0.2)])
    return np.array(start) + shape @ np.array([(cos, sin), (-sin, cos)])


def used(recording: Recording, channel: str) -> bool:
    """Return whether a steering of the car ever turns its wheels."""
    if channel not in recording:
        return False
    values = np.abs(recording[channel])
    return bool(np.max(values[np.isfinite(values)], initial=0.0) >= _MIN_ANGLE_RAD)


def text_scale(size: tuple[int, int]) -> float:
    """Return the scale of texts relative to a frame of 640 x 480, at least so large that they can be read."""
    high = size[1] / 480.0
    return max(min(high, math.sqrt(size[0] / 640.0 * high)), LEGIBLE)


def write(
    layer: Image.Image, place: tuple[float, float], text: str, colour: Colour, face: Font, anchor: str = "lm"
) -> None:
    """Draw a text with its anchor, as Pillow names it, at a place [pixels]."""
    ImageDraw.Draw(layer).text(place, text, colour, face, anchor)


@lru_cache(maxsize=100)
def font(points: float) -> Font:
    """Return the font of all texts over frames in a size [pixels]."""
    return ImageFont.load_default(max(6.0, points))
