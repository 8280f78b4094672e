"""Writes values into a table of a vehicle file, with the command they come from; all else, comments too, stays.

By lines: tomlkit, which keeps comments as well, puts a new key behind the comment that belongs to the next table.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from activesteer.config import read_toml
from activesteer.errors import ParameterError
from activesteer.files import write_text

_NOTE: Final = "# Written by `"
"""How the line begins that says where the values come from; an older one of these is replaced."""
_SAME: Final = {"characteristic_speed_mps": "characteristic_speed_kmh"}
"""Other spellings of a key that is written."""


def write_values(vehicle_file: Path, table: str, values: Mapping[str, str], command: str, date: str) -> None:
    """Replaces values in a table of a vehicle file.

    Keys keep their place and the comments behind them, missing ones are added at the end of the table; command and date
    stand in a comment below the table's header.

    Args:
        vehicle_file: The file.
        table: Name of the table.
        values: Key -> value as it is written.
        command: Command that found the values.
        date: Its date, as 2026-11-21.

    Raises:
        ParameterError: the file cannot be read or written, is no TOML, or has no such table.
    """
    before, source = read_toml(vehicle_file)
    lines = source.text.splitlines()
    header = next((number for number, line in enumerate(lines) if _is_header(line, table)), None)
    if header is None:
        raise ParameterError(
            "there is no such table to write to; add its line where it shall stand",
            file=str(vehicle_file),
            key=f"[{table}]",
        )
    end = next((number for number in range(header + 1, len(lines)) if _is_header(lines[number])), len(lines))
    # Blank lines and comments above the next header belong to that.
    while end > header + 1 and not re.match(r"\s*[\w\"'-]+\s*=", lines[end - 1]):
        end -= 1
    body, missing = [f"{_NOTE}{command}` on {date}."], dict(values)
    for line in lines[header + 1 : end]:
        if line.startswith(_NOTE):
            continue
        pair = re.match(r"(?P<key>\s*[\w-]+\s*=\s*)(?P<value>[^#\s]+)(?P<rest>.*)$", line)
        key = pair["key"].split("=")[0].strip() if pair else ""
        if pair and (new := missing.pop(_SAME.get(key, key), None)) is not None:
            start = pair["key"].replace(key, _SAME.get(key, key))
            body.append(f"{start}{new}{pair['rest']}")
        else:
            body.append(line)
    body += [f"{key} = {value}" for key, value in missing.items()]
    written = "\n".join([*lines[: header + 1], *body, *lines[end:]]) + "\n"
    try:
        after = tomllib.loads(written)
    except tomllib.TOMLDecodeError:
        after = {}
    kept = {key: value for key, value in before[table].items() if key not in {*values, *_SAME}}
    if {**before, table: None} != {**after, table: None} or kept.items() - after[table].items():
        raise ParameterError(
            "is not written as one key a line; write it so, or edit it by hand",
            file=str(vehicle_file),
            key=f"[{table}]",
        )
    write_text(vehicle_file, written, ParameterError)


def _is_header(line: str, name: str | None = None) -> bool:
    match = re.fullmatch(r"\s*\[+\s*([^\[\]]+?)\s*\]+\s*(#.*)?", line)
    return match is not None and (name is None or match[1] == name)
