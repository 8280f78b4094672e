"""Shared fixtures of the command line tests."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from activesteer.commands.cli import main

COMPILING = "activesteer: compiling native code, up to a minute; later starts reuse it\n"


class Told(NamedTuple):
    """Result of a command.

    Attributes:
        status: Exit status.
        out: Standard output.
        err: Standard error.
    """

    status: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """Return standard output as JSON; it must be JSON from the first to the last character."""

        def refuse(word: str) -> None:
            pytest.fail(f"{word} is not JSON")

        return json.loads(self.out, parse_constant=refuse)


Call = Callable[..., Told]


@pytest.fixture
def call(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Call:
    """Run a command in an empty folder."""
    monkeypatch.chdir(tmp_path)

    def call(*words: object) -> Told:
        capsys.readouterr()
        status = main([str(word) for word in words])
        out, err = capsys.readouterr()
        # Whoever is first after a change of the kernels compiles them, and is told so.
        return Told(status, out, err.replace(COMPILING, ""))

    return call


@pytest.fixture
def controller(tmp_path: Path) -> Callable[..., str]:
    """Write a user's controller and return the argument of `-c`."""

    def write(body: str, name: str = "mine.py", cls: str = "Mine") -> str:
        (tmp_path / name).write_text(
            "from activesteer import ActuatorCommand\n\n\n"
            f"class {cls}:\n    steps = 0\n\n    def step(self, command, measurement):\n        self.steps += 1\n"
            + textwrap.indent(textwrap.dedent(body), " " * 8)
        )
        return f"{name}:{cls}"

    return write
