"""`activesteer envelope`: how fast each car gets through a lane change or a slalom, and where who is lost."""

from __future__ import annotations

import argparse
from typing import Any

from activesteer.commands.arguments import (
    add_car,
    add_controller,
    add_driver,
    add_figures_folder,
    add_json,
    add_workers,
    overrides_of,
)
from activesteer.commands.output import print_json
from activesteer.commands.progress import ProgressBar
from activesteer.errors import ParameterError
from activesteer.resources import DEFAULT_DRIVER


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser("envelope", help="how fast cars get through lanes or cones, and where who is lost")
    parser.add_argument("maneuver", metavar="MANEUVER", help="a lane change or slalom: a name, or a TOML file")
    add_controller(parser, several=True, default="none, ars and afs")
    add_driver(parser, several=True)
    add_car(parser)
    parser.add_argument("--speeds-kmh", metavar="V,V", help="speeds of the map (default: the manoeuvre's +-30)")
    parser.add_argument("--lines-m", metavar="D,D", help="lane.margin_m or cones.offset_m of the map")
    add_figures_folder(parser)
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_envelope)


def _envelope(options: argparse.Namespace) -> int:
    from activesteer.studies.envelope import RANGE_KMH, State, envelope

    with ProgressBar("envelope", quiet=options.json) as bar:
        made = envelope(
            options.maneuver,
            options.controller or ("none", "ars", "afs"),
            options.vehicle,
            overrides_of(options),
            drivers=options.driver or (DEFAULT_DRIVER,),
            speeds_kmh=_numbers(options.speeds_kmh, "--speeds-kmh"),
            lines_m=_numbers(options.lines_m, "--lines-m"),
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=lambda what, done, total: bar(done / total, f"{what} {done}/{total}"),
        )
    figure = None
    if options.output is not None:
        from activesteer.errors import StudyError
        from activesteer.files import make_folder
        from activesteer.studies.envelope_figure import draw_envelope

        figure = draw_envelope(made, make_folder(options.output, StudyError) / f"envelope_{made.maneuver}.png")
    if options.json:
        print_json(made.to_json() | {"figures": [] if figure is None else [str(figure)]})
        return 0
    tried = f"between {RANGE_KMH[0]:g} and {RANGE_KMH[1]:g} km/h"
    print(f"highest entry speed at {made.line.key} = {made.nominal[1]:g}, {tried}")
    for entry in made.entry_speeds:
        found = "gets through at none" if entry["entry_speed_kmh"] is None else f"{entry['entry_speed_kmh']:.0f} km/h"
        print(f"  {entry['driver']:<12}{entry['controller']:<8}{found}")
    for driver in made.drivers:
        states = list(made.cells(driver).values())
        counts = ", ".join(f"{states.count(state)} {state.value}" for state in State if state in states)
        print(f"map of {driver}, {len(states)} cells: {counts}")
    for case in made.exceptions:
        print(
            f"not as bisection assumes: {case['driver']} {case['controller']} at {made.line.key} = {case['line_m']:g} "
            f"is lost at {case['lost_kmh']:g} km/h and not at {case['kept_kmh']:g}"
        )
    if figure is not None:
        print(f"figure: {figure}")
    return 0


def _numbers(text: str | None, option: str) -> list[float]:
    try:
        return [float(part) for part in text.split(",")] if text else []
    except ValueError as reason:
        raise ParameterError(
            f"is {text!r}; numbers with commas between are needed, as 60,100", key=option, value=text
        ) from reason
