"""Read and write .tir files.

Nothing in a file is executed, and no memory is allocated by what a file claims. A bad file raises a `TyreFileError`
that names the file, the line, the key, the value and the allowed range.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path

from activesteer.errors import ParameterError, TyreFileError
from activesteer.tyre.file.syntax import BASE_UNITS, BY_NAME, COEFFICIENTS, Entry, parse, read_text, si_factor
from activesteer.tyre.tyre_parameters import Side, TyreParameters

ALIASES: dict[str, str] = {
    "IP": "INFLPRES",
    "IP_NOM": "NOMPRES",
    "QFZ1": "Q_FZ1",
    "QFZ2": "Q_FZ2",
    "QFZ3": "Q_FZ3",
    "QPFZ1": "PFZ1",
    "QV1": "Q_V1",
    "QV2": "Q_V2",
    "QRE0": "Q_RE0",
    "QFCX1": "Q_FCX",
    "QFCY1": "Q_FCY",
    "QPZ1": "PPZ1",
    "LFZ0": "LFZO",
    "LKYA": "LKY",
    "PECPC1": "PECP1",
    "FITTYPE": "FITTYP",
}
"""Names of other programs for the same coefficients (PAC2002, and LFZ0 written with a zero)."""

_PAC2002_FITTYP = 6.0


def load_tir(path: str | Path, mounted: Side | None = None, *, slip_tangent: bool = False) -> TyreParameters:
    """Read a tyre property file.

    Args:
        path: The .tir file.
        mounted: Side of the vehicle that the tyre is mounted on; None for the side that the file is for.
        slip_tangent: True for alpha* = tan(alpha) and gamma* = sin(gamma), False for the angles themselves.

    Returns:
        The coefficients in SI and radians.

    Raises:
        TyreFileError: the file cannot be read, a line cannot be understood, or a value is missing or not allowed.

    Examples:
        >>> from activesteer.resources import models_dir
        >>> from activesteer.tyre.file.tir import load_tir
        >>> tyre = load_tir(models_dir() / "tyres" / "compact_205_55R16.tir")
        >>> tyre["FNOMIN"], tyre["UNLOADED_RADIUS"]
        (4000.0, 0.316)
    """
    path = Path(path)
    return tir_from_text(read_text(path), path, mounted, slip_tangent=slip_tangent)


@functools.lru_cache(maxsize=8)  # the cars of a study have the same few tyres
def tir_from_text(
    text: str, source: Path, mounted: Side | None = None, *, slip_tangent: bool = False
) -> TyreParameters:
    """Read a tyre property file from memory (see `load_tir`)."""
    entries, tables = parse(text, str(source))
    units = _units(entries, source)
    lines: dict[str, Entry] = {}
    texts: dict[tuple[str, str], str] = {}
    unused: dict[tuple[str, str], float] = {}
    for entry in entries:
        if entry.section == "UNITS":
            continue
        name = ALIASES.get(entry.key, entry.key)
        if name in BY_NAME:
            _place(lines, name, entry, source)
        elif isinstance(entry.value, str):
            texts[entry.section, entry.key] = entry.value
        else:
            unused[entry.section, entry.key] = entry.value
    values: dict[str, float] = {}
    for name, entry in lines.items():
        if isinstance(entry.value, str):
            raise entry.fail(f"{entry.value[:60]!r} is not a number", source)
        values[name] = entry.value * si_factor(BY_NAME[name].quantity, units)
    words = {key: word for (_, key), word in texts.items()}
    if "FITTYP" not in values:
        values["FITTYP"] = _version_without_fittyp(words, source)
    side = _side(words, source)
    try:
        return TyreParameters(values, source, side, mounted or side, slip_tangent, texts, unused, tables)
    except ParameterError as error:
        entry = lines.get(error.key or "")
        raise TyreFileError(
            error.problem, file=error.file, line=entry and entry.line, key=error.key, value=error.value
        ) from error


def _place(lines: dict[str, Entry], name: str, entry: Entry, source: Path) -> None:
    """Keep one entry per coefficient, and reject contradictory entries."""
    before = lines.get(name)
    if before is None or before.value == entry.value:
        lines[name] = entry
        return
    home = BY_NAME[name].section
    at_home = (before.section == home, entry.section == home)
    if at_home[0] == at_home[1]:
        raise entry.fail(f"is {entry.value} and contradicts line {before.line}, where it is {before.value}", source)
    if at_home[1]:
        lines[name] = entry


def _units(entries: tuple[Entry, ...], source: Path) -> dict[str, float]:
    """Return the SI values of the units in the file."""
    sizes: dict[str, float] = {}
    for entry in entries:
        if entry.section != "UNITS" or entry.key not in BASE_UNITS:
            continue
        known = BASE_UNITS[entry.key]
        word = str(entry.value).lower()
        if word not in known:
            raise entry.fail(f"is {str(entry.value)[:60]!r} in [UNITS]; allowed: {', '.join(known)}", source)
        sizes[entry.key] = known[word]
    return sizes


def _version_without_fittyp(words: Mapping[str, str], source: Path) -> float:
    """Return the version of a PAC2002 file, or reject a file of another tyre model."""
    model = words.get("PROPERTY_FILE_FORMAT", "PAC2002").upper()
    if not model.startswith(("PAC2002", "USER", "MF")):
        raise TyreFileError(
            f"{model[:60]!r} is not a supported tyre model; supported: PAC2002, and files with FITTYP "
            "5, 6, 21, 52, 60, 61 or 62",
            file=str(source),
            key="PROPERTY_FILE_FORMAT",
            value=model,
        )
    return _PAC2002_FITTYP


def _side(words: Mapping[str, str], source: Path) -> Side:
    """Return the vehicle side of the file, left for a symmetric tyre."""
    side = words.get("TYRESIDE", "LEFT").upper()
    if side == "RIGHT":
        return "RIGHT"
    if side not in ("LEFT", "SYMMETRIC", "SYM", "UNKNOWN", ""):
        raise TyreFileError(
            f"is {side[:60]!r}; allowed: 'LEFT', 'RIGHT' and 'SYMMETRIC'",
            file=str(source),
            key="TYRESIDE",
            value=side,
        )
    return "LEFT"


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
    """Write a tyre to a .tir file in Latin-1 (see `tir_text`)."""
    Path(path).write_text(tir_text(parameters, comment), encoding="latin-1")
