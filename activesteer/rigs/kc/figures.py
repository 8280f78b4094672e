"""Pictures of kinematics and compliance, both wheels. matplotlib is an extra, imported when a picture is made."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from activesteer.conventions import Array
from activesteer.plotting import new_figure, plain_axis, save_all, zero_line
from activesteer.rigs.kc.definitions import Axle
from activesteer.rigs.kc.metrics_kinematics import roll_angle_rad
from activesteer.rigs.kc.metrics_steering import mean_steer_rad, ratio_curve
from activesteer.rigs.kc.programme import rear_screw_travel_m
from activesteer.rigs.kc.result import KcMetric, KcResult
from activesteer.rigs.kc.sweep import Sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_LEFT, _RIGHT, _THIRD, _GREY = "#0072b2", "#d55e00", "#009e73", "#777777"
"""Colours that colour-blind readers can tell apart (Okabe and Ito, 2008)."""
_DEG: Final = math.degrees(1.0)
_AXLES: Final = (("front axle", 0), ("rear axle", 2))


class Panel(NamedTuple):
    """What a row of panels shows of each wheel: label, and values, shape (n, 4)."""

    label: str
    values: Callable[[Sweep], Array]


_TOE: Final = Panel("toe [deg]\n(+ toe-in)", lambda sweep: _DEG * sweep.toe_rad)
_CAMBER: Final = Panel("camber [deg]\n(- top in)", lambda sweep: _DEG * sweep.camber_rad)
_LOAD: Final = Panel("vertical force\n[kN]", lambda sweep: 1e-3 * sweep.load_N)
_WIND_UP: Final = Panel(
    "wind-up of the\nknuckle [deg]", lambda sweep: _DEG * (sweep.wind_up_rad - sweep.wind_up_rad[sweep.zero])
)


def _moved(points: str, axis: int, *, outwards: bool = False) -> Callable[[Sweep], Array]:
    """Motion of centre or contact point along an axis [mm]."""

    def values(sweep: Sweep) -> Array:
        path = getattr(sweep, points)[..., axis]
        sign = np.array([1.0, -1.0, 1.0, -1.0]) if outwards else 1.0
        return 1e3 * sign * (path - path[sweep.zero])

    return values


def draw(result: KcResult, folder: str | os.PathLike[str]) -> list[Path]:
    """Draw kinematics and compliance of a car, as PNG files.

    Args:
        result: What the rig measured.
        folder: Directory for the files; created where it does not exist.

    Returns:
        The paths written.

    Raises:
        ParameterError: matplotlib is not installed, or a file cannot be written.
    """
    pictures: dict[str, Callable[[KcResult], Figure]] = {
        "rear_camber": rear_camber_figure,
        "parallel_travel": _parallel_travel,
        "opposite_travel": _opposite_travel,
        "side_force": _side_force,
        "longitudinal_force": _longitudinal_force,
        "aligning_moment": _aligning_moment,
        "steering": _steering,
        "targets": _targets,
    }
    if "rear_steering_bump" in result.curves:
        pictures["rear_steering"] = _rear_steering
    return save_all(pictures, result, folder)


def _new_figure(result: KcResult, title: str, width_in: float, height_in: float) -> Figure:
    return new_figure(width_in, height_in, f"{result.vehicle}: {title}")


def _style(axis: Axes) -> None:
    plain_axis(axis)
    low, high = axis.get_ylim()
    if low < 0.0 < high:
        zero_line(axis.axhline)
    zero_line(axis.axvline)
    axis.margins(x=0.0)


def _wheels(axis: Axes, x: Array, values: Array, label: str = "", style: str = "both") -> None:
    """Both wheels of an axle, the right one dashed over the left one, so that both are seen where they agree."""
    width = 1.8 if style == "both" else 0.9
    note = f", {label}" if label else ""
    grey = style == "thin"
    axis.plot(x, values[:, 0], color=_GREY if grey else _LEFT, lw=width, label=label if grey else f"left{note}")
    if not grey:
        axis.plot(x, values[:, 1], color=_RIGHT, lw=width, ls=(0, (4, 3)), label=f"right{note}")


def _grid(
    result: KcResult,
    title: str,
    panels: tuple[Panel, ...],
    sweeps: tuple[tuple[str, str, str], ...],
    xlabel: str,
    factor: float,
) -> Figure:
    """One row per quantity, one column per axle.

    Args:
        result: What to draw.
        title: Title of the figure.
        panels: The rows.
        sweeps: Name, word for the legend and style (`both` wheels, or one `thin` line) of each sweep.
        xlabel: Label of the horizontal axis.
        factor: From the sweep's SI unit to the label's.
    """
    figure = _new_figure(result, title, 8.5, 1.0 + 1.75 * len(panels))
    axes = figure.subplots(len(panels), 2, sharex=True, squeeze=False)
    for row, panel in zip(axes, panels, strict=True):
        for axis, (axle, first) in zip(row, _AXLES, strict=True):
            for name, label, style in sweeps:
                sweep = result.curves[name]
                _wheels(axis, factor * sweep.x, panel.values(sweep)[:, first : first + 2], label, style)
            _style(axis)
            if axis in axes[0]:
                axis.set_title(axle, fontsize="medium")
            if axis in axes[-1]:
                axis.set_xlabel(xlabel)
        row[0].set_ylabel(panel.label)
    figure.align_ylabels(axes[:, 0])
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False, fontsize="small")
    return figure


def rear_camber_figure(result: KcResult) -> Figure:
    """Figure 1 of the paper: rear camber against wheel travel and against side force.

    Source: V. Dorsch, Mecatronics-REM 2012, figure 1.
    """
    figure = _new_figure(result, "camber angle of the rear suspension", 8.5, 3.6)
    travel, force = figure.subplots(1, 2)
    sweep = result.curves["parallel_travel"]
    _wheels(travel, 1e3 * sweep.x, _DEG * sweep.camber_rad[:, 2:])
    travel.set_xlabel("wheel travel, both wheels [mm] (+ bump)")
    travel.set_ylabel("camber [deg] (- top in)")
    sweep = result.curves["lateral_in_phase"]
    _wheels(force, 1e-3 * sweep.x, _DEG * sweep.camber_rad[:, 2:])
    force.set_xlabel("side force at each contact point [kN] (+ to the left)")
    force.set_ylabel("camber [deg]")
    for axis in (travel, force):
        _style(axis)
        axis.legend(frameon=False, fontsize="small")
    return figure


def _parallel_travel(result: KcResult) -> Figure:
    panels = (
        _TOE,
        _CAMBER,
        _LOAD,
        Panel("contact point\noutwards [mm]", _moved("contact_m", 1, outwards=True)),
        Panel("wheel centre\nforwards [mm]", _moved("centre_m", 0)),
    )
    sweeps = (("parallel_travel", "", "both"), ("parallel_kinematic", "without springs, links unloaded", "thin"))
    return _grid(result, "parallel wheel travel", panels, sweeps, "wheel travel [mm] (+ bump)", 1e3)


def _opposite_travel(result: KcResult) -> Figure:
    panels = (_TOE, _CAMBER, _LOAD)
    figure = _grid(
        result,
        "opposite wheel travel",
        panels,
        (("opposite_travel", "", "both"),),
        "travel of the right wheel [mm]",
        1e3,
    )
    for axis, name in zip(figure.axes[:2], ("front", "rear"), strict=True):
        roll = _DEG * roll_angle_rad(Axle(name, result.measured))
        travel = 1e3 * result.curves["opposite_travel"].x

        above = axis.secondary_xaxis("top", functions=(_between(travel, roll), _between(roll, travel)))
        widest = int(min(-roll[0], roll[-1]))
        above.set_xticks(range(-widest, widest + 1, 2 if widest % 2 == 0 else 1))
        above.set_xlabel("roll angle of the body [deg] (+ to the right)", fontsize="small")
        above.tick_params(labelsize="small")
        axis.set_title(f"{name} axle", fontsize="medium", pad=10)
    return figure


def _between(xs: Array, ys: Array) -> Callable[[ArrayLike], ArrayLike]:
    return lambda x: np.interp(np.asarray(x), xs, ys)


def _side_force(result: KcResult) -> Figure:
    panels = (
        _TOE,
        _CAMBER,
        Panel("contact point\nto the left [mm]", _moved("contact_m", 1)),
        Panel("wheel centre\nto the left [mm]", _moved("centre_m", 1)),
    )
    sweeps = (
        ("lateral_in_phase", "in phase (+ to the left)", "both"),
        ("lateral_opposed", "left, opposed (+ inwards)", "thin"),
    )
    return _grid(result, "side force at the contact points", panels, sweeps, "side force at each wheel [kN]", 1e-3)


def _longitudinal_force(result: KcResult) -> Figure:
    panels = (_TOE, _CAMBER, Panel("wheel centre\nforwards [mm]", _moved("centre_m", 0)), _WIND_UP)
    sweeps = (
        ("longitudinal_patch", "at the contact point, locked", "both"),
        ("longitudinal_centre", "left, at the wheel centre", "thin"),
    )
    return _grid(result, "longitudinal force", panels, sweeps, "force at each wheel [kN] (+ forwards)", 1e-3)


def _aligning_moment(result: KcResult) -> Figure:
    panels = (Panel("steer angle [deg]\n(+ left)", lambda sweep: _DEG * sweep.steer_rad), _CAMBER)
    sweeps = (
        ("aligning_in_phase", "in phase (+ to the left)", "both"),
        ("aligning_opposed", "left, opposed (+ toe-in)", "thin"),
    )
    return _grid(result, "aligning moment", panels, sweeps, "moment on each wheel [Nm]", 1.0)


def _steering(result: KcResult) -> Figure:
    figure = _new_figure(result, "steering", 8.5, 6.5)
    (angles, ratio), (ackermann, parking) = figure.subplots(2, 2)
    axle = Axle("front", result.measured)
    sweep = result.curves["steering_rolling"]
    _wheels(angles, _DEG * sweep.x, _DEG * sweep.steer_rad[:, :2])
    angles.set(xlabel="steering wheel [deg] (+ left)", ylabel="steer angle [deg]")
    angles.legend(frameon=False, fontsize="small")
    mean, local = ratio_curve(axle)
    ratio.plot(_DEG * mean, local, color=_LEFT, lw=1.8)
    ratio.set(xlabel="mean steer angle [deg]", ylabel="overall steering ratio")
    steer = _DEG * (sweep.steer_rad[:, :2] - sweep.steer_rad[sweep.zero, :2])
    left = sweep.x >= 0.0
    inner, outer = steer[left, 0], steer[left, 1]
    ackermann.plot(inner, inner - outer, color=_LEFT, lw=1.8, label="this car")
    ackermann.plot(inner, inner - _ideal_outer_deg(axle, inner), color=_GREY, lw=0.9, label="pure rolling")
    ackermann.set(xlabel="inner wheel [deg]", ylabel="inner less outer [deg]")
    ackermann.legend(frameon=False, fontsize="small")
    near = np.abs(sweep.x) <= math.radians(100.0)
    for name, label, colour in (
        ("steering_rolling", "no friction", _GREY),
        ("steering_at_rest_left", "at rest, dry, turning left", _LEFT),
        ("steering_at_rest_right", "turning right", _RIGHT),
    ):
        parking.plot(_DEG * sweep.x[near], _DEG * mean_steer_rad(axle, name)[near], color=colour, lw=1.5, label=label)
    parking.set(xlabel="steering wheel [deg]", ylabel="mean steer angle [deg]")
    parking.legend(frameon=False, fontsize="small")
    for axis in (angles, ratio, ackermann, parking):
        _style(axis)
    return figure


def _rear_steering(result: KcResult) -> Figure:
    """Of the left rear wheel over the travel of the screw in its toe link: angle, camber, half of the track."""
    figure = _new_figure(result, "rear steering by the toe link, left wheel", 9.5, 3.6)
    design = result.curves["rear_steering"]
    travel = 1e3 * rear_screw_travel_m(result.measured.vehicle, design.x)
    middle_m = design.contact_m[design.zero, 2, 1]
    panels = (
        ("steer angle [deg] (+ to the left)", lambda sweep: _DEG * sweep.steer_rad[:, 2]),
        ("camber [deg] (- top in)", lambda sweep: _DEG * sweep.camber_rad[:, 2]),
        (
            "contact point outwards [mm]",
            lambda sweep: 1e3 * (sweep.contact_m[:, 2, 1] - middle_m),
        ),
    )
    looks = (("_bump", "bump 40 mm", _LEFT), ("", "standing", _GREY), ("_rebound", "rebound 40 mm", _RIGHT))
    for axis, (label, values) in zip(figure.subplots(1, 3), panels, strict=True):
        for ending, words, colour in looks:
            axis.plot(travel, values(result.curves[f"rear_steering{ending}"]), color=colour, lw=1.6, label=words)
        axis.set_xlabel("travel of the screw [mm] (+ longer)")
        axis.set_ylabel(label)
        _style(axis)
    figure.axes[0].legend(frameon=False, fontsize="small")
    return figure


def _ideal_outer_deg(axle: Axle, inner_deg: Array) -> Array:
    """Outer steer angle of pure rolling [deg]."""
    left, right = (axis.point_m[1] for axis in axle.axes)
    contact = axle.sweep("steering_rolling").contact_m[axle.sweep("steering_rolling").zero]
    base = float(contact[:2, 0].mean() - contact[2:, 0].mean())
    inner = np.radians(np.maximum(inner_deg, 1e-6))
    return _DEG * np.arctan(1.0 / (1.0 / np.tan(inner) + (left - right) / base))


def _targets(result: KcResult) -> Figure:
    """Every metric with a band: where its value lies between the band's ends."""
    rows = [entry for entry in result.metrics if entry.band is not None]
    figure = _new_figure(result, "target bands", 8.5, 1.2 + 0.24 * max(len(rows), 1))
    axis = figure.subplots()
    axis.axvspan(0.0, 1.0, color="#d5ead9", zorder=0)
    for height, entry in enumerate(reversed(rows)):
        place = _place(entry)
        axis.plot(
            np.clip(place, -0.6, 1.6),
            height,
            "o" if entry.inside else "D",
            color=_THIRD if entry.inside else _RIGHT,
            ms=6,
        )
    axis.set_yticks(range(len(rows)), [_row_name(entry) for entry in reversed(rows)], fontsize="small")
    axis.set_xlim(-0.7, 1.7)
    axis.set_ylim(-0.7, len(rows) - 0.3)
    axis.set_xticks([0.0, 1.0], ["lowest", "highest"])
    axis.grid(visible=True, axis="y", color="#eeeeee", linewidth=0.6)
    axis.spines[["top", "right", "left"]].set_visible(False)
    axis.set_xlabel("target band (what lies further outside is drawn at the edge)")
    return figure


def _place(entry: KcMetric) -> float:
    assert entry.band is not None
    low, high = entry.band
    return (entry.value - low) / (high - low) if high > low else 0.5


def _row_name(entry: KcMetric) -> str:
    assert entry.band is not None
    name = entry.name.replace("_", " ")
    return f"{entry.axle}  {name}  {entry.value:.4g} ({entry.band[0]:g} to {entry.band[1]:g} {entry.unit})"
