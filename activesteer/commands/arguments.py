"""Declaration of commands and of the options that several commands share."""

from __future__ import annotations

import argparse
import difflib
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from activesteer.errors import MAX_SHOWN, ParameterError, nearest_names
from activesteer.resources import DEFAULT_DRIVER

Action = Callable[[argparse.Namespace], int | None]
"""Function of a command. It returns the exit status, or nothing for 0."""
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
    "linearise --speeds-kmh": "linearise --speed-kmh",
    "bench --maneuvers": "reproduce --setting paper",
    "reproduce --population": "study population -o DIR` or `activesteer study comparison -o DIR",
    **dict.fromkeys(
        ("reproduce -c", "reproduce --controller", "reproduce --controllers"), "study side_by_side -o DIR -c CONTROLLER"
    ),
}
"""Replacement of each removed command, or of each removed option of a command."""


Part = Callable[[Any], object]
"""Declared argument of a command: adds itself to a parser of `argparse`."""


class Group:
    """Group of commands in `--help`. Call it to decorate the function of a command."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.commands: list[tuple[str, str, str, Sequence[Part], Action | Group]] = []

    def __call__(self, name: str, help: str, *parts: Part, description: str = "") -> Callable[[Action], Action]:
        """Return a decorator that declares a function as a command."""

        def declare(action: Action) -> Action:
            self.commands.append((name, help, description or f"{help[0].upper()}{help[1:]}.", parts, action))
            return action

        return declare

    def with_actions(self, name: str, help: str) -> Group:
        """Declare a command with several actions, and return the group in which to declare the actions."""
        actions = Group(name)
        self.commands.append((name, help, f"{help[0].upper()}{help[1:]}.", (), actions))
        return actions

    def add_to(self, parsers: Any, *, listed: bool = False) -> None:
        """Add the commands to the parsers of `argparse`."""
        for name, help, description, parts, action in self.commands:
            parser = parsers.add_parser(name, description=description, **({"help": help} if listed else {}))
            for part in parts:
                part(parser)
            parser.set_defaults(parser=parser)
            if isinstance(action, Group):
                action.add_to(parser.add_subparsers(required=True, metavar="ACTION"), listed=True)
            else:
                parser.set_defaults(action=action)


class CommandLine:
    """All commands of the program, in the groups of `--help`."""

    def __init__(self, version: str, groups: Sequence[Group]) -> None:
        self._parser = argparse.ArgumentParser(
            prog="activesteer",
            usage="activesteer [-h] [--version] COMMAND ...",
            description="A multibody car with active steering, in MuJoCo.",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        self._parser.add_argument("--version", action="version", version=version)
        added = self._parser.add_subparsers(
            required=True, metavar="COMMAND", help=argparse.SUPPRESS, prog="activesteer"
        )
        lines: list[str] = []
        for group in groups:
            group.add_to(added)
            lines += [f"{group.title}:", *(f"  {name:{_NAME_WIDTH}}{help}" for name, help, *_ in group.commands), ""]
        self._parser.epilog = "\n".join([*lines, "`activesteer COMMAND --help` describes a command."])
        self.names = [name for group in groups for name, *_ in group.commands]

    def parse(self, arguments: Sequence[str] | None = None) -> argparse.Namespace:
        """Parse a command line, or end the program with a suggested correction."""
        words = list(sys.argv[1:] if arguments is None else arguments)
        command = next((word for word in words if not word.startswith("-")), None)
        if command in SUCCESSORS:
            self._parser.error(f"there is no command {command!r} any longer; use `activesteer {SUCCESSORS[command]}`")
        if command is not None and command not in self.names:
            self._parser.error(f"there is no command {command!r}; {nearest_names(command, self.names)}")
        options, unknown = self._parser.parse_known_args(words)
        if unknown:
            parser: argparse.ArgumentParser = options.parser
            parser.error(f"unrecognized arguments: {' '.join(unknown)}; {_hint(parser, words, unknown[0])}")
        return options


def _hint(parser: argparse.ArgumentParser, words: Sequence[str], unknown: str) -> str:
    """Return the suggested correction of an unknown argument."""
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


def option(names: str, metavar: str | tuple[Any, ...], help: str, default: Any = None, **words: Any) -> Part:
    """Declare an argument with a value. The default is appended to its help."""
    if words.pop("many", False):
        words["action"] = "append"
    words["metavar" if isinstance(metavar, str) else "choices"] = metavar
    if default is not None:
        words |= {"default": default, "type": words.get("type", type(default))}
        help += f" (default: {default:g})" if isinstance(default, float) else f" (default: {default})"
    return lambda parser: parser.add_argument(*names.split(), help=help, **words)


def flag(name: str, help: str) -> Part:
    """Declare an option without a value."""
    return lambda parser: parser.add_argument(name, action="store_true", help=help)


def several(*parts: Part) -> Part:
    """Declare arguments that commands share."""
    return lambda parser: [part(parser) for part in parts]


def one_of(*parts: Part) -> Part:
    """Declare options that exclude each other."""
    return lambda parser: several(*parts)(parser.add_mutually_exclusive_group())


JSON: Final = flag("--json", "print JSON and nothing else")
VEHICLE_WORDS: Final = "a name from `activesteer list`, a vehicle file or its folder"
VEHICLE: Final = option("--vehicle", "NAME_OR_PATH", VEHICLE_WORDS, "compact")
OVERRIDES: Final = several(
    option("--set", "KEY=VALUE", "replace a parameter, such as road.mu=0.4 or controllers.ars.limit_deg=2",
           many=True, dest="overrides"),
    option("--overrides", "FILE.toml", 'replace the parameters listed in a file, a line such as "road.mu" = 0.4 each',
           many=True, dest="override_files", type=Path),
)  # fmt: skip
"""Options of `overrides_of`."""
CAR: Final = several(VEHICLE, OVERRIDES)
JOBS: Final = option("--jobs", "N", "number of processes (default: one per processor)", type=int)
WORKERS: Final = several(
    JOBS,
    option("--scheduler", "ADDRESS",
           "work on a Dask cluster instead: tcp://host:8786, or the file of `dask scheduler --scheduler-file`"),
)  # fmt: skip
_RECORDING: Final = "a recording of `activesteer run` or `reproduce`"
RECORDING: Final = option("file", "FILE.mcap", _RECORDING, type=Path)
RECORDINGS: Final = option("files", "FILE.mcap", f"{_RECORDING}; several are compared", nargs="+", type=Path)


def driver(default: str = "") -> Part:
    """Return the option `--driver`, or None if not given."""
    words = "novice, typical, expert, a driver file, my_file.py:MyDriver, or driver.fmu"
    if default:
        return option("--driver", "DRIVER", f"{words} (default: {default})")
    return option("--driver", "DRIVER", words, DEFAULT_DRIVER)


def controllers(default: str = "none") -> Part:
    """Return the option `-c`, a list of controllers, or None if not given."""
    words = (
        "none, ars, afs or another of `activesteer list`, a variant's file, my_file.py:MyController?gain=2, or an FMU"
    )
    return option("-c --controller", "CONTROLLER", f"{words}; may be repeated (default: {default})", many=True)


def output(metavar: str, help: str, default: str | None = None) -> Part:
    """Return the option `-o` for a file or folder."""
    return option("-o --output", metavar, help, None if default is None else Path(default), type=Path)


FIGURES: Final = output("DIR", "folder for figures (default: no figures)")


def check_effect(options: argparse.Namespace, effect: str, *keys: str) -> None:
    """Reject options that have no effect, with `effect` as the reason."""
    for key in keys:
        if getattr(options, key) not in (None, False):
            raise ParameterError(f"has {effect}", key=f"--{key}")


def numbers(text: str) -> list[float]:
    """Return the numbers of a comma-separated option."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of numbers such as 60,100") from None


def overrides_of(options: argparse.Namespace, given: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return the overrides of `--overrides` and `--set`. Values that are not valid TOML become strings."""
    from activesteer.config import parse_value, read_toml

    values = dict(given or {})
    for path in options.override_files or ():
        table, source = read_toml(path)
        if not table:
            raise source.fail((), 'replaces nothing; write lines such as "road.mu" = 0.4')
        for key in table:
            if key in values:
                raise source.fail((key,), "is given twice; leave one out")
        values |= table
    for text in options.overrides or ():
        key, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not key:
            shortened = text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."
            raise ParameterError(f"--set {shortened}: KEY=VALUE is needed, as in --set road.mu=0.4", value=text)
        if key in values:
            raise ParameterError("is given twice; leave one out", key=key, value=value, overridden=True)
        values[key] = parse_value(value)
    return values
