"""The tables of the claims in the guide agree with the statements, the nominal runs and the stored populations."""

from __future__ import annotations

from pathlib import Path

import pytest

from activesteer.analysis.claims.judge import STATEMENTS
from tools.tables import CLAIMS_PAGE, CLAIMS_PARTS, claims_page

TEXT = CLAIMS_PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("page", CLAIMS_PARTS, ids=lambda page: page.name)
def test_tables_are_as_the_tool_writes_them(page: Path) -> None:
    assert claims_page(page) == page.read_text(encoding="utf-8")


def test_every_statement_is_in_the_table_once():
    for number, statement in STATEMENTS.items():
        assert TEXT.count(f"| {number} | {statement.text} |") == 1
