"""The documented list of modules that a run passes through."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_the_documentation_lists_the_modules_that_a_run_passes_through() -> None:
    command = [sys.executable, str(ROOT / "tools/trace_run.py")]
    lines: list[str] = []
    for _ in range(2):  # the first run may search the amplitude, and compile
        lines = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout.splitlines()
    found = [line.removeprefix("activesteer.") for line in lines if line.startswith("activesteer.")]
    text = (ROOT / "docs/maintaining.md").read_text(encoding="utf-8")
    listed = text.partition("## Modules of a run")[2].partition("```text")[2].partition("```")[0].split()
    assert found == listed
    assert len(found) <= 64
