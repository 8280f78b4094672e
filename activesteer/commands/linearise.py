"""`activesteer linearise`: modes of the full car at a speed, and stability of the loops around it, over speed."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Final

from activesteer.commands.arguments import (
    add_car,
    add_controller,
    add_driver,
    add_json,
    add_output,
    add_speeds,
    add_workers,
    overrides_of,
)
from activesteer.commands.output import print_json, print_table, tell
from activesteer.commands.progress import RunCounter
from activesteer.errors import ParameterError
from activesteer.files import make_folder
from activesteer.resources import DEFAULT_DRIVER

if TYPE_CHECKING:
    from typing import Any

    from activesteer.studies.linear.margins import LoopMargins

_LOCUS_KMH: Final = (40.0, 60.0, 80.0, 100.0, 120.0, 140.0, 160.0)
"""Speeds of the root locus [km/h]."""
_DRIVER_COLUMNS: Final = {
    "speed_kmh": "km/h",
    "controller": "controller",
    "damping": "damping",
    "damping_in_step": "in a step",
    "damping_in_run": "in a run",
    "step_difference_m": "apart m",
    "phase_margin_deg": "margin deg",
    "crossover_rad_s": "crossover rad/s",
}
"""Key of a result -> head of its column."""
_CONTROLLER_COLUMNS: Final = {
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
        "linearise",
        help="modes of the full car, and stability of its loops",
        description="Print the modes of the full car at a speed. With --loop driver, print crossover frequency, phase "
        "margin and damping of the loop of driver, controller and car, and the damping after a small step of the path, "
        "for the same loop and for a run. With --loop controller, print margins of the loop of controller, control "
        "unit, actuators, car and sensors, opened at the rear actuator and at the superposition; "
        "--set sensors.preset=production takes real sensors.",
    )
    add_car(parser)
    parser.add_argument("--loop", choices=("driver", "controller"), help="instead of the modes, stability of a loop")
    add_controller(parser, several=True, default="with --loop ars and afs, with --loop driver also none")
    add_driver(parser, f"{DEFAULT_DRIVER}; with --loop driver")
    add_speeds(parser, "80; with --loop driver 60, 80 ... 140; with --loop controller 60, 80 ... 160")
    parser.add_argument(
        "--study", metavar="STUDY", help="with --loop controller: smallest margins over the samples of a study (file "
        "or name); controllers are designed for the car without the factors of the study",
    )  # fmt: skip
    add_workers(parser)
    add_output(parser, "DIR", "folder for figures, with --loop controller for a page (default: none)")
    add_json(parser)
    parser.set_defaults(action=_linearise)


def _linearise(options: argparse.Namespace) -> int:
    effects = {"controller": ("driver", "controller"), "driver": ("driver",), "study": ("controller",)}
    for name, loops in effects.items():
        if getattr(options, name) is not None and options.loop not in loops:
            raise ParameterError(f"has an effect with --loop {' or '.join(loops)} only", key=f"--{name}")
    for name in ("jobs", "scheduler"):
        if getattr(options, name) is not None and options.study is None:
            raise ParameterError("has an effect with --study only", key=f"--{name}", value=getattr(options, name))
    if options.output is not None:
        make_folder(options.output, ParameterError)
    return {None: _modes, "driver": _driver_loop, "controller": _controller_loop}[options.loop](options)


def _modes(options: argparse.Namespace) -> int:
    from activesteer.scenario import check_gains
    from activesteer.studies.linear.linearisation import eigenvalue_table, linear_car, linear_cars

    speeds_kmh = options.speeds_kmh or [80.0]
    if len(speeds_kmh) > 1:
        raise ParameterError("give one speed for the modes", key="--speed-kmh", value=speeds_kmh)
    overrides = overrides_of(options)
    check_gains(overrides, ())
    car = linear_car(options.vehicle, speeds_kmh[0] / 3.6, overrides)
    modes, figures = car.modes(), []
    label = f"{speeds_kmh[0]:g} km/h"
    if options.output is not None:
        from activesteer.analysis.linear_plots import draw_bode, draw_root_locus

        speeds = [speed / 3.6 for speed in _LOCUS_KMH]
        systems = [each.state_space() for each in linear_cars(options.vehicle, speeds, overrides)]
        figures = [
            draw_bode({label: car.state_space()}, options.output / "bode.png"),
            draw_root_locus(systems, speeds, options.output / "root_locus.png"),
        ]
    values = {"speed_mps": car.speed_mps, "modes": [mode.to_json() for mode in modes]}
    tell(options, values, [f"{options.vehicle} at {label}", eigenvalue_table(modes)], figures)
    return 0


def _driver_loop(options: argparse.Namespace) -> int:
    from activesteer.studies.linear.driver_loop import FREQUENCIES_RADPS, SPEEDS_KMH, driver_loops

    driver = options.driver or DEFAULT_DRIVER
    loops = driver_loops(
        driver,
        options.vehicle,
        options.controller or ("none", "ars", "afs"),
        options.speeds_kmh or SPEEDS_KMH,
        overrides_of(options),
    )
    rows = [loop.to_json() for loop in loops]
    if options.json:
        print_json(rows)
    else:
        print(f"{driver} in {options.vehicle}")
        print_table(rows, _DRIVER_COLUMNS)
    if options.output is not None:
        from activesteer.analysis.linear_plots import driver_loops_figure
        from activesteer.plotting import save

        figure = driver_loops_figure(rows, FREQUENCIES_RADPS, [loop.loop.response for loop in loops])
        path = save(figure, options.output / "driver.png")
        if not options.json:
            print(f"figure: {path}")
    return 0


def _controller_loop(options: argparse.Namespace) -> int:
    found = _margins(options)
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
    print_table(rows, _CONTROLLER_COLUMNS)
    if options.study:
        least = min(rows, key=lambda row: row["disk_margin"])
        changed = ", ".join(f"{key} = {value:.3g}" for key, value in least["factors"].items())
        where = f"{least['controller']}, {least['loop']}, {least['speed_kmh']:.0f} km/h"
        print(f"smallest disk margin {least['disk_margin']:.3g}: {where}, with {changed}")
    if page is not None:
        print(f"page: {page}")
    return 0


def _margins(options: argparse.Namespace) -> list[LoopMargins]:
    from activesteer.studies.linear.margins import SPEEDS_KMH, loop_margins

    speeds_kmh, overrides = options.speeds_kmh or SPEEDS_KMH, overrides_of(options)
    controllers = options.controller or ("ars", "afs")
    if options.study is None:
        return loop_margins(controllers, options.vehicle, speeds_kmh, overrides)
    from activesteer.studies.linear.worst_margins import worst_margins

    with RunCounter("margins", quiet=options.json) as counter:
        return worst_margins(
            options.study, controllers, options.vehicle, speeds_kmh, overrides, counter,
            jobs=options.jobs, scheduler=options.scheduler,
        )  # fmt: skip
