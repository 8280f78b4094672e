"""Make the drawings of axes and signs in the documentation: `python tools/renew.py drawings`.

They are drawn in the axes that they explain, in metres: what is at y = 1 here is on the left of the car. Plain SVG
without fonts or scripts of their own, light, and dark where the reader's system is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Final

PICTURES: Final = Path(__file__).resolve().parents[1] / "docs" / "pictures"
INK, AXIS, MOTION, FORCE, BODY = "#222222", "#0072b2", "#009e73", "#d55e00", "#e8e8e8"
_IN_THE_DARK: Final = {
    "#ffffff": "#1e2129", INK: "#e4e6ea", AXIS: "#4aa8e0", MOTION: "#2bbd8e", FORCE: "#f0843c",
    BODY: "#3a3f4a", "#bbbbbb": "#6b7280",
}  # fmt: skip
_RULES: Final = "".join(
    f'[{part}="{light}"]{{{part}:{dark}}}' for light, dark in _IN_THE_DARK.items() for part in ("fill", "stroke")
)
_DARK: Final = f"@media (prefers-color-scheme:dark){{{_RULES}}}"
WHEELBASE_M, TRACK_M, CG_M = 2.637, 1.53, 1.082
WHEEL_M: Final = (0.63, 0.205)
BACK_M: Final = 0.55
"""Height of the centre of gravity in the drawings [m]."""


class Drawing:
    """A picture in metres, abscissa to the right, ordinate upwards.

    Attributes:
        parts: SVG elements, from the back to the front.
    """

    def __init__(self, left: float, right: float, low: float, high: float, pixels_per_m: float) -> None:
        """Takes the window that is seen [m] and the scale."""
        self._left, self._high, self._scale = left, high, pixels_per_m
        self._width, self._height = (right - left) * pixels_per_m, (high - low) * pixels_per_m
        self.parts: list[str] = []

    def _at(self, x: float, y: float) -> tuple[str, str]:
        return f"{(x - self._left) * self._scale:.1f}", f"{(self._high - y) * self._scale:.1f}"

    def polygon(self, points: list[tuple[float, float]], fill: str = BODY, stroke: str = INK) -> None:
        """A closed outline."""
        text = " ".join(",".join(self._at(*point)) for point in points)
        self.parts.append(f'<polygon points="{text}" fill="{fill}" stroke="{stroke}" stroke-width="1.2"/>')

    def box(self, x: float, y: float, length: float, width: float, turn_deg: float = 0.0, fill: str = BODY) -> None:
        """A rectangle about its middle, turned to the left."""
        cos, sin = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
        corners = [(0.5 * a * length, 0.5 * b * width) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
        self.polygon([(x + cos * a - sin * b, y + sin * a + cos * b) for a, b in corners], fill)

    def line(self, start: tuple[float, float], end: tuple[float, float], colour: str = INK, dash: bool = False) -> None:
        """A thin line, dashed where asked for."""
        (x1, y1), (x2, y2) = self._at(*start), self._at(*end)
        style = ' stroke-dasharray="5 4"' if dash else ""
        self.parts.append(f'<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" stroke="{colour}" stroke-width="1"{style}/>')

    def arrow(self, start: tuple[float, float], length: float, angle_deg: float, colour: str) -> None:
        """An arrow from a point, its direction counted to the left from the abscissa."""
        angle = math.radians(angle_deg)
        end = start[0] + length * math.cos(angle), start[1] + length * math.sin(angle)
        self.line(start, end, colour)
        self._head(end, angle, colour)

    def arc(self, centre: tuple[float, float], radius: float, start_deg: float, end_deg: float, colour: str) -> None:
        """An arc with an arrow head at its end, about a point."""
        ends = [
            (centre[0] + radius * math.cos(math.radians(it)), centre[1] + radius * math.sin(math.radians(it)))
            for it in (start_deg, end_deg)
        ]
        (x1, y1), (x2, y2) = (self._at(*end) for end in ends)
        left, large = end_deg > start_deg, abs(end_deg - start_deg) > 180.0
        size = f"{radius * self._scale:.1f}"
        self.parts.append(
            f'<path d="M {x1} {y1} A {size} {size} 0 {int(large)} {int(not left)} {x2} {y2}" fill="none" '
            f'stroke="{colour}" stroke-width="1.6"/>'
        )
        # A head is straight, the arc is not: it points to where the arc will be half a head later.
        bend = math.radians(90.0 if left else -90.0) - (1.0 if left else -1.0) * 4.0 / (radius * self._scale)
        self._head(ends[1], math.radians(end_deg) + bend, colour)

    def _head(self, tip: tuple[float, float], angle: float, colour: str) -> None:
        back, half = 10.0 / self._scale, 3.6 / self._scale
        cos, sin = math.cos(angle), math.sin(angle)
        sides = [(tip[0] - back * cos - b * half * sin, tip[1] - back * sin + b * half * cos) for b in (1, -1)]
        self.polygon([tip, *sides], colour, colour)

    def dot(self, x: float, y: float, radius_px: float = 3.5, fill: str = INK, stroke: str = INK) -> None:
        """A point."""
        cx, cy = self._at(x, y)
        self.parts.append(
            f'<circle cx="{cx}" cy="{cy}" r="{radius_px:g}" fill="{fill}" stroke="{stroke}" stroke-width="1.2"/>'
        )

    def circle(self, x: float, y: float, radius_m: float, fill: str = BODY) -> None:
        """A wheel from the side."""
        self.dot(x, y, radius_m * self._scale, fill)

    def text(self, x: float, y: float, words: str, colour: str = INK, anchor: str = "start") -> None:
        """A word, for which `words` may hold SVG."""
        tx, ty = self._at(x, y)
        self.parts.append(f'<text x="{tx}" y="{ty}" fill="{colour}" text-anchor="{anchor}">{words}</text>')

    def svg(self, title: str) -> str:
        """The file."""
        body = "\n".join(self.parts)
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self._width:.0f} {self._height:.0f}" '
            f'width="{self._width:.0f}" height="{self._height:.0f}" font-family="sans-serif" font-size="14">\n'
            f"<title>{title}</title>\n<style>{_DARK}</style>\n"
            f'<rect width="100%" height="100%" fill="#ffffff"/>\n{body}\n</svg>\n'
        )


def from_above() -> Drawing:
    """The car from above: axes, corners, steer, yaw and sideslip."""
    d = Drawing(-3.6, 3.0, -1.1, 1.8, 100.0)
    d.polygon([(0.85, 0.55), (0.75, 0.8), (-3.4, 0.85), (-3.45, -0.85), (0.75, -0.8), (0.85, -0.55)])
    for corner, x, side in (("fl", 0.0, 1), ("fr", 0.0, -1), ("rl", -WHEELBASE_M, 1), ("rr", -WHEELBASE_M, -1)):
        y = 0.5 * TRACK_M * side
        front = corner.startswith("f")
        d.box(x, y, *WHEEL_M, 14.0 if front else 0.0, "#bbbbbb")
        place = (x - 0.55, y - 0.13 * side - 0.05) if front else (x - 0.1, y - 0.28 * side - 0.05)
        d.text(*place, f"<tspan font-weight='bold'>{corner}</tspan>")
    d.line((0.0, 0.765), (1.25, 0.765), dash=True)
    d.line((0.0, 0.765), (1.25, 0.765 + 1.25 * math.tan(math.radians(14.0))), dash=True)
    d.arc((0.0, 0.765), 1.1, 0.0, 14.0, MOTION)
    d.text(1.2, 0.86, "steer &gt; 0: to the left", MOTION)
    for angle, name, tx, ty in ((0.0, "x", 1.75, -0.05), (90.0, "y", 0.08, 1.55)):
        d.arrow((0.0, 0.0), 1.65, angle, AXIS)
        d.text(tx, ty, name, AXIS)
    d.dot(0.0, 0.0, 6.0, "#ffffff", AXIS)
    d.dot(0.0, 0.0, 1.8, AXIS, AXIS)
    d.text(0.1, -0.2, "z, up", AXIS)
    cg = (-CG_M, 0.0)
    d.line(cg, (0.0, 0.0), dash=True)
    d.arrow(cg, 1.0, 16.0, FORCE)
    d.text(-0.62, 0.32, "v", FORCE)
    d.arc(cg, 0.62, 0.0, 16.0, MOTION)
    d.text(-0.72, -0.2, "sideslip &gt; 0", MOTION, "middle")
    d.arc(cg, 0.45, 120.0, 260.0, MOTION)
    d.text(-1.3, -0.66, "yaw, yaw rate &gt; 0", MOTION, "middle")
    d.dot(*cg)
    d.text(-CG_M - 0.1, 0.1, "cg", INK, "end")
    d.line((-WHEELBASE_M, -0.6), (-WHEELBASE_M, 0.6), dash=True)
    d.text(-WHEELBASE_M + 0.07, 0.05, "rear axle", INK)
    d.text(-WHEELBASE_M + 0.07, -0.15, "x = -2.637 m", INK)
    return d


def from_side_and_behind() -> Drawing:
    """The car from its right side and from behind: pitch, wheel travel, roll."""
    d = Drawing(-3.7, 6.0, -0.45, 2.0, 80.0)
    d.line((-3.6, 0.0), (1.6, 0.0))
    d.polygon([(0.85, 0.35), (0.8, 0.75), (-0.3, 0.95), (-1.0, 1.42), (-2.5, 1.42), (-3.3, 0.95), (-3.4, 0.35)])
    for x in (0.0, -WHEELBASE_M):
        d.circle(x, 0.316, 0.316, "#bbbbbb")
    d.arrow((0.0, 0.0), 1.45, 0.0, AXIS)
    d.text(1.5, 0.08, "x", AXIS)
    d.arrow((0.0, 0.0), 1.75, 90.0, AXIS)
    d.text(0.08, 1.68, "z", AXIS)
    d.text(-0.1, -0.28, "origin: on the road, middle of the front axle", INK, "middle")
    cg = (-CG_M, BACK_M)
    d.dot(*cg)
    d.arc(cg, 0.5, 150.0, 30.0, MOTION)
    d.text(-CG_M, 1.12, "pitch &gt; 0: nose down", MOTION, "middle")
    d.arrow((-WHEELBASE_M, 0.316), 0.5, 90.0, MOTION)
    d.text(-WHEELBASE_M - 0.1, 1.55, "travel &gt; 0: bump", MOTION, "middle")
    middle = 3.4
    d.line((middle - 1.5, 0.0), (middle + 1.5, 0.0))
    d.polygon(
        [(middle + a, b) for a, b in ((-0.9, 0.3), (-0.88, 0.9), (-0.65, 1.42), (0.65, 1.42), (0.88, 0.9), (0.9, 0.3))]
    )
    for side in (-1, 1):
        d.box(middle + side * 0.765, 0.316, 0.205, 0.632, 0.0, "#bbbbbb")
    d.arrow((middle, 0.0), 1.35, 180.0, AXIS)
    d.text(middle - 1.4, 0.08, "y", AXIS, "end")
    d.arrow((middle, 0.0), 1.75, 90.0, AXIS)
    d.text(middle + 0.08, 1.68, "z", AXIS)
    d.dot(middle, BACK_M)
    d.arc((middle, BACK_M), 0.5, 150.0, 30.0, MOTION)
    d.text(middle + 0.85, 1.1, "roll &gt; 0: to the right", MOTION)
    d.text(middle, -0.28, "from behind", INK, "middle")
    return d


def tyre() -> Drawing:
    """A wheel from above and from behind: ISO-W axes, slip angle, forces, inclination."""
    d = Drawing(-1.3, 4.3, -1.25, 1.25, 130.0)
    d.box(0.0, 0.0, *WHEEL_M, 0.0, "#bbbbbb")
    d.arrow((0.0, 0.0), 1.05, 0.0, AXIS)
    d.text(1.08, -0.12, "x: where the wheel heads", AXIS, "middle")
    d.arrow((0.0, 0.0), 1.05, 90.0, AXIS)
    d.text(0.05, 0.98, "y: to its left", AXIS)
    d.arrow((0.0, 0.0), 1.15, 25.0, MOTION)
    d.text(1.08, 0.5, "v of the wheel", MOTION)
    d.arc((0.0, 0.0), 0.75, 0.0, 25.0, MOTION)
    d.text(0.8, 0.14, "slip angle &gt; 0", MOTION)
    d.arrow((0.0, 0.0), 0.8, -90.0, FORCE)
    d.text(
        0.06, -0.75, "F<tspan dy='4' font-size='11'>y</tspan><tspan dy='-4'> &lt; 0: against the motion</tspan>", FORCE
    )
    d.arc((0.0, 0.0), 0.42, 150.0, 230.0, FORCE)
    d.text(-0.48, -0.05, "M<tspan dy='4' font-size='11'>z</tspan><tspan dy='-4'> &gt; 0:</tspan>", FORCE, "end")
    d.text(-0.48, -0.2, "turns it into v", FORCE, "end")
    d.text(0.0, -1.1, "from above", INK, "middle")
    middle, lean = 3.2, -12.0
    d.line((middle - 0.9, -0.45), (middle + 0.9, -0.45))
    angle = math.radians(lean)
    d.box(middle - 0.32 * math.sin(angle), -0.45 + 0.32 * math.cos(angle), 0.205, 0.632, lean, "#bbbbbb")
    d.line((middle, -0.45), (middle - 1.35 * math.sin(angle), -0.45 + 1.35 * math.cos(angle)), dash=True)
    d.arrow((middle, -0.45), 1.35, 90.0, AXIS)
    d.text(middle - 0.06, 0.78, "z: up from the road", AXIS, "end")
    d.arrow((middle, -0.45), 0.8, 180.0, AXIS)
    d.text(middle - 0.85, -0.4, "y", AXIS, "end")
    d.arc((middle, -0.45), 1.15, 90.0, 90.0 + lean, MOTION)
    d.text(middle + 0.14, 0.78, "inclination &gt; 0", MOTION)
    d.text(middle, -1.1, "from behind", INK, "middle")
    return d


DRAWINGS: Final[dict[str, tuple[str, Callable[[], Drawing]]]] = {
    "signs_from_above": ("The car from above: axes, corners, signs of steer, yaw and sideslip", from_above),
    "signs_from_side": (
        "The car from its right side and from behind: signs of pitch, travel and roll",
        from_side_and_behind,
    ),
    "signs_tyre": ("A wheel from above and from behind: ISO-W axes and signs", tyre),
}


def write_drawings() -> None:
    """Write the files."""
    for name, (title, draw) in DRAWINGS.items():
        (PICTURES / f"{name}.svg").write_text(draw().svg(title), encoding="utf-8")
        print(f"docs/pictures/{name}.svg")
