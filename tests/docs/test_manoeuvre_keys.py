from __future__ import annotations

from pathlib import Path

import pytest

from activesteer.config import key_paths
from activesteer.maneuver import KINDS
from tools.tables import keys_page

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "manoeuvre_keys.md").read_text(encoding="utf-8")


def test_page_is_as_the_tool_writes_it():
    assert keys_page() == PAGE


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_of_a_kind_is_on_the_page_with_its_meaning(kind):
    common, own = (PAGE.split(f"## {title}\n")[1].split("\n## ")[0] for title in ("All kinds", kind))
    rows = [row for row in (common + own).splitlines() if row.startswith("| `")]
    assert all(row.rstrip(" |").count("|") >= 3 for row in rows)
    for key in key_paths(KINDS[kind]):
        # A list of tables stands with the keys of its entries.
        assert any(f"`{key}`" in row or f"`{key}.N." in row for row in rows), key
