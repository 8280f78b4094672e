"""The envelope as a picture: a map over speed and line for each driver, entry speeds at the manoeuvre's own line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from activesteer.conventions import run_looks
from activesteer.errors import StudyError
from activesteer.plotting import new_figure, save
from activesteer.studies.paper.envelope import Envelope, State

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS: Final = {
    State.NOBODY: "#d9ead3",
    State.NONE_ONLY: "#8fbfe0",
    State.SOME: "#fff2cc",
    State.ALL: "#e6b8af",
}


def draw_envelope(made: Envelope, path: Path) -> Path:
    """Draws it.

    Args:
        made: The envelope.
        path: File to write.

    Returns:
        The file.

    Raises:
        ActiveSteerError: the file cannot be written, or matplotlib is not installed.
    """
    return save(envelope_figure(made), path, StudyError)


def envelope_figure(made: Envelope) -> Figure:
    """The figure that `draw_envelope` writes."""
    from matplotlib.patches import Patch  # noqa: PLC0415 - an extra, and slow to import

    title = f"{made.maneuver}: who gets through\nDots: highest entry speed by bisection; cross: as the manoeuvre has it"
    figure = new_figure(1.2 + 4.6 * len(made.drivers), 4.2, title)
    panels = figure.subplots(1, len(made.drivers), sharey=True, squeeze=False)[0]
    for axes, driver in zip(panels, made.drivers, strict=True):
        _draw_map(axes, made, driver)
    panels[0].set_ylabel(f"{made.line.label} [m]")
    shown = {state for driver in made.drivers for state in made.cells(driver).values()}
    states = [state for state in State if state in shown]
    patches = [Patch(facecolor=_COLOURS[state], edgecolor="grey") for state in states]
    dots, names = panels[0].get_legend_handles_labels()
    figure.legend([*patches, *dots], [*states, *names], loc="outside lower center", ncols=4, fontsize="small")
    return figure


def _draw_map(axes: Axes, made: Envelope, driver: str) -> None:
    cells = made.cells(driver)
    speeds, lines = (sorted({place[axis] for place in cells}) for axis in (0, 1))
    for place, state in cells.items():
        left, right = _edges(speeds, place[0])
        low, high = _edges(lines, place[1])
        axes.fill_between([left, right], low, high, facecolor=_COLOURS[state], edgecolor="white")
        if state is State.SOME:
            # At the top of the cell: the dots and the cross are on a line through the middle of some.
            text = ", ".join(made.kept_by(driver, place))
            axes.annotate(
                text, (place[0], high), (0, -2), textcoords="offset points", ha="center", va="top", fontsize="xx-small"
            )
    looks = run_looks(entry["controller"] for entry in made.entry_speeds)
    mine = [entry for entry in made.entry_speeds if entry["driver"] == driver and entry["entry_speed_kmh"] is not None]
    for entry, size in zip(mine, np.linspace(12.0, 6.0, len(mine)), strict=True):
        colour = looks[entry["controller"]].colour
        # Ever smaller, so that equal speeds are seen as rings.
        axes.plot(
            entry["entry_speed_kmh"], made.nominal[1], "o", color=colour, markersize=size, label=entry["controller"]
        )
    axes.plot(*made.nominal, "kx", markersize=9, markeredgewidth=2)
    axes.set_xlabel("speed [km/h]")
    axes.set_title(driver, fontsize="medium")


def _edges(values: list[float], value: float) -> tuple[float, float]:
    """Where the cell of a value begins and ends: half-way to its neighbours."""
    index = values.index(value)
    before = values[index - 1] if index else 2.0 * value - (values[1] if len(values) > 1 else value + 1.0)
    after = values[index + 1] if index + 1 < len(values) else 2.0 * value - (values[-2] if index else value - 1.0)
    return 0.5 * (before + value), 0.5 * (value + after)
