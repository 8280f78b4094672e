"""Writes `docs/manoeuvre_keys.md`: every key of every kind of manoeuvre, from the classes that read them."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import itertools
import typing
from pathlib import Path
from typing import Any, Final

from activesteer.config import Range, dataclass_in, element_of, spellings
from activesteer.maneuver.base import Maneuver
from activesteer.maneuver.kinds import KINDS

PAGE: Final = Path(__file__).resolve().parent.parent / "docs" / "manoeuvre_keys.md"
_HEAD: Final = """# Keys of a manoeuvre file

All keys that a manoeuvre's TOML file may have, by `kind`; `--set KEY=VALUE` and `overrides` take the same. A key may be
written in any of the units named; defaults and ranges are in the first one. `needed` inside a table is needed where
that table is given; `N` is the number of an entry, from 0. `tools/make_key_table.py` writes this page from the classes
that read the files.
"""


def page() -> str:
    """The page as it should be."""
    common = {field.name for field in dataclasses.fields(Maneuver)}
    parts = [_HEAD, "## All kinds\n", *_table(Maneuver)]
    for kind, cls in KINDS.items():
        first = (inspect.getdoc(cls) or "").splitlines()[0]
        parts += [f"\n## {kind}\n", f"{first}\n", *_table(cls, without=common)]
    return "\n".join(parts) + "\n"


def _table(cls: type, without: set[str] | None = None) -> list[str]:
    return ["| key | default | allowed | meaning |", "|---|---|---|---|", *_rows(cls, "", without or set())]


def _rows(cls: Any, prefix: str, without: set[str]) -> list[str]:
    plain, hints = typing.get_type_hints(cls), typing.get_type_hints(cls, include_extras=True)
    meanings = _meanings(cls)
    rows: list[str] = []
    for field in dataclasses.fields(cls):
        if field.name in without and not prefix:
            continue
        hint = plain[field.name]
        if (inner := dataclass_in(hint)) is not None:
            rows += _rows(inner, f"{prefix}{field.name}.", without)
            continue
        if (inner := element_of(hint)) is not None:
            rows += _rows(inner, f"{prefix}{field.name}.N.", without)
            continue
        keys = ", ".join(f"`{prefix}{spelling}`" for spelling in spellings(field.name))
        default = "needed" if _needed(field) else f"`{_default(field)}`"
        cells = (keys, default, _allowed(hints[field.name]), meanings.get(field.name, ""))
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return rows


def _needed(field: dataclasses.Field[Any]) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _default(field: dataclasses.Field[Any]) -> str:
    value = field.default if field.default is not dataclasses.MISSING else field.default_factory()  # type: ignore[misc]
    if value is None or value == "":
        return "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _allowed(hint: Any) -> str:
    if words := [word for option in (hint, *typing.get_args(hint)) for word in _words(option)]:
        return ", ".join(f"`{word}`" for word in words)
    ranges = [extra for extra in getattr(hint, "__metadata__", ()) if isinstance(extra, Range)]
    for inner in typing.get_args(hint):
        ranges += [extra for extra in getattr(inner, "__metadata__", ()) if isinstance(extra, Range)]
    return str(ranges[0]) if ranges else ""


def _words(hint: Any) -> tuple[Any, ...]:
    return typing.get_args(hint) if typing.get_origin(hint) is typing.Literal else ()


def _meanings(cls: type) -> dict[str, str]:
    """Text under each field, of the class and of those that it builds on."""
    found: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        if not dataclasses.is_dataclass(base):
            continue
        body = ast.parse(inspect.getsource(base)).body[0].body  # type: ignore[attr-defined]
        for statement, text in itertools.pairwise(body):
            if isinstance(statement, ast.AnnAssign) and isinstance(text, ast.Expr):
                found[ast.unparse(statement.target)] = " ".join(str(ast.literal_eval(text.value)).split())
    return found


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
