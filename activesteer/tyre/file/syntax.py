"""Syntax of .tir files: sections, tables, units.

A file states base units; the unit of every other quantity follows from them, so that a stiffness in a file with
millimetres is in newton per millimetre. Magic Formula coefficients are pure numbers in every system of units.

The columns of the table are: key, default, quantity, meaning. A default of `!` means that the file must give the key;
`-` means that it may be absent and that another quantity replaces it (see `tyre_parameters._fill`).
The quantity decides how `[UNITS]` of a file is applied; `1` is a pure number.

Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012, appendix 3; the names are those of the TNO/Siemens MF-Tyre
and the MSC PAC2002 property files.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from activesteer.config import read_toml
from activesteer.core import limits
from activesteer.core.files import read_bytes
from activesteer.errors import TyreFileError

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d{1,4})?\Z")
_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_.\-]*\Z")
_SECTION = re.compile(r"\[\s*([^\[\]]{1,80}?)\s*\]")


@dataclass(frozen=True)
class Entry:
    """Entry `KEY = value` of a file, with section, value and line number."""

    section: str
    key: str
    value: float | str
    line: int

    def fail(self, problem: str, source: Path) -> TyreFileError:
        """Return an error about this entry."""
        return TyreFileError(problem, file=str(source), line=self.line, key=self.key, value=self.value)


def read_text(path: Path) -> str:
    """Read a file of limited size as Latin-1, which has a character for every byte."""
    raw = read_bytes(path, TyreFileError, limits.MAX_TYRE_BYTES)
    return raw.removeprefix(b"\xef\xbb\xbf").decode("latin-1")


def number(text: str) -> float | None:
    """Parse a finite number, including Fortran's D exponent, or return None."""
    if not _NUMBER.match(text):
        return None
    value = float(text.replace("d", "e").replace("D", "e"))
    return value if math.isfinite(value) else None


def _without_comment(line: str) -> str:
    """Cut a line at the first `$` or `!` outside quotes."""
    quoted = ""
    for place, character in enumerate(line):
        if quoted:
            quoted = "" if character == quoted else quoted
        elif character in "'\"":
            quoted = character
        elif character in "$!":
            return line[:place].strip()
    return line.strip()


def _value(text: str) -> float | str:
    """Parse a number, or remove the quotes of a string."""
    found = number(text)
    if found is not None:
        return found
    if len(text) > 1 and text[0] in "'\"" and text[-1] == text[0]:
        return text[1:-1].strip()
    return text


def parse(text: str, source: str) -> tuple[tuple[Entry, ...], dict[str, tuple[tuple[float, ...], ...]]]:
    """Split a .tir file into its entries and its rows of numbers by section."""
    section = ""
    entries: list[Entry] = []
    tables: dict[str, list[tuple[float, ...]]] = {}
    for count, raw in enumerate(re.split(r"\r\n|\n|\r", text), start=1):
        line = _without_comment(raw)
        if not line or line[0] in "{('\"" or line[0] in "#*":
            continue
        if line[0] == "[":
            match = _SECTION.match(line)
            if not match:
                what = repr(line[:60]) if entries else "this"
                raise TyreFileError(f"{what} is not a section, expected [NAME]", file=source, line=count)
            section = match.group(1).upper()
            continue
        key, equals, rest = (part.strip() for part in line.partition("="))
        if equals:
            if not _KEY.match(key):
                what = repr(key[:60]) if entries else "this"
                raise TyreFileError(f"{what} is not a key, expected KEY = value", file=source, line=count)
            value = _value(rest)
            if isinstance(value, float):
                limits.check_number(value, TyreFileError, file=source, line=count, key=key)
            entries.append(Entry(section, key.upper(), value, count))
            continue
        row = [number(word) for word in line.replace(",", " ").split()]
        if any(value is None for value in row):
            # Without a key it may be any file; its content must not be printed.
            what = repr(line[:60]) if entries else "this"
            raise TyreFileError(
                f"{what} is neither KEY = value, [SECTION], {{heading}} nor a row of numbers", file=source, line=count
            )
        tables.setdefault(section, []).append(tuple(value for value in row if value is not None))
    return tuple(entries), {name: tuple(rows) for name, rows in tables.items()}


BASE_UNITS: dict[str, dict[str, float]] = read_toml(Path(__file__).with_name("units.toml"))[0]
"""Keys of `[UNITS]`, the unit names that each accepts (in lower case), and the size of the unit in SI."""

DIMENSIONS: dict[str, dict[str, int]] = {
    "1": {},
    "length": {"LENGTH": 1},
    "speed": {"LENGTH": 1, "TIME": -1},
    "acceleration": {"LENGTH": 1, "TIME": -2},
    "mass": {"MASS": 1},
    "inertia": {"MASS": 1, "LENGTH": 2},
    "force": {"FORCE": 1},
    "pressure": {"FORCE": 1, "LENGTH": -2},
    "stiffness": {"FORCE": 1, "LENGTH": -1},
    "damping": {"FORCE": 1, "LENGTH": -1, "TIME": 1},
    "angular_stiffness": {"FORCE": 1, "LENGTH": 1, "ANGLE": -1},
    "angle": {"ANGLE": 1},
}
"""Quantities of the coefficient table as powers of the base units."""


def si_factor(quantity: str, units: Mapping[str, float]) -> float:
    """Return the factor from a file's number to SI."""
    if quantity == "pressure" and "PRESSURE" in units:
        return units["PRESSURE"]
    return math.prod(units.get(base, 1.0) ** power for base, power in DIMENSIONS[quantity].items())


class Coefficient(NamedTuple):
    """One key of a .tir file. Its default is None if another quantity replaces it."""

    name: str
    section: str
    default: float | None
    required: bool
    quantity: str
    meaning: str


def _parse(table: str) -> tuple[Coefficient, ...]:
    """Parse the table of coefficients into records, in its order."""
    section, rows = "", []
    for line in table.splitlines():
        if line.startswith("["):
            section = line.strip("[]")
            continue
        name, default, quantity, meaning = line.split(maxsplit=3)
        value = None if default in ("!", "-") else float(default)
        rows.append(Coefficient(name, section, value, default == "!", quantity, meaning))
    return tuple(rows)


COEFFICIENTS: tuple[Coefficient, ...] = _parse(Path(__file__).with_name("coefficients.txt").read_text(encoding="utf-8"))
"""Every numeric key that the package knows, in the order of the table."""

BY_NAME: dict[str, Coefficient] = {coefficient.name: coefficient for coefficient in COEFFICIENTS}
"""Records of `COEFFICIENTS` by key."""
