"""The program, or other code, in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
MAIN = "import sys; from activesteer.commands.cli import main; sys.exit(main())"


def environment(**changes: str) -> dict[str, str]:
    """Return the present environment with this package first, and with changes."""
    return os.environ | {"PYTHONPATH": str(ROOT)} | changes


def ended(
    folder: Path | None,
    *words: str,
    code: str = MAIN,
    before: tuple[str, ...] = (),
    changes: Mapping[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:
    """Run the program or other code to its end, with words before the interpreter and changes of the environment."""
    return subprocess.run(
        [*before, sys.executable, "-c", code, *words], cwd=folder, env=environment(**(changes or {})),
        capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip


def begun(folder: Path, *words: str, code: str = MAIN, **more: Any) -> subprocess.Popen[str]:
    """Start the program or other code, with pipes unless told otherwise."""
    options: dict[str, Any] = {"env": environment(), "stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | more
    return subprocess.Popen([sys.executable, "-c", code, *words], cwd=folder, text=True, **options)
