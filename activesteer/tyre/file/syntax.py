"""The syntax of .tir files: sections, keys, values, table rows and comments. This module knows nothing about tyres."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

from activesteer import limits
from activesteer.errors import TyreFileError
from activesteer.files import read_bytes

"""Size of the largest file that is read; real ones have some tens of kilobytes."""

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d{1,4})?\Z")
_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_.\-]*\Z")
_SECTION = re.compile(r"\[\s*([^\[\]]{1,80}?)\s*\]")


@dataclass(frozen=True)
class Entry:
    """One `KEY = value` of a file.

    Attributes:
        section: Section in upper case, empty before the first one.
        key: Key in upper case.
        value: A number, or the text between the quotes.
        line: Line number, from 1.
    """

    section: str
    key: str
    value: float | str
    line: int

    def fail(self, problem: str, source: Path) -> TyreFileError:
        """Return an error about this entry of a file."""
        return TyreFileError(problem, file=str(source), line=self.line, key=self.key, value=self.value)


@dataclass(frozen=True)
class Syntax:
    """Content of a .tir file, in its order.

    Attributes:
        entries: Keys and values.
        tables: Rows of numbers, by section in upper case (`[SHAPE]`, deflection curves).
    """

    entries: tuple[Entry, ...]
    tables: dict[str, tuple[tuple[float, ...], ...]]


def read_text(path: Path) -> str:
    """Read a file of limited size as Latin-1, in which every byte is a character."""
    raw = read_bytes(path, TyreFileError, limits.MAX_TYRE_BYTES)
    return raw.removeprefix(b"\xef\xbb\xbf").decode("latin-1")


def number(text: str) -> float | None:
    """Return the finite number in a text (Fortran's D exponent included), None if it is not a number."""
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
    """Return a number if the text is one, else the text without its quotes."""
    found = number(text)
    if found is not None:
        return found
    if len(text) > 1 and text[0] in "'\"" and text[-1] == text[0]:
        return text[1:-1].strip()
    return text


def parse(text: str, source: str) -> Syntax:
    """Split a .tir file into its entries and tables."""
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
    return Syntax(tuple(entries), {name: tuple(rows) for name, rows in tables.items()})
