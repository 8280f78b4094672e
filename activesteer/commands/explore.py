"""`activesteer explore`: a local page to change a run by sliders and to drive a car by hand."""

from __future__ import annotations

import argparse
import sys
import webbrowser
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_json, add_output
from activesteer.commands.output import print_json
from activesteer.errors import ParameterError


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser(
        "explore",
        help="change a run by sliders, or drive the car by hand, in a local page",
        description="Open a page in the browser that only this computer can reach; Ctrl-C ends it.",
    )
    parser.add_argument("--port", type=int, default=0, metavar="N", help="port on 127.0.0.1 (default: a free one)")
    parser.add_argument("--no-browser", action="store_true", help="print the address and open no browser")
    add_output(parser, "DIR", "folder of your own controllers and manoeuvres, and of saved recordings", ".")
    add_json(parser)
    parser.set_defaults(action=_explore)


def _explore(options: argparse.Namespace) -> int:
    if not 0 <= options.port <= 65535:
        raise ParameterError(f"--port: is {options.port}, must be 0 to 65535")
    if not Path(options.output).is_dir():
        raise ParameterError(f"-o: {options.output} is no folder; the page reads and writes files there")
    try:
        from activesteer.explore.server import ExploreServer
    except ModuleNotFoundError as error:
        raise ParameterError(
            f"explore needs {error.name}, which is not installed: pip install 'activesteer[explore]'"
        ) from error
    server = ExploreServer(Path(options.output), options.port)

    def listening() -> None:
        if options.json:
            print_json({"url": server.url, "port": server.port}, one_line=True)
        else:
            print(server.url, flush=True)
            print("Ctrl-C ends the page", file=sys.stderr)
        if not (options.no_browser or options.json):
            webbrowser.open(server.url)

    server.serve(listening)
    return 0
