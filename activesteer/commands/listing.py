"""`activesteer list`: the manoeuvres, controllers and vehicles that there are."""

from __future__ import annotations

import argparse
from typing import Any


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser("list", help="manoeuvres, controllers and vehicles that there are")
    parser.set_defaults(action=_list)


def _list(_options: argparse.Namespace) -> int:
    from activesteer.config import read_toml
    from activesteer.controllers import BUILT_IN
    from activesteer.resources import find_maneuver, list_maneuvers, list_vehicles

    print("manoeuvres:")
    for name in list_maneuvers():
        title = read_toml(find_maneuver(name))[0].get("title", "")
        print(f"  {name:24} {title}")
    print("controllers:")
    for name, made_from in BUILT_IN.items():
        print(f"  {name:24} {(made_from.__doc__ or '').splitlines()[0]}")
    print("  my_file.py:MyController  a class of your own with step(self, command, measurement)")
    print("vehicles:")
    for name in list_vehicles():
        print(f"  {name}")
    return 0
