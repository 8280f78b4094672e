"""The command line: `activesteer run`, `reproduce` and the others; each has a module in `commands`."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence

from activesteer.commands import (
    bench,
    figures,
    identify,
    info,
    kc,
    linearise,
    listing,
    replay,
    report,
    reproduce,
    run,
    tyre,
    validate,
    vehicle,
    video,
    watch,
)
from activesteer.errors import ActiveSteerError
from activesteer.version import __version__


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of the console script.

    Args:
        arguments: Words after the program's name; those of the process where not given.

    Returns:
        Exit status: 0, 1 for an error that was explained, 130 after Ctrl-C.
    """
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        return options.action(options)
    except ActiveSteerError as error:
        lines = [f"activesteer: {error}", *getattr(error, "__notes__", [])]
        print("\n".join(lines), file=sys.stderr)
        return 1
    except BrokenPipeError:  # whoever reads the output, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except KeyboardInterrupt:
        print("activesteer: stopped; what was recorded until then is saved", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="activesteer", description="A multibody car with active steering, in MuJoCo.")
    parser.add_argument("--version", action="version", version=f"activesteer {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in (
        run,
        reproduce,
        figures,
        replay,
        watch,
        video,
        report,
        listing,
        info,
        tyre,
        kc,
        validate,
        vehicle,
        identify,
        linearise,
        bench,
    ):
        command.add_to(commands)
    return parser
