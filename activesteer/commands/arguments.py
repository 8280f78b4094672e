"""Options that several commands share, each declared once."""

from __future__ import annotations

import argparse
import difflib
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from activesteer.errors import MAX_SHOWN, ParameterError, nearest_names
from activesteer.resources import DEFAULT_DRIVER

if TYPE_CHECKING:
    from activesteer.scenario import Scenario

_NAME_WIDTH: Final = 12
SUCCESSORS: Final = {
    "recover": "info FILE.mcap --recover OUT.mcap",
    "figures": "reproduce --figures",
    "watch": "run MANEUVER --watch",
    "driver": "linearise --loop driver",
    "margins": "linearise --loop controller",
    "validate": "compare FOLDER` or `activesteer fit FOLDER",
    "envelope": "study envelope -o DIR",
    "fault-map": "study fault_map -o DIR` or `activesteer test r79-circle",
    "match": "tune STUDY",
    "falsify": "tune STUDY -c CONTROLLER",
    "reproduce --population": "study population -o DIR` or `activesteer study comparison -o DIR",
    **dict.fromkeys(
        ("reproduce -c", "reproduce --controller", "reproduce --controllers"), "study side_by_side -o DIR -c CONTROLLER"
    ),
}
"""Removed command, or command and option -> what does its work now."""


