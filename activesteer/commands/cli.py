"""Command line of the program."""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from activesteer.commands.arguments import CommandLine
    from activesteer.commands.stopping import StopSignals


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of the console script."""
    # Before anything else is imported: a signal may come at any moment.
    from io import TextIOWrapper

    from activesteer.commands.stopping import StopSignals

    stop = StopSignals()
    try:
        if arguments is None:
            stop.watch()
            for stream in (sys.stdout, sys.stderr):  # a terminal that has no such letter shows a question mark
                if isinstance(stream, TextIOWrapper):
                    stream.reconfigure(errors="replace")
        status = _called(arguments, stop)
        if arguments is None and sys.stdout is not None:
            sys.stdout.flush()
    except BrokenPipeError:  # the reader of the output, such as `head`, has ended
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        status = 1
    except BaseException as error:
        # An interrupted import or an ended worker may turn the signal into any other exception.
        if stop.number is None and not isinstance(error, KeyboardInterrupt):
            raise
        return stop.end()
    if stop.number is not None:
        return stop.end()
    stop.finished = True
    return status


def _called(arguments: Sequence[str] | None, stop: StopSignals) -> int:
    from contextlib import nullcontext

    from activesteer.commands.terminal import log_to_terminal, stdout_for_json
    from activesteer.errors import ActiveSteerError

    stop.options = options = command_line().parse(arguments)
    try:
        with log_to_terminal(), stdout_for_json() if getattr(options, "json", False) else nullcontext():
            return int(options.action(options) or 0)
    except BrokenPipeError:
        raise
    except (ActiveSteerError, OSError) as error:
        if stop.number is not None:
            raise
        # An OSError that arrives here concerns the output or a temporary folder.
        lines = [f"activesteer: {error}", *getattr(error, "__notes__", [])]
        print("\n".join(lines), file=sys.stderr)
        return 1
    except SystemExit as end:  # not the parser's: code of the user wants to end the program
        from activesteer.plugins import in_one_line

        print(f"activesteer: your code ended the program: {in_one_line(end)}", file=sys.stderr)
        return 1


def command_line() -> CommandLine:
    """Return the command line with all commands, in the groups of `--help`."""
    from activesteer.commands import car, drive, recordings, studying, verify
    from activesteer.commands.arguments import CommandLine
    from activesteer.core.version import __version__

    groups = [module.command for module in (drive, recordings, car, studying, verify)]
    return CommandLine(f"activesteer {__version__}", groups)
