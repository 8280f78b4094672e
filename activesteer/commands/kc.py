"""`activesteer kc`: kinematics and compliance of both axles, measured as on a rig."""

from __future__ import annotations

import argparse
from typing import Any

from activesteer.commands.arguments import (
    add_figures_folder,
    add_json,
    add_overrides,
    add_vehicle,
    overrides_of,
)


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser("kc", help="kinematics and compliance of the suspensions, as on a rig")
    add_vehicle(parser)
    add_overrides(parser)
    add_figures_folder(parser)
    add_json(parser)
    parser.set_defaults(action=_kc)


def _kc(options: argparse.Namespace) -> int:
    from activesteer.rigs import kinematics_compliance

    result = kinematics_compliance(options.vehicle, overrides_of(options))
    print(result.to_json() if options.json else result.table())
    if options.output is not None:
        from activesteer.rigs.kc import draw

        for path in draw(result, options.output):
            if not options.json:
                print(f"figure: {path}")
    return 0
