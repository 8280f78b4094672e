"""The available standards, with the scope on their pages, from standards.toml."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from activesteer.config import build, read_toml
from activesteer.errors import ParameterError, nearest_names
from activesteer.resources import DEFAULT_DRIVER


@dataclass(frozen=True)
class Standard:
    """A standard, with its implemented and missing parts."""

    title: str
    edition: str  # its edition, and the source of the text
    implemented: tuple[str, ...]  # the implemented parts, a sentence each
    left_out: tuple[str, ...]  # the parts that are not implemented, or are implemented differently
    driver: str = DEFAULT_DRIVER
    name: str = ""  # its name on the command line


def _read() -> dict[str, Standard]:
    tables, source = read_toml(Path(__file__).with_name("standards.toml"))
    return {name: build(Standard, table | {"name": name}, source, (name,)) for name, table in tables.items()}


STANDARDS: Final = _read()
"""Standards by name."""


def standard_of(name: str) -> Standard:
    """Return a standard by its name."""
    if name not in STANDARDS:
        problem = f"there is no standard {name!r};" if name else "which standard?"
        raise ParameterError(f"{problem} {nearest_names(name, STANDARDS)}", value=name, allowed=tuple(STANDARDS))
    return STANDARDS[name]
