"""`activesteer list`: the manoeuvres, controllers, drivers, vehicles and standards that there are."""

from __future__ import annotations

import argparse
from typing import Any, Final

from activesteer.commands.output import print_entry

_WIDTH: Final = 25
"""Of the column of names."""


def add_to(commands: Any) -> None:
    """Adds the command to the parser's."""
    parser = commands.add_parser("list", help="manoeuvres, controllers, drivers, vehicles, standards")
    parser.set_defaults(action=_list)


def _list(_options: argparse.Namespace) -> int:
    from activesteer.config import read_toml
    from activesteer.controllers import BUILT_IN, read_variant
    from activesteer.resources import (
        find_driver_file,
        find_maneuver,
        list_controller_variants,
        list_drivers,
        list_maneuvers,
        list_vehicles,
    )
    from activesteer.standards.catalogue import STANDARDS

    print("manoeuvres:")
    for name in list_maneuvers():
        title = read_toml(find_maneuver(name))[0].get("title", "")
        print_entry(f"  {name:{_WIDTH}} ", title, _WIDTH + 3)
    print("controllers:")
    for name, made_from in BUILT_IN.items():
        print_entry(f"  {name:{_WIDTH}} ", (made_from.__doc__ or "").splitlines()[0], _WIDTH + 3)
    for name in list_controller_variants():
        print_entry(f"  {name:{_WIDTH}} ", read_variant(name).title, _WIDTH + 3)
    print_entry(f"  {'my_file.py:MyController':{_WIDTH}} ", "your own: step(self, command, measurement)", _WIDTH + 3)
    print("drivers:")
    for name in list_drivers():
        print_entry(f"  {name:{_WIDTH}} ", read_toml(find_driver_file(name))[0].get("title", ""), _WIDTH + 3)
    own = "your own: step(self, reference, measurement, motion)"
    print_entry(f"  {'my_file.py:MyDriver':{_WIDTH}} ", own, _WIDTH + 3)
    print("vehicles:")
    for name in list_vehicles():
        print(f"  {name}")
    print("standards:")
    for name, standard in STANDARDS.items():
        print_entry(f"  {name:{_WIDTH}} ", standard.title, _WIDTH + 3)
    return 0
