"""Tables for the tests of the vehicle builder, and changes of them."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from activesteer.resources import models_dir

TABLES: Final = models_dir() / "tables"
COMPACT: Final = TABLES / "compact.toml"
WISHBONE: Final = TABLES / "wishbone.csv"


def changed(table: Path, folder: Path, *changes: tuple[str, str]) -> Path:
    """Write a copy of a table with texts replaced; each text must occur."""
    text = table.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    copy = folder / table.name
    copy.write_text(text, encoding="utf-8")
    return copy
