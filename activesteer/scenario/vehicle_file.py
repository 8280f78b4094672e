"""Changes of values in vehicle files.

The module edits lines, because tomlkit puts a new key after the comment that belongs to the next table.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from activesteer.config import read_toml
from activesteer.core.files import write_text
from activesteer.errors import ParameterError

_NOTE: Final = "# Written by `"
"""Start of the comment with the origin of the values, which replaces an older one."""
_SAME: Final = {"characteristic_speed_mps": "characteristic_speed_kmh"}
"""Other spellings of written keys in a file."""


def write_values(vehicle_file: Path, table: str, values: Mapping[str, str], command: str, date: str) -> None:
    """Replace or add values in a table of a vehicle file; a comment below its header names command and date."""
    before, source = read_toml(vehicle_file)
    lines = source.text.splitlines()
    start = source.line_of([table])
    if start is None or not isinstance(before[table], Mapping):
        lines += ["", f"[{table}]"]
        start, before = len(lines), {**before, table: {}}
    # Blank lines and comments below the last key belong to the next table.
    ends = (source.line_of([table, key]) for key, value in before[table].items() if not isinstance(value, Mapping))
    end = max([start, *filter(None, ends)])
    body, missing = [f"{_NOTE}{command}` on {date}."], dict(values)
    for line in lines[start:end]:
        if line.startswith(_NOTE):
            continue
        pair = re.match(r"(?P<key>\s*[\w-]+\s*=\s*)(?P<value>[^#\s]+)(?P<rest>.*)$", line)
        key = pair["key"].split("=")[0].strip() if pair else ""
        if pair and (new := missing.pop(_SAME.get(key, key), None)) is not None:
            body.append(f"{pair['key'].replace(key, _SAME.get(key, key))}{new}{pair['rest']}")
        else:
            body.append(line)
    body += [f"{key} = {value}" for key, value in missing.items()]
    written = "\n".join([*lines[:start], *body, *lines[end:]]) + "\n"
    try:
        after = tomllib.loads(written)
    except tomllib.TOMLDecodeError:
        after = {}
    kept = {key: value for key, value in before[table].items() if key not in {*values, *_SAME}}
    if not after or {**before, table: None} != {**after, table: None} or kept.items() - after[table].items():
        raise ParameterError(
            "needs one key per line; reformat it, or edit it by hand",
            file=str(vehicle_file),
            key=f"[{table}]",
        )
    write_text(vehicle_file, written, ParameterError)
