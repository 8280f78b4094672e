"""One program renews everything that is stored or drawn for the documentation, and the guide names its commands."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools.renew import COMMANDS, parser

GUIDE = Path(__file__).resolve().parents[2] / "docs" / "maintaining.md"


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_describes_itself(name, capsys):
    with pytest.raises(SystemExit) as end:
        parser().parse_args([name, "--help"])
    assert end.value.code == 0
    action, options = COMMANDS[name]
    told = capsys.readouterr().out
    assert (action.__doc__ or "").split()[0] in told
    assert all(option in told.lower() for option in options.split() if option not in ("claims", "names"))


def test_the_guide_names_the_commands():
    rows = [line for line in GUIDE.read_text(encoding="utf-8").splitlines() if "renew.py" in line]
    missing = [name for name in COMMANDS if not any(name in row for row in rows)]
    assert missing == []