class Commands:
    """All commands of the program, listed by `--help` in groups."""

    def __init__(self, version: str) -> None:
        self._parser = argparse.ArgumentParser(
            prog="activesteer",
            usage="activesteer [-h] [--version] COMMAND ...",
            description="A multibody car with active steering, in MuJoCo.",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        self._parser.add_argument("--version", action="version", version=version)
        self._added = self._parser.add_subparsers(
            required=True, metavar="COMMAND", help=argparse.SUPPRESS, prog="activesteer"
        )
        self._groups: dict[str, dict[str, str]] = {}

    def begin_group(self, title: str) -> None:
        """Start a group; commands that are added later belong to it."""
        self._groups[title] = {}

    def add_parser(self, name: str, help: str, description: str = "") -> argparse.ArgumentParser:
        """Add a command to the current group.

        Args:
            name: Name of the command.
            help: One line for the list of commands.
            description: First lines of the command's own help; `help` by default.
        """
        group = self._groups[next(reversed(self._groups))]
        group[name] = help
        parser = self._added.add_parser(name, description=description or f"{help[0].upper()}{help[1:]}.")
        parser.set_defaults(parser=parser)
        return parser

    def names(self) -> list[str]:
        """Names of the commands."""
        return [name for group in self._groups.values() for name in group]

    def parser(self) -> argparse.ArgumentParser:
        """Return the parser of the whole command line."""
        lines = []
        for title, group in self._groups.items():
            lines += [f"{title}:", *(f"  {name:{_NAME_WIDTH}}{words}" for name, words in group.items()), ""]
        self._parser.epilog = "\n".join([*lines, "`activesteer COMMAND --help` describes a command."])
        return self._parser

    def parse(self, arguments: Sequence[str] | None = None) -> argparse.Namespace:
        """Parse a command line; end the program with a correction if the command line is wrong.

        Args:
            arguments: Words after the name of the program; those of the process by default.
        """
        words = list(sys.argv[1:] if arguments is None else arguments)
        command = next((word for word in words if not word.startswith("-")), None)
        if command in SUCCESSORS:
            self._parser.error(f"there is no command {command!r} any more; use `activesteer {SUCCESSORS[command]}`")
        if command is not None and command not in self.names():
            self._parser.error(f"there is no command {command!r}; {nearest_names(command, self.names())}")
        options, unknown = self.parser().parse_known_args(words)
        if unknown:
            parser: argparse.ArgumentParser = options.parser
            parser.error(f"unrecognized arguments: {' '.join(unknown)}; {self._hint(parser, words, unknown[0])}")
        return options

    def _hint(self, parser: argparse.ArgumentParser, words: Sequence[str], unknown: str) -> str:
        """Correction of an unknown argument."""
        known = list(parser._option_string_actions)
        option = unknown.partition("=")[0]
        if successor := SUCCESSORS.get(f"{parser.prog.split()[-1]} {option}"):
            return f"use `activesteer {successor}`"
        if option in known:
            return f"put {option} after the command: activesteer {next(w for w in words if w[0] != '-')} {option}"
        if close := difflib.get_close_matches(option, known, 1, 0.7):
            return f"did you mean {close[0]}?"
        if "=" in unknown and "--set" in known:
            return f"--set {unknown} replaces a parameter"
        if "--set" in words and not unknown.startswith("-"):
            return "write --set KEY=VALUE without blanks around '='"
        return f"`{parser.prog} --help` lists the arguments"


def add_vehicle(parser: argparse.ArgumentParser) -> None:
    """Add `--vehicle`."""
    parser.add_argument(
        "--vehicle", default="compact", metavar="NAME_OR_PATH",
        help="a name from `activesteer list`, a vehicle file or its folder (default: compact)",
    )  # fmt: skip


def add_scenario(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `scenario_of`: the manoeuvre, `--vehicle`, `--driver`, `--set`, `--overrides`, `--fault`."""
    parser.add_argument(
        "maneuver", metavar="MANEUVER",
        help="a name from `activesteer list`, a TOML file, or a recording, whose inputs are driven again",
    )  # fmt: skip
    add_car(parser)
    add_driver(parser)
    parser.add_argument(
        "--fault", action="append", default=[], dest="faults", metavar="PART:KIND[=SIZE]@START[-END]",
        help="let an actuator or a sensor fail, such as rear:stuck@2.0 or yaw_rate_sensor:offset=2degps@1-3; "
        "replaces the faults of the manoeuvre",
    )  # fmt: skip


def add_car(parser: argparse.ArgumentParser) -> None:
    """Add `--vehicle`, `--set` and `--overrides`."""
    add_vehicle(parser)
    add_overrides(parser)


def add_overrides(parser: argparse.ArgumentParser) -> None:
    """Add `--set` and `--overrides`, which `overrides_of` reads."""
    parser.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="KEY=VALUE",
        help="replace a parameter, such as road.mu=0.4 or controllers.ars.limit_deg=2",
    )  # fmt: skip
    parser.add_argument(
        "--overrides", action="append", default=[], dest="override_files", type=Path, metavar="FILE.toml",
        help="replace the parameters listed in a file, a line such as \"road.mu\" = 0.4 each",
    )  # fmt: skip


def add_controller(parser: argparse.ArgumentParser, *, several: bool, default: str = "none") -> None:
    """Add `-c`; with several, `options.controller` is a list, or None for the default, which is given in words."""
    words = (
        "none, ars, afs or another of `activesteer list`, a variant's file, my_file.py:MyController?gain=2, or an FMU"
    )
    parser.add_argument(
        "-c", "--controller", metavar="CONTROLLER",
        action="append" if several else "store", default=None if several else "none",
        help=f"{words}{'; may be repeated' if several else ''} (default: {default})",
    )  # fmt: skip


def add_driver(parser: argparse.ArgumentParser, default: str = "", *, several: bool = False) -> None:
    """Add `--driver`; with several or a default in words, `options.driver` is None without the option."""
    more = "; may be repeated" if several else ""
    words = f"novice, typical, expert, a driver file, my_file.py:MyDriver, or driver.fmu{more}"
    parser.add_argument(
        "--driver", action="append" if several else "store", default=None if default or several else DEFAULT_DRIVER,
        metavar="DRIVER", help=f"{words} (default: {default or DEFAULT_DRIVER})",
    )  # fmt: skip


def add_recording(parser: argparse.ArgumentParser, *, several: bool = False) -> None:
    """Add the recordings of a command: `options.file`, or `options.files` for several."""
    words = "a recording of `activesteer run` or `reproduce`"
    if several:
        parser.add_argument("files", nargs="+", type=Path, metavar="FILE.mcap", help=f"{words}; several are compared")
    else:
        parser.add_argument("file", type=Path, metavar="FILE.mcap", help=words)


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add `--json`."""
    parser.add_argument("--json", action="store_true", help="print JSON and nothing else")


def add_output(parser: argparse.ArgumentParser, metavar: str, words: str, default: str | None = None) -> None:
    """Add `-o`; the help says what is written there, and what happens without the option if it has no default."""
    parser.add_argument(
        "-o", "--output", type=Path, metavar=metavar, default=None if default is None else Path(default),
        help=words if default is None else f"{words} (default: {default})",
    )  # fmt: skip


def add_figures_folder(parser: argparse.ArgumentParser) -> None:
    """Add `-o` of a command that draws figures only with this option."""
    add_output(parser, "DIR", "folder for figures (default: no figures)")


def add_jobs(parser: argparse.ArgumentParser) -> None:
    """Add `--jobs`."""
    parser.add_argument("--jobs", type=int, metavar="N", help="number of processes (default: one per processor)")


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add `--jobs` and `--scheduler`."""
    add_jobs(parser)
    parser.add_argument(
        "--scheduler", metavar="ADDRESS",
        help="work on a Dask cluster instead: tcp://host:8786, or the file of `dask scheduler --scheduler-file`",
    )  # fmt: skip


def add_pace(parser: argparse.ArgumentParser) -> None:
    """Add `--speed`, the pace of a film or a view."""
    parser.add_argument(
        "--speed", type=float, default=1.0, metavar="FACTOR", help="pace: 0.25 is slow motion, 4 is fast (default: 1)"
    )


def add_speeds(parser: argparse.ArgumentParser, default: str) -> None:
    """Add `--speeds-kmh`; `default` describes the default. `--speed-kmh` is the same and may be repeated."""
    parser.add_argument(
        "--speeds-kmh", "--speed-kmh", type=numbers, action="extend", metavar="V,V",
        help=f"speeds, separated by commas (default: {default})",
    )  # fmt: skip


def numbers(text: str) -> list[float]:
    """Return the numbers of an option, which are separated by commas."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no list of numbers such as 60,100") from None


def add_cutaway(parser: argparse.ArgumentParser, when: str = "") -> None:
    """Add `--cutaway`; `when` says with which option it has an effect."""
    parser.add_argument("--cutaway", action="store_true", help=f"{when}show the suspension through the body")


def scenario_of(options: argparse.Namespace) -> Scenario:
    """Return the scenario that the arguments describe."""
    from activesteer.scenario import resolve

    faults = {"fault": " ".join(options.faults)} if options.faults else {}
    overrides = overrides_of(options, faults)
    given = getattr(options, "controller", None) or ()
    controllers = [given] if isinstance(given, str) else given
    return resolve(options.maneuver, options.vehicle, overrides, options.driver, controllers)


def overrides_of(options: argparse.Namespace, given: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the parameters that `--overrides` and `--set` replace."""
    from activesteer.config import read_toml

    values = dict(given or {})
    for path in options.override_files:
        table, source = read_toml(path)
        if not table:
            raise source.fail((), 'replaces nothing; write lines such as "road.mu" = 0.4')
        for key in table:
            if key in values:
                raise source.fail((key,), "is given twice; leave one out")
        values |= table
    return pairs(options.overrides, "--set", "road.mu=0.4", values)


def pairs(texts: Sequence[str], option: str, example: str, given: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the keys and values of a repeated option `key=value`, beside those that are given already.

    A value is written as in TOML; any other value is a text.
    """
    from activesteer.config import parse_value

    values = dict(given or {})
    for text in texts:
        key, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not key:
            shortened = text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."
            raise ParameterError(f"{option} {shortened}: KEY=VALUE is needed, as in {option} {example}", value=text)
        if key in values:
            raise ParameterError("is given twice; leave one out", key=key, value=value, overridden=True)
        values[key] = parse_value(value)
    return values
