"""`activesteer margins`: stability margins of the loops of a controller, over speed."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any, Final

from activesteer.commands.arguments import (
    add_car,
    add_controller,
    add_json,
    add_output,
    add_speeds,
    add_workers,
    overrides_of,
)
from activesteer.commands.output import print_json, print_table
from activesteer.commands.progress import RunCounter
from activesteer.errors import ParameterError

if TYPE_CHECKING:
    from activesteer.studies.linear.margins import LoopMargins

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
    """Add the command to the command line."""
    parser = commands.add_parser(
        "margins",
        help="gain, phase, delay and disk margins of a controller",
        description="Print margins of the loop of controller, control unit, actuators, linearised car and sensors, "
        "opened at the rear actuator and at the superposition. Use --set sensors.preset=production for real sensors.",
    )
    add_car(parser)
    add_controller(parser, several=True, default="ars and afs")
    add_speeds(parser, "60, 80 ... 160")
    parser.add_argument(
        "--study", metavar="STUDY", help="print the smallest margins over the samples of a study (file or name); "
        "controllers are designed for the car without the factors of the study",
    )  # fmt: skip
    add_output(parser, "DIR", "folder for a page with the Nyquist curves (default: no page)")
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_margins)


def _margins(options: argparse.Namespace) -> int:
    found = _found(options)
    rows = [margins.to_json() for margins in found]
    if not rows:
        raise ParameterError("none of these controllers uses a measurement, so there is no loop", key="-c")
    page = None
    if options.output is not None:
        from activesteer.studies.linear.margins_page import write_margins_page

        page = write_margins_page(found, str(options.vehicle), options.output)
    if options.json:
        print_json(rows)
        return 0
    print_table(rows, _COLUMNS)
    if options.study:
        least = min(rows, key=lambda row: row["disk_margin"])
        changed = ", ".join(f"{key} = {value:.3g}" for key, value in least["factors"].items())
        where = f"{least['controller']}, {least['loop']}, {least['speed_kmh']:.0f} km/h"
        print(f"smallest disk margin {least['disk_margin']:.3g}: {where}, with {changed}")
    if page is not None:
        print(f"page: {page}")
    return 0


def _found(options: argparse.Namespace) -> list[LoopMargins]:
    from activesteer.studies.linear.margins import SPEEDS_KMH, loop_margins

    speeds_kmh, overrides = options.speeds_kmh or SPEEDS_KMH, overrides_of(options)
    controllers = options.controller or ("ars", "afs")
    if options.study is None:
        for name in ("jobs", "scheduler"):
            if getattr(options, name) is not None:
                raise ParameterError("belongs to --study", key=f"--{name}", value=getattr(options, name))
        return loop_margins(controllers, options.vehicle, speeds_kmh, overrides)
    from activesteer.studies.linear.worst_margins import worst_margins

    with RunCounter("margins", quiet=options.json) as counter:
        return worst_margins(
            options.study, controllers, options.vehicle, speeds_kmh, overrides, counter,
            jobs=options.jobs, scheduler=options.scheduler,
        )  # fmt: skip
