"""The envelope as a picture: a map over speed and line for each driver, entry speeds at the manoeuvre's own line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from activesteer.conventions import run_looks
from activesteer.plotting import Area, Curve, Panel, Picture, draw
from activesteer.studies.paper.envelope import Envelope, State

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS: Final = {
    State.NOBODY: "#d9ead3",
    State.NONE_ONLY: "#8fbfe0",
    State.SOME: "#fff2cc",
    State.ALL: "#e6b8af",
}


def envelope_figure(made: Envelope) -> Figure:
    """Return the figure of an envelope."""
    title = (
        f"{made.maneuver}: cars that get through\nDots: highest entry speed by bisection; cross: the manoeuvre's own"
    )
    shown = {state for driver in made.drivers for state in made.cells(driver).values()}
    legend = [(str(state), _COLOURS[state]) for state in State if state in shown]
    panels = [_map(made, driver) for driver in made.drivers]
    width_in = 1.2 + 4.6 * len(panels)
    return draw(Picture(title, panels, None, len(panels), width_in, 4.2, legend, shared_legend=True))


def _map(made: Envelope, driver: str) -> Panel:
    cells, kept = made.cells(driver), made.kept(driver)
    speeds, lines = (sorted({place[axis] for place in cells}) for axis in (0, 1))
    areas, notes = [], []
    for place, state in cells.items():
        low, high = _edges(lines, place[1])
        areas.append(Area(_edges(speeds, place[0]), low, high, "", _COLOURS[state], edge="white"))
        if state is State.SOME:
            # At the top of the cell: dots and cross are on a line through the middle of some cells.
            notes.append((place[0], high, ", ".join(name for name, passes in kept[place].items() if passes)))
    looks = run_looks(entry["controller"] for entry in made.entry_speeds)
    mine = [entry for entry in made.entry_speeds if entry["driver"] == driver and entry["entry_speed_kmh"] is not None]
    curves = [
        # Each dot is smaller than the one before, so that equal speeds are seen as rings.
        Curve(
            [entry["entry_speed_kmh"]], [made.nominal[1]], entry["controller"], looks[entry["controller"]].colour, "",
            marker="o", size=size,
        )
        for entry, size in zip(mine, np.linspace(12.0, 6.0, len(mine)).tolist(), strict=True)
    ]  # fmt: skip
    speed, line = made.nominal
    curves.append(Curve([speed], [line], "", "black", "", 2.0, "x", 9.0))
    y_label = f"{made.line.label} [m]" if driver == made.drivers[0] else ""
    return Panel("speed [km/h]", y_label, curves, driver, areas, notes=notes)


def _edges(values: list[float], value: float) -> tuple[float, float]:
    """Return the edges of the cell of a value, half-way to its neighbours."""
    index = values.index(value)
    before = values[index - 1] if index else 2.0 * value - (values[1] if len(values) > 1 else value + 1.0)
    after = values[index + 1] if index + 1 < len(values) else 2.0 * value - (values[-2] if index else value - 1.0)
    return 0.5 * (before + value), 0.5 * (value + after)
