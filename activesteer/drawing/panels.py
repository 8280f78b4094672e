"""Panels of signals over time, with their curves and the views that show them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from activesteer.core.conventions import CORNERS, Array
from activesteer.core.units import ESTIMATED, MEASURED, DisplayUnit, Quantity, quantity_of
from activesteer.drawing.cars import SLOWEST_MPS
from activesteer.errors import RecordingError

FIGURE, REPORT, EXPLORE, FILM = "figure", "report", "explore", "film"
MOTION, DRIVING, BODY, WHEELS = "Motion", "Driving", "Body", "Wheels"
"""Pages of plots in rerun."""
_RERUN: Final = (MOTION, DRIVING, BODY, WHEELS)
_EVERYWHERE: Final = (FIGURE, REPORT, EXPLORE, FILM, *_RERUN)
_OF_CORNERS: Final[dict[str, str]] = dict(zip(CORNERS, ("#56b4e9", "#e69f00", "#009e73", "#cc79a7"), strict=True))
CORNER_WORDS: Final = {"fl": "front left", "fr": "front right", "rl": "rear left", "rr": "rear right"}
_GREY: Final = "#a6a6a6"
PATH_DISTANCE: Final = "path_distance_m"
"""Name of the only line that needs more than recorded channels. Views that know the course derive it."""
AXLE_SLIP: Final = {f"{axle}_axle_slip_angle_rad": (f"{axle[0]}l", f"{axle[0]}r") for axle in ("front", "rear")}
"""Wheels of each axle's slip angle. It is the mean of the wheels by wheel load, so that a lifted wheel has no part."""
_LEAST_LOAD_N: Final = 1.0
"""Load of a lifted wheel in this mean [N]. An axle in the air then has the mean of both wheels."""


class Channels(Protocol):
    """A recorded run, with channels by name."""

    def __getitem__(self, name: str, /) -> Any:
        """Return the values of a channel."""
        ...


def drawn_values(recording: Channels, channel: str) -> Array:
    """Return a channel for drawing. The sideslip angle of a car that turns round continues beyond 180 deg."""
    if channel in AXLE_SLIP:
        slips, loads = (
            [recording[f"{wheel}_{what}"] for wheel in AXLE_SLIP[channel]] for what in ("slip_angle_rad", "tyre_fz_N")
        )
        slip = np.average(slips, axis=0, weights=np.maximum(loads, _LEAST_LOAD_N))
        # There, the tyre model gives the deflection of the tyre.
        stands = np.abs(recording["speed_mps"]) < SLOWEST_MPS if _holds(recording, "speed_mps") else False
        return np.where(stands, np.nan, slip)
    values = recording[channel]
    return np.unwrap(values) if channel.endswith("sideslip_rad") else values


class Line(NamedTuple):
    """Channel, style and views of a line in a panel."""

    channel: str
    name: str = ""  # its name where a panel has several lines of a run
    colour: str = ""  # its colour where a single run is drawn; empty for the colour of the run
    width: float = 1.5  # its width [pt]
    demand: str = ""  # channel that is zero throughout if the line has no meaning, such as the demand of an actuator
    beside: str = ""  # channel without which the line is not drawn
    views: tuple[str, ...] = _EVERYWHERE  # views that draw the line

    def of(self, recording: Channels) -> Array | None:
        """Return the values of a run [SI], or None if they have no meaning."""
        if self.beside and not _holds(recording, self.beside):
            return None
        values = drawn_values(recording, self.channel)
        demand = self.demand if self.demand and _holds(recording, self.demand) else ""
        return None if demand and not np.any(recording[demand]) else values


class Panel(NamedTuple):
    """A panel of signals over time, with a colour for each line of one run, or for each of several runs."""

    # The first line of each of several runs is full, and views on paper draw the others dotted.

    title: str
    quantity: Quantity  # quantity that gives unit, name of the axis, and the least height of the axis
    lines: tuple[Line, ...]
    note: str = ""  # meaning of a dotted line
    in_rerun: str = ""  # title in rerun, if it tells the lines apart
    extreme: np.ufunc | None = None  # extreme of the four wheels that stands for them where a run has one line
    joined: bool = False  # whether rerun keeps all lines in one entity, which makes the file smaller

    @property
    def title_with_unit(self) -> str:
        """Title in rerun, with the unit in brackets."""
        return self.quantity._replace(label=self.in_rerun or self.quantity.label).title

    def lines_in(self, view: str) -> tuple[Line, ...]:
        """Return the lines that a view draws."""
        return tuple(line for line in self.lines if view in line.views)


def panel_of(channel: str, *others: Line, **more: Any) -> Panel:
    """Return a panel of a channel."""
    shown = quantity_of(channel)
    return Panel(shown.label.capitalize(), shown, (Line(channel), *others), **more)


def _beside_truth(word: str, channel: str) -> Panel:
    found = f"{word}_{channel}"
    return panel_of(found, Line(channel, beside=found), note="dotted: true")


def _also(word: str, channel: str) -> Line:
    return Line(f"{word}_{channel}", word, _GREY, 0.8, views=_RERUN)


def _of_wheels(channel: str, *, title: str = "", extreme: np.ufunc | None = None, demanded: bool = False) -> Panel:
    names = {corner: f"{corner}_{channel}" for corner in CORNERS}
    lines = (
        Line(name, CORNER_WORDS[corner], _OF_CORNERS[corner], demand=name if demanded else "")
        for corner, name in names.items()
    )
    shown = quantity_of(channel)
    return Panel(title or shown.label.capitalize(), shown, tuple(lines), extreme=extreme, joined=extreme is None)


