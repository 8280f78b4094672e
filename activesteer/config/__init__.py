"""TOML tables to frozen dataclasses: every key is known, every value has the right type and range.

The type of a field defines its check: `float`, `int`, `bool`, `str`, a `Literal` of words, a tuple of floats, a nested
dataclass, a dict or a tuple of nested dataclasses, or one of these `| None`. An element of a tuple has its number as a
key: `road.patches.0.mu` is the `mu` of the first [[road.patches]]. A range is written
`Annotated[float, Range(low, high)]`. Values are SI and radians. A key in a file may have a display unit instead:
`speed_kmh` fills `speed_mps`, `angle_deg` fills `angle_rad`.

A class may define `KEY_HINTS`: keys that users expect but that do not exist -> help. It may define `OVERRULED`: keys
without effect while other keys have certain values: key -> {other key: its value, None for any}.

In: TOML files and tables.
Out: frozen dataclasses in SI units, or an error with file, key and line.
"""

from __future__ import annotations

from activesteer.config.values import (
    Range,
    Source,
    build,
    check_overruled,
    check_points,
    checked_number,
    convert,
    dataclass_in,
    element_of,
    field_in_unit,
    field_path,
    find_file,
    key_hint,
    key_paths,
    leaves,
    merged,
    parse_value,
    read_toml,
    spellings,
    to_table,
    toml_text,
    toml_value,
)

__all__ = [
    "Range",
    "Source",
    "build",
    "check_overruled",
    "check_points",
    "checked_number",
    "convert",
    "dataclass_in",
    "element_of",
    "field_in_unit",
    "field_path",
    "find_file",
    "key_hint",
    "key_paths",
    "leaves",
    "merged",
    "parse_value",
    "read_toml",
    "spellings",
    "to_table",
    "toml_text",
    "toml_value",
]
