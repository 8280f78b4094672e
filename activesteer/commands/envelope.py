"""`activesteer envelope`: highest entry speeds of a lane change or a slalom, and where each car loses control."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from activesteer.commands.arguments import (
    add_car,
    add_controller,
    add_driver,
    add_figures_folder,
    add_json,
    add_speeds,
    add_workers,
    numbers,
    overrides_of,
)
from activesteer.commands.output import print_json
from activesteer.commands.progress import ProgressBar
from activesteer.errors import ParameterError
from activesteer.files import make_folder
from activesteer.resources import DEFAULT_DRIVER

if TYPE_CHECKING:
    from activesteer.studies.paper.envelope import Envelope


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("envelope", help="highest entry speeds, and where each car loses control")
    parser.add_argument(
        "maneuvers", nargs="+", metavar="MANEUVER", help="lane changes and slaloms: names, or TOML files"
    )
    add_controller(parser, several=True, default="none, ars and afs")
    add_driver(parser, several=True)
    add_car(parser)
    add_speeds(parser, "30 below to 30 above that of the manoeuvre")
    parser.add_argument("--lines-m", type=numbers, metavar="D,D", help="lane.margin_m or cones.offset_m of the map")
    add_figures_folder(parser)
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_envelope)


def _envelope(options: argparse.Namespace) -> int:
    from activesteer.studies.paper.envelope import envelope

    overrides, drivers = overrides_of(options), options.driver or (DEFAULT_DRIVER,)
    lines_m = options.lines_m or []
    controllers = options.controller or ["none", "ars", "afs"]
    _check(options, overrides, drivers[0], controllers, given_lines=bool(lines_m))
    found = []
    for maneuver in options.maneuvers:
        with ProgressBar(f"envelope of {maneuver}", quiet=options.json) as bar:
            made = envelope(
                maneuver,
                controllers,
                options.vehicle,
                overrides,
                drivers=drivers,
                speeds_kmh=options.speeds_kmh or [],
                lines_m=lines_m,
                jobs=options.jobs,
                scheduler=options.scheduler,
                progress=lambda what, done, total, bar=bar: bar(done / total, f"{what} {done}/{total}"),
            )
        figures = _drawn(made, options.output)
        found.append(made.to_json() | {"figures": figures})
        if not options.json:
            _print(made, figures)
    if options.json:
        print_json({"envelopes": found})
    return 0


def _check(
    options: argparse.Namespace,
    overrides: Mapping[str, Any],
    driver: Any,
    controllers: Sequence[str],
    *,
    given_lines: bool,
) -> None:
    """Check all manoeuvres before the first one is driven, which takes minutes."""
    from activesteer.scenario import resolve
    from activesteer.studies.paper.envelope import line_of

    scenarios = [resolve(maneuver, options.vehicle, overrides, driver, controllers) for maneuver in options.maneuvers]
    keys = list(dict.fromkeys(line_of(scenario).key for scenario in scenarios))
    if given_lines and len(keys) > 1:
        raise ParameterError(
            f"would set {' and '.join(keys)} at once; use one command for each",
            key="--lines-m", value=options.lines_m,
        )  # fmt: skip
    names = [scenario.maneuver.name for scenario in scenarios]
    if len(set(names)) < len(names):
        raise ParameterError(
            f"{', '.join(options.maneuvers)}: names must be unique, because the figures are named after them",
            key="MANEUVER", value=tuple(options.maneuvers),
        )  # fmt: skip


def _drawn(made: Envelope, folder: Path | None) -> list[str]:
    """Draw the figure, and return its files; none without a folder."""
    if folder is None:
        return []
    from activesteer.errors import StudyError
    from activesteer.plotting import save
    from activesteer.studies.paper.envelope_figure import envelope_figure

    path = make_folder(folder, StudyError) / f"envelope_{made.maneuver}.png"
    return [str(save(envelope_figure(made), path, StudyError))]


def _print(made: Envelope, figures: Sequence[str]) -> None:
    from activesteer.studies.paper.envelope import RANGE_KMH, State

    tried = f"between {RANGE_KMH[0]:g} and {RANGE_KMH[1]:g} km/h"
    print(f"{made.maneuver}: highest entry speed at {made.line.key} = {made.nominal[1]:g}, {tried}")
    for entry in made.entry_speeds:
        found = "fails at every speed" if entry["entry_speed_kmh"] is None else f"{entry['entry_speed_kmh']:.0f} km/h"
        print(f"  {entry['driver']:<12}{entry['controller']:<8}{found}")
    for driver in made.drivers:
        states = list(made.cells(driver).values())
        counts = ", ".join(f"{states.count(state)} {state.value}" for state in State if state in states)
        print(f"map of {driver}, {len(states)} cells: {counts}")
    for case in made.exceptions:
        print(
            f"bisection is wrong here: {case['driver']} {case['controller']} at {made.line.key} = {case['line_m']:g} "
            f"loses control at {case['lost_kmh']:g} km/h and not at {case['kept_kmh']:g}"
        )
    for figure in figures:
        print(f"figure: {figure}")