PANELS: Final = {
    "steering_wheel": panel_of("steering_wheel_rad"),
    "yaw_rate": panel_of(
        "yaw_rate_radps",
        Line(
            "yaw_rate_desired_radps", "desired", "#b39b00", 0.8, "yaw_rate_desired_radps",
            views=(REPORT, EXPLORE, *_RERUN),
        ),
        _also(MEASURED, "yaw_rate_radps"),
        note="dotted: desired", in_rerun="yaw rate, desired one thin",
    ),
    "sideslip": panel_of("sideslip_rad", _also(ESTIMATED, "sideslip_rad")),
    "lateral": panel_of("ay_mps2", _also(MEASURED, "ay_mps2")),
    "axle_slip": Panel(
        "Slip angle of the axles", quantity_of("slip_angle_rad"),
        (Line("rear_axle_slip_angle_rad", "rear axle"), Line("front_axle_slip_angle_rad", "front axle")),
        "rear, dotted: front",
    ),
    "added": Panel(
        "Added angle at the wheels", quantity_of("rear_steer_rad")._replace(short="added angle"),
        (
            # An angle that no controller demands is the give of a hinge, not an added angle.
            Line("rear_steer_rad", "rear wheels", "#d55e00", 2.0, "rear_steer_demand_rad"),
            Line("superposition_rad", "front superposition", "#0072b2", 1.0, "superposition_demand_rad"),
        ),
        "rear wheels, dotted: front superposition", "added steer angles, rear thick, front thin",
    ),
    "path_distance": panel_of(PATH_DISTANCE),
    "roll": panel_of("roll_rad"),
    "speed": panel_of("speed_mps"),
    "longitudinal": panel_of("ax_mps2"),
    "sideslip_estimate": _beside_truth(ESTIMATED, "sideslip_rad"),
    "speed_estimate": _beside_truth(ESTIMATED, "speed_mps"),
    "yaw_rate_measured": _beside_truth(MEASURED, "yaw_rate_radps"),
    "lateral_measured": _beside_truth(MEASURED, "ay_mps2"),
    "friction_utilisation": _of_wheels(
        "friction_utilisation", title="Friction utilisation, highest of four wheels", extreme=np.maximum
    ),
    "wheel_load": _of_wheels("tyre_fz_N", title="Wheel load, lowest of four wheels", extreme=np.minimum),
    "lateral_force": _of_wheels("tyre_fy_N"),
    "longitudinal_force": _of_wheels("tyre_fx_N"),
    "brake_pressure": _of_wheels("brake_pressure_Pa", demanded=True),
}  # fmt: skip
"""Panels by name."""

VIEWS: Final = {
    FIGURE: ("steering_wheel", "yaw_rate", "added", "lateral", "sideslip", "roll", "speed"),
    REPORT: (
        "steering_wheel", "yaw_rate", "sideslip", "axle_slip", "lateral", "added", "path_distance", "roll", "speed",
        "sideslip_estimate", "speed_estimate", "yaw_rate_measured", "lateral_measured", "friction_utilisation",
        "wheel_load",
    ),
    EXPLORE: (
        "steering_wheel", "yaw_rate", "sideslip", "axle_slip", "added", "lateral", "path_distance", "roll", "speed",
        "wheel_load",
    ),
    FILM: ("speed", "sideslip", "added", "steering_wheel"),
    MOTION: ("yaw_rate", "sideslip", "added"),
    DRIVING: ("steering_wheel", "speed"),
    BODY: ("lateral", "roll", "longitudinal"),
    WHEELS: ("wheel_load", "friction_utilisation", "lateral_force", "longitudinal_force", "brake_pressure"),
}  # fmt: skip
"""Panels of each view, in their order. A report and Explore show the panels that a run has, in pairs."""


def panels_in(view: str) -> tuple[Panel, ...]:
    """Return the panels of a view."""
    return tuple(PANELS[name] for name in VIEWS[view])


def added_lines(recording: Channels) -> list[Line]:
    """Return the lines of the steer angles that a system adds."""
    return [line for line in PANELS["added"].lines if line.of(recording) is not None]


def link_panels(channels: Iterable[str]) -> tuple[Panel, ...]:
    """Return a panel of link and spring forces for each corner."""
    named = {corner: [name[3:] for name in channels if name.startswith(f"{corner}_")] for corner in CORNERS}
    # A part that all corners have, such as a spring, has the same colour in all of them.
    everywhere = [name for name in named[CORNERS[0]] if all(name in names for names in named.values())]
    colours = (*_OF_CORNERS.values(), "#f0e442", "#d55e00", _GREY)
    panels = []
    for corner, names in named.items():
        order = [*everywhere, *(name for name in names if name not in everywhere)]
        lines = tuple(
            Line(f"{corner}_{name}", name.removesuffix("_force_N").replace("_", " "), colours[place % len(colours)])
            for place, name in enumerate(order)
        )
        title = f"Link forces {CORNER_WORDS[corner]}, tension positive"
        if lines:
            panels.append(Panel(title, _LINK_FORCE, lines, in_rerun=title, joined=True))
    return tuple(panels)


_LINK_FORCE: Final = quantity_of("tie_rod_force_N")._replace(unit=DisplayUnit("N", 1.0), min_span=100.0)


def _holds(recording: Channels, channel: str) -> bool:
    try:
        recording[channel]
    except RecordingError:
        return False
    return True
