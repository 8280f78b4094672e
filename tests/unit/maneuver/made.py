"""A manoeuvre from a table, as if it stood in a file."""

from __future__ import annotations

from typing import Any, TypeVar

from activesteer.config import Source
from activesteer.errors import ManeuverError
from activesteer.maneuver import Maneuver, build_maneuver

Kind = TypeVar("Kind", bound=Maneuver)


def made(kind: type[Kind], table: dict[str, Any]) -> Kind:
    """Return the manoeuvre of a table in `mine.toml`, which must be of this kind."""
    built = build_maneuver(table, Source("mine.toml", error=ManeuverError))
    assert isinstance(built, kind)
    return built
