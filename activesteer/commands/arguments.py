"""Options that several commands share, each declared once: the same name, meaning and help everywhere."""

from __future__ import annotations

import argparse
import difflib
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from activesteer.config import parse_value, read_toml
from activesteer.errors import MAX_SHOWN, ParameterError, nearest_names
from activesteer.resources import DEFAULT_DRIVER

if TYPE_CHECKING:
    from activesteer.scenario import Scenario

_NAME_WIDTH: Final = 12


class Commands:
    """The commands of the program as they are added, and the list of them that `--help` shows, in groups."""

    def __init__(self, version: str) -> None:
        """Begins with no command.

        Args:
            version: What `--version` prints.
        """
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
        """Commands that are added from now on stand under this title."""
        self._groups[title] = {}

    def add_parser(self, name: str, help: str, description: str = "") -> argparse.ArgumentParser:
        """Adds a command, as argparse does it.

        Args:
            name: Its name.
            help: What it does, in some words.
            description: What its own help begins with; the words of `help` where not given.
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
        """The whole command line."""
        lines = []
        for title, group in self._groups.items():
            lines += [f"{title}:", *(f"  {name:{_NAME_WIDTH}}{words}" for name, words in group.items()), ""]
        self._parser.epilog = "\n".join([*lines, "`activesteer COMMAND --help` tells more of a command."])
        return self._parser

    def parse(self, arguments: Sequence[str] | None = None) -> argparse.Namespace:
        """What a command line asks for; one that is wrong ends the program with what would be right.

        Args:
            arguments: Words after the program's name; those of the process where not given.
        """
        words = list(sys.argv[1:] if arguments is None else arguments)
        command = next((word for word in words if not word.startswith("-")), None)
        if command is not None and command not in self.names():
            self._parser.error(f"there is no command {command!r}; {nearest_names(command, self.names())}")
        options, unknown = self.parser().parse_known_args(words)
        if unknown:
            parser: argparse.ArgumentParser = options.parser
            parser.error(f"unrecognized arguments: {' '.join(unknown)}; {self._hint(parser, words, unknown[0])}")
        return options

    def _hint(self, parser: argparse.ArgumentParser, words: Sequence[str], unknown: str) -> str:
        """Where an argument belongs, or which one may have been meant."""
        known = list(parser._option_string_actions)
        option = unknown.partition("=")[0]
        if option in known:
            return f"{option} stands behind the command: activesteer {next(w for w in words if w[0] != '-')} {option}"
        if close := difflib.get_close_matches(option, known, 1, 0.7):
            return f"did you mean {close[0]}?"
        if "=" in unknown and "--set" in known:
            return f"a parameter is replaced by --set {unknown}"
        if "--set" in words and not unknown.startswith("-"):
            return "--set KEY=VALUE has no blanks around its sign"
        return f"`{parser.prog} --help` lists what there is"


def add_vehicle(parser: argparse.ArgumentParser) -> None:
    """Adds `--vehicle`."""
    parser.add_argument(
        "--vehicle", default="compact", metavar="NAME_OR_PATH",
        help="a name from `activesteer list`, a vehicle file or its folder (default: compact)",
    )  # fmt: skip


def add_scenario(parser: argparse.ArgumentParser) -> None:
    """Adds what `scenario_of` reads: the manoeuvre, `--vehicle`, `--driver`, `--set`, `--overrides` and `--fault`."""
    parser.add_argument(
        "maneuver", metavar="MANEUVER",
        help="a name from `activesteer list`, a TOML file, or a recording, whose steering, speed and brake are driven",
    )  # fmt: skip
    add_car(parser)
    add_driver(parser)
    parser.add_argument(
        "--fault", action="append", default=[], dest="faults", metavar="PART:KIND[=SIZE]@START[-END]",
        help="let an actuator or a sensor fail, as rear:stuck@2.0 or yaw_rate_sensor:offset=2degps@1-3; "
        "in place of the manoeuvre's own faults",
    )  # fmt: skip


def add_car(parser: argparse.ArgumentParser) -> None:
    """Adds `--vehicle`, and `--set` and `--overrides`, which `overrides_of` reads."""
    add_vehicle(parser)
    parser.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="KEY=VALUE",
        help="replace a parameter, as road.mu=0.4 or controllers.ars.limit_deg=2",
    )  # fmt: skip
    parser.add_argument(
        "--overrides", action="append", default=[], dest="override_files", type=Path, metavar="FILE.toml",
        help="replace the parameters of a file, as `activesteer fit` writes it: \"road.mu\" = 0.4 in every line",
    )  # fmt: skip


def add_controller(parser: argparse.ArgumentParser, *, several: bool, default: str = "none") -> None:
    """Adds `-c`; where there may be several, `options.controller` is a list, or None: then `default`, in words."""
    words = "none, ars, afs or another of `activesteer list`, a variant's file, or my_file.py:MyController?gain=2"
    parser.add_argument(
        "-c", "--controller", metavar="CONTROLLER",
        action="append" if several else "store", default=None if several else "none",
        help=f"{words}{'; may be repeated' if several else ''} (default: {default})",
    )  # fmt: skip


def add_driver(parser: argparse.ArgumentParser, default: str = "", *, several: bool = False) -> None:
    """Adds `--driver`; where the default depends on something, it is None, and `default` says it in words.

    Where there may be several, `options.driver` is a list, or None.
    """
    words = f"novice, typical, expert, a driver file, or my_file.py:MyDriver{'; may be repeated' if several else ''}"
    parser.add_argument(
        "--driver", action="append" if several else "store", default=None if default or several else DEFAULT_DRIVER,
        metavar="DRIVER", help=f"{words} (default: {default or DEFAULT_DRIVER})",
    )  # fmt: skip


def add_recording(parser: argparse.ArgumentParser, *, several: bool = False) -> None:
    """Adds the recordings to look at: `options.file`, or `options.files` where there may be several."""
    words = "a recording that `activesteer run` or `reproduce` made"
    if several:
        parser.add_argument("files", nargs="+", type=Path, metavar="FILE.mcap", help=f"{words}; several are compared")
    else:
        parser.add_argument("file", type=Path, metavar="FILE.mcap", help=words)


def add_json(parser: argparse.ArgumentParser) -> None:
    """Adds `--json`."""
    parser.add_argument("--json", action="store_true", help="print JSON and nothing else")


def add_output(parser: argparse.ArgumentParser, metavar: str, words: str, default: str | None = None) -> None:
    """Adds `-o`.

    Args:
        parser: Of the command.
        metavar: What is to be given: DIR, FILE.html.
        words: What goes there, and what is done without the option where it has no default.
        default: Where it goes if nothing is given.
    """
    parser.add_argument(
        "-o", "--output", type=Path, metavar=metavar, default=None if default is None else Path(default),
        help=words if default is None else f"{words} (default: {default})",
    )  # fmt: skip


def add_figures_folder(parser: argparse.ArgumentParser) -> None:
    """Adds `-o` of a command that draws only where it is told to."""
    add_output(parser, "DIR", "folder for the figures; none are drawn without it")


def add_jobs(parser: argparse.ArgumentParser) -> None:
    """Adds `--jobs`."""
    parser.add_argument("--jobs", type=int, metavar="N", help="processes (default: one per processor)")


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Adds `--jobs` and `--scheduler`."""
    add_jobs(parser)
    parser.add_argument(
        "--scheduler", metavar="ADDRESS",
        help="work on a Dask cluster instead: tcp://host:8786, or the file of `dask scheduler --scheduler-file`",
    )  # fmt: skip


