"""`activesteer list`: print all manoeuvres, controllers, drivers, vehicles, studies and standards."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, Final

from activesteer.commands.arguments import add_json
from activesteer.commands.output import print_entry, print_json

_WIDTH: Final = 25
"""Width of the column of names."""


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("list", help="list manoeuvres, controllers, drivers, cars, studies, standards")
    add_json(parser)
    parser.set_defaults(action=_list)


def _list(options: argparse.Namespace) -> int:
    from activesteer import resources
    from activesteer.controllers import CONTROLLERS, read_variant
    from activesteer.standards.catalogue import STANDARDS

    controllers = {name: (made_from.__doc__ or "").splitlines()[0] for name, made_from in CONTROLLERS.items()}
    controllers |= {name: read_variant(name).title for name in resources.list_controller_variants()}
    found = {
        "manoeuvres": _titles(resources.list_maneuvers(), resources.find_maneuver),
        "controllers": controllers,
        "drivers": _titles(resources.list_drivers(), resources.find_driver_file),
        "vehicles": dict.fromkeys(resources.list_vehicles(), ""),
        "studies": _titles(resources.list_studies(), resources.find_study),
        "standards": {name: standard.title for name, standard in STANDARDS.items()},
    }
    if options.json:
        print_json(found)
        return 0
    found["controllers"]["my_file.py:MyController"] = "your own: step(self, command, measurement)"
    found["drivers"]["my_file.py:MyDriver"] = "your own: step(self, setpoint, measurement, motion)"
    for kind, titles in found.items():
        print(f"{kind}:")
        for name, title in titles.items():
            print_entry(f"  {name:{_WIDTH}} ", title, _WIDTH + 3)
    return 0


def _titles(names: Iterable[str], find: Callable[[str], Path]) -> dict[str, str]:
    from activesteer.config import read_toml

    return {name: read_toml(find(name))[0].get("title", "") for name in names}
