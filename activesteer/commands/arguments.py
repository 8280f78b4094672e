"""Arguments that several commands share: which vehicle, which manoeuvre, which parameters are replaced."""

from __future__ import annotations

import argparse
import tomllib
from typing import TYPE_CHECKING, Any

from activesteer.errors import ParameterError

if TYPE_CHECKING:
    from activesteer.scenario import Scenario


def add_vehicle(parser: argparse.ArgumentParser) -> None:
    """Adds `--vehicle`."""
    parser.add_argument("--vehicle", default="compact", metavar="NAME_OR_PATH", help="default: compact")


def add_scenario(parser: argparse.ArgumentParser) -> None:
    """Adds what `scenario_of` reads: the manoeuvre, `--vehicle` and `--set`."""
    parser.add_argument("maneuver", metavar="MANEUVER", help="a name from `activesteer list`, or a TOML file")
    add_vehicle(parser)
    parser.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="KEY=VALUE",
        help="replace a parameter, as road.mu=0.4 or controllers.ars.limit_deg=2",
    )  # fmt: skip


def scenario_of(options: argparse.Namespace) -> Scenario:
    """The scenario that the arguments name.

    Raises:
        ActiveSteerError: there is no such manoeuvre, vehicle or parameter, or a value is wrong.
    """
    from activesteer.scenario import resolve

    return resolve(options.maneuver, options.vehicle, dict(_override(text) for text in options.overrides))


def _override(text: str) -> tuple[str, Any]:
    """`key=value`, the value as in TOML; what is no TOML value is a text."""
    key, sign, value = text.partition("=")
    if not sign or not key:
        msg = f"--set {text}: KEY=VALUE is needed, as in --set road.mu=0.4"
        raise ParameterError(msg)
    try:
        return key.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return key.strip(), value
