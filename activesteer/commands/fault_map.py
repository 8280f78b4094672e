"""`activesteer fault-map`: effect of each fault on the car, and the longest time it may last."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from typing import Any, Final

from activesteer.commands.arguments import (
    add_car,
    add_controller,
    add_driver,
    add_figures_folder,
    add_json,
    add_speeds,
    add_workers,
    overrides_of,
    pairs,
)
from activesteer.commands.output import tell
from activesteer.commands.progress import ProgressBar
from activesteer.config import Source, build
from activesteer.errors import ParameterError

_ROW: Final = "{:<30}{:<18}{:>7}{:>10}{:>8}{:>9}{:>9}{:>10}{:>11}"
_HEADS: Final = (
    ("fault", "situation", "speed", "yaw rate", "a_y", "off 1 s", "driver", "corrects", "tolerated"),
    ("", "", "km/h", "deg/s", "m/s2", "m", "m", "deg", "s"),
)


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("fault-map", help="effect of faults on the car, and how long they may last")
    add_controller(parser, several=False)
    add_driver(parser)
    add_car(parser)
    parser.add_argument(
        "--fault", action="append", default=[], dest="faults", metavar="PART:KIND[=SIZE]",
        help="a fault, such as rear:stuck or rear:offset=1deg (default: all of the controller's actuators)",
    )  # fmt: skip
    parser.add_argument("--preset", default="usual", metavar="NAME", help="usual, or un_r79: circles of 100 m, 80 km/h")
    add_speeds(parser, "those of the preset, usual: 60,100,140")
    parser.add_argument(
        "--situations", metavar="NAME,NAME",
        help="replaces those of the preset: straight, turn, lane_change, circle_100m, circle_100m_right",
    )  # fmt: skip
    parser.add_argument(
        "--limit", action="append", default=[], dest="limits", metavar="KEY=VALUE",
        help="allowed effect of a fault: yaw_rate_degps (3), ay_mps2 (1), lateral_offset_m (the lane's), window_s (2)",
    )  # fmt: skip
    add_figures_folder(parser)
    add_workers(parser)
    add_json(parser)
    parser.set_defaults(action=_fault_map)


def _fault_map(options: argparse.Namespace) -> int:
    from activesteer.errors import nearest_names
    from activesteer.studies.paper.fault_map import Limits, fault_map
    from activesteer.studies.paper.fault_situations import PRESETS

    if options.preset not in PRESETS:
        raise ParameterError(
            f"there is no preset {options.preset!r}; {nearest_names(options.preset, PRESETS)}",
            key="--preset",
            value=options.preset,
        )
    preset = PRESETS[options.preset]
    limits = pairs(options.limits, "--limit", "ay_mps2=2")
    with ProgressBar("fault map", quiet=options.json) as bar:
        made = fault_map(
            options.controller,
            options.vehicle,
            overrides_of(options),
            faults=options.faults,
            speeds_kmh=options.speeds_kmh or preset.speeds_kmh,
            situations=options.situations.split(",") if options.situations else preset.situations,
            limits=build(Limits, limits, Source("--limit")),
            driver=options.driver,
            jobs=options.jobs,
            scheduler=options.scheduler,
            progress=lambda done, total: bar(done / total, f"{done}/{total}"),
        )
    figures = []
    if options.output is not None:
        from activesteer.studies.paper.fault_map_figure import draw_fault_map

        figures = draw_fault_map(made, options.output)
    lines = [*(_ROW.format(*words) for words in _HEADS), *map(_line, made.rows)]
    tell(options, {"faults": made.rows}, lines, figures)
    return 0


def _line(row: Mapping[str, Any]) -> str:
    tolerated = row["fault_tolerant_time_s"]
    words = "always" if tolerated is None else "failed" if math.isnan(tolerated) else f"{tolerated:.3f}"
    figures = (math.degrees(row["yaw_rate_change_radps"]), row["ay_change_mps2"])
    offsets = (row["lateral_offset_1s_m"], row["lateral_offset_1s_driver_m"])
    correction_deg = math.degrees(row["steering_correction_rad"])
    numbers = [*(f"{value:.2f}" for value in (*figures, *offsets)), f"{correction_deg:.1f}"]
    return _ROW.format(row["fault"], row["situation"], f"{row['speed_kmh']:g}", *numbers, words)
