"""Writer of .tir files: all numbers of the tyre, in SI, so that reading the file gives the same parameters again."""

from __future__ import annotations

from pathlib import Path

from activesteer.tyre.file.coefficients import COEFFICIENTS
from activesteer.tyre.tyre_parameters import TyreParameters

_HEADER = """[MDI_HEADER]
FILE_TYPE = 'tir'
FILE_VERSION = 3.0
FILE_FORMAT = 'ASCII'
[UNITS]
LENGTH = 'meter'
FORCE = 'newton'
ANGLE = 'radians'
MASS = 'kg'
TIME = 'second'
"""
_OWN_SECTIONS = ("MDI_HEADER", "UNITS")


def tir_text(parameters: TyreParameters, comment: str = "") -> str:
    """Return the content of a .tir file."""
    lines = [f"! {line}" for line in comment.splitlines()] + _HEADER.splitlines()
    names: dict[str, list[str]] = {"MODEL": [f"TYRESIDE = '{parameters.side}'"]}
    for coefficient in COEFFICIENTS:
        if coefficient.name in parameters.given:
            number = f"{coefficient.name:<24} = {parameters.given[coefficient.name]!r}"
            names.setdefault(coefficient.section, []).append(f"{number:<50} $ {coefficient.meaning}")
    for (section, key), value in parameters.unused.items():
        if section not in _OWN_SECTIONS:
            names.setdefault(section, []).append(f"{key:<24} = {value!r}")
    for (section, key), word in parameters.texts.items():
        if section not in _OWN_SECTIONS and key != "TYRESIDE":
            quote = '"' if "'" in word else "'"
            names.setdefault(section, []).append(f"{key:<24} = {quote}{word}{quote}")
    for section, rows in parameters.tables.items():
        names.setdefault(section, []).extend(" ".join(repr(value) for value in row) for row in rows)
    for section, content in names.items():
        lines += ([f"[{section}]"] if section else []) + content
    return "\n".join(lines) + "\n"


def write_tir(parameters: TyreParameters, path: str | Path, comment: str = "") -> None:
    """Write a tyre to a .tir file, Latin-1; see `tir_text`."""
    Path(path).write_text(tir_text(parameters, comment), encoding="latin-1")
