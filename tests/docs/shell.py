"""Run the command lines of a page in the reader's folder."""

from __future__ import annotations

import contextlib
import glob
import io
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

from activesteer.commands.cli import command_line, main
from tests.docs.blocks import Command, same_output

ROOT = Path(__file__).resolve().parents[2]
ORDINARY = frozenset({"mkdir", "cp", "mv", "ls", "cat", "sed", "python"})
"""Programs that are simply called."""


def run(command: Command) -> None:
    """Run a command line and compare its output with the page."""
    printed = "".join(_run(part.strip(), command.exit_status) for part in command.words.split("&&"))
    if command.output:
        assert same_output(command.output, printed), f"$ {command.words}\nprinted\n{printed}"


def check(command: Command) -> None:
    """Check with the program's own parser a command line that is not run."""
    for part in command.words.split("&&"):
        words = shlex.split(part.partition(" > ")[0])
        if words[0] == "activesteer":
            with contextlib.redirect_stderr(io.StringIO()) as told:
                try:
                    command_line().parse(words[1:])
                except SystemExit:
                    raise AssertionError(f"{command.words}\n{told.getvalue()}") from None
        elif words[0] in {"make", "pip"}:
            _run(part.strip())
        else:
            assert words[0] in ORDINARY | {"rerun", "cd"}, f"{words[0]}: no program of ours"


def _run(line: str, exit_status: int = 0) -> str:
    words = shlex.split(line)
    match words[0]:
        case "activesteer":
            return _activesteer(words[1:], exit_status)
        case "cd":
            os.chdir(words[1])
        case "make":
            targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
            assert set(words[1:]) <= set(targets), f"{line}: the targets are {targets}"
        case "pip":
            _check_extras(words)
        case program:
            assert program in ORDINARY, f"{line}: {program} is not run here"
            if re.fullmatch(r"python examples/\w+\.py", line):
                assert (ROOT / words[1]).is_file(), f"{line}: there is no such example"
                return ""  # tests/examples runs it
            return _ordinary(line)
    return ""


def _activesteer(words: list[str], exit_status: int) -> str:
    """Run the program in this process, where the kernels are already loaded."""
    target = Path(words.pop()) if len(words) > 1 and words[-2] == ">" else None
    if target is not None:
        words.pop()
    given = [match for word in words for match in (sorted(glob.glob(word)) or [word])]
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as told:
        try:
            status = main(given)
        except SystemExit as end:  # argparse
            status = end.code
    assert status == exit_status, (
        f"activesteer {shlex.join(given)}: status {status}\n{out.getvalue()}\n{told.getvalue()}"
    )
    if target is not None:
        target.write_text(out.getvalue(), encoding="utf-8")
        return ""
    return out.getvalue()


def _check_extras(words: list[str]) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert words[1] == "install"
    for word in words[2:]:
        found = re.fullmatch(r"(?:\.|activesteer)(?:\[([a-z,]+)\])?", word)
        assert found, f"pip install {word}: not this package"
        extras = set((found[1] or "").split(",")) - {""}
        assert extras <= set(project["optional-dependencies"]), f"pip install {word}: there is no such extra"


def _ordinary(line: str) -> str:
    here = os.environ | {
        "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
        "PYTHONPATH": str(ROOT),
    }
    done = subprocess.run(["bash", "-c", line], env=here, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{line}: status {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout
