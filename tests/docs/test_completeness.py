"""Subjects that the documentation must cover, and its size limits."""

from __future__ import annotations

import pkgutil
import re
from pathlib import Path

import pytest

from activesteer.commands.cli import command_line
from activesteer.maneuver import KINDS
from activesteer.resources import list_maneuvers

DOCS = Path(__file__).resolve().parents[2] / "docs"
MAX_BYTES = 1_600_000
"""Of all still pictures together."""
MAX_STILL_BYTES = 300_000
MAX_ANIMATION_BYTES = 2_000_000
"""Of all animations together."""
STILL_FILM = "film_rear_steering.webp"


@pytest.mark.parametrize("name", list_maneuvers())
def test_every_manoeuvre_has_a_section_with_its_picture(name: str) -> None:
    pages = "\n".join(page.read_text(encoding="utf-8") for page in sorted((DOCS / "manoeuvres").glob("*.md")))
    section = re.search(rf"^### {name}\n(.*?)(?=^#|\Z)", pages, re.MULTILINE | re.DOTALL)
    assert section, f"docs/manoeuvres/ has no section {name}"
    assert f"(../pictures/manoeuvre_{name}.png)" in section[1], "python tools/renew.py pictures makes it"
    assert (DOCS / "pictures" / f"manoeuvre_{name}.png").is_file()


@pytest.mark.parametrize("page", sorted((DOCS / "manoeuvres").glob("*.md")), ids=lambda page: page.stem)
def test_every_page_of_manoeuvres_has_a_film(page: Path) -> None:
    films = re.findall(r"\(\.\./pictures/(film_\w+\.webp)\)", page.read_text(encoding="utf-8"))
    assert len(films) == 1, "python tools/renew.py films makes it"
    assert (DOCS / "pictures" / films[0]).is_file()


def test_every_kind_of_manoeuvre_is_in_the_reference() -> None:
    page = (DOCS / "reference" / "manoeuvres.md").read_text(encoding="utf-8")
    package = re.search(r"^::: (activesteer\.maneuver)\n    options:\n      show_submodules: true$", page, re.MULTILINE)
    assert package
    assert all(kind.__module__.startswith(f"{package[1]}.") and kind.__doc__ for kind in KINDS.values())


@pytest.mark.parametrize("page", sorted((DOCS / "reference").glob("*.md")), ids=lambda page: page.stem)
def test_reference_names_what_exists_and_has_a_docstring(page: Path) -> None:
    names = re.findall(r"^::: (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert names
    assert not [name for name in names if not pkgutil.resolve_name(name).__doc__]


@pytest.mark.parametrize("command", command_line().names)
def test_every_command_is_in_the_list(command: str) -> None:
    page = (DOCS / "commands.md").read_text(encoding="utf-8")
    assert re.search(rf"^\| `{command}\b", page, re.MULTILINE), f"docs/commands.md does not list {command}"


def test_every_page_is_in_the_navigation() -> None:
    navigation = (DOCS.parent / "mkdocs.yml").read_text(encoding="utf-8")
    pages = [page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")]
    assert not [page for page in pages if f": {page}\n" not in navigation]


def test_every_picture_is_shown_and_all_are_small() -> None:
    shown = "".join(page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md"))
    pictures = [*DOCS.glob("pictures/*")]
    assert not [picture.name for picture in pictures if f"pictures/{picture.name}" not in shown]
    sizes = {picture.name: picture.stat().st_size for picture in pictures}
    animations = [name for name in sizes if name.startswith("film_") and name != STILL_FILM]
    assert sum(sizes.pop(name) for name in animations) < MAX_ANIMATION_BYTES
    assert max(sizes.values()) < MAX_STILL_BYTES
    assert sum(sizes.values()) < MAX_BYTES
