"""TOML texts: reading with limits for hostile files, and writing."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from activesteer import limits
from activesteer.config.source import Source
from activesteer.errors import ActiveSteerError, ParameterError, shown
from activesteer.files import read_text

_DEEP_KEY: Final = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]++\s*+\.\s*+){{{limits.MAX_TOML_DEPTH}}}""")
"""Dotted key with too many parts; the time of tomllib grows with the square of their number."""


def read_toml(path: Path, error: type[ActiveSteerError] = ParameterError) -> tuple[dict[str, Any], Source]:
    """Return the table of a TOML file, and its source."""
    text = read_text(path, error)
    try:
        return _parsed(text), Source(path.name, text, error)
    except ValueError as reason:
        raise error(f"no valid TOML: {reason}", file=path.name) from reason


def _parsed(text: str) -> dict[str, Any]:
    """Parse a TOML text."""
    if _DEEP_KEY.search(text):
        raise ValueError(f"a key is nested more than {limits.MAX_TOML_DEPTH} deep")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("lists or tables are nested too deeply") from None


def parse_value(text: str) -> Any:
    """Return a value written as in TOML; any other text is returned as it is."""
    try:
        table = _parsed(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    except ValueError as reason:
        raise ParameterError(f"{shown(text)}: {reason}", value=text) from reason
    return table["value"] if len(table) == 1 else text


def toml_value(value: Any) -> str:
    """Return a value as TOML; texts, numbers and lists of JSON are valid TOML."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(key)} = {toml_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def toml_text(table: Mapping[str, Any], remarks: Mapping[str, str] | None = None) -> str:
    """Return a table as the text of a file, each inner table below its header; `read_toml` restores it.

    A list of tables is written in one line. Remarks are comments above the header of a table, by its dotted name.
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
