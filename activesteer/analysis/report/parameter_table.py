"""Parameters of runs side by side: the flattened tables of their metadata, as text."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from activesteer.recording import Recording
from activesteer.units import display_unit, typeset


class Row(NamedTuple):
    """A parameter.

    Attributes:
        key: Its name, with the names of its tables.
        values: Its value in each run; a single value if all runs have the same.
    """

    key: str
    values: tuple[str, ...]

    @property
    def differs(self) -> bool:
        """True if the runs differ in this parameter."""
        return len(self.values) > 1


def rows(recordings: Sequence[Recording], *tables: str) -> list[Row]:
    """Return the entries of tables of the metadata: those of the first run in its order, then those of later runs.

    Args:
        recordings: The runs.
        tables: Keys of the metadata: tables, or single values. The entries of a single table come without its name.
    """
    flat = [dict(_flat(_chosen(run.metadata, tables))) for run in recordings]
    found = []
    for key in dict.fromkeys(key for entries in flat for key in entries):
        values = tuple(entries.get(key, "") for entries in flat)
        found.append(Row(key, values if len(set(values)) > 1 else values[:1]))
    return found


def _chosen(metadata: Mapping[str, Any], tables: Sequence[str]) -> Mapping[str, Any]:
    if len(tables) == 1:
        table = metadata.get(tables[0], {})
        return table if isinstance(table, Mapping) else {tables[0]: table}
    return {key: metadata[key] for key in tables if key in metadata}


def _flat(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", _text(key, value)


def _text(key: str, value: Any) -> str:
    if isinstance(value, bool) or value is None:
        return str(value).lower() if value is not None else "none"
    if isinstance(value, int | float):
        unit, factor = display_unit(key)
        return typeset(f"{value:.6g}" if factor == 1.0 else f"{value:.6g} ({value * factor:.4g} {unit})")
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
