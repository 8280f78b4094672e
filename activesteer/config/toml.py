"""TOML as text: read with limits on what a hostile file may cost, and written."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from activesteer.config.source import Source
from activesteer.errors import ActiveSteerError, ParameterError, shown
from activesteer.files import read_text

_MAX_DEPTH: Final = 32
_DEEP_KEY: Final = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]++\s*+\.\s*+){{{_MAX_DEPTH}}}""")
"""A dotted key of more than so many parts; the time that tomllib takes grows with the square of their number."""


def read_toml(path: Path, error: type[ActiveSteerError] = ParameterError) -> tuple[dict[str, Any], Source]:
    """Read a TOML file.

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


def toml_value(value: Any) -> str:
    """A value as TOML writes it; JSON's texts, numbers and lists are TOML's too."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(key)} = {toml_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def toml_text(table: Mapping[str, Any], remarks: Mapping[str, str] | None = None) -> str:
    """A table as the text of a file, the tables in it each below its header.

    Args:
        table: Keys that need no quotes, and their values; a list of tables stands in one line.
        remarks: What to say above a header, by the table's dotted name; a line of it becomes a line of comment.

    Returns:
        The text; `read_toml` makes the same table of it.
    """
    return "\n".join(_lines(table, remarks or {}, "")).lstrip("\n") + "\n"


def _lines(table: Mapping[str, Any], remarks: Mapping[str, str], name: str) -> Iterator[str]:
    values = {key: value for key, value in table.items() if not isinstance(value, Mapping)}
    if name and (values or not table or name in remarks):
        yield from ("", *(f"# {line}" for line in remarks.get(name, "").splitlines()), f"[{name}]")
    yield from (f"{key} = {toml_value(value)}" for key, value in values.items())
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _lines(value, remarks, f"{name}.{key}" if name else key)
