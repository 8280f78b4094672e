"""The committed reference is the text that `tools/make_reference.py` makes from the docstrings."""

from __future__ import annotations

import pytest

from tools import make_reference
from tools.make_reference import FOLDER, PAGES, text_of


@pytest.mark.parametrize("name", PAGES)
def test_page_is_as_the_tool_writes_it(name: str) -> None:
    committed = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    assert committed == text_of(PAGES[name]), "run python tools/make_reference.py"


def test_every_page_is_made() -> None:
    assert {page.stem for page in FOLDER.glob("*.md")} == set(PAGES)


@pytest.mark.parametrize(
    ("page", "text"),
    [
        ("runs", "### simulate\n\n`from activesteer import simulate`\n"),
        ("runs", "| `rear_steer_rad` | `float` | "),
        ("runs", "| `rear_steer_demand_rad` | `float` | `0.0` | "),
        ("recordings", "#### Recording.open\n"),
        ("controllers", "### ControllerSetup\n"),
        ("controllers", "| `limit_rad` | `float`, 0.0 to math.radians(10.0) | "),
        ("tyres", "#### MagicFormula.evaluate\n"),
        ("errors", "### ActiveSteerError\n"),
    ],
)
def test_reference_has_what_users_call(page: str, text: str) -> None:
    assert text in (FOLDER / f"{page}.md").read_text(encoding="utf-8")


def test_a_name_that_does_not_exist_is_an_error() -> None:
    page = make_reference.Page("", "", (make_reference.Section("", "activesteer.signals", ("Nothing",)),))
    with pytest.raises(LookupError, match=r"activesteer\.signals has no Nothing"):
        text_of(page)