def add_pace(parser: argparse.ArgumentParser) -> None:
    """Adds `--speed`, the pace of what is shown."""
    parser.add_argument(
        "--speed", type=float, default=1.0, metavar="FACTOR", help="0.25 is slow motion, 4 is fast (default: 1)"
    )


def add_speeds(parser: argparse.ArgumentParser, default: str) -> None:
    """Adds `--speed-kmh` of a command that computes something at several speeds; `default` says in words at which."""
    parser.add_argument(
        "--speed-kmh", type=float, action="append", metavar="V", help=f"may be repeated (default: {default})"
    )


def add_cutaway(parser: argparse.ArgumentParser) -> None:
    """Adds `--cutaway`, which shows what the body hides."""
    parser.add_argument("--cutaway", action="store_true", help="see the suspension through the body")


def scenario_of(options: argparse.Namespace) -> Scenario:
    """The scenario that the arguments name.

    Raises:
        ActiveSteerError: there is no such manoeuvre, vehicle or parameter, or a value is wrong.
    """
    from activesteer.faults import fault_table
    from activesteer.scenario import resolve

    faults = {"fault": [fault_table(text) for text in options.faults]} if options.faults else {}
    overrides = overrides_of(options, faults)
    return resolve(options.maneuver, options.vehicle, overrides, options.driver)


def overrides_of(options: argparse.Namespace, given: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """What `--overrides` and `--set` give.

    Args:
        options: What the command was called with.
        given: Keys that have values already.

    Raises:
        ParameterError: a file cannot be read, something is not written so, or a key is given twice.
    """
    values = dict(given or {})
    for path in options.override_files:
        table, source = read_toml(path)
        if not table:
            raise source.fail((), 'replaces nothing; a line as "road.mu" = 0.4 is needed')
        for key in table:
            if key in values:
                raise source.fail((key,), "is given twice; leave one out")
        values |= table
    return pairs(options.overrides, "--set", "road.mu=0.4", values)


def pairs(texts: Sequence[str], option: str, example: str, given: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Keys and values that an option gives, each value as in TOML; what is no TOML value is a text.

    Args:
        texts: As `key=value`.
        option: The option, for error messages.
        example: What may stand behind it.
        given: Keys that have values already.

    Raises:
        ParameterError: one is not written so, or a key is given twice.
    """
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
