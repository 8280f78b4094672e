"""The table of claims in the guide is that of the statements, the nominal runs and the stored population."""

from __future__ import annotations

from activesteer.analysis.claims.judge import STATEMENTS
from tools.tables import CLAIMS_PAGE, claims_page

TEXT = CLAIMS_PAGE.read_text(encoding="utf-8")


def test_table_is_as_the_tool_writes_it():
    assert claims_page(TEXT) == TEXT


def test_every_statement_is_in_the_table_once():
    for number, statement in STATEMENTS.items():
        assert TEXT.count(f"| {number} | {statement.text} |") == 1
