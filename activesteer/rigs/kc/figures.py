"""Figures of kinematics and compliance of both wheels."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from markupsafe import Markup

from activesteer.core.conventions import Array
from activesteer.core.units import three_digits, typeset
from activesteer.pages import Page, Section, Table, Text, failed, passed, write_page
from activesteer.plotting import Area, Curve, Panel, Picture, save_all
from activesteer.plotting import draw as drawn
from activesteer.rigs.kc.metrics import DEG, Axle, mean_steer_rad, ratio_curve, roll_angle_rad
from activesteer.rigs.kc.programme import Sweep, rear_screw_travel_m
from activesteer.rigs.kc.result import KcMetric, KcResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LEFT, _RIGHT, _THIRD, _GREY = "#0072b2", "#d55e00", "#009e73", "#777777"
"""Colours that colour-blind readers can distinguish (Okabe and Ito, 2008)."""
_DASHES: Final = (0.0, (4.0, 3.0))
_AXLES: Final = (("front axle", 0), ("rear axle", 2))
_NOTHING: Final = 1e-9
"""Value below which a result is a rounding error."""
_FURTHEST: Final = 0.6
"""Largest distance beyond its band at which a metric is drawn, in widths of the band."""


Row = tuple[str, Callable[[Sweep], Array]]
"""Name and unit of the ordinate, and the function from a sweep to the values of each wheel, shape (n, 4)."""

_TOE: Final[Row] = ("toe [deg]\n(+ toe-in)", lambda sweep: DEG * sweep.toe_rad)
_CAMBER: Final[Row] = ("camber [deg]\n(\N{MINUS SIGN} top in)", lambda sweep: DEG * sweep.camber_rad)
_LOAD: Final[Row] = ("vertical force\n[kN]", lambda sweep: 1e-3 * sweep.load_N)
_WIND_UP: Final[Row] = (
    "wind-up of the\nknuckle [deg]",
    lambda sweep: DEG * (sweep.wind_up_rad - sweep.wind_up_rad[sweep.zero]),
)


def _moved(points: str, axis: int, *, outwards: bool = False) -> Callable[[Sweep], Array]:
    """Return the motion of the wheel centre or of the contact point along an axis [mm]."""

    def values(sweep: Sweep) -> Array:
        path = getattr(sweep, points)[..., axis]
        sign = np.array([1.0, -1.0, 1.0, -1.0]) if outwards else 1.0
        return 1e3 * sign * (path - path[sweep.zero])

    return values


def draw(result: KcResult, folder: str | os.PathLike[str]) -> list[Path]:
    """Draw kinematics and compliance of a car as PNG files, and all of them on the page `kc.html`."""
    pictures = _pictures(result)
    paths = save_all(pictures, folder, f"{result.vehicle}: ")
    return [*paths, _write_page(result, [*pictures.values()], Path(folder))]


def _pictures(result: KcResult) -> dict[str, Picture]:
    return {
        **({"targets": _targets(result)} if result.targeted else {}),
        "rear_camber": _rear_camber(result),
        **{name: _drawn_grid(result, grid) for name, grid in _GRIDS.items()},
        "opposite_travel": _opposite_travel(result),
        "steering": _steering(result),
        **({"rear_steering": _rear_steering(result)} if "rear_steering_bump" in result.curves else {}),
    }


def _write_page(result: KcResult, pictures: Sequence[Picture], folder: Path) -> Path:
    met = len(result.targeted) - len(result.outside)
    lead: list[Text] = [f"{met} of {len(result.targeted)} target bands are met."] if result.targeted else []
    lead += [
        f"Outside its band: {_row_name(entry)}; {entry.remark}."
        if entry.remark
        else failed(f"outside: {_row_name(entry)}")
        for entry in result.outside
    ]
    heads = ["axle", "metric", "value", "unit"]
    banded = sorted(result.targeted, key=lambda entry: entry.inside is True)  # those outside first
    others = [_metric_row(entry)[:4] for entry in result.metrics if entry.inside is None]
    tables = [
        Table(f"{len(others)} metrics without a target band" if banded else "", heads, others, folded=bool(banded))
    ]
    if banded:
        outside = frozenset(range(len(result.outside)))
        columns = [*heads, "target band", "", "remark or source"]
        tables.insert(0, Table("", columns, [_metric_row(entry) for entry in banded], outside))
    metrics = Section("Metrics", tables=tables)
    sections = [
        metrics,
        *(Section(picture.title[0].upper() + picture.title[1:], pictures=[picture._replace(title="")],
                  kind="repeated" if picture.title == "target bands" else "") for picture in pictures),
    ]  # fmt: skip
    title = f"Kinematics and compliance: {result.vehicle}"
    return write_page(Page(f"activesteer kc: {result.vehicle}", title, lead, sections), folder / "kc.html")


def _metric_row(entry: KcMetric) -> list[Text]:
    """Return the cells of a metric."""
    value = entry.value if abs(entry.value) > _NOTHING else 0.0
    return [
        entry.axle,
        Markup('<span title="{}">{}</span>').format(
            entry.definition, entry.name.removeprefix(f"{entry.axle}_").replace("_", " ")
        ),
        three_digits(value) if math.isfinite(value) else "none",
        entry.unit,
        f"{entry.band[0]:g} to {entry.band[1]:g}" if entry.band else "",
        {None: "", True: passed("inside", chip=True), False: failed("outside", chip=True)}[entry.inside],
        entry.remark or entry.source,
    ]


def rear_camber_figure(result: KcResult) -> Figure:
    """Draw figure 1 of the paper: rear camber versus wheel travel and versus side force.

    Source: V. Dorsch, Mecatronics-REM 2012, figure 1.
    """
    picture = _rear_camber(result)
    return drawn(picture._replace(title=f"{result.vehicle}: {picture.title}"))


def _wheels(x: Array, values: Array, label: str = "", *, both: bool = True) -> list[Curve]:
    """Return the left wheel of an axle as a thin grey line, or both wheels with the right one dashed."""
    if not both:
        return [Curve(x, values[:, 0], label, _GREY, "-", 0.9)]
    note = f", {label}" if label else ""
    return [
        Curve(x, values[:, 0], f"left{note}", _LEFT, "-", 1.8),
        Curve(x, values[:, 1], f"right{note}", _RIGHT, _DASHES, 1.8),
    ]


class Grid(NamedTuple):
    """A figure with quantities as rows and axles as columns."""

    title: str
    rows: Sequence[Row]
    both: tuple[str, str]  # name and word for the legend of the sweep that is drawn of both wheels
    left: tuple[str, str] | None  # the same of a sweep that is drawn of the left wheel
    x_label: str
    factor: float  # from the sweep's SI unit to the label's unit


_GRIDS: Final = {
    "parallel_travel": Grid(
        "parallel wheel travel",
        (
            _TOE, _CAMBER, _LOAD, ("contact point\noutwards [mm]", _moved("contact_m", 1, outwards=True)),
            ("wheel centre\nforwards [mm]", _moved("centre_m", 0)),
        ),
        ("parallel_travel", ""), ("parallel_kinematic", "without springs, links unloaded"),
        "wheel travel [mm] (+ bump)", 1e3,
    ),
    "opposite_travel": Grid(
        "opposite wheel travel", (_TOE, _CAMBER, _LOAD), ("opposite_travel", ""), None,
        "travel of the right wheel [mm]", 1e3,
    ),
    "side_force": Grid(
        "side force at the contact points",
        (
            _TOE, _CAMBER, ("contact point\nto the left [mm]", _moved("contact_m", 1)),
            ("wheel centre\nto the left [mm]", _moved("centre_m", 1)),
        ),
        ("lateral_in_phase", "in phase (+ to the left)"), ("lateral_opposed", "left, opposed (+ inwards)"),
        "side force at each wheel [kN]", 1e-3,
    ),
    "longitudinal_force": Grid(
        "longitudinal force",
        (_TOE, _CAMBER, ("wheel centre\nforwards [mm]", _moved("centre_m", 0)), _WIND_UP),
        ("longitudinal_patch", "at the contact point, locked"), ("longitudinal_centre", "left, at the wheel centre"),
        "force at each wheel [kN] (+ forwards)", 1e-3,
    ),
    "aligning_moment": Grid(
        "aligning moment", (("steer angle [deg]\n(+ left)", lambda sweep: DEG * sweep.steer_rad), _CAMBER),
        ("aligning_in_phase", "in phase (+ to the left)"), ("aligning_opposed", "left, opposed (+ toe-in)"),
        "moment on each wheel [Nm]", 1.0,
    ),
}  # fmt: skip
"""Contents of the figures, by name."""


def _drawn_grid(result: KcResult, grid: Grid) -> Picture:
    panels = []
    for place, (row_label, of_wheels) in enumerate(grid.rows):
        above, below = place == 0, place == len(grid.rows) - 1
        for axle, first in _AXLES:
            curves = []
            for name, label in filter(None, (grid.both, grid.left)):
                sweep = result.curves[name]
                values = of_wheels(sweep)[:, first : first + 2]
                curves += _wheels(grid.factor * sweep.x, values, label, both=name == grid.both[0])
            labels = grid.x_label if below else "", row_label if not first else ""
            panels.append(Panel(*labels, curves, axle if above else "", zero=True))
    height_in = 1.0 + 1.75 * len(grid.rows)
    return Picture(grid.title, panels, columns=2, width_in=8.5, height_in=height_in)


def _rear_camber(result: KcResult) -> Picture:
    travel, force = result.curves["parallel_travel"], result.curves["lateral_in_phase"]
    panels = [
        Panel(
            "wheel travel, both wheels [mm] (+ bump)", "camber [deg] (\N{MINUS SIGN} top in)",
            _wheels(1e3 * travel.x, DEG * travel.camber_rad[:, 2:]), zero=True,
        ),
        Panel(
            "side force at each contact point [kN] (+ to the left)", "camber [deg]",
            _wheels(1e-3 * force.x, DEG * force.camber_rad[:, 2:]), zero=True,
        ),
    ]  # fmt: skip
    return Picture("camber angle of the rear suspension", panels, width_in=8.5, height_in=3.6)


def _opposite_travel(result: KcResult) -> Picture:
    picture = _drawn_grid(result, _GRIDS["opposite_travel"])
    panels = list(picture.panels)
    for place, axle in enumerate(("front", "rear")):
        roll = DEG * roll_angle_rad(Axle(axle, result.measured))
        travel = 1e3 * result.curves["opposite_travel"].x
        panels[place] = panels[place]._replace(above=("roll angle of the body [deg] (+ to the right)", travel, roll))
    return picture._replace(panels=panels)


def _steering(result: KcResult) -> Picture:
    axle = Axle("front", result.measured)
    sweep = result.curves["steering_rolling"]
    mean, local = ratio_curve(axle)
    steer = DEG * (sweep.steer_rad[:, :2] - sweep.steer_rad[sweep.zero, :2])
    left = sweep.x >= 0.0
    inner, outer = steer[left, 0], steer[left, 1]
    ackermann = [
        Curve(inner, inner - outer, "Ackermann, this car", _THIRD, "-", 1.8),
        Curve(inner, inner - _ideal_outer_deg(axle, inner), "Ackermann, pure rolling", _THIRD, "--", 0.9),
    ]
    near = np.abs(sweep.x) <= math.radians(100.0)
    parking = [
        Curve(DEG * sweep.x[near], DEG * mean_steer_rad(axle, name)[near], label, colour, "-", 1.5)
        for name, label, colour in (
            ("steering_rolling", "no friction", _GREY),
            ("steering_at_rest_left", "at rest, dry, turning left", "#cc79a7"),
            ("steering_at_rest_right", "at rest, dry, turning right", "#e69f00"),
        )
    ]
    angles = _wheels(DEG * sweep.x, DEG * sweep.steer_rad[:, :2])
    ratio = [Curve(DEG * mean, local, "", _GREY, "-", 1.8)]
    panels = [
        Panel("steering wheel [deg] (+ left)", "steer angle [deg]", angles, zero=True),
        Panel("mean steer angle [deg]", "overall steering ratio", ratio, zero=True),
        Panel("inner wheel [deg]", "inner minus outer [deg]", ackermann, zero=True),
        Panel("steering wheel [deg]", "mean steer angle [deg]", parking, zero=True),
    ]
    return Picture("steering", panels, width_in=8.5, height_in=6.5)


def _rear_steering(result: KcResult) -> Picture:
    """Angle, camber and half track of the left rear wheel versus the travel of its toe link screw."""
    design = result.curves["rear_steering"]
    travel = 1e3 * rear_screw_travel_m(result.measured.vehicle, design.x)
    middle_m = design.contact_m[design.zero, 2, 1]
    shown: dict[str, Callable[[Sweep], Array]] = {
        "steer angle [deg] (+ to the left)": lambda sweep: DEG * sweep.steer_rad[:, 2],
        "camber [deg] (\N{MINUS SIGN} top in)": lambda sweep: DEG * sweep.camber_rad[:, 2],
        "contact point outwards [mm]": lambda sweep: 1e3 * (sweep.contact_m[:, 2, 1] - middle_m),
    }
    looks = (("_bump", "bump 40 mm", _LEFT), ("", "standing", _GREY), ("_rebound", "rebound 40 mm", _RIGHT))
    panels = [
        Panel(
            "travel of the screw [mm] (+ longer)", label,
            [
                Curve(travel, values(result.curves[f"rear_steering{ending}"]), words, colour, "-", 1.6)
                for ending, words, colour in looks
            ],
            zero=True,
        )
        for label, values in shown.items()
    ]  # fmt: skip
    return Picture("rear steering by the toe link, left wheel", panels, width_in=9.5, height_in=3.6)


def _ideal_outer_deg(axle: Axle, inner_deg: Array) -> Array:
    """Return the outer steer angle of pure rolling [deg]."""
    left, right = (axis.point_m[1] for axis in axle.axes)
    contact = axle.sweep("steering_rolling").contact_m[axle.sweep("steering_rolling").zero]
    base = float(contact[:2, 0].mean() - contact[2:, 0].mean())
    inner = np.radians(np.maximum(inner_deg, 1e-6))
    return DEG * np.arctan(1.0 / (1.0 / np.tan(inner) + (left - right) / base))


def _targets(result: KcResult) -> Picture:
    """Position of each metric within its target band."""
    rows = sorted(result.targeted, key=lambda entry: entry.inside is True)  # those outside first
    places = [min(max(_place(entry), -_FURTHEST), 1.0 + _FURTHEST) for entry in rows]
    curves = [
        Curve(
            [places[number]], [float(number)], "",
            _THIRD if entry.inside else _RIGHT, "", marker="o" if entry.inside else "D", size=6.0,
        )
        for number, entry in enumerate(rows)
    ]  # fmt: skip
    x_label = "position in the target band: 0 lowest, 1 highest"
    band = Area([0.0, 1.0], -0.9, len(rows) - 0.3, "", "#d5ead9")
    names = [_row_name(entry, told=False) for entry in rows]
    notes = [(places[number], float(number), three_digits(entry.value)) for number, entry in enumerate(rows)]
    panel = Panel(x_label, "", curves, areas=[band], names=names, notes=notes, x_range=(-0.7, 1.7))
    return Picture("target bands", [panel], width_in=8.5, height_in=1.2 + 0.24 * len(rows))


def _place(entry: KcMetric) -> float:
    assert entry.band is not None
    low, high = entry.band
    return (entry.value - low) / (high - low) if high > low else 0.5


def _row_name(entry: KcMetric, *, told: bool = True) -> str:
    assert entry.band is not None
    name = entry.name.removeprefix(f"{entry.axle}_").replace("_", " ")
    band = f"{entry.band[0]:g} to {entry.band[1]:g} {entry.unit}".removesuffix(" -")
    return typeset(f"{entry.axle}  {name}{f'  {three_digits(entry.value)}' if told else ''} ({band})")
