"""`activesteer margins`: how far the loops of a controller are from instability, over speed."""

from __future__ import annotations

import argparse
from typing import Any, Final

from activesteer.commands.arguments import add_controller, add_json, add_overrides, add_vehicle, overrides_of
from activesteer.commands.output import print_json

_COLUMNS: Final = {
    "speed_kmh": "km/h",
    "controller": "controller",
    "loop": "opened at",
    "gain_margin_dB": "gain dB",
    "phase_margin_deg": "phase deg",
    "delay_margin_s": "delay s",
    "disk_margin": "disk",
}
"""Key of a row -> head of its column."""


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser(
        "margins",
        help="gain, phase, delay and disk margins of a controller",
        description="Margins of the loop of controller, control unit, actuators, linearised car and sensors, opened at "
        "the rear actuator and at the superposition. Sensors are ideal unless --set sensors.preset=production.",
    )
    add_vehicle(parser)
    add_controller(parser, several=True, default="ars and afs")
    add_overrides(parser)
    parser.add_argument(
        "--speed-kmh", type=float, action="append", metavar="V", help="may be repeated (default: 60, 80 ... 160)"
    )
    add_json(parser)
    parser.set_defaults(action=_margins)


def _margins(options: argparse.Namespace) -> int:
    from activesteer.studies.margins import SPEEDS_KMH, loop_margins

    found = loop_margins(
        options.controller or ("ars", "afs"),
        options.vehicle,
        options.speed_kmh or SPEEDS_KMH,
        overrides_of(options),
    )
    rows = [margins.to_json() for margins in found]
    if options.json:
        print_json(rows)
        return 0
    print(" ".join(f"{head:>14}" for head in _COLUMNS.values()))
    for row in rows:
        values = (row[key] for key in _COLUMNS)
        print(" ".join(f"{value:>14}" if isinstance(value, str) else f"{value:14.3g}" for value in values))
    return 0
