"""TOML as text: read with limits on what a hostile file may cost."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any, Final

from activesteer.config.source import Source
from activesteer.errors import ActiveSteerError, ParameterError, shown
from activesteer.files import read_text

_MAX_DEPTH: Final = 32
_DEEP_KEY: Final = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]++\s*+\.\s*+){{{_MAX_DEPTH}}}""")
"""A dotted key of more than so many parts; the time that tomllib takes grows with the square of their number."""


def read_toml(path: Path, error: type[ActiveSteerError] = ParameterError) -> tuple[dict[str, Any], Source]:
    """Reads a TOML file.

    Args:
        path: The file.
        error: Class of the error to raise.

    Returns:
        The table and its source.

    Raises:
        ActiveSteerError: the file cannot be read or is no TOML; of class `error`.
    """
    text = read_text(path, error)
    try:
        return _parsed(text), Source(path.name, text, error)
    except ValueError as reason:
        raise error(f"no valid TOML: {reason}", file=path.name) from reason


def _parsed(text: str) -> dict[str, Any]:
    """A TOML text's table.

    Raises:
        ValueError: it is no TOML, has a number of too many digits, or is nested too deeply.
    """
    if _DEEP_KEY.search(text):
        raise ValueError(f"a key is nested more than {_MAX_DEPTH} deep")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("lists or tables are nested too deeply") from None


def parse_value(text: str) -> Any:
    """A value as TOML writes it; what is no TOML value is a text.

    Raises:
        ParameterError: it is nested too deeply, or has a number of too many digits.
    """
    try:
        table = _parsed(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    except ValueError as reason:
        raise ParameterError(f"{shown(text)}: {reason}", value=text) from reason
    return table["value"] if len(table) == 1 else text
