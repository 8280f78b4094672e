"""TOML tables into frozen dataclasses: every key known, every value of the right type and within its range.

A field's type is its check: `float`, `int`, `bool`, `str`, a `Literal` of some words, tuples of floats, a nested
dataclass, a dict or a tuple of nested dataclasses, or one of these `| None`. An element of a tuple has its number for a
key: `road.patches.0.mu` is the `mu` of the first [[road.patches]]. A range is written
`Annotated[float, Range(low, high)]`. Inside, everything is SI and radians; in a file a key may carry an edge unit
instead: `speed_kmh` fills `speed_mps`, `angle_deg` fills `angle_rad`.

A class may name, in `KEY_HINTS`, keys that people look for in vain, and what to say to them; and in `OVERRULED`, keys
that have no effect where other keys have certain values: key -> {other key: its value, None for any}.
"""

from __future__ import annotations

from activesteer.config.keys import (
    dataclass_in,
    element_of,
    field_in_unit,
    field_path,
    key_hint,
    key_paths,
    leaf_keys,
    spellings,
)
from activesteer.config.merging import check_overruled, merged
from activesteer.config.source import Range, Source
from activesteer.config.toml import parse_value, read_toml, toml_text, toml_value
from activesteer.config.values import build, checked_number, to_table

__all__ = [
    "Range",
    "Source",
    "build",
    "check_overruled",
    "checked_number",
    "dataclass_in",
    "element_of",
    "field_in_unit",
    "field_path",
    "key_hint",
    "key_paths",
    "leaf_keys",
    "merged",
    "parse_value",
    "read_toml",
    "spellings",
    "to_table",
    "toml_text",
    "toml_value",
]
