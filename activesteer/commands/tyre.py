"""`activesteer tyre FILE.tir`: describe a tyre file, list unusual values, and draw its curves."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import add_figures_folder, add_json
from activesteer.commands.output import tell, tell_files
from activesteer.errors import TyreFileError, nearest_names


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("tyre", help="describe a tyre file, list unusual values, draw curves")
    parser.add_argument("file", metavar="FILE.tir", help="a path, or a name in models/tyres")
    add_figures_folder(parser)
    add_json(parser)
    parser.set_defaults(action=_tyre)


def _tyre(options: argparse.Namespace) -> int:
    from activesteer.tyre import load_tir
    from activesteer.tyre.report import describe, key_figures

    params = load_tir(_find(options.file))
    tell(options, key_figures(params), [describe(params)])
    if options.output is not None:
        from activesteer.tyre.figures import draw

        tell_files(options, draw(params, options.output))
    return 0


def _find(name: str) -> Path:
    from activesteer.resources import models_dir

    folder = models_dir() / "tyres"
    for candidate in (Path(name), folder / name, folder / f"{name}.tir"):
        if candidate.is_file():
            return candidate
    names = [path.name for path in folder.glob("*.tir")]
    raise TyreFileError(
        f"there is no tyre file {name}, neither as a path nor in models/tyres; {nearest_names(name, names)}", value=name
    )
